"""Options that `learn` and `crossvalidate` share, and what they mean."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mlnlite.cli.options import FILE, Command
from mlnlite.cli.terminal import warn, working
from mlnlite.errors import MlnError

if TYPE_CHECKING:
    from mlnlite.learn.prior import OnePrior, Prior
    from mlnlite.model.evidence import Evidence
    from mlnlite.model.model import Model
    from mlnlite.syntax.tree import Dialect

DEFAULT_SD = 5.0
FAMILIES = ("gaussian", "laplace", "cauchy", "hierarchical", "none")


def learning_options(command: Command) -> Command:
    """Model and database files, objective, open predicates and prior."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


_OPTIONS = (
    click.argument("files", type=FILE, nargs=-1, metavar="MODEL... DATABASE..."),
    click.option("-m", "--model", type=FILE, multiple=True, metavar="FILE", help="A model file, whatever its name."),
    click.option("-d", "--database", type=FILE, multiple=True, metavar="FILE", help="A database, whatever its name."),
    click.option(
        "--objective",
        type=click.Choice(["pseudo-likelihood", "likelihood", "composite", "max-margin"]),
        help="`likelihood`: of all that is predicted, exactly or by sampling; `composite`: of pairs of atoms that "
        "share a formula; `max-margin`: by how much the data beat other worlds. By default pseudo-likelihood, or "
        "likelihood if some atoms are unknown.",
    ),
    click.option(
        "--open",
        "open_predicates",
        multiple=True,
        metavar="NAMES",
        help="Predicates whose atoms are unknown where they are not facts, as are atoms marked `?`; for likelihoods.",
    ),
    click.option(
        "--prior",
        type=click.Choice(FAMILIES),
        default="gaussian",
        show_default=True,
        help="`laplace`: exact zeros; `hierarchical`: rows of a `+` template share a learnt mean and spread; `none`: "
        "weights that the data push to infinity are reported, and clipped.",
    ),
    click.option(
        "--prior-sd",
        type=click.FloatRange(min=0, min_open=True),
        metavar="S",
        help="Standard deviation, or scale, of the prior (mean 0). By default 5; Laplace 1, Cauchy 2.5.",
    ),
    click.option(
        "--prior-of",
        multiple=True,
        metavar="'FORMULA: PRIOR'",
        help="Another prior for one formula: family, scale, for `gaussian` a mean: `formula 2: gaussian 1 0.5`.",
    ),
)


def prior_of(family: str, sd: float | None, single: tuple[str, ...] = ()) -> Prior | None:
    """The prior that the options mean."""
    if not single:
        return _prior(family, sd)
    found = {"*": _prior(family, sd)}
    for one in single:
        formula, _, text = one.rpartition(":")
        words = text.split()
        try:
            numbers = [float(word) for word in words[1:]]
        except ValueError:
            words = []
        known = words and words[0] in FAMILIES and (len(words) <= 2 or (words[0] == "gaussian" and len(words) == 3))
        if not known or not formula:
            raise click.UsageError(f"--prior-of takes `FORMULA: {'|'.join(FAMILIES)} [SCALE [MEAN]]`, found {one}")
        found[formula.strip()] = _prior(words[0], numbers[0] if numbers else None, *numbers[1:])
    return found


def _prior(family: str, sd: float | None, mean: float = 0.0) -> OnePrior | None:
    """One prior."""
    from mlnlite.learn.prior import Cauchy, Gaussian, Hierarchical, Laplace

    if family == "none":
        if sd is not None:
            raise click.UsageError("--prior none and --prior-sd exclude each other")
        return None
    if family == "laplace":
        return Laplace(1.0 if sd is None else sd)
    if family == "cauchy":
        return Cauchy(2.5 if sd is None else sd)
    sd = DEFAULT_SD if sd is None else sd
    return Hierarchical(sd) if family == "hierarchical" else Gaussian(sd, mean)


def split_files(
    files: tuple[Path, ...], model: tuple[Path, ...], database: tuple[Path, ...]
) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Which files are models and which are databases.

    Raises:
        MlnError: if there is none of either.
    """
    models = tuple(f for f in files if f.suffix == ".mln") + model
    databases = tuple(f for f in files if f.suffix != ".mln") + database
    if not models:
        raise MlnError("no file is a model", "a model ends in .mln; say `-m FILE` for one that does not")
    if not databases:
        raise MlnError("there is no database to learn from", "name one after the model; `-d FILE` if it ends in .mln")
    return models, databases


def read(models: tuple[Path, ...], databases: tuple[Path, ...], dialect: Dialect | None) -> tuple[Model, Evidence]:
    """Model and databases; what reading found strange goes to standard error."""
    import mlnlite as ml

    with working("reading"):
        model = ml.read_model(*models, dialect=dialect)
        found = ml.read_evidence(*databases, model=model)
    warn(found.warnings)
    return model, found

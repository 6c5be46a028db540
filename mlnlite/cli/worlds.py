"""Which evidence a question is about, and which predicates have a closed world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mlnlite.cli.terminal import warn
from mlnlite.errors import Diagnostic, MlnError, QueryMistake, did_you_mean

if TYPE_CHECKING:
    from mlnlite.model.evidence import Evidence
    from mlnlite.model.model import Model


def opened(model: Model, open_names: Sequence[str]) -> Model:
    """The model without closed worlds for some predicates."""
    for name in open_names:
        verify_predicate(model, name)
    predicates = {n: replace(p, closed=False) if n in open_names else p for n, p in model.predicates.items()}
    return replace(model, predicates=predicates)


def verify_predicate(model: Model, name: str) -> None:
    """Complains about a name that is no predicate."""
    if name not in model.predicates:
        hint = did_you_mean(name, list(model.predicates))
        raise QueryMistake([Diagnostic("E510", f"there is no predicate {name}", hint=hint)])


def closed_world(model: Model, items: Sequence[str], closed: Sequence[str], open_names: Sequence[str]) -> list[str]:
    """Names of the predicates to close.

    Args:
        model: says which predicates there are.
        items: what is asked; `all` leaves its predicates open.
        closed: names, or `all`. (All that can be closed: `P(x, y!)` always has a true value.)
        open_names: predicates that stay open.
    """
    asked = set(closed)
    if "all" in asked:
        closable = {name for name, p in model.predicates.items() if p.marker != "!"}
        asked = asked - {"all"} | closable - predicates_of(model, items)
    for name in sorted(asked):
        verify_predicate(model, name)
    return [name for name in model.predicates if name in asked and name not in open_names]


def predicates_of(model: Model, items: Sequence[str]) -> set[str]:
    """The predicates that stand in a query."""
    from mlnlite.model.typing import atoms_of
    from mlnlite.syntax.queries import parse_atom_query

    return {atom.predicate for item in items for atom in atoms_of(parse_atom_query(item, model.dialect))}


def evidence_of_one_world(model: Model, paths: Sequence[Path], database: int | None) -> Evidence:
    """The evidence that a question is about.

    Args:
        model: what it is about.
        paths: several files describe one world together; none: nothing is known.
        database: which database of the one file, from 1.

    Raises:
        MlnError: if there is no such database, or several and none was chosen.
    """
    import mlnlite as ml

    if not paths:
        return ml.no_evidence(model)
    evidence = ml.read_evidence(*paths, model=model, together=len(paths) > 1)
    warn(evidence.warnings)
    n = evidence.n_databases
    if database is None and n > 1:
        raise MlnError(f"{paths[0]} has {n} databases, and a question is about one", "choose one: --database 1")
    if database is not None and database > n:
        raise MlnError(f"there is no database {database} in {paths[0]}: it has {n}")
    return ml.one_database(evidence, (database or 1) - 1)

"""`mlnlite check`: what a model and its evidence are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

import click

from mlnlite.cli.options import APART, dialect_option, evidence_option, format_option, models_argument
from mlnlite.cli.terminal import shortened, table, working
from mlnlite.errors import Diagnostic

if TYPE_CHECKING:
    from mlnlite.model.evidence import Evidence
    from mlnlite.model.model import Model
    from mlnlite.syntax.tree import Dialect, Origin

WIDTH = 60
MANY = 20


class _Options(TypedDict):
    models: tuple[Path, ...]
    evidence: tuple[Path, ...]
    dialect: Dialect | None
    format: str
    verbose: bool


@click.command()
@models_argument
@evidence_option(APART)
@dialect_option
@format_option("text", "json")
@click.option("-v", "--verbose", is_flag=True, help="Show all constants and all templates.")
def check(**options: Unpack[_Options]) -> None:
    """Say what a model and its evidence are, and what is wrong with them.

    MODEL is one file, or several that continue each other.
    """
    with working("reading"):
        summary = _summary(options["models"], options["evidence"], options["dialect"])
    if options["format"] == "json":
        import json

        click.echo(json.dumps(_as_dict(summary), indent=2))
    else:
        click.echo("\n\n".join(_sections(summary, verbose=options["verbose"])))


@dataclass(frozen=True, slots=True)
class _Summary:
    """What is shown.

    Attributes:
        model: the model.
        evidence: its evidence, or none.
        rows: number of weights of each template, for the constants that are known.
        warnings: what is strange.
    """

    model: Model
    evidence: Evidence | None
    rows: tuple[int, ...]
    warnings: tuple[Diagnostic, ...]


def _summary(models: tuple[Path, ...], evidence: tuple[Path, ...], dialect: Dialect | None) -> _Summary:
    import mlnlite as ml
    from mlnlite.model.coverage import coverage

    model = ml.read_model(*models, dialect=dialect)
    found = ml.read_evidence(*evidence, model=model) if evidence else None
    types = found.types if found else model.types
    rows = tuple(len(t.expanded(types).weights) for t in model.templates)
    warnings = model.warnings + (found.warnings + coverage(found) if found else ())
    return _Summary(model, found, rows, warnings)


def _n_weights(summary: _Summary) -> int:
    """Number of weights that are not those of hard formulas."""
    return sum(n for n, t in zip(summary.rows, summary.model.templates, strict=True) if not t.hard)


# --- text


def _sections(summary: _Summary, *, verbose: bool) -> Iterator[str]:
    if verbose and summary.model.origin:
        yield f"dialect\n{_origin(summary.model.origin)}"
    yield f"types\n{_types(summary, WIDTH if not verbose else 10**9)}"
    yield f"predicates\n{_predicates(summary)}"
    if summary.rows:
        yield f"templates\n{_templates(summary, len(summary.rows) if verbose else MANY)}"
    counts = [["weights", f"{_n_weights(summary):,}"]]
    if summary.evidence:
        counts.append(["databases", f"{summary.evidence.n_databases:,}"])
    yield table(counts, "<>").replace("  ", "", 1).replace("\n  ", "\n")
    if summary.warnings:
        yield "\n\n".join(map(str, summary.warnings))


def _origin(origin: Origin) -> str:
    """The dialect, why it was taken for it, and what differs from the system it belongs to."""
    reasons = origin.reasons or ("it was asked for",)
    return "\n".join(f"  {line}" for line in (f"{origin.dialect}: {'; '.join(reasons)}", *origin.notes))


def _types(summary: _Summary, width: int) -> str:
    types = (summary.evidence or summary.model).types.values()
    rows = [[t.name, f"{len(t.constants):,}", shortened(t.constants, width)] for t in types]
    return table(rows, "<><")


def _predicates(summary: _Summary) -> str:
    rows = []
    for predicate in summary.model.predicates.values():
        if predicate.comparison:
            continue
        facts = summary.evidence.facts[predicate.name] if summary.evidence else None
        rows.append([str(predicate), _counted(len(facts.truth), "fact") if facts else ""])
    return table(rows, "<<")


def _templates(summary: _Summary, most: int) -> str:
    rows = []
    for n, template in zip(summary.rows, summary.model.templates, strict=True):
        rows.append([_counted(n, "hard row" if template.hard else "weight"), template.text])
    left = len(rows) - most
    return table(rows[:most], "><") + (f"\n  ... ({left:,} more; -v shows all)" if left > 0 else "")


def _counted(n: int, what: str) -> str:
    return f"{n:,} {what}{'s' * (n != 1)}"


# --- data


def _as_dict(summary: _Summary) -> dict[str, object]:
    evidence = summary.evidence
    types = (evidence or summary.model).types.values()
    templates = zip(summary.rows, summary.model.templates, strict=True)
    return {
        "dialect": summary.model.origin.dialect if summary.model.origin else summary.model.dialect,
        "reasons": list(summary.model.origin.reasons) if summary.model.origin else [],
        "types": {t.name: list(t.constants) for t in types},
        "predicates": [
            {"declaration": str(p), "n_facts": len(evidence.facts[p.name].truth) if evidence else None}
            for p in summary.model.predicates.values()
            if not p.comparison
        ],
        "templates": [{"formula": t.text, "n_rows": n, "hard": t.hard, "fixed": t.fixed} for n, t in templates],
        "n_weights": _n_weights(summary),
        "n_databases": evidence.n_databases if evidence else None,
        "warnings": [w.to_dict() for w in summary.warnings],
    }

"""What grounding will take, template by template, before it is done; and limits that name the culprit."""

from __future__ import annotations

from dataclasses import dataclass

from mlnlite.engines.forecast import estimate
from mlnlite.engines.memory import machine_memory
from mlnlite.engines.plan import Plan, Relation, Run, Tables
from mlnlite.errors import Diagnostic, LimitReached
from mlnlite.ground.compile import Compiled, Source
from mlnlite.model.templates import Template

ROWS_PER_SECOND = 1.1e7
"""Ground rows a second of one core, from plan to network (measured: docs/explanation/performance.md)."""

BYTES_PER_VALUE = 24
"""Memory at the peak for each number of a ground row: engine, row columns and merged factors live side by side."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """What one template will take.

    Attributes:
        template: it.
        rows: about how many ground formulas it leaves open.
        widest: rows of the largest intermediate result.
        memory: [byte] at the peak.
        seconds: [s] of one core.
    """

    template: Template
    rows: float
    widest: float
    memory: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Limits:
    """What grounding may take.

    Attributes:
        groundings: open ground formulas of one template; None for any number.
        memory: [byte] of one template's rows, and of the database that joins them; None for what there is.
    """

    groundings: int | None = None
    memory: int | None = None


def forecast(template: Template, compiled: Compiled, tables: Tables) -> Forecast:
    """The forecast for a template's plan."""
    found = estimate(compiled.plan, tables)
    return Forecast(
        template=template,
        rows=found.rows,
        widest=found.widest,
        memory=found.rows * _width(compiled) * BYTES_PER_VALUE,
        seconds=found.rows / ROWS_PER_SECOND + (found.widest - found.rows) / (10 * ROWS_PER_SECOND),
    )


def verify(expected: Forecast, source: Source, limits: Limits) -> None:
    """Refuses a template that would take more than the limits.

    Raises:
        LimitReached: naming the formula, its place, and what would help.
    """
    if limits.groundings is not None and expected.rows > limits.groundings:
        over = f"about {expected.rows:,.0f} open groundings, and the limit is {limits.groundings:,}"
    elif limits.memory is not None and expected.memory > limits.memory:
        over = f"about {expected.memory / 1e6:,.0f} MB, and the limit is {limits.memory / 1e6:,.0f} MB"
    else:
        return
    raise too_large(expected.template, source, over)


def machine_limits() -> Limits:
    """The memory of the machine, or of the container; no limit where the system does not say."""
    return Limits(memory=machine_memory())


def within(limits: Limits, compiled: Compiled, run: Run) -> Run:
    """What runs the parts of a template's plan, and refuses the one with which their rows are beyond the limits.

    Forecasts are estimates; this holds where they are wrong.
    """
    width, listed = _width(compiled), 0

    def bounded(plan: Plan) -> Relation:
        nonlocal listed
        rows = run(plan)
        listed += len(next(iter(rows.values()))) if rows else 1
        if limits.groundings is not None and listed > limits.groundings:
            raise LimitReached(f"it leaves more open than the limit of {limits.groundings:,} groundings")
        if limits.memory is not None and listed * width * BYTES_PER_VALUE > limits.memory:
            raise LimitReached(
                f"it has at least {listed:,} ground formulas; the limit is {limits.memory / 1e6:,.0f} MB"
            )
        return rows

    return bounded


def _width(compiled: Compiled) -> int:
    """Numbers of a ground row."""
    return len(compiled.atoms) + 2


def too_large(template: Template, source: Source, over: str) -> LimitReached:
    """The error that names a template as the culprit."""
    message = f"{template.name} needs {over}: {template.text}"
    return LimitReached([Diagnostic("E410", message, template.span, advice(source))])


def advice(source: Source) -> str:
    """What would make the grounding smaller."""
    schemas = source.formula.atoms
    still_open = sorted({s.predicate for s in schemas if not source.is_closed(s)})
    parts = []
    if len(still_open) > 1:
        parts.append(f"close the world of one of {', '.join(still_open)} if what is not a fact is false")
    by_type: dict[str, list[str]] = {}
    for i in source.formula.free:
        by_type.setdefault(source.formula.variables[i].type, []).append(source.formula.variables[i].name)
    widest = max(by_type, key=lambda t: len(by_type[t]) * len(source.evidence.types[t].constants), default=None)
    if widest is not None and len(source.evidence.types[widest].constants) > 1:
        n = len(source.evidence.types[widest].constants)
        parts.append(f"{', '.join(by_type[widest])} range over {n:,} constants of {widest}: give them a narrower type")
    parts.append("raise the limit")
    return "; or ".join(parts)

"""Which engine runs a plan: NumPy as long as joins fit into memory with ease, DuckDB for what is larger."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.engines.numpy import NumpyEngine, TooManyRowsError
from mlnlite.engines.plan import Engine, Plan, Relation, Run, Tables
from mlnlite.errors import QueryMistake, did_you_mean

MOST_ROWS = 1 << 25
"""Rows of a join up to which NumPy is faster than starting DuckDB (measured: docs/explanation/performance.md)."""

ENGINES: dict[str, type[NumpyEngine] | type[DuckDBEngine]] = {"numpy": NumpyEngine, "duckdb": DuckDBEngine}


def engine_named(name: str) -> Engine:
    """The engine of a name.

    Raises:
        QueryMistake: if there is none.
    """
    if name not in ENGINES:
        hint = did_you_mean(name, list(ENGINES))
        raise QueryMistake(f"there is no engine {name}; there are {', '.join(ENGINES)}", hint)
    return ENGINES[name]()


def engine_for(*, memory: int | None = None) -> Engine:
    """The engine to use where none is asked for.

    Args:
        memory: [byte] that joins may use, which only DuckDB keeps to; None for most of what the machine has.
    """
    return BySize() if memory is None else DuckDBEngine(memory)


@dataclass(frozen=True, slots=True)
class BySize:
    """NumPy, and DuckDB for plans in which a join turns out to have more than `MOST_ROWS` rows."""

    def load(self, tables: Tables) -> Run:
        """What runs plans over these tables."""
        in_memory = NumpyEngine(MOST_ROWS).load(tables)

        @cache
        def database() -> Run:
            return DuckDBEngine().load(tables)

        def run(plan: Plan) -> Relation:
            try:
                return in_memory(plan)
            except TooManyRowsError:
                return database()(plan)

        return run

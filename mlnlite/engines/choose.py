"""Which engine runs a plan: NumPy for small inputs, where starting a database would cost more than the answer."""

from __future__ import annotations

from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.engines.numpy import NumpyEngine
from mlnlite.engines.plan import Engine, Tables
from mlnlite.errors import QueryMistake, did_you_mean

SMALL = 50_000
"""Stored rows up to which NumPy is faster than starting DuckDB (measured: docs/explanation/performance.md)."""

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


def engine_for(tables: Tables, *, memory: int | None = None) -> Engine:
    """The engine for inputs of this size.

    Args:
        tables: what the plans will draw on.
        memory: [byte] that a database may use; None for most of what the machine has.
    """
    n_rows = sum(len(columns[0]) for columns in tables.values() if columns)
    return NumpyEngine() if n_rows <= SMALL and memory is None else DuckDBEngine(memory)

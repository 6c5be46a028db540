"""The default engine for anything large: plans run by DuckDB, embedded, in parallel, spilling to disk."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING
from weakref import finalize

import numpy as np

from mlnlite.engines.memory import machine_memory
from mlnlite.engines.plan import Plan, Relation, Run, Tables, columns_of
from mlnlite.engines.sql import query, quoted
from mlnlite.errors import LimitReached

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

_SHARE = 4
"""Rows as arrays may take this part of the machine's memory: what is made of them takes as much again, and more."""


@dataclass(frozen=True, slots=True)
class DuckDBEngine:
    """Runs plans as SQL in an in-memory database of its own.

    Attributes:
        memory: [byte] that the database may use before it spills to disk, and then fails; None for most of what the
            machine has.
        scratch: folder for what it spills; None for a temporary one, removed at the end.
    """

    memory: int | None = None
    scratch: str | None = None

    def load(self, tables: Tables) -> Run:
        """What runs plans over these tables, which are copied into the database (it wants their statistics)."""
        import duckdb  # late: most commands do without

        connection = duckdb.connect()
        connection.execute("SET enable_progress_bar = false")
        connection.execute("SET preserve_insertion_order = false")
        scratch = TemporaryDirectory(prefix="mlnlite-", dir=self.scratch)
        connection.execute("SET temp_directory = ?", [scratch.name])
        if self.memory is not None:
            connection.execute("SET memory_limit = ?", [f"{max(self.memory // 10**6, 1)}MB"])
        with self._bounded("loading the facts"):
            for name, columns in tables.items():
                connection.register("given", {f"c{i}": column for i, column in enumerate(columns)})
                connection.execute(f"CREATE TABLE {quoted(name)} AS SELECT * FROM given")
                connection.unregister("given")

        def run(plan: Plan) -> Relation:
            with self._bounded("a join"):
                self._verify_size(connection, plan)
                result = connection.execute(query(plan)).fetchnumpy()
            return {name: np.asarray(result[name]) for name in columns_of(plan)}

        finalize(run, _close, connection, scratch)
        return run

    def _verify_size(self, connection: DuckDBPyConnection, plan: Plan) -> None:
        """Refuses a plan whose rows are too many for memory: once they are arrays, the database does not bound them."""
        ((n_rows,),) = connection.execute(f"SELECT count(*) FROM ({query(plan)})").fetchall()
        limit = self.memory or (machine_memory() or 0) // _SHARE or None
        if limit is not None and n_rows * 8 * len(columns_of(plan)) > limit:
            raise LimitReached(f"a join has {n_rows:,} rows, too many for {limit:,} bytes")

    @contextmanager
    def _bounded(self, what: str) -> Iterator[None]:
        """Says what needed too much memory or disk, and that the user interrupted it, in words that others know."""
        import duckdb

        try:
            yield
        except (duckdb.OutOfMemoryException, MemoryError) as error:
            limit = "there is" if self.memory is None else f"the limit of {self.memory:,} bytes"
            raise LimitReached(f"{what} needs more memory than {limit}") from error
        except duckdb.IOException as error:
            raise LimitReached(f"{what} needs more room for temporary files than there is: {error}") from error
        except (duckdb.InterruptException, RuntimeError) as error:
            if "interrupted" in str(error).lower():
                raise KeyboardInterrupt from error
            raise


def _close(connection: DuckDBPyConnection, scratch: TemporaryDirectory[str]) -> None:
    connection.close()
    scratch.cleanup()

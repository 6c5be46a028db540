"""The default engine for anything large: plans run by DuckDB, embedded, in parallel, spilling to disk."""

from __future__ import annotations

import numpy as np

from mlnlite.engines.plan import Plan, Relation, Run, Tables, columns_of
from mlnlite.engines.sql import query, quoted


class DuckDBEngine:
    """Runs plans as SQL in an in-memory database of its own."""

    def load(self, tables: Tables) -> Run:
        """What runs plans over these tables, which are copied into the database (it wants their statistics)."""
        import duckdb  # late: most commands do without

        connection = duckdb.connect()
        connection.execute("SET enable_progress_bar = false")
        connection.execute("SET preserve_insertion_order = false")
        for name, columns in tables.items():
            connection.register("given", {f"c{i}": column for i, column in enumerate(columns)})
            connection.execute(f"CREATE TABLE {quoted(name)} AS SELECT * FROM given")
            connection.unregister("given")

        def run(plan: Plan) -> Relation:
            result = connection.execute(query(plan)).fetchnumpy()
            return {name: np.asarray(result[name], np.int64) for name in columns_of(plan)}

        return run

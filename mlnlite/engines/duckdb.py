"""The default engine for anything large: plans run by DuckDB, embedded, in parallel, spilling to disk."""

from __future__ import annotations

import numpy as np

from mlnlite.engines.plan import Plan, Relation, Tables, columns_of
from mlnlite.engines.sql import select


class DuckDBEngine:
    """Runs plans as SQL in an in-memory database of its own."""

    def run(self, plan: Plan, tables: Tables) -> Relation:
        """All rows of a plan in rising order of its columns."""
        import duckdb  # late: most commands do without

        with duckdb.connect() as connection:
            for name, columns in tables.items():
                connection.register(name, {f"c{i}": column for i, column in enumerate(columns)})
            result = connection.execute(select(plan)).fetchnumpy()
        return {name: np.asarray(result[name], np.int64) for name in columns_of(plan)}

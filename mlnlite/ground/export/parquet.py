"""A Parquet table with one row for each literal of each ground formula."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.network import Network

Columns: TypeAlias = dict[str, NDArray[Any]]


def write_parquet(network: Network, path: Path) -> None:
    """Writes a Parquet file.

    Its columns: `factor` (number), `kind` (0 clause, 1 conjunction, 2 table), `template` (index), `weight`, `count`,
    `position` (in the formula), `literal` (atom from 1, negative if negated), `atom` (its number in the evidence).
    """
    import duckdb

    blocks = list(_blocks(network))
    columns = {name: np.concatenate([b[name] for b in blocks]) for name in blocks[0]}
    quoted = str(path).replace("'", "''")
    with duckdb.connect() as connection:
        connection.register("factors", columns)
        connection.execute(f"COPY (SELECT * FROM factors ORDER BY factor, position) TO '{quoted}' (FORMAT parquet)")


def _blocks(network: Network) -> Iterator[Columns]:
    first = 0
    none = np.empty((0, 1), np.int32)
    yield _columns(network, (first, 0), none, np.empty(0, np.int32), np.empty(0, np.int64))
    for block in network.clauses:
        literals = -block.literals if block.negated else block.literals
        yield _columns(network, (first, int(block.negated)), literals, block.weight, block.count)
        first += len(literals)
    for table in network.tables:
        yield _columns(network, (first, 2), table.atoms + 1, table.weight, table.count)
        first += len(table.atoms)


def _columns(
    network: Network,
    first_and_kind: tuple[int, int],
    literals: NDArray[np.int32],
    weight: NDArray[np.int32],
    count: NDArray[np.int64],
) -> Columns:
    n, k = literals.shape
    first, kind = first_and_kind
    flat = literals.ravel()
    return {
        "factor": np.repeat(np.arange(first, first + n), k),
        "kind": np.full(n * k, kind, np.int8),
        "template": np.repeat(network.template[weight], k),
        "weight": np.repeat(network.weights[weight], k),
        "count": np.repeat(count, k),
        "position": np.tile(np.arange(k, dtype=np.int32), n),
        "literal": flat,
        "atom": network.atoms[np.abs(flat) - 1] if len(flat) else np.empty(0, np.int64),
    }

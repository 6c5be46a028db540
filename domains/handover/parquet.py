"""Parquet files by DuckDB: rows of equal keys in, a file out; and back."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import duckdb

import mlnlite as ml


def write_parquet(rows: Iterable[Mapping[str, Any]], path: str | Path) -> None:
    """Writes rows in their order; values are numbers, text, lists of these, or None.

    Raises:
        MlnError: the file cannot be written.
    """
    with TemporaryDirectory() as folder:
        lines = Path(folder) / "rows.jsonl"
        with lines.open("w", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in rows)
        _run("COPY (SELECT * FROM read_json($source, format = 'newline_delimited', sample_size = -1)) "
             f"TO '{_quoted(path)}' (FORMAT parquet, COMPRESSION zstd)", path, source=str(lines))  # fmt: skip


def read_parquet(path: str | Path) -> list[dict[str, Any]]:
    """The rows of a file, in order.

    Raises:
        MlnError: no such file, or not Parquet.
    """
    found = _run("SELECT * FROM read_parquet($source)", path, source=str(path))
    names = [column[0] for column in found.description]
    return [dict(zip(names, row, strict=True)) for row in found.fetchall()]


def _quoted(path: str | Path) -> str:
    return str(path).replace("'", "''")


def _run(query: str, path: str | Path, **values: str) -> duckdb.DuckDBPyConnection:
    try:
        return duckdb.connect().execute(query, values)
    except duckdb.Error as reason:
        raise ml.MlnError(f"cannot use {path}: {reason}", hint="give the path of a Parquet file in a folder") from None

"""Tables to coded columns: DuckDB reads them and numbers their constants, so that no row becomes a Python object."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, EvidenceMistake, did_you_mean
from mlnlite.model.bins import cut_points, numbered
from mlnlite.model.facts import TableFacts
from mlnlite.model.rowsource import RowSource
from mlnlite.model.symbols import Predicate
from mlnlite.model.table import Table
from mlnlite.syntax.coded import Coded
from mlnlite.syntax.facts import FactTable

READERS = {
    ".csv": "read_csv({}, all_varchar=true, header=true)",
    ".tsv": "read_csv({}, all_varchar=true, header=true, delim='\t')",
    ".parquet": "read_parquet({})",
    ".json": "read_json_auto({})",
    ".jsonl": "read_json_auto({}, format='newline_delimited')",
    ".ndjson": "read_json_auto({}, format='newline_delimited')",
}
ROWS_AT_ONCE = 65_536


def read_table(predicate: Predicate, table: Table) -> tuple[TableFacts, list[Diagnostic]]:
    """The facts of a table, and warnings.

    Raises:
        EvidenceMistake: it cannot be read, or its columns do not fit the predicate.
    """
    source = table.source
    name = str(source) if isinstance(source, str | Path) else f"<table {predicate.name}>"
    with closing(duckdb.connect()) as connection:
        try:
            _open(connection, source)
            return _read(connection, predicate, table, name)
        except (duckdb.Error, sqlite3.Error, OSError) as error:
            reason = str(error).split("\n", 1)[0]
            raise EvidenceMistake([Diagnostic("E332", f"{name} cannot be read as a table: {reason}")]) from None


# --- opening: afterwards there is a relation `source`


def _open(connection: duckdb.DuckDBPyConnection, source: Any) -> None:  # noqa: ANN401
    if not isinstance(source, str | Path):
        columns = {k: np.asarray(v) for k, v in source.items()} if isinstance(source, dict) else source
        connection.register("source", _objects(columns))
        return
    path, _, table = str(source).partition("::")
    if not Path(path).is_file():
        hint = did_you_mean(Path(path).name, [p.name for p in Path(path).parent.glob("*")])
        raise EvidenceMistake([Diagnostic("E332", f"there is no file {path}", hint=hint)])
    if table:
        _open_database(connection, path, table)
        return
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        hint = f"known are {', '.join(READERS)}, and FILE::TABLE for SQLite and DuckDB"
        raise EvidenceMistake([Diagnostic("E332", f"{path} is no kind of table that can be read", hint=hint)])
    connection.execute(f"CREATE VIEW source AS SELECT * FROM {reader.format(_text(path))}")


def _objects(columns: Any) -> Any:  # noqa: ANN401
    """Text columns of NumPy as columns of objects, which is how DuckDB reads them."""
    if not isinstance(columns, dict):
        return columns
    return {k: v.astype(object) if v.dtype.kind == "U" else v for k, v in columns.items()}


def _open_database(connection: duckdb.DuckDBPyConnection, path: str, table: str) -> None:
    with Path(path).open("rb") as file:
        is_sqlite = file.read(15) == b"SQLite format 3"
    if not is_sqlite:
        connection.execute(f"ATTACH {_text(path)} AS attached (READ_ONLY)")
        connection.execute(f"CREATE VIEW source AS SELECT * FROM attached.{_name(table)}")
        return
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as database:
        names = [column[0] for column in database.execute(f"SELECT * FROM {_name(table)} LIMIT 0").description]
        texts = ", ".join(f"CAST({_name(n)} AS TEXT)" for n in names)
        rows = database.execute(f"SELECT {texts} FROM {_name(table)}")
        connection.execute(f"CREATE TABLE source ({', '.join(f'{_name(n)} VARCHAR' for n in names)})")
        while chunk := rows.fetchmany(ROWS_AT_ONCE):
            columns = {str(i): np.array(c, object) for i, c in enumerate(zip(*chunk, strict=True))}
            connection.register("chunk", columns)
            connection.execute("INSERT INTO source SELECT * FROM chunk")


def _text(value: str) -> str:
    return "'" + value.replace("'", "''") + "'"


def _name(value: str) -> str:
    return '"' + value.replace('"', '""') + '"'


# --- reading


def _read(
    connection: duckdb.DuckDBPyConnection, predicate: Predicate, table: Table, name: str
) -> tuple[TableFacts, list[Diagnostic]]:
    types = {row[0]: row[1] for row in connection.execute("DESCRIBE source").fetchall()}
    special = {role: _special(role, table, list(types), name) for role in ("truth", "probability", "weight")}
    arguments = _arguments(predicate, table, list(types), {c for c in special.values() if c}, name)
    cuts = {i: cut_points(connection, c, table.bins[c], name) for i, c in enumerate(arguments) if c in table.bins}
    parts = [numbered(_name(c), cuts[i]) if i in cuts else _as_text(c, types[c]) for i, c in enumerate(arguments)]
    parts += [f"{_name(c)} AS {role}" for role, c in special.items() if c]
    connection.execute(f"CREATE TEMP TABLE t AS SELECT {', '.join(_aliased(parts, len(arguments)))} FROM source")
    columns = tuple(_coded(connection, i) for i in range(len(arguments)))
    truth, weight = _truth(connection, special, name)
    rows = np.flatnonzero(np.all([column.codes >= 0 for column in columns], axis=0) if columns else truth == truth)
    source = RowSource(name, "", columns, predicate.name)
    unsure = np.isfinite(weight[rows])
    facts = [
        FactTable(
            predicate.name,
            tuple(Coded(c.names, c.codes[mine]) for c in columns),
            truth[mine] != 0,
            np.zeros(len(mine), np.int32),
            weight[mine] if soft else None,
            mine,
            source,
        )
        for mine, soft in ((rows[~unsure], False), (rows[unsure], True))
        if len(mine) or not soft
    ]
    warnings = list(_warnings(columns, arguments, len(truth), rows, name))
    return TableFacts(tuple(facts), tuple(c.names for c in columns), cuts), warnings


def _special(role: str, table: Table, names: Sequence[str], where: str) -> str | None:
    """The column of a role: the one asked for, or the one called so."""
    asked = getattr(table, role)
    if asked is not None:
        _verify_column(asked, names, where)
        return str(asked)
    return next((n for n in names if n.lower() == role and n not in (table.columns or ())), None)


def _verify_column(column: str, names: Sequence[str], where: str) -> None:
    if column not in names:
        hint = did_you_mean(column, names) or f"it has {', '.join(names)}"
        raise EvidenceMistake(
            [Diagnostic("E333", f"{where} has no column {column}", hint=hint, found=column, expected=", ".join(names))]
        )


def _arguments(predicate: Predicate, table: Table, names: Sequence[str], special: set[str], where: str) -> list[str]:
    columns = list(table.columns) if table.columns is not None else [n for n in names if n not in special]
    for column in (*columns, *table.bins):
        _verify_column(column, names, where)
    if len(columns) != predicate.arity:
        message = f"{where} has {len(columns)} columns for {predicate}, which takes {predicate.arity}"
        hint = f"say which: a mapping file with columns = [...]; it has {', '.join(names)}"
        raise EvidenceMistake([Diagnostic("E334", message, hint=hint)])
    return columns


def _as_text(column: str, kind: str) -> str:
    """A column as text; whole numbers without `.0`."""
    quoted = _name(column)
    if kind in ("DOUBLE", "FLOAT"):
        whole = f"{quoted} = trunc({quoted}) AND abs({quoted}) < 1e15"
        text = f"CASE WHEN {whole} THEN CAST(CAST({quoted} AS BIGINT) AS VARCHAR) ELSE CAST({quoted} AS VARCHAR) END"
        return f"CASE WHEN isnan({quoted}) THEN NULL ELSE {text} END"
    return f"CAST({quoted} AS VARCHAR)"


def _aliased(parts: Sequence[str], n_arguments: int) -> list[str]:
    return [f"{part} AS c{i}" if i < n_arguments else part for i, part in enumerate(parts)] or ["1"]


def _coded(connection: duckdb.DuckDBPyConnection, index: int) -> Coded:
    """A column of `t`; a join numbers its constants, which takes a quarter of the time of a rank."""
    column = f"c{index}"
    distinct = f"SELECT DISTINCT {column} AS name FROM t WHERE {column} IS NOT NULL"
    code = "CAST(row_number() OVER (ORDER BY name) AS INTEGER) - 1"
    connection.execute(f"CREATE OR REPLACE TEMP TABLE names AS SELECT name, {code} AS code FROM ({distinct})")
    found = connection.execute(f"SELECT t.rowid AS row, code FROM t JOIN names ON {column} = name").fetchnumpy()
    codes = np.full(_n_rows(connection), -1, np.int32)
    codes[found["row"]] = found["code"]
    return Coded(connection.execute("SELECT name FROM names ORDER BY code").fetchnumpy()["name"].tolist(), codes)


def _n_rows(connection: duckdb.DuckDBPyConnection) -> int:
    return int(connection.execute("SELECT count(*) FROM t").fetchall()[0][0])


def _truth(
    connection: duckdb.DuckDBPyConnection, special: dict[str, str | None], name: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """For each row whether its fact is true (1 or 0), and its log-odds if it is not certain, else nan.

    An empty cell leaves the fact open, which is a log-odds of 0.
    """
    n_rows = _n_rows(connection)
    truth, weight = np.ones(n_rows), np.full(n_rows, np.nan)
    if special["truth"]:
        truth = _numbers(connection, "CAST(CAST(truth AS BOOLEAN) AS DOUBLE)", name)
        weight[np.isnan(truth)] = 0
    if special["probability"]:
        weight = _log_odds(_numbers(connection, "CAST(probability AS DOUBLE)", name), name)
    elif special["weight"]:
        weight = _numbers(connection, "CAST(weight AS DOUBLE)", name)
        _verify(np.isinf(weight), weight, "weight", name)
    return truth, weight if not (special["probability"] or special["weight"]) else np.where(np.isnan(weight), 0, weight)


def _numbers(connection: duckdb.DuckDBPyConnection, expression: str, name: str) -> NDArray[np.float64]:
    try:
        found = connection.execute(f"SELECT coalesce({expression}, 'nan'::DOUBLE) AS value FROM t").fetchnumpy()
    except duckdb.ConversionException as error:
        reason = str(error).split("\n", 1)[0]
        message = f"{name} has a value that is no truth or number: {reason}"
        raise EvidenceMistake([Diagnostic("E336", message)]) from None
    return np.asarray(found["value"], np.float64)


def _log_odds(values: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    _verify((values <= 0) | (values >= 1), values, "probability", name)
    return np.asarray(np.log(values) - np.log1p(-values))


def _verify(wrong: NDArray[np.bool_], values: NDArray[np.float64], what: str, name: str) -> None:
    for row in np.flatnonzero(wrong)[:1].tolist():
        message = f"row {row + 1} of {name} has the {what} {values[row]:g}"
        hint = "soft evidence lies between certainties; say what is certain in a column `truth`"
        raise EvidenceMistake([Diagnostic("E336", message, hint=hint)])


def _warnings(
    columns: Sequence[Coded], names: Sequence[str], n_rows: int, rows: NDArray[np.int64], where: str
) -> Iterator[Diagnostic]:
    for column, name in zip(columns, names, strict=True):
        if name in column.names:
            message = f"the first line of {where} was taken as its header, and {name} stands below, too"
            yield Diagnostic("W311", message, hint="a table starts with the names of its columns", severity="warning")
    if len(rows) < n_rows:
        message = f"{n_rows - len(rows):,} of {n_rows:,} rows of {where} lack a constant and say nothing"
        hint = "an atom without a fact is unknown, unless its predicate is closed"
        yield Diagnostic("W312", message, hint=hint, severity="warning")

"""Tables to coded columns: DuckDB reads them and numbers their constants, so that no row becomes a Python object."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, EvidenceMistake, did_you_mean
from mlnlite.model.bins import cut_points, numbered
from mlnlite.model.constants import blocks
from mlnlite.model.facts import TableFacts
from mlnlite.model.rowsource import RowSource
from mlnlite.model.symbols import Predicate
from mlnlite.model.table import Table
from mlnlite.syntax.coded import Coded, Codes
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
    kept = "VIEW" if name.lower().endswith(".parquet") else "TABLE"  # what is quick to read again takes no memory
    connection.execute(f"CREATE TEMP {kept} t AS SELECT {', '.join(_aliased(parts, len(arguments)))} FROM source")
    columns = _coded(connection, predicate.types)
    truth, weight = _truth(connection, special, name)
    source = RowSource(name, "", columns, predicate.name)
    told, unsure = np.ones(len(truth), np.bool_), np.isfinite(weight)
    for column in columns:
        told &= column.codes >= 0
    facts = [
        FactTable(
            predicate.name,
            tuple(Coded(c.names, c.codes[rows]) for c in columns),
            truth[rows] != 0,
            np.broadcast_to(np.int32(0), len(offset)),
            weight[rows] if soft else None,
            offset,
            source,
        )
        for soft, (rows, offset) in ((False, _rows(told & ~unsure)), (True, _rows(told & unsure)))
        if len(offset) or not soft
    ]
    constants = tuple([c.names[i] for i in np.unique(c.codes[~told & (c.codes >= 0)]).tolist()] for c in columns)
    warnings = list(_warnings(columns, arguments, told, name))
    return TableFacts(tuple(facts), constants, cuts), warnings


def _rows(mine: NDArray[np.bool_]) -> tuple[slice | Codes, Codes]:
    """The rows marked, as what selects them and as numbers."""
    numbers = np.flatnonzero(mine).astype(np.int32)
    return (slice(None) if len(numbers) == len(mine) else numbers), numbers


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


def _coded(connection: duckdb.DuckDBPyConnection, types: Sequence[str]) -> tuple[Coded, ...]:
    """The columns of `t`; those of one type share their constants. NULL is -1.

    DuckDB hashes the texts; what is left is to find numbers in a list, if no two texts have the same hash.
    """
    found: dict[int, Coded] = {}
    for of in dict.fromkeys(types):
        mine = [i for i, t in enumerate(types) if t == of]
        distinct = " UNION ".join(f"SELECT DISTINCT c{i} AS name FROM t" for i in mine)
        for salt in count():
            query = f"SELECT name, hash(name, {salt}) AS key FROM ({distinct}) ORDER BY key"
            names, keys = connection.execute(query).fetchnumpy().values()
            if (keys[1:] != keys[:-1]).all():
                break
        lacking = np.flatnonzero(np.ma.getmaskarray(names)).tolist()
        texts = np.ma.filled(names, "").tolist()
        for i in mine:
            hashes = connection.execute(f"SELECT hash(c{i}, {salt}) AS key FROM t").fetchnumpy()["key"]
            codes = _places(np.asarray(hashes), np.asarray(keys))
            for null in lacking:
                codes[codes == null] = -1
            found[i] = Coded(texts, codes)
    return tuple(found[i] for i in range(len(types)))


def _places(numbers: NDArray[np.uint64], rising: NDArray[np.uint64]) -> Codes:
    """Where numbers stand in a rising list that holds them: looked up by their first bits, then one after the other."""
    bits = len(rising).bit_length() + 1
    shift = np.uint64(64 - bits)
    first = np.searchsorted(rising >> shift, np.arange(1 << bits, dtype=np.uint64)).astype(np.int32)
    places = np.empty(len(numbers), np.int32)
    for block in blocks(len(numbers)):
        some = numbers[block]
        at = first[some >> shift]
        while len(on := np.flatnonzero(rising[at] != some)):
            at[on] += 1
        places[block] = at
    return places


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
    columns: Sequence[Coded], names: Sequence[str], told: NDArray[np.bool_], where: str
) -> Iterator[Diagnostic]:
    for column, name in zip(columns, names, strict=True):
        if name in column.names:
            message = f"the first line of {where} was taken as its header, and {name} stands below, too"
            yield Diagnostic("W311", message, hint="a table starts with the names of its columns", severity="warning")
    if not told.all():
        message = f"{np.count_nonzero(~told):,} of {len(told):,} rows of {where} lack a constant and say nothing"
        hint = "an atom without a fact is unknown, unless its predicate is closed"
        yield Diagnostic("W312", message, hint=hint, severity="warning")

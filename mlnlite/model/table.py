"""What a table says about a predicate: which column is which argument. Comes from the caller or from a TOML file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from mlnlite.errors import Diagnostic, EvidenceMistake, did_you_mean


@dataclass(frozen=True)
class Table:
    """Facts about one predicate in a table.

    Attributes:
        source: a file (CSV, TSV, Parquet, JSON lines), `FILE::TABLE` for a table of an SQLite or DuckDB file, a data
            frame (pandas, Polars, Arrow), or a mapping from names to columns.
        columns: the column of each argument of the predicate; by default the columns of those names that are left when
            `truth` and the like are taken out, in order.
        truth: name of a column that says whether the fact is true; NULL means unknown. By default a column `truth`.
        probability: name of a column with probabilities: soft evidence. By default a column `probability`.
        weight: name of a column with log-odds: soft evidence. By default a column `weight`.
        bins: for a column of numbers its cut points, or how many bins with about equally many rows it gets. The
            constants are called `<18`, `18..65` (18 included, 65 not), `>=65`.
    """

    source: Any
    columns: Sequence[str] | None = None
    truth: str | None = None
    probability: str | None = None
    weight: str | None = None
    bins: Mapping[str, int | Sequence[float]] = field(default_factory=dict)


_OPTIONS = ("file", *(f.name for f in fields(Table) if f.name != "source"))


def read_mapping(path: Path) -> list[tuple[str, Table]]:
    """The tables that a TOML file names, one section for each predicate.

    ```toml
    [Friends]
    file = "friends.csv"        # taken relative to the TOML file
    columns = ["from", "to"]
    ```

    Raises:
        EvidenceMistake: it cannot be read, or says something else.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise EvidenceMistake([Diagnostic("E330", f"{path} cannot be read as a mapping: {error}")]) from None
    mistakes = [Diagnostic("E331", f"{path}: {m}", hint=hint) for m, hint in _mistakes(content)]
    if mistakes:
        raise EvidenceMistake(mistakes)
    return [(name, _table(path.parent, section)) for name, section in content.items()]


def _table(folder: Path, section: Mapping[str, Any]) -> Table:
    file, _, name = section["file"].partition("::")
    options = {key: value for key, value in section.items() if key != "file"}
    return Table(f"{folder / file}{'::' if name else ''}{name}", **options)


def _mistakes(content: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What is wrong with a mapping, each with a hint."""
    for name, section in content.items():
        if not isinstance(section, dict):
            yield f"{name} is not a section", f"write [{name}] and below it file = ..."
            continue
        if not isinstance(section.get("file"), str):
            yield f"[{name}] names no file", 'write file = "..."'
        for key, value in section.items():
            if key not in _OPTIONS:
                yield f"[{name}] has an unknown {key}", did_you_mean(key, _OPTIONS) or f"known: {', '.join(_OPTIONS)}"
            elif not _fits(key, value):
                yield f"[{name}] {key} is {value!r}", _EXPECTED.get(key, "a text is expected")


_EXPECTED = {"columns": "a list of names is expected", "bins": "write bins = { age = [18, 65] } or bins = { age = 4 }"}


def _fits(key: str, value: object) -> bool:
    if key == "columns":
        return isinstance(value, list) and all(isinstance(v, str) for v in value)
    if key == "bins":
        return isinstance(value, dict) and all(_are_bins(v) for v in value.values())
    return isinstance(value, str)


def _are_bins(value: object) -> bool:
    numbers = value if isinstance(value, list) else [value]
    return bool(numbers) and all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers)

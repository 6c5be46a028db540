"""Tables for people: come in cells, goes out plain text or HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import MissingPart

if TYPE_CHECKING:
    import pandas as pd

Int64 = NDArray[np.int64]

SHOWN = 60
"""Rows that are shown unless all are asked for."""


def text_table(head: tuple[str, ...], rows: list[tuple[str, ...]], limit: int | None, foot: Sequence[str]) -> str:
    """A table in plain text."""
    shown = [head, *(rows if limit is None else rows[:limit])]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in shown]
    lines.insert(1, "  ".join("-" * w for w in widths))
    left = len(rows) - len(shown) + 1
    return "\n".join([*lines, *([f"... {left:,} more"] if left else []), *foot])


def html_table(head: tuple[str, ...], rows: list[tuple[str, ...]], caption: str) -> str:
    """A table in HTML, its first rows if there are many."""
    body = "".join(f"<tr>{''.join(f'<td>{escape(c)}</td>' for c in row)}</tr>" for row in rows[:SHOWN])
    more = f" ({len(rows) - SHOWN:,} more rows)" if len(rows) > SHOWN else ""
    top = "".join(f"<th>{escape(h)}</th>" for h in head)
    caption = f"<caption>{escape(caption)}{more}</caption>"
    return f"<table>{caption}<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def data_frame(columns: Mapping[str, object]) -> pd.DataFrame:
    """A data frame of columns."""
    try:
        import pandas as pd
    except ImportError as error:
        raise MissingPart("pandas is not installed", hint="pip install pandas") from error
    return pd.DataFrame({name: list(column) for name, column in columns.items()})  # type: ignore[call-overload]


def order_of_rows(names: Sequence[str], block: Int64 | None) -> list[int]:
    """Rows predicate by predicate, block by block, otherwise as given."""
    predicates: dict[str, int] = {}
    for name in names:
        predicates.setdefault(name.partition("(")[0], len(predicates))
    blocks: dict[int, int] = {}
    first = [i if b < 0 else blocks.setdefault(b, i) for i, b in enumerate([] if block is None else block.tolist())]
    place = first or range(len(names))
    return sorted(range(len(names)), key=lambda i: (predicates[names[i].partition("(")[0]], place[i], i))


def number_cell(value: float, form: str) -> str:
    """A number, or nothing."""
    return format(value, form) if isfinite(value) else ""


def json_number(value: float) -> float | None:
    """A number as JSON knows it."""
    return value if isfinite(value) else None

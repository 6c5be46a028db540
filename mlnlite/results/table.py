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


def text_table(head: tuple[str, ...], rows: list[tuple[str, ...]], left: int, foot: Sequence[str]) -> str:
    """A table in plain text; `left` says how many rows are not in it."""
    shown = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in shown]
    lines.insert(1, "  ".join("-" * w for w in widths))
    return "\n".join([*lines, *([f"... {left:,} more"] if left else []), *foot])


def html_table(head: tuple[str, ...], rows: list[tuple[str, ...]], left: int, caption: str) -> str:
    """A table in HTML; `left` says how many rows are not in it."""
    body = "".join(f"<tr>{''.join(f'<td>{escape(c)}</td>' for c in row)}</tr>" for row in rows)
    more = f" ({left:,} more rows)" if left else ""
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
    predicate = np.array([predicates.setdefault(name.partition("(")[0], len(predicates)) for name in names], np.int64)
    place = np.arange(len(names))
    if block is not None:
        _, first, inverse = np.unique(block, return_index=True, return_inverse=True)
        place = np.where(block < 0, place, first[inverse])
    order: list[int] = np.lexsort((place, predicate)).tolist()
    return order


def number_cell(value: float, form: str) -> str:
    """A number, or nothing."""
    return format(value, form) if isfinite(value) else ""


def json_number(value: float) -> float | None:
    """A number as JSON knows it."""
    return value if isfinite(value) else None

"""Numbers to constants: cut points, and the names of the bins between them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import duckdb

from mlnlite.errors import Diagnostic, EvidenceMistake


def cut_points(
    connection: duckdb.DuckDBPyConnection, column: str, bins: int | Sequence[float], where: str
) -> tuple[float, ...]:
    """The cut points of a column of the relation `source`: those given, or those that make `bins` equal parts.

    Raises:
        EvidenceMistake: the points do not rise, or the column has no numbers.
    """
    if not isinstance(bins, int):
        points = tuple(float(b) for b in bins)
        if any(b <= a for a, b in pairwise(points)):
            message = f"the cut points of {column} of {where} do not rise: {', '.join(f'{p:g}' for p in points)}"
            raise EvidenceMistake([Diagnostic("E337", message)])
        return points
    shares = ", ".join(str(i / bins) for i in range(1, bins))
    if not shares:
        message = f"{column} of {where} is to have {bins} bins; at least 2 make sense"
        raise EvidenceMistake([Diagnostic("E337", message)])
    name = '"' + column.replace('"', '""') + '"'
    found = connection.execute(f"SELECT quantile_disc(TRY_CAST({name} AS DOUBLE), [{shares}]) FROM source").fetchall()
    if not found[0][0]:
        raise EvidenceMistake([Diagnostic("E337", f"{column} of {where} has no numbers to be divided into bins")])
    return tuple(dict.fromkeys(float(p) for p in found[0][0]))


def bin_names(points: Sequence[float]) -> list[str]:
    """The names of the bins between cut points.

    >>> bin_names([18, 65])
    ['<18', '18..65', '>=65']
    """
    texts = [f"{p:.12g}" for p in points]
    between = [f"{a}..{b}" for a, b in pairwise(texts)]
    return [f"<{texts[0]}", *between, f">={texts[-1]}"]


def numbered(column: str, points: Sequence[float]) -> str:
    """SQL for the name of the bin of a column's value. A value that is no number is an error of the reader."""
    value = f"CAST({column} AS DOUBLE)"
    names = bin_names(points)
    cases = " ".join(f"WHEN {value} < {point!r} THEN '{name}'" for point, name in zip(points, names, strict=False))
    return f"CASE WHEN {value} IS NULL THEN NULL {cases} ELSE '{names[-1]}' END"

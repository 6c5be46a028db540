"""Choices: alternatives as sparse rows, and the gathering of equal ones. Comes in what was listed, goes out each once.

Rows are compared by two 64-bit sums, so that a million of them are merged by one sort of integers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Int64 = NDArray[np.int64]
UInt64 = NDArray[np.uint64]
Float = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Choices:
    """All choices, those with the same rows once.

    Attributes:
        rows: shape (n_rows, n_weights), sparse; row `r` is an alternative of choice `choice[r]`.
        log_times: shape (n_rows,), logarithm of how many alternatives of the choice have this row.
        choice: shape (n_rows,), rising.
        many: shape (n_choices,), how many choices of the data look like this.
        n_choices: number of all choices in the data, those included that no formula touches.
        constant: what the untouched choices add to the log-likelihood.
        group: shape (n_choices,), cluster of each choice (choices of different clusters are then kept apart).
    """

    rows: sparse.csr_array
    log_times: Float
    choice: Int64
    many: Float
    n_choices: int
    constant: float
    group: Int64


@dataclass(frozen=True, slots=True)
class Listed:
    """Choices one by one.

    Attributes:
        rows: shape (n_rows, n_weights), sparse.
        times: shape (n_rows,), how many alternatives look like this.
        choice: shape (n_rows,), rising.
        database: shape (n_touched,), of each choice.
        unit: shape (n_touched,), number of an atom of each choice; where worlds are listed, number of the part.
        n_choices: number of choices, those included that no formula touches.
        constant: log-likelihood of the latter in each database, shape (n_databases,), or 0 for all.
    """

    rows: sparse.csr_array
    times: Float
    choice: Int64
    database: Int64
    unit: Int64
    n_choices: int
    constant: Float


def merged(
    parts: Sequence[Listed], n_weights: int, groups: Sequence[Int64] | None = None, worth: Float | None = None
) -> Choices:
    """Choices, equal ones once.

    Args:
        parts: what was listed.
        n_weights: number of weights.
        groups: for each part the cluster of each choice: only choices of one cluster are merged. None: all are of one.
        worth: shape (n_databases,), how much each database counts; None for 1.
    """
    n_touched = np.cumsum([0, *(len(p.database) for p in parts)])
    rows = sparse.csr_array(sparse.vstack([p.rows for p in parts])) if parts else sparse.csr_array((0, n_weights))
    times = np.concatenate([np.empty(0), *(p.times for p in parts)])
    shifted = (p.choice + n for p, n in zip(parts, n_touched, strict=False))
    choice = np.concatenate([np.empty(0, np.int64), *shifted])
    n_choices, constant = sum(p.n_choices for p in parts), sum(float(_times(p.constant, worth).sum()) for p in parts)
    clusters = [np.zeros(len(p.database), np.int64) for p in parts] if groups is None else groups
    of_choice = np.concatenate([np.empty(0, np.int64), *clusters])
    rows, times, choice, key = _equal_rows(rows, times, choice)
    firsts = np.flatnonzero(np.diff(choice, prepend=-1))
    n_rows = np.diff(np.append(firsts, len(choice)))
    each = np.concatenate([np.empty(0), *(_times(np.ones(len(p.database)), worth, p.database) for p in parts)])
    kept, many = _equal_choices(key, times, firsts, of_choice[choice[firsts]], each[choice[firsts]])
    number = np.full(len(firsts), -1, np.int64)
    number[kept] = np.arange(len(kept))
    of_row = np.repeat(number, n_rows)
    keep = np.flatnonzero(of_row >= 0)
    cluster = of_choice[choice[firsts[kept]]]
    log_times = np.log(times[keep])
    return Choices(sparse.csr_array(rows[keep]), log_times, of_row[keep], many, n_choices, constant, cluster)


def _equal_rows(rows: sparse.csr_array, times: Float, choice: Int64) -> tuple[sparse.csr_array, Float, Int64, UInt64]:
    """Equal alternatives of a choice once, and the keys of the rows, shape (2, n_rows)."""
    key = _row_keys(rows)
    if not (np.diff(choice) == 0).any():
        return rows, times, choice, key
    order = np.lexsort((key[1], key[0], choice))
    times, choice, key = times[order], choice[order], key[:, order]
    new = np.ones(len(choice), bool)
    new[1:] = (choice[1:] != choice[:-1]) | (key[:, 1:] != key[:, :-1]).any(axis=0)
    start = np.flatnonzero(new)
    return sparse.csr_array(rows[order[start]]), np.add.reduceat(times, start), choice[start], key[:, start]


def _times(values: Float, worth: Float | None, database: Int64 | None = None) -> Float:
    """Values of databases times their worth."""
    return values if worth is None else values * (worth if database is None else worth[database])


def _equal_choices(key: UInt64, times: Float, firsts: Int64, group: Int64, each: Float) -> tuple[Int64, Float]:
    """The first of each kind of choice, and what all of that kind count."""
    if not len(firsts):
        return np.empty(0, np.int64), np.empty(0)
    with np.errstate(over="ignore"):
        mixed = _mixed(key + times.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15))
        sums = np.add.reduceat(mixed, firsts, axis=1) + group.astype(np.uint64) * np.uint64(0xD1B54A32D192ED03)
    _, kept, number = np.unique(sums[0], return_index=True, return_inverse=True)
    if (sums[1] != sums[1, kept[number.reshape(-1)]]).any():
        _, kept, number = np.unique(sums, axis=1, return_index=True, return_inverse=True)
    order = np.argsort(kept)
    return kept[order], np.bincount(number.reshape(-1), each)[order].astype(float)


def _row_keys(rows: sparse.csr_array) -> UInt64:
    """Two 64-bit sums for each row that are equal for equal rows, and else with chance 2^-128. Shape (2, n_rows)."""
    random = np.random.default_rng(20060101).integers(0, 2**64, (2, rows.shape[1]), dtype=np.uint64)
    values = rows.data.astype(np.int64).astype(np.uint64)
    keys = np.zeros((2, rows.shape[0]), np.uint64)
    filled = np.flatnonzero(np.diff(rows.indptr))
    with np.errstate(over="ignore"):
        for i in range(2):
            products = values * random[i, rows.indices]
            if len(filled):
                keys[i, filled] = np.add.reduceat(products, rows.indptr[filled])
    return keys


def _mixed(keys: UInt64) -> UInt64:
    """Keys stirred (splitmix64), so that sums of them tell sets apart."""
    keys = (keys ^ (keys >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    keys = (keys ^ (keys >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(keys ^ (keys >> np.uint64(31)), np.uint64)

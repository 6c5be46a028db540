"""Choices at some weights to matrices: how sharp the likelihood is, and what each cluster of the data says of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from mlnlite.learn.data.merge import Choices
from mlnlite.learn.optimise import likelihood

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]


def expected_rows(choices: Choices, x: Float) -> sparse.csr_array:
    """What each choice adds to the gradient, shape (n_choices, n_weights)."""
    point = likelihood.at(choices, x)
    n_rows = len(choices.choice)
    shape = (len(choices.many), n_rows)
    chance = sparse.csr_array((point.chance, (choices.choice, np.arange(n_rows))), shape=shape)
    return sparse.csr_array(chance @ choices.rows)


def hessian(choices: Choices, x: Float) -> sparse.csr_array:
    """Minus the Hessian of the log-likelihood, shape (n_weights, n_weights)."""
    point, mean = likelihood.at(choices, x), expected_rows(choices, x)
    weight = choices.many[choices.choice] * point.chance
    second = choices.rows.T @ sparse.diags_array(weight) @ choices.rows
    return sparse.csr_array(second - mean.T @ sparse.diags_array(choices.many) @ mean)


def columns(choices: Choices, x: Float, at: Int64) -> tuple[Float, Float]:
    """The diagonal of minus the Hessian, shape (n_weights,), and its columns `at`, shape (n_weights, len(at))."""
    point, mean = likelihood.at(choices, x), expected_rows(choices, x)
    weight = choices.many[choices.choice] * point.chance
    diagonal = choices.rows.power(2).T @ weight - mean.power(2).T @ choices.many
    rows, means = (np.asarray(m[:, at].todense(), float) for m in (choices.rows, mean))
    chosen = choices.rows.T @ (weight[:, None] * rows) - mean.T @ (choices.many[:, None] * means)
    return np.asarray(diagonal), np.asarray(chosen)


def without_rows(choices: Choices) -> Choices:
    """No choices, over the same weights."""
    rows, none = sparse.csr_array((0, choices.rows.shape[1])), np.empty(0)
    return replace(choices, rows=rows, log_times=none, choice=np.empty(0, np.int64), many=none)


def scores(choices: Choices, x: Float) -> sparse.csr_array:
    """Gradient of each cluster, shape (n_clusters, n_weights); clusters without a choice are left out."""
    clusters, cluster = np.unique(choices.group, return_inverse=True)
    n = len(choices.many)
    gather = sparse.csr_array((choices.many, (cluster.reshape(-1), np.arange(n))), shape=(len(clusters), n))
    return sparse.csr_array(gather @ expected_rows(choices, x))


def blocks(matrix: sparse.csr_array) -> Iterator[Int64]:
    """Weights that hang together: the connected components of a symmetric matrix."""
    n, label = connected_components(matrix, directed=False)
    order = np.argsort(label, kind="stable").astype(np.int64)
    yield from np.split(order, np.cumsum(np.bincount(label, minlength=n))[:-1])


def dense(matrix: sparse.csr_array, rows: Int64) -> Float:
    """A square part of a matrix."""
    return np.asarray(matrix[rows][:, rows].todense(), float)

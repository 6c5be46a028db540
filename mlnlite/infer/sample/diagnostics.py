"""How far averages over chains can be off: come in series of draws, go out R-hat, standard errors, effective sizes.

Series have the shape (n_chains, n_batches, n_columns): each entry is the mean of `batch` successive draws.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import betaincinv, ndtri

from mlnlite.ground.network import Bool, Float, Float32, Int64

_AT_ONCE, _FEW_LAGS = 1 << 18, 8


def standard_errors(series: Float | Float32) -> tuple[Float, Float]:
    """Monte Carlo standard error of the mean of each column, and the number of independent entries that would do.

    Autocovariances are summed as long as neighbours add up to something positive and falling (Geyer 1992); chains that
    disagree count as autocorrelation (Vehtari et al. 2021).

    Args:
        series: shape (n_chains, n_batches, n_columns).

    Returns:
        Two arrays of shape (n_columns,): 0 and the number of entries for a column that never changes.
    """
    m, n, _ = series.shape
    error, entries = [np.zeros(0)], [np.zeros(0)]
    for block in _blocks(series):
        split = _halves(block)
        within, spread = _within(split), split.mean(axis=1).var(axis=0, ddof=1)
        both = within * (split.shape[1] - 1) / split.shape[1] + spread
        with np.errstate(invalid="ignore", divide="ignore"):
            time = np.maximum(_integrated(split, within, both), 1 / np.log10(m * n))
        time = np.where(both > 0, time, 1.0)
        error.append(np.sqrt(both * time / (m * n)))
        entries.append(m * n / time)
    return np.concatenate(error), np.concatenate(entries)


def r_hat(series: Float | Float32, ratio: Float | float = 1.0) -> Float:
    """Whether chains agree: rank-normalised split R-hat, plain or folded, whichever is larger (Vehtari et al. 2021).

    Args:
        series: shape (n_chains, n_batches, n_columns).
        ratio: shape (n_columns,), variance of a batch over that of a single draw: with it R-hat is that of the draws.

    Returns:
        Shape (n_columns,), nan for a column that never changes.
    """
    found, done = [np.zeros(0)], 0
    for block in _blocks(series):
        part = ratio[done : done + block.shape[2]] if isinstance(ratio, np.ndarray) else ratio
        folded = np.abs(block - np.median(block.reshape(-1, block.shape[2]), axis=0))
        found.append(np.fmax(_split_r_hat(_normal(block), part), _split_r_hat(_normal(folded), part)))
        done += block.shape[2]
    return np.concatenate(found)


def jeffreys(never: Bool, size: float) -> tuple[Float, Float]:
    """95 % interval for the probability of something that was never, or always, seen.

    Args:
        never: shape (n,), True where it was never seen, False where always.
        size: effective number of draws.
    """
    edge = float(betaincinv(0.5, size + 0.5, 0.975))
    return np.where(never, 0.0, 1.0 - edge), np.where(never, edge, 1.0)


def _blocks(series: Float | Float32) -> Iterator[Float]:
    """A bounded number of columns at a time."""
    step = max(1, _AT_ONCE // (series.shape[0] * series.shape[1]))
    for begin in range(0, series.shape[2], step):
        yield series[:, :, begin : begin + step].astype(float)


def _halves(series: Float) -> Float:
    """Each chain as two."""
    half = series.shape[1] // 2
    return np.concatenate([series[:, :half], series[:, -half:]])


def _within(series: Float) -> Float:
    """Mean variance inside chains."""
    return np.asarray(series.var(axis=1, ddof=1).mean(axis=0))


def _integrated(series: Float, within: Float, both: Float) -> Float:
    """Integrated autocorrelation time of each column: twice the sum of the initial monotone sequence.

    Most columns forget in a few lags; only for the others all lags are worked out.

    Args:
        series: shape (n_chains, n_batches, n_columns).
        within: shape (n_columns,), mean variance inside chains.
        both: shape (n_columns,), that with what differs between chains.
    """
    time, ends = _sequence(1 - (within - _first_lags(series)) / both)
    rest = np.flatnonzero(~ends & (both > 0))
    if len(rest):
        time[rest], _ = _sequence(1 - (within[rest] - _all_lags(series[:, :, rest])) / both[rest])
    return time


def _first_lags(series: Float) -> Float:
    """Mean over chains of the autocovariance at the first few lags: shape (n_lags, n_columns)."""
    n = series.shape[1]
    centred = series - series.mean(axis=1, keepdims=True)
    sums = [np.einsum("cbi,cbi->i", centred[:, lag:], centred[:, : n - lag]) for lag in range(min(_FEW_LAGS, n))]
    return np.asarray(np.stack(sums) / (len(series) * (n - 1)))


def _all_lags(series: Float) -> Float:
    """The same at each lag: shape (n_batches, n_columns)."""
    n = series.shape[1]
    centred = series - series.mean(axis=1, keepdims=True)
    spectrum = np.fft.rfft(centred, 2 * n, axis=1)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, axis=1)[:, :n].mean(axis=0) / (n - 1))


def _sequence(rho: Float) -> tuple[Float, Bool]:
    """Initial monotone sequence of autocorrelations, shape (n_lags, n_columns): its double sum, whether it ends."""
    rho = rho[: len(rho) // 2 * 2].copy()
    rho[0] = 1.0
    pairs = rho.reshape(-1, 2, rho.shape[1]).sum(axis=1)
    over = np.maximum.accumulate(~(pairs > 0), axis=0)
    pairs[over] = 0.0
    return np.asarray(2 * np.minimum.accumulate(pairs, axis=0).sum(axis=0) - 1), over[-1]


def _normal(series: Float) -> Float:
    """Normal scores of the ranks over all chains, equal entries with their mean rank."""
    rows = np.ascontiguousarray(series.reshape(-1, series.shape[2]).T)
    n = rows.shape[1]
    order = np.argsort(rows, axis=1)
    ordered = np.take_along_axis(rows, order, axis=1)
    new = np.ones(rows.shape, np.bool_)
    new[:, 1:] = ordered[:, 1:] != ordered[:, :-1]
    twice = np.broadcast_to(2 * np.arange(n), rows.shape).copy()
    ties = np.flatnonzero(~new.all(axis=1))
    twice[ties] = _mean_places(new[ties])
    scores = ndtri((np.arange(2 * n) / 2 + 0.625) / (n + 0.25))
    found = np.empty(rows.shape)
    np.put_along_axis(found, order, scores[twice], axis=1)
    return np.asarray(found.T).reshape(series.shape)


def _mean_places(new: Bool) -> Int64:
    """Twice the mean place of equal entries in sorted rows, of which `new` says where others begin."""
    n = new.shape[1]
    place: Int64 = np.broadcast_to(np.arange(n), new.shape)
    first = np.maximum.accumulate(np.where(new, place, 0), axis=1)
    last_here = np.ones(new.shape, np.bool_)
    last_here[:, :-1] = new[:, 1:]
    last = np.minimum.accumulate(np.where(last_here, place, n)[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(first + last)


def _split_r_hat(series: Float, ratio: Float | float) -> Float:
    """R-hat of half chains."""
    split = _halves(series)
    n, within = split.shape[1], _within(split)
    between = split.mean(axis=1).var(axis=0, ddof=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(within > 0, np.sqrt((n - 1) / n + ratio * between / within), np.nan)

"""From a solution to a result: comes in numbers about the atoms of a network, go out `Marginals` with names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.approach import BOUNDED
from mlnlite.infer.marginal.bp import LOOPY
from mlnlite.infer.marginal.ladder import Solution
from mlnlite.results import Marginals, Statistics

EVIDENCE = "evidence"
_NAMED = 3


def marginals_from(
    names: Sequence[str], rows: tuple[Int64, Bool], solution: Solution, statistics: Statistics, block: Int64
) -> Marginals:
    """A result.

    Args:
        names: of its n rows.
        rows: for each the row of the solution, -1 where evidence decides it; and for the first ones their truth if so.
        solution: the numbers.
        statistics: what it took.
        block: shape (n,), functional block of each row, -1 for none.
    """
    (source, truth), columns = rows, solution.columns
    known = source < 0
    decided = np.zeros(len(source))
    decided[: len(truth)] = truth

    def column(values: Float, else_: Float | float) -> Float:
        padded = np.append(values, np.nan)
        return np.where(known, else_, padded[source])

    exact = np.append(columns.exact, True)[source]
    methods = [EVIDENCE if s < 0 else solution.methods[s] for s in source.tolist()]
    return Marginals(
        names=tuple(names),
        probabilities=column(columns.probability, decided),
        methods=tuple(methods),
        exact=exact,
        error=column(columns.error, 0.0),
        status=status_of(names, source, solution),
        log_z=solution.log_z,
        statistics=statistics,
        block=block,
        low=column(columns.low, decided),
        high=column(columns.high, decided),
        r_hat=column(columns.r_hat, np.nan),
        effective_size=column(columns.size, np.nan),
        traces=solution.traces,
        draws=tuple((np.flatnonzero(np.isin(source, which)), series) for which, series in solution.draws),
    )


def status_of(names: Sequence[str], source: Int64, solution: Solution) -> str:
    """One line about the whole, naming what is not as it should be."""
    used, columns = source[source >= 0], solution.columns
    if columns.exact[used].all():
        return "exact"
    guessed = {m for m in solution.methods if m.startswith(LOOPY)}
    if guessed:
        settled = "" if guessed == {LOOPY} else "; messages did not settle"
        return f"approximate: {LOOPY}, errors not known{settled}"
    error = float(np.nanmax(columns.error[used]))
    if {solution.methods[s] for s in used[~columns.exact[used]].tolist()} == {BOUNDED}:
        return f"exact to within {error:.1e}"
    parts = [f"sampled, standard errors up to {error:.4f}"]
    parts += [word for end, word in _ENDINGS.items() if end in solution.endings]
    bad = [i for i in np.flatnonzero(source >= 0).tolist() if not columns.mixed[source[i]]]
    if bad:
        worst = sorted(bad, key=lambda i: -columns.r_hat[source[i]])[:_NAMED]
        shown = ", ".join(
            f"{names[i]} (R-hat {columns.r_hat[source[i]]:.3f}, effective size {columns.size[source[i]]:.0f})"
            for i in worst
        )
        parts.append(f"{len(bad):,} not well mixed: {shown}{', ...' if len(bad) > _NAMED else ''}")
    return "; ".join(parts)


_ENDINGS = {"interrupted": "interrupted", "time": "time limit reached"}

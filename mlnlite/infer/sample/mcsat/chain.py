"""MC-SAT with an exact inner sampler: comes in a chain, goes out the chain further on.

Each ground formula as a whole is kept with probability 1 - exp(-|weight|) if it holds (if its weight is negative: if it
fails), and a world that satisfies all that are kept is drawn (Poon and Domingos 2006). The published method draws it
with SampleSAT, which is not uniform; here unit propagation takes the kept formulas apart, and each part is drawn
uniformly by listing its worlds. In what has too many, SampleSAT's moves (Wei, Erenrich and Selman 2004) are accepted as
Metropolis and Hastings ask, so that they too keep the uniform distribution. A sweep of Gibbs sampling follows, for the
average.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mlnlite.ground.network import Bool, Int32, Int64
from mlnlite.infer.sample.gibbs import Chain, Sums, gibbs_draws, owners, states

if TYPE_CHECKING:
    from mlnlite.infer.sample.mcsat.slice import Slice

LISTED = 4096
"""Values to try, besides 16 for each variable, before a part counts as too large to list its worlds."""
TRIPS, MOST_TRIPS, LONGEST, HEAT = 64, 16_384, 48, (0.5, 4.0)
"""Of SampleSAT: trips besides one for each variable, most trips, most moves of a trip, costs of a violation."""


def mcsat_draws(chain: Chain, n: int, watched: Int32, exact: Bool) -> Sums:
    """Draws of MC-SAT, each followed by a sweep.

    Args:
        chain: changed.
        n: how many.
        watched: shape (n_watched, 2), variables and atoms to follow.
        exact: shape (n_variables,), set to False for variables that some slice did not draw uniformly.
    """
    total = np.zeros((2, chain.factors.n_atoms))
    seen = np.zeros((n, len(watched)), np.bool_)
    for i in range(n):
        jump(chain, exact)
        sums = gibbs_draws(chain, 1, watched)
        total += sums.total
        seen[i] = sums.seen[0]
    return Sums(total, seen)


def jump(chain: Chain, exact: Bool) -> None:
    """One step of MC-SAT.

    Args:
        chain: changed.
        exact: as in `mcsat_draws`.
    """
    from mlnlite.infer.sample.mcsat.draw import draw
    from mlnlite.infer.sample.mcsat.slice import cut, empty_slice
    from mlnlite.infer.sample.mcsat.units import propagate

    f = chain.factors
    s, owner = empty_slice(f), owners(f)
    queue = np.empty(2 * f.n_factors + 1, np.int64)
    n_queued = cut(f, s, chain.state, chain.rng.random(f.n_factors), queue)
    propagate(f, s, owner, queue, n_queued)
    left = draw(f, s, owner, chain.rng.random(f.n_variables), chain.true, LISTED)
    exact[left[0]] = False
    if left.size:
        _wander(chain, s, owner, left)
    chain.state[:] = states(f, chain.true)


def _wander(chain: Chain, s: Slice, owner: Int32, left: Int64) -> None:
    """Takes as many trips through each part as it has variables, and some more.

    Args:
        chain: changed.
        s: the slice.
        owner: shape (n_atoms,), variable of each atom.
        left: shape (2, n), the variables that are left, part by part, and the number of each one's part.
    """
    from mlnlite.infer.sample.mcsat.wander import Trips, wander

    start = np.flatnonzero(np.diff(left[1], prepend=-1))
    length = np.diff(start, append=left.shape[1])
    spans = np.repeat(np.stack([start, start + length], axis=1), np.minimum(TRIPS + length, MOST_TRIPS), axis=0)
    heat = chain.rng.uniform(*HEAT, len(spans))
    chance = chain.rng.random((len(spans), LONGEST, 5))
    wander(chain.factors, s, owner, Trips(left[0], spans, chance, heat), chain.true)

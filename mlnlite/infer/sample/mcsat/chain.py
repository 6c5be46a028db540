"""MC-SAT with an exact inner sampler: comes in a chain, goes out the chain further on.

Each ground formula as a whole is kept with probability 1 - exp(-|weight|) if it holds (if its weight is negative: if it
fails), and a world that satisfies all that are kept is drawn (Poon and Domingos 2006). The published method draws it
with SampleSAT, which is not uniform; here unit propagation takes the kept formulas apart, and each part is drawn
uniformly by listing its worlds. A sweep of Gibbs sampling follows, for the average.
"""

from __future__ import annotations

import numpy as np

from mlnlite.ground.network import Bool, Int32
from mlnlite.infer.sample.gibbs import Chain, Sums, gibbs_draws, owners, states


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
    draw(f, s, owner, chain.rng.random(f.n_variables), chain.true, exact)
    chain.state[:] = states(f, chain.true)

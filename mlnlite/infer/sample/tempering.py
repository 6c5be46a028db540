"""Parallel tempering: comes in a chain with hotter ones beside it, goes out the same further on.

The hotter chains see flatter distributions and cross between modes; worlds trade places along the ladder so that each
chain keeps its distribution (Geyer 1991; Earl and Deem 2005).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.ground.network import Bool, Int32
from mlnlite.infer.sample.gibbs import Chain, Sums, gibbs_draws, log_weights

LADDER = tuple(0.8**i for i in range(1, 12))


def with_ladder(chain: Chain) -> Chain:
    """A chain with hotter ones beside it, all in its present world."""
    rngs = chain.rng.spawn(len(LADDER))
    hotter = (
        replace(chain, true=chain.true.copy(), state=chain.state.copy(), rng=rng, beta=beta)
        for rng, beta in zip(rngs, LADDER, strict=True)
    )
    return replace(chain, hotter=tuple(hotter))


def tempered_draws(chain: Chain, n: int, watched: Int32, _: Bool) -> Sums:
    """Sweeps of all chains, each followed by trades between neighbours.

    Args:
        chain: the coldest, changed as its hotter ones are.
        n: how many sweeps.
        watched: shape (n_watched, 2), variables and atoms to follow in the coldest.
    """
    ladder, nothing = (chain, *chain.hotter), np.zeros((0, 2), np.int32)
    total = np.zeros((2, chain.factors.n_atoms))
    seen = np.zeros((n, len(watched)), np.bool_)
    for i in range(n):
        sums = gibbs_draws(chain, 1, watched)
        total += sums.total
        seen[i] = sums.seen[0]
        for other in chain.hotter:
            gibbs_draws(other, 1, nothing)
        for k in range(i % 2, len(ladder) - 1, 2):
            trade(ladder[k], ladder[k + 1])
    return Sums(total, seen)


def trade(cold: Chain, hot: Chain) -> bool:
    """Lets two chains trade worlds, so often as leaves both distributions as they are; returns whether they did."""
    gain = (cold.beta - hot.beta) * float(log_weights(hot).sum() - log_weights(cold).sum())
    if np.log(1.0 - cold.rng.random()) > gain:
        return False
    for mine, theirs in ((cold.true, hot.true), (cold.state, hot.state)):
        mine[:], theirs[:] = theirs.copy(), mine.copy()
    return True

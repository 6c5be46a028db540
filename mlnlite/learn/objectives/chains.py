"""Worlds of a network that are carried along while its weights change. Comes in a network, go out worlds and counts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.ground.network import Network
from mlnlite.ground.patterns import with_counts
from mlnlite.infer.sample.factors import factors_of
from mlnlite.infer.sample.gibbs import gibbs_draws, start
from mlnlite.infer.sample.mcsat.chain import jump
from mlnlite.infer.sample.sampling import best_sampler
from mlnlite.infer.sample.worlds import start_worlds
from mlnlite.infer.score import counts

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Chains:
    """Chains at some point.

    Attributes:
        network: its weights do not matter.
        worlds: shape (n_chains, n_atoms), where the chains are.
    """

    network: Network
    worlds: Bool


def new_chains(network: Network, n_chains: int, random: np.random.Generator) -> Chains:
    """Chains that start in random worlds that the hard formulas allow.

    Raises:
        Contradiction: if there is none.
    """
    return Chains(with_counts(network), start_worlds(network, n_chains, random))


def sweep(
    chains: Chains, weights: Float, share: sparse.csr_array, n: int, random: np.random.Generator
) -> tuple[Chains, Float]:
    """The chains further on: sweeps of Gibbs sampling, each after a jump of MC-SAT where formulas are nearly hard.

    Args:
        chains: where they are.
        weights: shape (n_weights,), of the network.
        share: shape (n_weights, k), sums of counts that are wanted.
        n: sweeps of each chain.
        random: where chance comes from.

    Returns:
        The chains, and the sums of the numbers of true groundings after each sweep, shape (n_chains, n, k).
    """
    network = replace(chains.network, weights=weights)
    wanted = sparse.csr_array(share.T)
    found = np.empty((len(chains.worlds), n, share.shape[1]))
    if not network.n_atoms:
        found[:] = wanted @ network.decided_true
        return chains, found
    factors = factors_of(network, np.ones(network.n_variables, np.bool_))
    jumps = best_sampler(factors) == "mcsat"
    watched, even = np.zeros((0, 2), np.int32), np.ones(factors.n_variables, np.bool_)
    worlds = np.zeros_like(chains.worlds)
    for c, world in enumerate(chains.worlds):
        chain = start(factors, world[factors.atom], random)
        for t in range(n):
            if jumps:
                jump(chain, even)
            gibbs_draws(chain, 1, watched)
            worlds[c] = False
            worlds[c, factors.atom[chain.true[chain.true >= 0]]] = True
            found[c, t] = wanted @ counts(network, worlds[c])
    return Chains(chains.network, worlds), found

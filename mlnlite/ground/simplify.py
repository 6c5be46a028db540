"""Hard unit clauses: what they force becomes evidence. Network in, smaller network out, the distribution unchanged."""

from __future__ import annotations

import numpy as np

from mlnlite.errors import Contradiction, Diagnostic
from mlnlite.ground.condition import condition
from mlnlite.ground.network import Network
from mlnlite.model.change import UNKNOWN


def propagated(network: Network) -> Network:
    """The network with the atoms known that hard formulas force, again and again until none is.

    What was removed shows in the sizes: `n_atoms` and `n_factors` before and after.

    Raises:
        Contradiction: if two hard formulas force one atom both ways.
    """
    while True:
        known = np.full(network.n_atoms, UNKNOWN, np.int8)
        for block in network.clauses:
            hard = np.isposinf(network.weights[block.weight])
            if block.negated:
                literals, owner = -block.literals[hard].ravel(), np.repeat(block.weight[hard], block.literals.shape[1])
            elif block.literals.shape[1] == 1:
                literals, owner = block.literals[hard].ravel(), block.weight[hard]
            else:
                continue
            for truth in (0, 1):
                forced = (literals > 0) == bool(truth)
                atoms = np.abs(literals[forced]) - 1
                against = known[atoms] == 1 - truth
                if against.any():
                    raise _against(network, int(owner[forced][against][0]))
                known[atoms] = truth
        if (known == UNKNOWN).all():
            return network
        network = condition(network, known)


def _against(network: Network, weight: int) -> Contradiction:
    template = network.model.templates[network.template[weight]]
    message = f"{template.name} is hard and forces an atom that other hard formulas forbid: {template.text}"
    return Contradiction([Diagnostic("E405", message, template.span, "give one of them a finite weight")])

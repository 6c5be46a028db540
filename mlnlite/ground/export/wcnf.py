"""Weighted MaxSAT as the MaxSAT Evaluation writes it since 2022: `h` for hard, else a whole-number weight."""

from __future__ import annotations

import numpy as np

from mlnlite.ground.export.factors import penalties
from mlnlite.ground.network import Network

SCALE = 1_000_000
"""Weights are multiplied by this and rounded."""


def wcnf(network: Network) -> str:
    """The most probable world as a MaxSAT problem: its cost is what the best world pays, times `SCALE`."""
    lines = [f"c weights are multiplied by {SCALE} and rounded; literal a is the a-th atom of this list"]
    lines += [f"c {i} {name}" for i, name in enumerate(network.evidence.atom_texts(network.atoms), 1)]
    for factor in penalties(network):
        head = "h" if np.isinf(factor.gain) else str(round(factor.gain * SCALE))
        if head != "0":
            lines.append(f"{head} {' '.join(map(str, factor.literals))} 0")
    return "\n".join(lines) + "\n"

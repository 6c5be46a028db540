"""The Markov network format of the UAI inference competitions: tables of factors, not of their logarithms."""

from __future__ import annotations

import numpy as np

from mlnlite.ground.export.scopes import log_tables
from mlnlite.ground.network import Network


def uai(network: Network) -> str:
    """The network as a UAI file. What evidence decides, a constant factor, is left out."""
    scopes, tables = [], []
    for scope, table in log_tables(network):
        scopes.append(f"{len(scope)} {' '.join(map(str, scope))}")
        tables.append(f"{table.size}\n {' '.join(f'{x:.17g}' for x in np.exp(table).ravel())}")
    head = ["MARKOV", str(network.n_variables), " ".join(map(str, network.cardinality.tolist())), str(len(scopes))]
    return "\n".join([*head, *scopes, "", *tables]) + "\n"

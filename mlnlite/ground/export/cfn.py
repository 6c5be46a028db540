"""The cost function network format of toulbar2 (JSON): costs to be minimised, variables with named values."""

from __future__ import annotations

import json

import numpy as np

from mlnlite.ground.export.scopes import log_tables, value_names
from mlnlite.ground.network import Network

DECIMALS = 6


def cfn(network: Network) -> str:
    """The most probable world as a cost function network; costs are what a factor loses against its best."""
    names = value_names(network)
    soft = [w for w in np.abs(network.weights[np.isfinite(network.weights)]) * 1.0]
    top = 1.0 + float(sum(soft)) * max(1, network.n_factors)
    variables = {f"x{v}": [_clean(n) for n in values] for v, values in enumerate(names)}
    functions = {}
    for i, (scope, table) in enumerate(log_tables(network)):
        cost = np.where(np.isneginf(table), top, table.max() - table)
        costs = [round(c, DECIMALS) for c in cost.ravel().tolist()]
        functions[f"f{i}"] = {"scope": [f"x{v}" for v in scope], "costs": costs}
    problem = {"name": "mlnlite", "mustbe": f"<{top:.{DECIMALS}f}"}
    return json.dumps({"problem": problem, "variables": variables, "functions": functions}, indent=1) + "\n"


def _clean(name: str) -> str:
    """A value name without what toulbar2 does not read."""
    return "".join(c if c.isalnum() or c in "_-!" else "_" for c in name)

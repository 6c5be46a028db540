"""Components of networks."""

import networkx as nx
import numpy as np
from hypothesis import given, settings

from mlnlite.infer.reduce.components import components_of
from tests.networks import network, networks


@settings(max_examples=100, deadline=None)
@given(net=networks())
def test_components_are_those_of_the_graph(net):
    graph = nx.Graph()
    graph.add_nodes_from(range(net.n_variables))
    scopes = [net.variable[np.abs(c.literals) - 1] for c in net.clauses] + [net.variable[t.atoms] for t in net.tables]
    scopes += [net.variable[np.abs(c.literals) - 1] for c in net.counts]
    for scope in scopes:
        for row in scope.tolist():
            nx.add_path(graph, row)
    label = components_of(net)
    found = [np.flatnonzero(label == c).tolist() for c in range(label.max(initial=-1) + 1)]
    assert found == sorted(map(sorted, nx.connected_components(graph)))


def test_variables_without_factors_are_components():
    assert components_of(network([("", 1), ("!", 3)])).tolist() == [0, 1]

"""The factor graph: variables, factors, and edges between them, for Graphviz and for GraphML readers."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO

from mlnlite.ground.export.factors import clause_factors, table_factors
from mlnlite.ground.export.text import origin
from mlnlite.ground.network import Network


def dot(network: Network) -> str:
    """A Graphviz text: atoms are ellipses (a block is one), factors are boxes with their weight."""
    lines = ["graph mlnlite {", "  node [fontsize=10];"]
    lines += [f'  x{v} [label="{_escaped(label)}"];' for v, label in enumerate(_labels(network))]
    for i, (variables, gain, where) in enumerate(_factors(network)):
        lines.append(f'  f{i} [shape=box, label="{gain:.4g}", tooltip="{_escaped(where)}"];')
        lines += [f"  f{i} -- x{v};" for v in variables]
    return "\n".join([*lines, "}"]) + "\n"


def graphml(network: Network) -> str:
    """A GraphML text with the attributes `kind`, `label`, `gain` and `origin`."""
    import networkx as nx

    graph = nx.Graph()
    for v, label in enumerate(_labels(network)):
        graph.add_node(f"x{v}", kind="variable", label=label)
    for i, (variables, gain, where) in enumerate(_factors(network)):
        graph.add_node(f"f{i}", kind="factor", gain=gain, origin=where)
        graph.add_edges_from((f"f{i}", f"x{v}") for v in variables)
    buffer = BytesIO()
    nx.write_graphml(graph, buffer)
    return buffer.getvalue().decode("utf-8") + "\n"


def _labels(network: Network) -> list[str]:
    labels: list[list[str]] = [[] for _ in range(network.n_variables)]
    for v, name in zip(network.variable.tolist(), network.evidence.atom_texts(network.atoms), strict=True):
        labels[v].append(name)
    return [" | ".join(names) for names in labels]


def _factors(network: Network) -> Iterator[tuple[list[int], float, str]]:
    for factor in clause_factors(network):
        atoms = [abs(x) - 1 for x in factor.literals]
        yield sorted(set(network.variable[atoms].tolist())), factor.gain, origin(network, factor.weight)
    for table in table_factors(network):
        variables = sorted(set(network.variable[list(table.atoms)].tolist()))
        yield variables, table.gain, origin(network, table.weight)


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')

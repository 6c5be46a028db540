"""Why a world: comes in a network and a world, go out the groundings that it pays for, and what one atom would change.

The groundings of a soft formula that a world violates are a query, as in cutting planes, so nothing is ground for it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Engine
from mlnlite.errors import Contradiction, QueryMistake
from mlnlite.ground.compile import bindings, column
from mlnlite.ground.condition import condition
from mlnlite.ground.ground import row_tables, source_of
from mlnlite.ground.lazy import world_evidence
from mlnlite.ground.network import Bool, Int64, Network
from mlnlite.ground.tables import tables_of
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.map.rungs import Method
from mlnlite.infer.query import question_of
from mlnlite.infer.score import counts, log_weight, n_paid
from mlnlite.model.change import UNKNOWN
from mlnlite.model.formulas import Formula
from mlnlite.model.model import Model
from mlnlite.model.propositional import cubes
from mlnlite.model.unparse import row_text
from mlnlite.results.why import Alternative, PaidGrounding


def paid_texts(network: Network, paid: Int64) -> dict[int, str]:
    """The formula of each weight that a world pays for, see `score.n_paid`."""
    first = np.searchsorted(network.template, np.arange(len(network.model.templates)))
    texts = {}
    for w in np.flatnonzero(paid).tolist():
        t = int(network.template[w])
        template = network.model.templates[t]
        texts[w] = row_text(template, network.model, w - int(first[t])) if template.keys else template.text
    return texts


def paid_groundings(
    network: Network, truth: Bool, texts: dict[int, str], engine: Engine | None = None
) -> list[PaidGrounding]:
    """The violated groundings of soft formulas, dearest first; those with counting quantifiers are left out.

    Args:
        network: what was ground.
        truth: shape (n_atoms,), a world.
        texts: for each weight that is paid for, the text of its formula.
        engine: what runs the queries.
    """
    world = world_evidence(network, truth)
    paid = np.array(sorted(texts), np.int64)
    found: list[PaidGrounding] = []
    for violated in (True, False):
        weights = paid[(network.weights[paid] > 0) == violated]
        model = _with_weights(network, weights)
        run = (engine or engine_for()).load({**tables_of(world), **row_tables(model)})
        for t in np.unique(network.template[weights]).tolist():
            source = source_of(t, model.templates[t], world)
            own = weights[network.template[weights] == t]
            for cube in () if source.counted else cubes(source.formula.body, not violated):
                rows = run(bindings(source, cube, source.formula.free))
                free = {v: rows[column(v)] for v in source.formula.free}
                n = len(next(iter(rows.values()), np.zeros(1)))
                which = own[rows["row"] if source.tabled else np.zeros(n, np.int64)]
                found += _paid(network, source.formula, (which, free), texts)
    return sorted(found, key=lambda g: (-g.cost, g.formula, g.binding))


def _with_weights(network: Network, weights: Int64) -> Model:
    """The model with some of its formulas only; templates keep their places."""
    chosen = np.zeros(len(network.weights), np.bool_)
    chosen[weights] = True
    own = np.split(chosen, np.searchsorted(network.template, np.arange(1, len(network.model.templates))))
    return replace(
        network.model,
        templates=tuple(
            replace(t, rows=None if t.rows is None else t.rows[o], weights=t.weights[o], row_spans=())
            for t, o in zip(network.model.templates, own, strict=True)
        ),
    )


def _paid(
    network: Network, formula: Formula, groundings: tuple[Int64, dict[int, Int64]], texts: dict[int, str]
) -> Iterator[PaidGrounding]:
    """Groundings, each by its weight and the constants of its variables, as records."""
    weights, free = groundings
    for i, w in enumerate(weights.tolist()):
        binding = tuple(
            (formula.variables[v].name, network.evidence.types[formula.variables[v].type].constants[int(ids[i])])
            for v, ids in free.items()
        )
        yield PaidGrounding(texts[w], binding, float(network.weights[w]))


def alternative(network: Network, truth: Bool, text: str, method: Method, time_limit: float | None) -> Alternative:
    """The best world in which an atom is the other way round, against a most probable world.

    Args:
        network: what was ground.
        truth: shape (n_atoms,), the most probable world.
        text: the atom.
        method: how to search.
        time_limit: [s] for the search.

    Raises:
        QueryMistake: the text is not one ground atom.
    """
    numbers = question_of([text], network.model, network.evidence).atoms
    if len(numbers) != 1:
        raise QueryMistake(f"{text} is not a single atom", "name one atom with constants only")
    atom = int(np.searchsorted(network.atoms, numbers[0]))
    name = network.evidence.atom_texts(numbers)[0]
    if atom == network.n_atoms or network.atoms[atom] != numbers[0]:
        return Alternative(name, np.inf, 0.0)
    known = np.full(network.n_atoms, UNKNOWN, np.int8)
    known[atom] = not truth[atom]
    try:
        left = condition(network, known)
        best = map_of(left, method=method, time_limit=time_limit)
    except Contradiction:
        return Alternative(name, np.inf, 0.0)
    other = _whole(network, left, best.truth)
    changed = np.flatnonzero(other != truth)
    texts = network.evidence.atom_texts(network.atoms[changed])
    order = np.argsort(changed != atom, kind="stable").tolist()
    names = tuple(("" if other[changed[i]] else "!") + texts[i] for i in order)
    paid = n_paid(network, counts(network, truth)) + n_paid(network, counts(network, other))
    before, after = (Counter(paid_groundings(network, w, paid_texts(network, paid))) for w in (truth, other))
    margin = log_weight(network, truth) - best.log_weight
    return Alternative(
        name, margin, best.gap, names, tuple((after - before).elements()), tuple((before - after).elements())
    )


def _whole(network: Network, left: Network, truth: Bool) -> Bool:
    """A world of all atoms, from one of those that were left open."""
    whole = left.evidence.is_true(network.atoms)
    whole[np.searchsorted(network.atoms, left.atoms)] = truth
    return whole

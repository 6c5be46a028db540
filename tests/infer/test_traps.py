"""Three cases that are easily got wrong, as docs/explanation/marginals.md has them, against listing all worlds."""

import numpy as np
import pytest

import mlnlite as ml
from tests import brute

FIVE = """Smokes(person)
Cancer(person)
*Friends(person, person)
1.5 Smokes(x) => Cancer(x)
1.1 Friends(x, y) => (Smokes(x) <=> Smokes(y))
"""
FACTS = "Friends(Ann, Bob)\nFriends(Bob, Cat)\nFriends(Cat, Dan)\nFriends(Dan, Eve)\nFriends(Eve, Ann)\nSmokes(Ann)\n"
TRAPS = {
    "a hard disjunction": ("H\nS\nH v S.\n", "", ["H", "S"]),
    "a soft biconditional": ("A\nB\n1.5 A <=> B\n0.7 A\n", "", ["A", "B"]),
    "five smokers": (FIVE, FACTS, ["Smokes", "Cancer"]),
}


@pytest.mark.parametrize("method", ["auto", "mcsat", "gibbs", "wmc"])
@pytest.mark.parametrize("name", TRAPS)
def test_traps(name, method):
    text, facts, query = TRAPS[name]
    if method == "gibbs" and name == "a hard disjunction":
        pytest.skip("one atom at a time cannot be asked to pass hard formulas")
    if method == "wmc":
        pytest.importorskip("pyganak")
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text(facts, model=model)
    every, probability, _ = brute.distribution(model, evidence)
    found = ml.marginal(model, evidence, query, method=method, precision=0.004)
    for row, atom in enumerate(found.names):
        predicate, _, rest = atom.rstrip(")").partition("(")
        ids = tuple(evidence.types["person"].index[c] for c in rest.split(", ")) if rest else ()
        expected = sum(p for world, p in zip(every, probability, strict=True) if world[predicate, ids])
        assert abs(found[atom] - expected) <= 5 * found.error[row] + 1e-7  # series are kept in single precision
    assert np.isfinite(found.probabilities).all()

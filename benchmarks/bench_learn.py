"""How learning grows with the data, whether intervals hold the truth, and whether planted rules are found.

Run with `make benchmark`. Friends and smokers: N people, ten random friends each, friendship known; time is CPU time.
"""

from dataclasses import replace
from time import process_time

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.infer.deadline import Deadline
from mlnlite.learn.learned import How
from mlnlite.learn.objectives.choose import Search, solved, task_of
from mlnlite.learn.prior import Gaussian
from mlnlite.model.evidence import Facts
from mlnlite.model.symbols import Type
from tests.learn.test_structure import GIVEN, PLANTED, f1, planted, planted_lines, without
from tests.learn.test_uncertainty import coverage

SMOKERS = """Smokes(person)
Cancer(person)
Friends(person, person)
Smokes(x) => Cancer(x)
Friends(x, y) => (Smokes(x) <=> Smokes(y))
"""
SIZES = (1_000, 10_000, 100_000, 1_000_000)


def table(arguments):
    n = len(arguments)
    return Facts(np.zeros(n, np.int32), np.ascontiguousarray(arguments, np.int32), np.ones(n, np.bool_))


def smokers(n):
    """N people, as evidence that was read."""
    random = np.random.default_rng(0)
    smokes = random.random(n) < 0.3
    cancer = random.random(n) < np.where(smokes, 0.5, 0.1)
    friends = np.unique(np.repeat(np.arange(n), 10) * n + random.integers(0, n, 10 * n))
    model = ml.model_from_text(SMOKERS)
    facts = {
        "Smokes": table(np.flatnonzero(smokes)[:, None]),
        "Cancer": table(np.flatnonzero(cancer)[:, None]),
        "Friends": table(np.column_stack(np.divmod(friends, n))),
    }
    person = Type("person", tuple(f"P{i}" for i in range(n)))
    present = {"person": np.ones((1, n), np.bool_)}
    return model, replace(ml.no_evidence(model), types={"person": person}, facts=facts, present=present)


@pytest.mark.parametrize("n", SIZES)
def test_smokers(n, benchmark):
    model, data = smokers(n)
    learned = benchmark.pedantic(lambda: ml.learn(model, data, predict=["Smokes", "Cancer"]), rounds=3, warmup_rounds=1)
    benchmark.extra_info["distinct rows"] = learned.problem.every.rows.shape[0]
    assert learned.status == "converged"


def test_exponents(benchmark):
    """CPU time of counting and of the search as powers of the number of people."""

    def best_of_three(work):
        found, seconds = None, []
        for _ in range(3):
            start = process_time()
            found = work()
            seconds.append(process_time() - start)
        return min(seconds), found

    def measured():
        how, seconds = How(predict=("Cancer", "Smokes")), []
        for n in SIZES:
            model, data = smokers(n)
            count, task = best_of_three(
                lambda model=model, data=data: task_of(model, data, how, frozenset(how.predict), None)
            )
            search = Search(None, 0, Deadline())
            solve, _ = best_of_three(
                lambda model=model, task=task, search=search: solved(model, task, Gaussian(), search)
            )
            seconds.append((count, solve))
        benchmark.extra_info["count and search [s]"] = seconds
        return [float(np.polyfit(np.log(SIZES), np.log(s), 1)[0]) for s in zip(*seconds, strict=True)]

    counting, search = benchmark.pedantic(measured, rounds=1)
    benchmark.extra_info.update({"counting exponent": counting, "search exponent": search})
    assert counting <= 1.1
    assert search <= 0.3


def test_intervals_hold_the_truth(benchmark):
    """200 data sets drawn from a known model."""
    share = benchmark.pedantic(lambda: coverage(200), rounds=1)
    benchmark.extra_info["coverage"] = share.tolist()
    assert ((share >= 0.92) & (share <= 0.98)).all()


def test_planted_rules(benchmark):
    """Three rules among 45 candidates, 10^5 facts."""
    model, data = planted(26_000, 0)
    found = benchmark.pedantic(lambda: ml.find_rules(model, data, predict=["Ill"], given=GIVEN), rounds=1)
    assert f1({rule.text for rule in found.rules}, PLANTED) >= 0.95


def test_planted_rules_with_missing_labels(benchmark):
    """The same with 30 % of what the rules conclude marked unknown."""
    model, lines = planted_lines(26_000, 0)
    data = ml.evidence_from_text("\n".join(without(lines, {"Ill": 0.3}, 26_000)), model=model)
    found = benchmark.pedantic(lambda: ml.find_rules(model, data, predict=["Ill"], given=GIVEN), rounds=1)
    assert f1({rule.text for rule in found.rules}, PLANTED) >= 0.95


def test_quantifiers_over_pairs(benchmark):
    """Pairs of unknown atoms among 1000 constants."""
    n, random = 1000, np.random.default_rng(0)
    facts = [f"S(P{i})" for i in range(0, n, 2)]
    facts += [f"A(P{a}, P{b})" for a, b in random.integers(0, n, (3 * n, 2)).tolist()]
    facts += [f"A(P{b}, P{a})" for a, b in random.integers(0, n, (n, 2)).tolist()]
    model = ml.model_from_text("S(p)\nA(p, p)\nA(x, y)\nS(x)\nEXIST y (A(x, y) ^ A(y, x))")
    data = ml.evidence_from_text("\n".join(dict.fromkeys(facts)), model=model)
    learned = benchmark.pedantic(lambda: ml.learn(model, data), rounds=1)
    assert learned.status == "converged"

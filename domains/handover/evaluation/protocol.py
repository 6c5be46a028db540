"""The paper's protocol, repeated: instances and poses in, accuracy on objects that were left out of training out.

Of 32 objects 22 train and 10 test. The first split is the paper's (its ten test objects), the others are random. Every
number stands beside chance, majority, the look-up table, the paper's single conjunction and the Bayes ceiling.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

import mlnlite as ml
from mlnlite.domains.handover.instances.generate import Instance, facts_of
from mlnlite.domains.handover.instances.poses import Cell, MeanPose, Placed, quaternion_angles, templates
from mlnlite.domains.handover.knowledge.facts import THING, Fact, fact_text, kept, level_facts, object_facts
from mlnlite.domains.handover.knowledge.train import train
from mlnlite.domains.handover.knowledge.words import ASKED, METHODS, known_predicates, method_name, read_knowledge
from mlnlite.domains.handover.objects import object_names, read_object
from mlnlite.domains.handover.pose import FloatArray
from mlnlite.domains.handover.study.preferences import published

PAPER_TEST = ("shoe", "stapler", "camera", "bowl", "plate", "sunglasses", "toothbrush", "marker", "flashlight", "glass")
TOLERANCE = (0.005, np.radians(2.0))
"""The paper's: 5 mm and 2 degrees."""
MEASURES = ("method", "region", "pose", "grasp", "pose and grasp", "pose from template", "chance", "majority",
            "look-up", "paper's conjunction", "ceiling")  # fmt: skip
"""`pose` is the object's pose and `grasp` the tool's pose in the object, both by the cost model for what was predicted,
within tolerance of those for the label; `pose from template` takes the mean pose of shape and method in training. The
last five are of the method."""


@dataclass(frozen=True, slots=True)
class Split:
    """One split.

    Attributes:
        test: the objects left out.
        scores: rows right and rows in all, by measure, source of rows, and shape.
    """

    test: tuple[str, ...]
    scores: Mapping[tuple[str, str, str], tuple[float, int]]


def splits(n: int, *, seed: int = 0) -> tuple[tuple[str, ...], ...]:
    """Test objects of each split, the paper's first."""
    rng, names = np.random.default_rng(seed), object_names()
    drawn = [tuple(names[i] for i in sorted(rng.permutation(len(names))[:10])) for _ in range(n - 1)]
    return (PAPER_TEST, *drawn)[:n]


def run_splits(
    instances: Sequence[Instance], placed: Mapping[Cell, Placed], n: int = 200, *, seed: int = 0, workers: int = 2
) -> tuple[Split, ...]:
    """Trains and tests on each split."""
    work = partial(run_split, instances, placed)
    if workers == 1:
        return tuple(map(work, splits(n, seed=seed)))
    with ProcessPoolExecutor(workers) as pool:
        return tuple(pool.map(work, splits(n, seed=seed), chunksize=5))


def run_split(instances: Sequence[Instance], placed: Mapping[Cell, Placed], test: tuple[str, ...]) -> Split:
    """Trains without the test objects, then predicts their rows."""
    training = [row for row in instances if row.thing not in test]
    learned = train(read_knowledge(), facts_of(training)).model
    asked = sorted({(row.thing, row.task, row.level) for row in instances if row.thing in test})
    answers = answer_all(learned, asked)
    means = templates(placed, {n: read_object(n).shape for n in object_names() if n not in test})
    rivals = _rivals(training)
    scores: dict[tuple[str, str, str], list[float]] = defaultdict(lambda: [0.0, 0.0])
    for row in instances:
        if row.thing in test:
            shape = read_object(row.thing).shape
            right = _judged(row, answers[row.thing, row.task, row.level], placed, means) | rivals(row)
            for measure, value in right.items():
                for place in ((measure, row.source, shape), (measure, row.source, "all"), (measure, "all", "all")):
                    scores[place][0] += value
                    scores[place][1] += 1
    return Split(test, {key: (right, int(n)) for key, (right, n) in scores.items()})


def answer_all(model: ml.Model, asked: Sequence[tuple[str, str, str]]) -> dict[tuple[str, str, str], tuple[int, str]]:
    """Most probable region (from 1) and method for each object, task and level; one inference for each level."""
    out = {}
    for level in sorted({key[2] for key in asked}):
        chosen = [key for key in asked if key[2] == level]
        facts: list[Fact] = list(level_facts(level))
        for i, (thing, task, _) in enumerate(chosen):
            known = kept(object_facts(read_object(thing), task), known_predicates(model))
            facts += [(name, f"{THING}{i}", *rest) for name, _, *rest in known]
        text = "".join(f"{fact_text(fact)}\n" for fact in facts)
        evidence = ml.evidence_from_text(text, model=model)
        found = ml.marginal(model, evidence, ASKED, closed_world=known_predicates(model))
        best = _best(found)
        out.update({key: (int(best["graspRegion", f"{THING}{i}"]), method_name(best["handover", f"{THING}{i}"]))
                    for i, key in enumerate(chosen)})  # fmt: skip
    return out


def _best(found: ml.Marginals) -> dict[tuple[str, str], str]:
    """Most probable value of each predicate and object."""
    best: dict[tuple[str, str], tuple[float, str]] = {}
    for name, p in zip(found.names, found.probabilities.tolist(), strict=True):
        predicate, _, rest = name.rstrip(")").partition("(")
        thing, value = rest.split(", ")
        if p > best.get((predicate, thing), (-1.0, ""))[0]:
            best[predicate, thing] = (p, value)
    return {key: value for key, (_, value) in best.items()}


Means = Mapping[tuple[str, str], MeanPose]


def _judged(row: Instance, answer: tuple[int, str], placed: Mapping[Cell, Placed], means: Means) -> dict[str, float]:
    """What of an answer is right."""
    region, method = answer
    right = {"method": float(method == row.method), "region": float(region == row.region)}
    wanted = placed.get(_cell(row.thing, row.region, row.level, row.method))
    if wanted is None or wanted.status != "optimal":
        return right
    found = placed.get(_cell(row.thing, region, row.level, method))
    pose, grasp = _near(found, wanted)
    mean = means.get((read_object(row.thing).shape, method))
    right |= {"pose": pose, "grasp": grasp, "pose and grasp": pose * grasp}
    return right | {"pose from template": _mean_near(mean, wanted)}


def _cell(thing: str, region: int, level: str, method: str) -> Cell:
    return Cell(thing, region, level if method == "ours" else "", method)


def _near(found: Placed | None, wanted: Placed) -> tuple[float, float]:
    if found is None or found.status != "optimal":
        return 0.0, 0.0
    pose = is_near((found.position, found.quaternion), (wanted.position, wanted.quaternion))
    grasp = is_near((found.grasp_position, found.grasp_quaternion), (wanted.grasp_position, wanted.grasp_quaternion))
    return float(pose), float(grasp)


def _mean_near(mean: MeanPose | None, wanted: Placed) -> float:
    if mean is None:
        return 0.0
    return float(is_near((mean.position, mean.quaternion), (wanted.position, wanted.quaternion)))


_PoseArrays = tuple[FloatArray, FloatArray]


def is_near(first: _PoseArrays, second: _PoseArrays) -> bool:
    """Whether two poses, as positions [m] and quaternions (w, x, y, z), are within `TOLERANCE`."""
    distance = float(np.linalg.norm(first[0] - second[0]))
    return distance <= TOLERANCE[0] and float(quaternion_angles(first[1], second[1])) <= TOLERANCE[1]


_Shares = dict[str, float]


def _rivals(training: Sequence[Instance]) -> Callable[[Instance], _Shares]:
    """What simpler guesses of the method score on a row; ties share the credit."""
    everyone = Counter(row.method for row in training)
    cells: dict[tuple[str, ...], Counter[str]] = defaultdict(Counter)
    for row in training:
        cells[_features(row)][row.method] += 1
    table = published()
    best_of_level = {level: table.methods[int(counts.argmax())]
                     for level, counts in zip(table.levels, table.counts, strict=True)}  # fmt: skip

    def score(row: Instance) -> _Shares:
        cell = cells.get(_features(row), Counter())
        return {
            "chance": 1 / len(METHODS),
            "majority": _credit(everyone, row.method),
            "look-up": _credit(cell or everyone, row.method),
            "paper's conjunction": _credit(cell, row.method),
            "ceiling": float(best_of_level[row.level] == row.method),
        }

    return score


def _features(row: Instance) -> tuple[str, ...]:
    thing = read_object(row.thing)
    return thing.shape, thing.category, row.task, row.level


def _credit(counts: Mapping[str, int], label: str) -> float:
    """Share of the credit if the most frequent are guessed; of nothing, every method is as good."""
    top = [name for name in METHODS if counts.get(name, 0) == max(counts.values(), default=0)]
    return float(label in top) / len(top)

"""Time of one optimisation, one question and one new plan: 100 random scenes x 4 mobility levels x 2 robots.

Run: python benchmarks/bench_handover.py [scenes]. CPU seconds of one core; kernels are compiled before it starts.
The map has 15^3 voxels x 8 orientations. `fresh`: scene, grasps of an object not met before, optimisation. `warm`: the
optimisation again. `ask`: one question to a learnt model; `replan`: the question, the scene with the hand elsewhere,
and the optimisation.
"""

from __future__ import annotations

import os
import sys
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from mlnlite.domains import handover
from mlnlite.domains.handover.scene.grasps import sample_grasps
from mlnlite.domains.handover.scene.objects import object_names, read_object
from mlnlite.domains.handover.scene.receiver import Body, read_receiver
from mlnlite.domains.handover.scene.scene import Layout, make_scene
from mlnlite.domains.handover.search.hierarchical import optimise

LEVELS = ("H", "H-M", "L-M", "L")
ROBOTS = ("pr2", "panda")


def draw(seed):
    """Object, task, body and an offset of the hand [m]."""
    rng = np.random.default_rng(seed)
    name = object_names()[rng.integers(32)]
    tasks = read_object(name).affordances
    task = tasks[rng.integers(len(tasks))][0]
    posture = ("standing", "seated")[rng.integers(2)]
    sex = ("male", "female")[rng.integers(2)]
    body = Body(round(rng.uniform(1.55, 1.90), 2), round(rng.uniform(50, 95), 1), sex, posture=posture)
    return name, task, body, rng.uniform(-0.03, 0.03, 3)


def run(seed, level, robot):
    """CPU seconds fresh and warm, and the result."""
    name, task, body, offset = draw(seed)
    receiver = read_receiver(level, body)
    hand = make_scene(name, task, receiver, robot).hand.position + offset
    optimise(make_scene("marker", "to_write", receiver, robot))
    sample_grasps.cache_clear()
    start = process_time()
    scene = make_scene(name, task, receiver, robot, layout=Layout(hand=hand))
    optimise(scene)
    fresh, start = process_time() - start, process_time()
    result = optimise(scene)
    return fresh, process_time() - start, result


def learnt():
    """A model of all generated instances, ready for questions."""
    return handover.open_knowledge(
        handover.train(handover.read_knowledge(), handover.facts_of(handover.generate())).model
    )


def timed(do, *arguments):
    """CPU seconds of a call."""
    start = process_time()
    do(*arguments)
    return process_time() - start


def questions(n):
    """CPU seconds of asking and of planning anew, warm."""
    knowledge, rng, asked, planned = learnt(), np.random.default_rng(0), [], []
    for seed in range(n):
        name, task, body, offset = draw(seed)
        level, thing, receiver = LEVELS[seed % 4], read_object(name), read_receiver(LEVELS[seed % 4], body)
        scene = make_scene(thing, task, receiver, ROBOTS[seed % 2])
        handover.advise(knowledge, scene)
        asked.append(timed(handover.ask, knowledge, thing, task, level))
        layout = Layout(hand=scene.hand.position + offset + rng.uniform(-0.02, 0.02, 3))
        planned.append(timed(replan, knowledge, scene, layout))
    for name, seconds in (("ask", asked), ("replan", planned)):
        p50, p95, top = 1000 * np.percentile(seconds, [50, 95, 100])
        print(f"{name:<8} p50 {p50:.1f} ms, p95 {p95:.1f} ms, max {top:.1f} ms over {n}")


def replan(knowledge, scene, layout):
    """A question, the scene with the hand where it is now, and the optimisation."""
    answer = handover.ask(knowledge, scene.thing, scene.task, scene.receiver.level.name)
    now = make_scene(scene.thing, scene.task, scene.receiver, scene.robot, layout=layout)
    return answer, optimise(now)


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    questions(n)
    rows = {(robot, level): [run(seed, level, robot) for seed in range(n)] for robot in ROBOTS for level in LEVELS}
    columns = f"{'fresh p50':>10}{'p95':>8}{'warm p50':>10}{'p95':>8}{'max':>8}{'IK p50':>8}{'max':>6}  status"
    print(f"{'robot':<8}{'level':<6}{columns}")
    for (robot, level), found in rows.items():
        print(f"{robot:<8}{level:<6}{summary(found)}")
    print(f"{'all':<14}{summary([row for found in rows.values() for row in found])}")


def summary(found):
    """One line of the table."""
    fresh, warm = (np.array([row[i] for row in found]) for i in (0, 1))
    calls = np.array([row[2].ik_calls for row in found])
    states = [row[2].status for row in found]
    counts = ", ".join(f"{name} {states.count(name)}" for name in dict.fromkeys(states))
    a, b, c, d = np.percentile(fresh, 50), np.percentile(fresh, 95), np.percentile(warm, 50), np.percentile(warm, 95)
    return f"{a:>10.3f}{b:>8.3f}{c:>10.3f}{d:>8.3f}{warm.max():>8.3f}{np.median(calls):>8.0f}{calls.max():>6}  {counts}"


if __name__ == "__main__":
    main()

"""Collisions: a robot, a receiver's body and an object in, a yes-or-no test of configurations out. Distances by coal.

Everything lives in the frame of the robot's base. The object is fixed to the tool, so its place follows from the grasp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import coal
import numpy as np
import pinocchio as pin

from mlnlite.domains.handover.kinematics.chain import PLACEMENT
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, inverse, transform_points
from mlnlite.domains.handover.scene.bodies import Capsule
from mlnlite.domains.handover.scene.geometry import Part
from mlnlite.domains.handover.scene.objects import HandoverObject
from mlnlite.domains.handover.scene.robots import Robot


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Bodies on a kinematic model, the pairs of them that must stay apart, and the buffers of the queries."""

    model: pin.Model
    geometry: pin.GeometryModel
    state: tuple[pin.Data, pin.GeometryData]


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """Three views of one scene, from cheap to dear. Its buffers serve one thread at a time.

    Attributes:
        robot: whose arm moves.
        arm: all bodies on the robot's model: answers for a configuration.
        thing: the object afloat against the receiver and the robot's foot: answers for a pose of the object.
        hand: the gripper afloat against the same: answers for a pose of the last joint.
        held: index of each body of the object in `arm`, with its placement in the object.
        capsules: the receiver in the world: start, end, radius in rows, shape (m, 7) [m].
        hand_points: points inside the gripper in the tool, shape (p, 3) [m].
    """

    robot: Robot
    arm: Bodies
    thing: Bodies
    hand: Bodies
    held: tuple[tuple[int, pin.SE3], ...]
    capsules: FloatArray
    hand_points: FloatArray


def make_world(robot: Robot, base: Pose, thing: HandoverObject, body: Sequence[Capsule]) -> World:
    """The bodies of a scene; `base` and `body` in the world [m]."""
    last = robot.model.njoints - 1
    links = robot.geometry.geometryObjects
    person = [_capsule_body(i, capsule, base) for i, capsule in enumerate(body)]
    parts = [
        (pin.GeometryObject(f"object_{i}", last, place, shape), place)
        for i, (shape, place) in enumerate(_shapes(thing))
    ]
    foot = [link for link in links if link.parentJoint == 0]
    gripper = [link for link in links if link.parentJoint == last]
    arm, held = _arm(robot, person, parts)
    floating_thing = _floating([part for part, _ in parts], person + foot)
    capsules = np.array([[*capsule.start, *capsule.end, capsule.radius] for capsule in body]).reshape(-1, 7)
    return World(
        robot, arm, floating_thing, _floating(gripper, person + foot), held, capsules, _hand_points(robot, gripper)
    )


def _hand_points(robot: Robot, gripper: list[pin.GeometryObject]) -> FloatArray:
    """A 3x3x5 grid inside each box of the gripper and along each other body's axis, in the tool."""
    grid = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], np.linspace(-1, 1, 5)), axis=-1).reshape(-1, 3)
    to_tool = np.linalg.inv(robot.chain.table[-1, PLACEMENT].reshape(4, 4))
    found = [np.zeros((0, 3))]
    for body in gripper:
        shape = body.geometry
        half = shape.halfSide if isinstance(shape, coal.Box) else (0, 0, getattr(shape, "halfLength", 0.0))
        points = (grid * 0.999 * np.asarray(half)) @ body.placement.rotation.T + body.placement.translation
        found.append(points @ to_tool[:3, :3].T + to_tool[:3, 3])
    return np.ascontiguousarray(np.concatenate(found))


def _arm(
    robot: Robot, person: list[pin.GeometryObject], parts: list[tuple[pin.GeometryObject, pin.SE3]]
) -> tuple[Bodies, tuple[tuple[int, pin.SE3], ...]]:
    geometry = robot.geometry.copy()
    links = list(range(geometry.ngeoms))
    people = [int(geometry.addGeometryObject(body)) for body in person]
    held = tuple((int(geometry.addGeometryObject(part)), place) for part, place in parts)
    things = [i for i, _ in held]
    moving = [i for i in links if geometry.geometryObjects[i].parentJoint < robot.model.njoints - 1]
    pairs = [*_self_pairs(robot), *_products(links, people), *_products(things, people), *_products(moving, things)]
    return _bodies(robot.model, geometry, pairs), held


def _floating(moving: list[pin.GeometryObject], fixed: list[pin.GeometryObject]) -> Bodies:
    """Bodies on a free joint, in the frame that they have on theirs, against fixed ones."""
    model, geometry = pin.Model(), pin.GeometryModel()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "free")
    afloat = [_copied(geometry, body, joint) for body in moving]
    still = [_copied(geometry, body, 0) for body in fixed]
    return _bodies(model, geometry, _products(afloat, still))


def _copied(geometry: pin.GeometryModel, body: pin.GeometryObject, joint: int) -> int:
    copy = pin.GeometryObject(body.name, joint, body.placement, body.geometry)
    return int(geometry.addGeometryObject(copy))


def _bodies(model: pin.Model, geometry: pin.GeometryModel, pairs: Sequence[tuple[int, int]]) -> Bodies:
    geometry.removeAllCollisionPairs()
    for first, second in pairs:
        geometry.addCollisionPair(pin.CollisionPair(first, second))
    return Bodies(model, geometry, (model.createData(), pin.GeometryData(geometry)))


def _products(first: Sequence[int], second: Sequence[int]) -> list[tuple[int, int]]:
    return [(a, b) for a in first for b in second]


def _capsule_body(index: int, capsule: Capsule, base: Pose) -> pin.GeometryObject:
    ends = transform_points(inverse(base, "base"), np.stack([capsule.start, capsule.end]))
    length = float(np.linalg.norm(ends[1] - ends[0]))
    shape = coal.Capsule(capsule.radius, length) if length > 1e-6 else coal.Sphere(capsule.radius)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), ends[1] - ends[0] if length > 1e-6 else np.ones(3))
    return pin.GeometryObject(f"person_{capsule.name}_{index}", 0, pin.SE3(turn.matrix(), ends.mean(axis=0)), shape)


def _shapes(thing: HandoverObject) -> list[tuple[coal.CollisionGeometry, pin.SE3]]:
    """Collision shapes of an object with their placements in it; tubes count as full."""
    if thing.parts:
        return [(_shape(part), pin.SE3(part.pose.rotation, part.pose.position)) for part in thing.parts]
    hull = thing.mesh.convex_hull
    model = coal.BVHModelOBB()
    model.beginModel(len(hull.faces), len(hull.vertices))
    model.addVertices(np.asarray(hull.vertices))
    model.endModel()
    model.buildConvexHull(True, "Qt")
    return [(model.convex, pin.SE3.Identity())]


def _shape(part: Part) -> coal.CollisionGeometry:
    size = part.size
    if part.kind == "box":
        return coal.Box(*size)
    if part.kind == "sphere":
        return coal.Sphere(size[0])
    if part.kind == "capsule":
        return coal.Capsule(size[0], size[1])
    return coal.Cylinder(size[-2], size[-1])


@lru_cache(maxsize=8)
def _self_pairs(robot: Robot) -> tuple[tuple[int, int], ...]:
    """Pairs of links that are no neighbours and are apart in some of 200 seeded random configurations.

    Joints that share an origin are one: a wrist of two crossing axes makes neighbours of forearm and hand.
    """
    geometry = robot.geometry.copy()
    geometry.removeAllCollisionPairs()
    offsets = robot.chain.table[:-1, PLACEMENT].reshape(-1, 4, 4)[:, :3, 3]
    stations = np.hstack([0, np.cumsum(np.linalg.norm(offsets, axis=1) > 1e-6)])
    joints = [int(stations[body.parentJoint]) for body in geometry.geometryObjects]
    pairs = [(i, j) for i in range(len(joints)) for j in range(i) if abs(joints[i] - joints[j]) > 1]
    for first, second in pairs:
        geometry.addCollisionPair(pin.CollisionPair(first, second))
    data, state = robot.model.createData(), pin.GeometryData(geometry)
    hits = np.zeros(len(pairs))
    draw = np.random.default_rng(0).uniform(robot.chain.lower, robot.chain.upper, (200, len(robot.chain.names)))
    for q in draw:
        pin.computeCollisions(robot.model, data, geometry, state, q, False)
        hits += [result.isCollision() for result in state.collisionResults]
    return tuple(pair for pair, n in zip(pairs, hits, strict=True) if n < 150)


def hold(world: World, grasp: Pose) -> None:
    """Fixes the object to the tool: `grasp` is the tool's pose in the object [m]."""
    tool = world.robot.chain.table[-1, PLACEMENT].reshape(4, 4)
    in_tool = inverse(grasp, "tool")
    place = pin.SE3(tool[:3, :3], tool[:3, 3]) * pin.SE3(in_tool.rotation, in_tool.position)
    for index, part in world.held:
        world.arm.geometry.geometryObjects[index].placement = place * part


def is_free(world: World, q: FloatArray) -> bool:
    """Whether a configuration, shape (n,) [rad], keeps every pair apart."""
    return _apart(world.arm, q)


def thing_is_free(world: World, pose: Pose) -> bool:
    """Whether the object at `pose`, in the robot's base, keeps off the receiver and the robot's foot. Needs no arm."""
    return _apart(world.thing, pin.SE3ToXYZQUAT(pin.SE3(pose.rotation, pose.position)))


def hand_is_free(world: World, tool: Pose) -> bool:
    """Whether the gripper with its tool at `tool`, in the robot's base, keeps off the same. Needs no arm."""
    placement = world.robot.chain.table[-1, PLACEMENT].reshape(4, 4)
    last = pin.SE3(tool.rotation, tool.position) * pin.SE3(placement[:3, :3], placement[:3, 3]).inverse()
    return _apart(world.hand, pin.SE3ToXYZQUAT(last))


def _apart(bodies: Bodies, q: FloatArray) -> bool:
    data, state = bodies.state
    return not pin.computeCollisions(bodies.model, data, bodies.geometry, state, q, True)


def touching(world: World, q: FloatArray) -> tuple[tuple[str, str], ...]:
    """Names of the pairs that collide at a configuration."""
    data, state = world.arm.state
    pin.computeCollisions(world.arm.model, data, world.arm.geometry, state, q, False)
    bodies = world.arm.geometry.geometryObjects
    hits = zip(world.arm.geometry.collisionPairs, state.collisionResults, strict=True)
    return tuple((bodies[pair.first].name, bodies[pair.second].name) for pair, hit in hits if hit.isCollision())


def clearance(world: World, q: FloatArray) -> float:
    """Least distance of any pair at a configuration [m]; negative if they overlap."""
    data, state = world.arm.state
    pin.computeDistances(world.arm.model, data, world.arm.geometry, state, q)
    return min((float(result.min_distance) for result in state.distanceResults), default=float("inf"))

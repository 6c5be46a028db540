from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pinocchio")

import trimesh

from mlnlite import MlnError
from mlnlite.domains.handover.scene import objects as catalogue
from mlnlite.domains.handover.scene.geometry import is_hidden
from mlnlite.domains.handover.scene.grasps import FRICTION, sample_grasps
from mlnlite.domains.handover.scene.mobility import read_level, read_levels
from mlnlite.domains.handover.scene.objects import object_names, read_object, region_centre, region_of, region_points
from mlnlite.domains.handover.scene.receiver import Body, read_receiver
from mlnlite.domains.handover.scene.robots import Gripper, read_robot
from mlnlite.domains.handover.scene.scene import Layout, make_scene
from mlnlite.domains.handover.scene.voxels import VoxelMap
from mlnlite.domains.handover.search.hierarchical import optimise, require

KNOWN = {"shoe", "stapler", "camera", "bowl", "plate", "sunglasses", "toothbrush", "marker", "flashlight", "glass",
         "book", "bottle", "comb", "phone", "remote"}  # fmt: skip


def test_the_catalogue_has_the_fifteen_known_names_and_seventeen_of_ours():
    things = [read_object(name) for name in object_names()]
    assert len(things) == 32
    assert {thing.name for thing in things if thing.known} == KNOWN
    assert {thing.shape for thing in things} == set(catalogue.SHAPES)
    assert {thing.category for thing in things} == set(catalogue.CATEGORIES)
    assert {task for thing in things for task, _ in thing.affordances} == set(catalogue.AFFORDANCES)
    assert len(catalogue.AFFORDANCES) == 13


@pytest.mark.parametrize("name", object_names())
def test_every_object_has_regions_on_its_outside_and_grasps_beyond_them(name):
    thing = read_object(name)
    assert 1 < len(thing.regions) <= 3
    assert np.allclose(thing.mesh.bounds.mean(axis=0), 0, atol=1e-9)
    assert np.allclose(np.linalg.norm(thing.surface.normals, axis=1), 1)
    assert not is_hidden(thing.parts, thing.surface.points + 2e-3 * thing.surface.normals).mean() > 0.02
    for task, region in thing.affordances:
        index = region_of(thing, task)
        assert thing.regions[index] == region
        assert len(region_points(thing, index)) >= 20
        assert (thing.surface.points == region_centre(thing, index)).all(axis=1).any()
        for robot in ("pr2", "panda"):
            grasps = sample_grasps(thing, read_robot(robot).gripper)
            assert (grasps.labels != index).all(axis=1).sum() >= 3


@pytest.mark.parametrize("name", ["mug", "ball", "book", "scissors"])
def test_grasps_fit_the_jaws_and_close_within_the_friction_cones(name):
    thing, gripper = read_object(name), Gripper(width=0.07)
    grasps = sample_grasps(thing, gripper)
    assert (grasps.widths <= 0.07).all()
    assert np.allclose(grasps.rotations @ grasps.rotations.transpose(0, 1, 3, 2), np.eye(3))
    closing = grasps.contacts[:, 1] - grasps.contacts[:, 0]
    closing /= np.linalg.norm(closing, axis=1, keepdims=True)
    assert np.allclose(grasps.rotations[:, :, :, 1], closing[:, None])
    points, normals = thing.surface.points, thing.surface.normals
    first = normals[[np.linalg.norm(points - c, axis=1).argmin() for c in grasps.contacts[:, 0]]]
    assert ((-first * closing).sum(axis=1) >= np.cos(np.arctan(FRICTION)) - 1e-9).all()
    assert grasps.free.any(axis=1).all()


def test_a_box_of_your_own_has_the_grasps_that_it_must_have(tmp_path):
    entry = _entry(parts='[{ region = "a", shape = "box", size = [0.2, 0.05, 0.2] }, '
                   '{ region = "b", shape = "box", size = [0.05, 0.05, 0.05], at = [0.12, 0, 0] }]')  # fmt: skip
    thing = _read(tmp_path, entry)
    grasps = sample_grasps(thing, Gripper(width=0.08))
    across = np.abs(grasps.contacts[:, 1] - grasps.contacts[:, 0])
    assert (grasps.widths > 0.04).all()
    assert (across.max(axis=1) < 0.0761).all()
    assert sample_grasps(thing, Gripper(width=0.04)).widths.size == 0


def _entry(**changes):
    values = {"shape": '"cube"', "category": '"work_tool"', "material": '"plastic"', "texture": '"smooth"',
              "mass": "0.2", "affordances": '{ to_hand_over = "a" }',
              "parts": '[{ region = "a", shape = "box", size = [0.05, 0.05, 0.05] }, '
                       '{ region = "b", shape = "box", size = [0.05, 0.05, 0.05], at = [0.05, 0, 0] }]'}  # fmt: skip
    values.update(changes)
    return "[thing]\n" + "".join(f"{key} = {value}\n" for key, value in values.items() if value)


def _read(folder, text):
    (folder / "own.toml").write_text(text)
    return read_object("thing", catalogue=folder / "own.toml")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"shape": '"cubic"'}, "did you mean cube"),
        ({"category": '"tool"'}, "unknown category"),
        ({"material": '"wood"'}, "known: plastic"),
        ({"texture": ""}, "'texture' is missing"),
        ({"mass": '"heavy"'}, "'mass' is 'heavy'"),
        ({"mass": "-1"}, "expected between 0 and 100 kg"),
        ({"affordances": '{ to_fly = "a" }'}, "unknown affordance"),
        ({"affordances": '{ to_pour = "handle" }'}, "unknown region"),
        ({"parts": "[]"}, "no parts"),
        ({"parts": '[{ region = "a", shape = "cone", size = [1] }]'}, "unknown primitive"),
        ({"parts": '[{ region = "a", shape = "box", size = [1, 2] }]'}, "expected 3 numbers"),
        ({"parts": '[{ region = "a", shape = "tube", size = [0.2, 0.1, 0.1] }]'}, "inner radius below"),
        ({"parts": '[{ shape = "box", size = [1, 1, 1] }]'}, "'region' is missing"),
        ({"parts": "", "mesh": '"absent.stl"'}, "cannot read the mesh"),
        ({"parts": "", "mesh": '"broken.stl"'}, "mesh"),
        ({"shape": "cube"}, "line 2"),
    ],
)
def test_mistakes_in_a_catalogue_are_named_with_their_place(tmp_path, change, words):
    (tmp_path / "broken.stl").write_text("solid nothing\nendsolid nothing\n")
    with pytest.raises(MlnError, match=words) as caught:
        _read(tmp_path, _entry(**change))
    assert "own.toml" in str(caught.value)


def test_a_mesh_of_your_own_is_handed_over(tmp_path):
    mesh = trimesh.creation.box((60, 40, 160))
    mesh.export(tmp_path / "box.stl")
    entry = _entry(parts="", mesh='"box.stl"', scale="0.001", regions="{ a = [[-0.1, -0.1, 0.0], [0.1, 0.1, 0.1]] }")
    thing = _read(tmp_path, entry)
    assert thing.regions == ("a", "rest")
    assert np.allclose(thing.mesh.extents, (0.06, 0.04, 0.16))
    found = require(optimise(make_scene(thing)))
    assert found.appropriateness > 0.03
    with pytest.raises(MlnError, match="write scale"):
        _read(tmp_path, _entry(parts="", mesh='"box.stl"', regions="{ }"))
    with pytest.raises(MlnError, match="no surface lies in the region"):
        _read(tmp_path, _entry(parts="", mesh='"box.stl"', scale="0.001", regions="{ a = [[5, 5, 5], [6, 6, 6]] }"))


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: make_scene("mugg"), "did you mean mug"),
        (lambda: make_scene("mug", "to_cut"), "unknown task of 'mug'"),
        (lambda: make_scene("mug", receiver="M"), "known: H, H-M, L-M, L"),
        (lambda: make_scene("mug", robot="pr3"), "did you mean pr2"),
        (lambda: make_scene("mug", robot="absent.urdf"), "cannot read the robot file"),
        (lambda: make_scene("mug", layout=Layout(hand=np.array([3.0, 0, 1]))), "cannot be at"),
        (lambda: make_scene("mug", layout=Layout(hand=np.array([np.nan, 0, 1]))), "three finite numbers"),
        (lambda: read_receiver("H", Body(height=174)), "heights are in metres"),
        (lambda: read_receiver("H", Body(mass=5)), "masses are in kilograms"),
        (lambda: read_receiver("H", Body(side="both")), "unknown side"),
        (lambda: VoxelMap(counts=(0, 3, 3)), "voxel map"),
        (lambda: VoxelMap(step=-1.0), "positive step"),
        (lambda: read_level("very low"), "unknown mobility level"),
    ],
)
def test_what_a_user_can_get_wrong_is_told_with_a_cure(act, words):
    with pytest.raises(MlnError, match=words) as caught:
        act()
    assert "hint" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot", "arm.urdf:1:"),
        ("<robot name='x'><link name='a'/></robot>", "no moving joint"),
        (
            "<robot name='x'><link name='a'/><link name='b'><collision><geometry><mesh filename='package://p/b.stl'/>"
            "</geometry></collision></link><joint name='j' type='revolute'><parent link='a'/><child link='b'/>"
            "<axis xyz='0 0 1'/><limit lower='0' upper='1' effort='1' velocity='1'/></joint></robot>",
            "for meshes give their folder",
        ),
        ("<robot name='x'><link name='a'/><joint name='j' type='revolute'><parent link='a'/></joint></robot>", "URDF"),
    ],
)
def test_broken_robots_are_refused(tmp_path, text, words):
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(MlnError, match=words):
        read_robot(str(tmp_path / "arm.urdf"))
    with pytest.raises(MlnError, match="has no frame"):
        read_robot(str(_panda(tmp_path)), tool="panda_gras")


def _panda(folder):
    path = folder / "copy.urdf"
    path.write_text((catalogue.DATA / "panda.urdf").read_text())
    return path


def test_a_robot_by_path_is_the_robot_by_name(tmp_path):
    ours, copy = read_robot("panda"), read_robot(str(_panda(tmp_path)), tool="panda_grasp")
    assert np.array_equal(ours.chain.table, copy.chain.table)


def test_a_robot_by_path_hands_over(tmp_path):
    ours = read_robot("panda")
    robot = read_robot(str(_panda(tmp_path)), tool="panda_grasp", base=ours.base("standing"), gripper=ours.gripper)
    found = require(optimise(make_scene("marker", "to_write", robot=robot)))
    assert np.array_equal(found.hold.q, require(optimise(make_scene("marker", "to_write", robot=ours))).hold.q)


def test_levels_of_your_own(tmp_path):
    path = tmp_path / "levels.toml"
    path.write_text('[frail]\ntitle = "frail"\nrange = 0.3\nstrength = 0.1\ntrunk = 0.1\n')
    (level,) = read_levels(path)
    assert read_receiver(level).strength[4] == pytest.approx(7.0)
    path.write_text('[frail]\ntitle = "frail"\nrange = 1.3\nstrength = 0.1\ntrunk = 0.1\n')
    with pytest.raises(MlnError, match="at most 1"):
        read_levels(path)

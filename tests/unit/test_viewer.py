"""The 3-D viewer: closed meshes, poses, what the still draws, and what the page is given.

Catches a mesh with a hole or turned inside out, a projection with a wrong sign, a measured pose
that does not follow the joints, markup in names, and a page that grows.
"""

import json
import re
from collections import Counter
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
import tracking_table_cases
import trunk_table_cases
from cohort_cases import swap, text, without, write
from hostile import PAYLOAD, Structure
from study_cases import Size, project

from spinepipe.cohort import read
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.report.specimen import view_of
from spinepipe.report.specimen_curves import measured_curves
from spinepipe.report.viewer.figure import viewer_html, viewer_script
from spinepipe.report.viewer.meshes import SIDES, Endplate, Mesh, spine_meshes, vertebra
from spinepipe.report.viewer.scene import (
    Camera,
    Muscle,
    Scene,
    SceneBody,
    SceneLoad,
    SceneStep,
    as_script,
    load_path,
    posed,
    rotation_vector,
    scenes_as_data,
)
from spinepipe.report.viewer.specimens import MOST_SPECIMENS, measured_poses, specimen_scenes
from spinepipe.report.viewer.still import projected_parts, still, telling_step, view_matrix
from spinepipe.studies.tracking.scenes import MOST_FRAMES, MOST_SCENES, tracking_scenes
from spinepipe.studies.trunk_loads.scenes import MOST_PERSONS, trunk_scenes

ROOT = Path(__file__).resolve().parents[2]
LARGEST_SCRIPT, LARGEST_SCENES = 120_000, 1_000_000
"""Bytes."""

FLAT = np.eye(3)
TILTED = rotation_zxy(0.3, -0.2, 0.4)
LOW, HIGH = Endplate(np.zeros(3), FLAT), Endplate(np.array([0.0, 27.0, 0.0]), FLAT)


def volume(mesh: Mesh) -> float:
    """Mm3 inside, by the divergence theorem; negative where faces look inwards."""
    total = 0.0
    for face in mesh.faces:
        a, *rest = mesh.vertices[list(face)]
        total += sum(float(a @ np.cross(b, c)) for b, c in pairwise(rest)) / 6.0
    return total


def assert_closed_and_outward(mesh: Mesh) -> None:
    """Every edge is run through once each way, and the surface is one ball with its face out."""
    edges = Counter(
        (a, b) for face in mesh.faces for a, b in zip(face, face[1:] + face[:1], strict=True)
    )
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert {k for face in mesh.faces for k in face} == set(range(len(mesh.vertices)))
    assert len(mesh.vertices) - len(edges) // 2 + len(mesh.faces) == 2
    assert volume(mesh) > 0.0


@pytest.mark.parametrize("sacrum", [False, True])
@pytest.mark.parametrize("high", [HIGH, Endplate(np.array([4.0, 25.0, -3.0]), TILTED)])
def test_a_vertebra_is_closed_and_faces_outwards(sacrum: bool, high: Endplate) -> None:
    assert_closed_and_outward(vertebra(LOW, high, 48.0, 34.0, sacrum))


def test_a_vertebra_has_its_sizes_and_its_processes_behind() -> None:
    mesh = vertebra(LOW, HIGH, 48.0, 34.0)
    rims = mesh.vertices[: 2 * SIDES]
    assert np.ptp(rims[:, 2]) == pytest.approx(48.0, rel=0.02)
    assert rims[:, 0].max() == pytest.approx(17.0, rel=0.02)
    assert set(rims[:SIDES, 1]) == {0.0}
    assert set(rims[SIDES:, 1]) == {27.0}
    assert mesh.vertices[:, 0].min() < -1.8 * 17.0, "a spinous process"
    assert np.ptp(mesh.vertices[:, 2]) > 1.4 * 48.0, "transverse processes"
    mirrored = mesh.vertices * [1.0, 1.0, -1.0]
    apart = np.linalg.norm(mesh.vertices[:, None] - mirrored, axis=2).min(axis=1)
    np.testing.assert_allclose(apart, 0.0, atol=1e-9, err_msg="right as left")


def test_endplates_lie_where_landmarks_say_else_beside_the_joints() -> None:
    joints = [Endplate(np.array([0.0, y, 0.0]), FLAT) for y in (0.0, 40.0)]
    centre = np.array([2.0, 6.0, 1.0])
    points = {"L4": {"inferior_endplate_centre": centre / 1000.0}}
    lowest, middle, top = spine_meshes(("L5", "L4", "L3"), joints, points)
    np.testing.assert_allclose(middle.vertices[:SIDES].mean(axis=0), centre, atol=1.0)
    assert middle.vertices[SIDES : 2 * SIDES, 1] == pytest.approx(35.6), "half a disc below it"
    assert lowest.vertices[SIDES : 2 * SIDES, 1] == pytest.approx(-4.4)
    for mesh in (lowest, top):
        assert np.ptp(mesh.vertices[: 2 * SIDES, 1]) == pytest.approx(0.78 * 40.0), "as neighbours"


@pytest.mark.parametrize("name", ["palanca_l1l4", "l4l5_disc", "t12s1_phantom"])
def test_meshes_of_provided_cohorts_are_closed_and_small_enough(name: str) -> None:
    cohort = read(ROOT / "config" / "cohorts" / name)
    scenes = specimen_scenes(cohort)
    assert [scene.title for scene in scenes] == list(cohort.specimen_names[:MOST_SPECIMENS])
    for body in scenes[0].bodies:
        assert_closed_and_outward(body.mesh)
    assert len(as_script(scenes_as_data(scenes))) < 150_000
    assert len(still(scenes[0], telling_step(scenes[0]))) < 100_000


@pytest.mark.parametrize(
    ("camera", "seen"),
    [
        # right, up, towards the reader, of a point 1 ahead, 2 up and 3 to the right
        (Camera(0.0, 0.0), (1.0, 2.0, 3.0)),
        (Camera(-90.0, 0.0), (3.0, 2.0, -1.0)),
        (Camera(-90.0, 90.0), (3.0, 1.0, 2.0)),
    ],
)
def test_views_from_the_right_from_behind_and_from_above(
    camera: Camera, seen: tuple[float, float, float]
) -> None:
    np.testing.assert_allclose(view_matrix(camera) @ [1.0, 2.0, 3.0], seen, atol=1e-12)


def box(x: float, y: float) -> SceneStep:
    """One body, turned by 90 degrees to the left about the vertical."""
    return SceneStep("a", "A.", np.array([[x, y, 0.0, 0.0, 90.0, 0.0]]))


def test_a_vertex_is_drawn_where_it_is_by_hand() -> None:
    """Turned by 90 degrees about y, x points to the left: from behind the front is at the left."""
    mesh = vertebra(LOW, HIGH, 48.0, 34.0)
    scene = Scene("s", "Load", [SceneBody("L4", mesh)], [box(5.0, 7.0)], "", Camera(-90.0, 0.0))
    front = mesh.vertices[0]
    turned = np.array([front[2] + 5.0, front[1] + 7.0, -front[0]])
    np.testing.assert_allclose(posed(front, scene.steps[0].poses[0]), turned, atol=1e-9)
    by_hand = np.array([turned[2], turned[1], -turned[0]])
    drawn = np.vstack([p.at for p in projected_parts(scene, scene.steps[0], _view(scene))])
    assert np.linalg.norm(drawn - by_hand, axis=1).min() < 1e-9
    told = scenes_as_data([scene])
    assert told["scenes"][0]["steps"][0]["poses"] == [[5, 7, 0, 0, 90, 0]]
    at = np.array(told["meshes"][0]["at"]).reshape(-1, 3)
    np.testing.assert_allclose(at, mesh.vertices, atol=0.051)


def _view(scene: Scene) -> Array:
    return view_matrix(scene.camera)


def test_only_fronts_are_drawn_and_the_nearest_last() -> None:
    mesh = vertebra(LOW, HIGH, 48.0, 34.0, sacrum=True)
    scene = Scene("s", "Load", [SceneBody("S1", mesh)], [box(0.0, 0.0)], "", Camera(0.0, 0.0))
    faces = [p for p in projected_parts(scene, scene.steps[0], _view(scene)) if p.look == "bone"]
    assert 0 < len(faces) < len(mesh.faces)
    for part in faces:
        edges = part.at[1] - part.at[0], part.at[2] - part.at[0]
        assert np.cross(*edges)[2] > 0.0
        assert 0.45 <= part.light <= 1.0


def test_measured_poses_follow_the_joints_from_below() -> None:
    """Two joints that extend by 30 degrees each: the upper body is turned by 60, by hand."""
    frames = [Pose(FLAT, np.zeros(3)), Pose(FLAT, np.array([0.0, 0.1, 0.0]))]
    neutral = np.array([[0.0, y, 0.0, 0.0, 0.0, 0.0] for y in (-50.0, 50.0, 150.0)])
    motion = np.full((2, 6), np.nan)
    motion[:, 3] = np.deg2rad(30.0)
    found = measured_poses(frames, motion, neutral)
    np.testing.assert_allclose(found[:, 3:], [[0, 0, 0], [0, 0, 30.0], [0, 0, 60.0]], atol=1e-9)
    s, c = 0.5, np.sqrt(0.75)
    np.testing.assert_allclose(found[1, :3], [-50.0 * s, 50.0 * c, 0.0], atol=1e-9)
    np.testing.assert_allclose(found[2, :3], [-100 * s - 50 * c, 100 * c + 50 * s, 0], atol=1e-9)


def test_above_a_joint_that_was_not_read_nothing_is_drawn() -> None:
    frames = [Pose(FLAT, np.array([0.0, y, 0.0])) for y in (0.0, 0.1)]
    motion = np.full((2, 6), np.nan)
    motion[1, 3] = 0.1
    found = measured_poses(frames, motion, np.zeros((3, 6)))
    assert np.isfinite(found).all(axis=1).tolist() == [True, False, False]
    scene = _loaded()
    step = SceneStep("a", "A.", scene.steps[0].poses, measured=np.full((1, 6), np.nan))
    told = scenes_as_data([Scene("s", "Load", scene.bodies, [step], "")])
    assert told["scenes"][0]["steps"][0]["measured"] == [None]


def _loaded(vector: tuple[float, float, float] = (0.0, 0.0, 5.0)) -> Scene:
    mesh = vertebra(LOW, HIGH, 48.0, 34.0)
    loads = [SceneLoad("moment", 0, np.zeros(3), np.array(vector))]
    loads.append(SceneLoad("force", 0, np.array([10.0, 0.0, 0.0]), np.array([0.0, -20.0, 0.0])))
    step = SceneStep("a", "A.", box(0.0, 0.0).poses, loads=loads)
    return Scene("s", "Load", [SceneBody("L4", mesh)], [step], "")


@pytest.mark.parametrize("vector", [(0.0, 0.0, 5.0), (0.0, -2.0, 0.0), (1.0, 1.0, 0.0)])
def test_a_moment_turns_right_handed_and_a_force_ends_at_its_point(
    vector: tuple[float, float, float],
) -> None:
    scene = _loaded(vector)
    moment, force = scene.steps[0].loads
    arc = load_path(moment, scene)
    turns = np.cross(arc[:-1], arc[1:]) @ moment.vector
    assert (turns > 0.0).all()
    arrow = load_path(force, scene)
    np.testing.assert_allclose(arrow[-1], 0.0)
    assert (arrow[-1] - arrow[0]) @ force.vector > 0.0
    (drawn,) = (
        p
        for p in projected_parts(scene, scene.steps[0], np.eye(3))
        if p.look == "load" and len(p.at) == 2
    )
    np.testing.assert_allclose(drawn.at[-1], [0.0, 0.0, -10.0], atol=1e-9)


def test_the_largest_load_of_its_kind_is_the_longest() -> None:
    scene = _loaded()
    smaller = SceneLoad("force", 0, np.zeros(3), np.array([0.0, -5.0, 0.0]))
    step = SceneStep("b", "B.", scene.steps[0].poses, loads=[smaller])
    both = Scene("s", "Load", scene.bodies, [*scene.steps, step], "")
    lengths = [
        float(np.linalg.norm(np.diff(load_path(load, both), axis=0)))
        for load in (scene.steps[0].loads[1], smaller)
    ]
    assert lengths[0] > 1.2 * lengths[1] > 0.0


def test_meshes_that_are_equal_are_written_once() -> None:
    scene = _loaded()
    told = scenes_as_data([scene, _loaded()])
    assert (len(told["meshes"]), len(told["shapes"]), len(told["scenes"])) == (1, 1, 2)


def test_the_still_is_a_drawing_with_colours_of_the_page() -> None:
    scene = _loaded()
    muscles = [Muscle(np.array([[0.0, 0, 0], [50.0, 50, 0]]), share) for share in (0.05, 0.5)]
    markers = np.array([[0.0, 0, 0, 1, 1, 1], [5.0, 5, 5, np.nan, np.nan, np.nan]])
    step = SceneStep(
        *("a", "A & <b>.", scene.steps[0].poses, scene.steps[0].poses),
        loads=scene.steps[0].loads,
        muscles=muscles,
        markers=markers,
    )
    drawn = still(Scene("<i>", "Load", [SceneBody("<L4>", scene.bodies[0].mesh)], [step], ""), 0)
    svg = ElementTree.fromstring(drawn)
    looks = Counter(element.get("class") for element in svg)
    assert looks["muscle"] == 1, "the faint one is left out"
    assert (looks["model"], looks["marker"]) == (2, 1)
    assert looks["load"] == looks["head"] == 2
    assert looks["measured"] == 6
    assert [e.text for e in svg if e.tag == "text"] == ["<L4>"]
    assert not re.search(r'(fill|stroke)="#', drawn)
    for element in svg.iter("polygon"):
        points = np.array([p.split(",") for p in element.attrib["points"].split()], float)
        assert (points >= 0.0).all()
        assert (points <= [640.0, 420.0]).all(), "inside the picture"


def test_names_do_not_become_markup() -> None:
    def figure(name: str) -> Structure:
        scene = _loaded()
        step = SceneStep(name, name, scene.steps[0].poses)
        body = SceneBody(name, scene.bodies[0].mesh)
        return Structure(viewer_html([Scene(name, name, [body], [step], name)] * 2, name))

    hostile, harmless = figure(PAYLOAD), figure("x")
    assert hostile.elements == harmless.elements
    (data,) = hostile.scripts
    assert "<" not in data
    assert json.loads(data)["scenes"][0]["title"] == PAYLOAD


def test_what_is_not_there_has_no_switch() -> None:
    page = viewer_html([_loaded()])
    assert re.findall('data-show="([a-z]+)"', page) == ["loads"]
    assert "<select>" not in page
    assert viewer_html([]) == ""


def test_the_script_is_small_and_writes_no_markup() -> None:
    script = viewer_script()
    assert len(script.encode()) < LARGEST_SCRIPT
    assert not re.search(r"innerHTML|outerHTML|document\.write|insertAdjacentHTML|eval\(", script)
    assert not re.search(r"https?:|</script|fetch\(|import\(", script)


def test_a_specimen_is_neutral_then_loaded(tmp_path: Path) -> None:
    cohort = read(ROOT / "config/cohorts/l4l5_disc")
    scene = specimen_scenes(cohort)[0]
    assert [step.label for step in scene.steps[:2]] == ["Neutral", "Flexion 7.50 N m"]
    assert "schematic and of a usual lumbar size." in scene.caption, "one joint tells no distance"
    flexion = scene.steps[1]
    row = cohort.motion
    assert row is not None
    read_deg = row[(row["specimen"] == scene.title) & (row["test"] == "flexion")]["extension_deg"]
    assert flexion.measured is not None
    np.testing.assert_allclose(flexion.measured[1, 3:], [0.0, 0.0, read_deg.min()], atol=1e-9)
    assert f"L4–L5 −{abs(read_deg.min()):.1f}°" in flexion.says
    (moment,) = flexion.loads
    assert (moment.kind, moment.body, moment.vector.tolist()) == ("moment", 1, [0.0, 0.0, -7.5])
    assert [len(s.steps) for s in specimen_scenes(cohort, with_loads=False)] == [1] * 2
    assert len(specimen_scenes(cohort, tests=["flexion"])[0].steps) == 2
    films = write(tmp_path / "small", without("motion.csv"))
    steps = specimen_scenes(read(films))[0].steps
    assert all(step.measured is None for step in steps)
    assert "No motion was measured." in steps[1].says


def test_a_study_moves_the_points_of_its_loads(tmp_path: Path) -> None:
    cohort = read(write(tmp_path / "small"))
    (before,), (after,) = (
        specimen_scenes(cohort, load_shift_mm=shift)[0].steps[1].loads[:1]
        for shift in ((0.0, 0.0, 0.0), (5.0, 0.0, -2.0))
    )
    np.testing.assert_allclose(after.at - before.at, [5.0, 0.0, -2.0], atol=1e-9)


def test_measured_curves_are_what_the_files_say() -> None:
    cohort = read(ROOT / "config/cohorts/l4l5_disc")
    curves = list(measured_curves(view_of(cohort, cohort.specimen_names[0])))
    flexion = next(curve for curve in curves if curve.test == "flexion")
    assert flexion.coordinate == "extension"
    assert cohort.motion is not None
    own = cohort.motion[cohort.motion["specimen"] == cohort.specimen_names[0]]
    told = own[own["test"] == "flexion"].sort_values("step")["extension_deg"]
    np.testing.assert_allclose(flexion.motion[1:], told.to_numpy(float)[1:])
    assert flexion.load.min() == pytest.approx(-7.5)


def test_the_first_specimens_alone_are_shown_and_that_is_said(tmp_path: Path) -> None:
    project(tmp_path, Size(specimens=tuple("abcdefg")))
    scenes = specimen_scenes(read(tmp_path / "config/cohorts/straight"))
    assert [scene.title for scene in scenes] == list("abcdef")
    assert "The first 6 of 7 specimens." in scenes[0].caption


def test_tracked_motions_are_thinned_and_small_enough() -> None:
    size = tracking_table_cases.Size()
    rows = tracking_table_cases.tables_of(size)["drawn"]
    scenes = tracking_scenes(rows)
    assert 0 < len(scenes) <= MOST_SCENES
    assert sum(len(scene.steps) for scene in scenes) <= MOST_FRAMES
    assert len(as_script(scenes_as_data(scenes))) < LARGEST_SCENES
    first = scenes[0]
    own = rows[(rows["kind"] == "body") & (rows["specimen"] == rows["specimen"].iloc[0])]
    times = own[own["trial"] == "flexion_extension"]["time_s"]
    assert first.steps[-1].label == f"{times.max():.2f} s"
    for body in first.bodies:
        assert_closed_and_outward(body.mesh)
    assert tracking_scenes(rows.head(0)) == []


def test_the_largest_animation_is_small_enough() -> None:
    """As many persons, frames and markers as are shown at most."""
    size = tracking_table_cases.Size(1)
    rows = tracking_table_cases.tables_of(size)["drawn"]
    names = rows.loc[rows["kind"] == "modelled", "name"].unique()
    more = [rows[rows["name"].isin(names)].assign(name=f"m{k}") for k in range(40 // len(names))]
    whole = pd.concat([rows, *more], ignore_index=True).drop_duplicates(
        ["specimen", "trial", "approach", "frame", "kind", "name"]
    )
    whole[["x_mm", "y_mm", "z_mm"]] += 123.4
    many = pd.concat([whole.assign(specimen=f"p{k:02d}") for k in range(9)], ignore_index=True)
    scenes = tracking_scenes(many)
    n = many.groupby(["specimen", "trial", "approach"]).ngroups
    assert f" {len(scenes)} of {n} motions are here." in scenes[0].caption
    per_step = len(as_script(scenes_as_data(scenes))) / sum(len(s.steps) for s in scenes)
    assert per_step * MOST_FRAMES < LARGEST_SCENES


def test_a_tracked_body_is_where_the_table_has_it() -> None:
    rows = tracking_table_cases.tables_of(tracking_table_cases.Size(1))["drawn"].copy()
    rows.loc[rows["name"] == "L3", ["extension_deg", "right_bending_deg"]] = 0.0
    rows.loc[rows["name"] == "L3", "left_rotation_deg"] = 90.0
    scene = tracking_scenes(rows)[0]
    k = [body.name for body in scene.bodies].index("L3")
    np.testing.assert_allclose(scene.steps[0].poses[k, 3:], [0.0, 90.0, 0.0], atol=1e-6)
    place = scene.steps[0].poses[k, :3]
    every = rows[(rows["kind"] == "body") & (rows["name"] == "L3")][["x_mm", "y_mm", "z_mm"]]
    assert np.linalg.norm(every.to_numpy(float) - place, axis=1).min() < 1e-9


def test_trunks_have_a_step_of_each_task_and_are_small_enough() -> None:
    size = trunk_table_cases.Size()
    made, cohort = trunk_table_cases.tables_of(size), trunk_table_cases.cohort_of(size)
    scenes = trunk_scenes(cohort, made["paths"], made["levels"])
    assert 0 < len(scenes) <= MOST_PERSONS
    assert len(as_script(scenes_as_data(scenes))) < LARGEST_SCENES
    scene = scenes[0]
    drawn = [step for step in scene.steps if step.muscles]
    assert len(drawn) == made["paths"].groupby("specimen")["task"].nunique().iloc[0]
    for step in scene.steps:
        assert step.disc is not None
        assert ((step.disc >= 0.0) & (step.disc <= 1.0)).all()
        assert bool(step.muscles) != ("not stored" in step.says)
    assert trunk_scenes(cohort, made["paths"].head(0), made["levels"]) == []
    poses = scene.steps[0].poses
    up = np.array([posed(np.array([[0.0, 1.0, 0.0]]), p)[0] - p[:3] for p in poses])
    way = poses[2:, :3] - poses[1:-1, :3]
    np.testing.assert_allclose(
        up[1:-1], way / np.linalg.norm(way, axis=1, keepdims=True), atol=1e-9
    )


def test_the_load_in_the_hands_hangs_where_the_task_says() -> None:
    size = trunk_table_cases.Size(1)
    made, cohort = trunk_table_cases.tables_of(size), trunk_table_cases.cohort_of(size)
    scene = trunk_scenes(cohort, made["paths"], made["levels"])[0]
    step = next(step for step in scene.steps if step.label == "One handed")
    (load,) = step.loads
    np.testing.assert_allclose(
        posed(load.at, step.poses[load.body]), [0.0, -150.0, 340.0], atol=1e-9
    )
    np.testing.assert_allclose(load.vector, [0.0, -19.8 * 9.81, 0.0])
    assert "19.8 kg" in step.says


def test_rotation_vectors_are_degrees_about_their_axis() -> None:
    turned = rotation_vector(rotation_zxy(np.deg2rad(20.0), 0.0, 0.0))
    np.testing.assert_allclose(turned, [0.0, 0.0, 20.0], atol=1e-9)


def test_a_cohort_of_joints_alone_has_its_neutral_pose(tmp_path: Path) -> None:
    frame = "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg\n"
    rows = "".join(f"{s},{j}\n" for s in "ab" for j in ("L3L4,0,5,0,-3,0,0", "L2L3,0,41,0,4,0,0"))
    changes = [text("joints.csv", frame + rows), swap("cohort.yaml", "true", "false")]
    changes += [without(f"{name}.csv") for name in ("landmarks", "bodies", "loads", "motion")]
    scenes = specimen_scenes(read(write(tmp_path / "small", *changes)))
    assert [len(scene.steps) for scene in scenes] == [1, 1]


def test_without_joints_in_space_there_is_nothing() -> None:
    cohort = trunk_table_cases.cohort_of(trunk_table_cases.Size(1))
    assert specimen_scenes(cohort) == []

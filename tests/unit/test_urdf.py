"""The URDF of a model: parsed again it stands, weighs and moves like the model.

Catches a URDF that stands, weighs or moves otherwise than its model.
"""

import tempfile
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from example_effects import slope, spine
from scipy.spatial.transform import Rotation

from spinepipe.frames import Pose, rotation_zxy, transform_of
from spinepipe.model import SpineModel
from spinepipe.model.urdf import urdf
from spinepipe.units import COORDINATES
from spinepipe.world import Chain


def numbers(text: str) -> np.ndarray:
    return np.array(text.split(), dtype=float)


def origin_of(element: ElementTree.Element) -> Pose:
    origin = element.find("origin")
    rotation = Rotation.from_euler("xyz", numbers(origin.get("rpy"))).as_matrix()
    return Pose(rotation, numbers(origin.get("xyz")))


def chain_of(model: SpineModel) -> list[ElementTree.Element]:
    """Joints in order, checked to form one chain from ground."""
    robot = ElementTree.fromstring(urdf(model))
    joints = robot.findall("joint")
    names = ["ground", *(joint.find("child").get("link") for joint in joints)]
    assert [joint.find("parent").get("link") for joint in joints] == names[:-1]
    assert [link.get("name") for link in robot.findall("link")] == names
    return joints


def test_each_level_is_six_single_axis_joints_in_the_order_of_the_coordinates() -> None:
    joints = chain_of(spine(2))
    assert [j.get("name") for j in joints] == [f"j{n}_{c}" for n in range(2) for c in COORDINATES]
    assert [j.get("type") for j in joints] == (["prismatic"] * 3 + ["revolute"] * 3) * 2
    axes = [numbers(j.find("axis").get("xyz")) for j in joints[:6]]
    np.testing.assert_array_equal(axes, np.eye(3)[[0, 1, 2, 2, 0, 1]])


def test_neutral_frames_are_the_models() -> None:
    model = spine(3)
    place = Pose(np.eye(3), np.zeros(3))
    for number, joint in enumerate(chain_of(model)):
        place = place @ origin_of(joint)
        expected = model.frames[number // 6]
        np.testing.assert_allclose(place.rotation, expected.rotation, rtol=0, atol=1e-14)
        np.testing.assert_allclose(place.origin, expected.origin, rtol=0, atol=1e-14)


def test_mass_is_on_the_last_link_of_each_level() -> None:
    model = spine(2)
    robot = ElementTree.fromstring(urdf(model))
    for number, link in enumerate(robot.findall("link")):
        inertial = link.find("inertial")
        mass = float(inertial.find("mass").get("value"))
        if number == 0 or number % 6:
            assert mass == 0.0
            continue
        body, frame = model.bodies[number // 6 - 1], model.frames[number // 6 - 1]
        assert mass == body.mass
        com = frame.apply(origin_of(inertial).origin)
        np.testing.assert_allclose(com, body.com, rtol=0, atol=1e-15)
        entry = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
        inertia = np.array([[entry["i" + "".join(sorted(a + b))] for a in "xyz"] for b in "xyz"])
        axes = frame.rotation @ origin_of(inertial).rotation
        turned = axes @ inertia @ axes.T
        np.testing.assert_allclose(turned, body.inertia, rtol=0, atol=1e-18)


def test_lines_are_short_enough_for_pybullets_parser() -> None:
    assert max(len(line) for line in urdf(spine(3)).splitlines()) < 400


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-7])
def test_frames_turned_a_quarter_about_the_vertical_stand_right(angle: float) -> None:
    rotation = rotation_zxy(0.0, 0.0, angle) @ rotation_zxy(0.3, -0.2, 0.0)
    yaw_first = Rotation.from_euler("ZYX", [0.4, angle, 0.3]).as_matrix()
    for frame in (rotation, yaw_first):
        model = replace(spine(1), frames=(Pose(frame, np.zeros(3)),))
        found = origin_of(chain_of(model)[0]).rotation
        np.testing.assert_allclose(found, frame, rtol=0, atol=1e-13)


def placed(model: SpineModel, q: np.ndarray, body: int, point: np.ndarray) -> np.ndarray:
    """Where a body's point is at q, written out without PyBullet."""
    place, below = Pose(np.eye(3), np.zeros(3)), Pose(np.eye(3), np.zeros(3))
    for (lower, upper), coordinates in zip(
        pairwise((below, *model.frames[: body + 1])), q.reshape(-1, 6), strict=False
    ):
        place = place @ (lower.inverse() @ upper) @ transform_of(coordinates)
    return place.apply(model.frames[body].inverse().apply(point))


def test_pybullet_moves_points_and_weighs_as_the_model_says() -> None:
    model, rng = spine(3), np.random.default_rng(5)
    skew = rng.normal(0, 1e-4, (3, 3))
    inertia = np.diag([3e-4, 4e-4, 5e-4]) + skew @ skew.T * 1e3  # principal axes of its own
    body = model.bodies[2]
    model = SpineModel(
        **{
            **vars(model),
            "bodies": (*model.bodies[:2], type(body)(body.name, body.mass, body.com, inertia)),
        }
    )
    chain, point = Chain(model), np.array([0.02, 0.11, -0.01])
    q = np.tile([1e-3] * 3 + [0.2] * 3, 3) * rng.normal(size=18)
    linear, _ = chain.jacobian(q, 2, chain.local_point(2, point))
    moments = chain.mass_velocity(q)
    for column, unit in enumerate(np.eye(18)):

        def position(h: float, along: np.ndarray = unit) -> np.ndarray:
            return placed(model, q + h * along, 2, point)

        def mass_moment(h: float, along: np.ndarray = unit) -> np.ndarray:
            return sum(
                b.mass * placed(model, q + h * along, i, b.com) for i, b in enumerate(model.bodies)
            )

        # fourth-order differences of positions of 0.1 m, good to 1e-17, over 1e-3
        np.testing.assert_allclose(linear[column], slope(position, 1e-3), rtol=0, atol=1e-12)
        np.testing.assert_allclose(moments[column], slope(mass_moment, 1e-3), rtol=0, atol=1e-11)


def test_a_model_that_was_loaded_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Workers end outright: what is there between two jobs would stay for good."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for joints in (1, 2):
        Chain(spine(joints))
        assert not list(tmp_path.iterdir())

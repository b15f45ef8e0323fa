"""Places, loads and their slopes: against differences and free bodies."""

import numpy as np
import pytest
from moving_spine import markers, postures, spine

from spinepipe.frames import rotation_zxy
from spinepipe.motion.points import COUNT, marker_places, with_slopes
from spinepipe.motion.residual_terms import bodies_of
from spinepipe.motion.skeleton import BODIES, body_poses
from spinepipe.units import STANDARD_GRAVITY

SMALL = 1e-6


def moved(q: np.ndarray, column: int, by: float) -> np.ndarray:
    flat = q.reshape(len(q), COUNT).copy()
    flat[:, column] += by
    return flat.reshape(q.shape)


def test_bodies_are_where_their_joints_put_them() -> None:
    """Joint by joint with the house's own rotation, from the pelvis up."""
    q = postures(1, 1)[0]
    turns, places = body_poses(spine(), q)
    turn, place = rotation_zxy(*q[0, 3:]), q[0, :3]
    for body, step in enumerate(spine().steps, start=1):
        place = place + turn @ (step.origin + step.rotation @ q[body, :3])
        turn = turn @ step.rotation @ rotation_zxy(*q[body, 3:])
        np.testing.assert_allclose(places[body], place, atol=1e-12)
        np.testing.assert_allclose(turns[body], turn, atol=1e-12)


def test_slopes_of_markers_are_differences() -> None:
    q = postures(2, 3)
    at, slopes = with_slopes(spine(), markers(), q)
    np.testing.assert_allclose(at, marker_places(spine(), markers(), q), atol=1e-15)
    for column in range(COUNT):
        apart = marker_places(spine(), markers(), moved(q, column, SMALL))
        apart = apart - marker_places(spine(), markers(), moved(q, column, -SMALL))
        np.testing.assert_allclose(slopes[..., column], apart / (2.0 * SMALL), atol=1e-8)


def test_slopes_of_loads_are_differences() -> None:
    bodies = bodies_of(spine())
    motion = [
        postures(seed, 2).reshape(2, COUNT) * size for seed, size in ((3, 1), (4, 5), (5, 30))
    ]
    loads, slopes = bodies.with_slopes(*motion)
    np.testing.assert_allclose(loads, bodies.loads(*motion), atol=1e-9)
    for which in range(3):
        for column in range(COUNT):
            up, down = ([one.copy() for one in motion] for _ in range(2))
            up[which][:, column] += SMALL
            down[which][:, column] -= SMALL
            apart = (bodies.loads(*up) - bodies.loads(*down)) / (2.0 * SMALL)
            size = np.abs(slopes[:, which]).max()
            np.testing.assert_allclose(slopes[:, which, :, column], apart, atol=1e-7 * size)


def test_at_rest_a_joint_holds_what_is_above() -> None:
    """Vertical force: all weight above; moment about z: weights times how far ahead they are."""
    q = postures(6, 1)
    still = np.zeros((1, COUNT))
    loads = bodies_of(spine()).loads(q.reshape(1, COUNT), still, still).reshape(len(BODIES), 6)
    turns, places = body_poses(spine(), q[0])
    at = places + np.einsum("bij,bj->bi", turns, spine().masses.com)
    kg, pull = spine().masses.kg, -STANDARD_GRAVITY[1]
    for body in range(1, len(BODIES)):
        step = spine().steps[body - 1]
        base = turns[body - 1] @ step.rotation
        whole = pull * kg[body:].sum()
        np.testing.assert_allclose(loads[body, :3], base.T @ [0.0, whole, 0.0], atol=1e-9)
        arms = at[body:] - places[body]
        moment = np.cross(arms, np.outer(pull * kg[body:], [0.0, 1.0, 0.0])).sum(axis=0)
        assert loads[body, 3] == pytest.approx(base[:, 2] @ moment, abs=1e-9)


def test_a_body_that_falls_needs_no_load() -> None:
    q = postures(7, 1).reshape(1, COUNT)
    falling = np.zeros((1, COUNT))
    falling[0, :3] = STANDARD_GRAVITY
    loads = bodies_of(spine()).loads(q, np.zeros((1, COUNT)), falling)
    np.testing.assert_allclose(loads, 0.0, atol=1e-9)
    weightless = bodies_of(spine(), weight=False).loads(
        q, np.zeros((1, COUNT)), np.zeros((1, COUNT))
    )
    np.testing.assert_allclose(weightless, 0.0, atol=1e-12)

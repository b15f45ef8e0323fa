"""Skin that slides: errors of markers hang together, and vertebrae are not dragged along."""

from dataclasses import replace

import numpy as np
import pytest
from moving_spine import law, markers, spine, trial_at
from scipy.spatial.transform import Rotation

from spinepipe.motion.objective import MotionObjective, ResidualScales, SampledTrial, sample_trial
from spinepipe.motion.points import marker_places
from spinepipe.motion.residual_terms import Markers, MuscleDemand
from spinepipe.motion.skeleton import PELVIS, body_poses
from spinepipe.motion.skin import trunk_bend, with_sliding_skin
from spinepipe.motion.spline import KnotGrid
from spinepipe.motion.trajectory import solve

FRAMES = 21


def bent(largest: float = -0.6) -> np.ndarray:
    """(F, 18, 6) forwards and back, the bend shared alike by all joints."""
    q = np.zeros((FRAMES, 18, 6))
    q[:, 1:, 3] = largest / 17 * np.sin(np.linspace(0.0, np.pi, FRAMES))[:, None] ** 2
    return q


def seen(places: np.ndarray) -> SampledTrial:
    return sample_trial(spine(), markers(), trial_at(places), len(places) - 1)


def at(q: np.ndarray) -> np.ndarray:
    return marker_places(spine(), markers(), q)


def test_a_bend_is_the_turn_of_the_uppermost_body_against_the_pelvis() -> None:
    q = bent()
    q[:, 0, 3:] = [0.4, 0.2, -0.3]  # the pelvis tips along, which bends nothing
    turns, _ = body_poses(spine(), q)
    rest, _ = body_poses(spine(), np.zeros((1, 18, 6)))
    for frame, found in enumerate(trunk_bend(seen(at(q)), turns)):
        now = Rotation.from_matrix(turns[frame, PELVIS].T @ turns[frame, -1])
        before = Rotation.from_matrix(rest[0, PELVIS].T @ rest[0, -1])
        assert found == pytest.approx((now * before.inv()).magnitude(), abs=1e-7)


def test_errors_that_hang_together_are_made_independent() -> None:
    """Sums of squares against the inverse of a covariance that is written down here."""
    q, sizes = bent(), ResidualScales(own_skin_m=4e-3, shared_skin_m=9e-3)
    trial = seen(at(q))
    weight = trial.weight.copy()
    weight[:, 3], weight[:, 5] = 0.0, 2.0
    trial = replace(trial, weight=weight)
    frame, body = FRAMES // 2, np.asarray(trial.markers.body)
    slid = with_sliding_skin(trial, q, sizes)
    off = np.random.default_rng(3).normal(0.0, 5e-3, (1, len(body), 3))
    told = replace(slid.at(np.array([frame])), places=at(q)[[frame]] - off)
    found = np.sum(Markers(told, MotionObjective(sizes=sizes)).residuals(q[[frame]]) ** 2)
    turns, _ = body_poses(spine(), q)
    bend = trunk_bend(trial, turns)[frame] / np.deg2rad(60.0)
    up = bend * turns[frame, body][:, :, 1] * np.where(body == PELVIS, 0.3, 1.0)[:, None]
    kept = weight[frame] > 0.0
    covariance = np.zeros((3 * kept.sum(),) * 2)
    for one in set(body[kept]):
        way = np.where((body == one)[:, None], up, 0.0)[kept].ravel()
        covariance += sizes.own_skin_m**2 * np.outer(way, way)
    way = np.where((body != PELVIS)[:, None], up, 0.0)[kept].ravel()
    covariance += sizes.shared_skin_m**2 * np.outer(way, way)
    covariance += np.diag(np.repeat(sizes.marker_m**2 / weight[frame, kept], 3))
    rows = off[0, kept].ravel()
    assert found == pytest.approx(rows @ np.linalg.solve(covariance, rows), rel=1e-9)


def test_without_a_bend_or_without_sliding_markers_are_weighed_alike() -> None:
    q = np.zeros((FRAMES, 18, 6))
    trial, off = seen(at(q) + 1e-3), MotionObjective()
    plain = Markers(trial, off).residuals(q)
    np.testing.assert_allclose(
        Markers(with_sliding_skin(trial, q, ResidualScales()), off).residuals(q), plain, atol=1e-12
    )
    stiff = ResidualScales(own_skin_m=0.0, shared_skin_m=0.0)
    assert with_sliding_skin(seen(at(bent())), bent(), stiff).shares is None


@pytest.mark.parametrize(
    "sizes",
    [ResidualScales(own_skin_m=0.0), ResidualScales(shared_skin_m=0.0)],
    ids=("alike", "by itself"),
)
def test_skin_that_slides_in_one_of_two_ways_slides(sizes: ResidualScales) -> None:
    assert with_sliding_skin(seen(at(bent())), bent(), sizes).shares is not None


def test_vertebrae_are_not_dragged_down_with_their_markers() -> None:
    """Skin slides 15 mm down all vertebrae; half of what it drags them is left at most."""
    q = bent()
    turns, _ = body_poses(spine(), q)
    share = trunk_bend(seen(at(q)), turns)[:, None] / np.deg2rad(60.0)
    on = np.where(markers().body == PELVIS, 0.0, 0.015)
    places = at(q) - (share * on)[..., None] * turns[:, markers().body][..., 1]
    top = []
    for sizes in (ResidualScales(own_skin_m=0.0, shared_skin_m=0.0), ResidualScales()):
        ask = MotionObjective(passive=law(), force_cost="level_difference", sizes=sizes)
        known = with_sliding_skin(seen(places), q, sizes)
        found = solve(ask, [known], [KnotGrid(0.0, 0.1, FRAMES - 1).through(q)])
        now = known.grid.at_nodes(found.coefficients[0])[0]
        apart = body_poses(spine(), now)[1][:, -1] - body_poses(spine(), q)[1][:, -1]
        top.append(float(np.linalg.norm(apart[FRAMES // 2])))
    assert top[1] < 0.5 * top[0]
    assert top[0] > 3e-3


def test_a_spine_that_is_pressed_together_as_a_whole_costs_its_mean_force() -> None:
    """All joints pressed alike: differences cost nothing, the mean over its size does."""
    q = np.zeros((1, 18, 6))
    q[:, 1:, 1] = -1e-3
    soft = replace(MotionObjective(passive=law()), force_cost="level_difference")
    rest = np.zeros_like(q)
    loads = MuscleDemand.of(seen(at(np.repeat(q, 2, axis=0))), soft)
    active = loads.active(soft.passive, (q, rest, rest))
    rows = loads.residuals(soft.passive, (q, rest, rest)).reshape(17, 6)
    expected = active[0, :, :3].mean(axis=0) * np.sqrt(17.0) / soft.sizes.common_n
    np.testing.assert_allclose(rows[-1, :3], expected, rtol=1e-12)
    np.testing.assert_allclose(rows[-1, 3:], 0.0, atol=1e-12)
    np.testing.assert_allclose(rows[:-1, 1], np.diff(active[0, :, 1]) / 200.0, rtol=1e-9, atol=1e-9)


def test_joints_that_are_unloaded_elsewhere_resist_from_there() -> None:
    moved = law()
    rest = np.random.default_rng(8).normal(0.0, 0.02, (17, 6)) * [0.05, 0.05, 0.05, 1.0, 1.0, 1.0]
    there = replace(moved, rest=rest)
    q = 2.0 * rest[None]
    np.testing.assert_allclose(there.forces(q), moved.forces(rest[None]), rtol=1e-12)
    np.testing.assert_allclose(there.forces(rest[None]), 0.0, atol=1e-12)
    doubled = there.scaled(np.full((17, 6), 2.0), np.ones((17, 6)))
    np.testing.assert_allclose(doubled.forces(q), 2.0 * there.forces(q), rtol=1e-12)

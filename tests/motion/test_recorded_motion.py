"""Recorded lifts as motions: a rigid pendulum in closed form, mirrors, weights, what a load adds.

Catches an inertia that is lost, a sign of a moment, a part that does not move with its markers, and
a load that is carried while it stands on the floor.
"""

import lifts
import numpy as np
import pytest

from spinepipe.anatomy.segments import CENTRE, GYRATION, MASS_PERCENT, length_m
from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.motion.body_segments import RigidPart, combine
from spinepipe.motion.joint_tables import ratio_sets
from spinepipe.motion.lifted_load import LiftedLoad, borne_by_height, borne_by_plates
from spinepipe.motion.plug_in_gait import head_centre, l5s1_centre, marker_places, shoulder_centres
from spinepipe.motion.recorded_motion import RecordedMotion, move, net_moments, shared_rotations
from spinepipe.motion.skeleton import BODIES, JOINTS
from spinepipe.motion.smoothing import acceleration, low_pass
from spinepipe.studies.recorded_motion import places_of, recorded_motion, smooth_places
from spinepipe.studies.recordings import trial_rows

SHARES = ratio_sets()["christophy_2012"]
RATE_HZ = 200.0
TIME_S = np.arange(400) / RATE_HZ
OMEGA, SWING_RAD = 3.0, 0.6
THETA = SWING_RAD * np.sin(OMEGA * TIME_S)
G = 9.81


def turned(places: dict[str, Array], about: Array) -> dict[str, Array]:
    """All markers turned by `THETA` in extension about a point."""
    turns = np.array([rotation_zxy(angle, 0.0, 0.0) for angle in THETA])
    return {name: about + turns @ (at - about) for name, at in places.items()}


def whole(stance: dict[str, Array]) -> RigidPart:
    """All above L5S1 as one body, about L5S1; arms do not spin, so their axis has no inertia."""
    origin, subject = l5s1_centre(stance, "male"), lifts.MAN

    def segment(name: str) -> tuple[float, float, tuple[float, ...]]:
        key = f"{name} {subject.sex}"
        kg = MASS_PERCENT[key] / 100.0 * subject.mass_kg
        return kg, length_m(name, subject.sex, subject.height_m), GYRATION[key]

    parts = list(lifts.spine().slices)
    kg, size, (forwards, right, along) = segment("head")
    about = kg * size**2 * np.diag([forwards**2, along**2, right**2])
    parts.append(RigidPart("head", kg, head_centre(stance, subject) - origin, about))
    for side, shoulder in shoulder_centres(stance).items():
        wrist = (stance[f"{side}WRA"] + stance[f"{side}WRB"]) / 2.0
        elbow, knuckle = stance[f"{side}ELB"], stance[f"{side}FIN"]
        for name, start, end in (
            ("upper_arm", shoulder, elbow),
            ("forearm", elbow, wrist),
            ("hand", wrist, knuckle),
        ):
            kg, size, (forwards, right, _) = segment(name)
            line = end - start
            axis = line / np.linalg.norm(line)
            reach = size if name == "hand" else np.linalg.norm(line)
            com = start + CENTRE[f"{name} male"] * reach * axis - origin
            across = kg * size**2 * (forwards**2 + right**2) / 2.0
            parts.append(RigidPart(name, kg, com, across * (np.eye(3) - np.outer(axis, axis))))
    return combine("all", parts)


def test_a_rigid_pendulum_asks_what_newton_says() -> None:
    stance = lifts.stance()
    origin = l5s1_centre(stance, "male")
    motion = move("swing", TIME_S, lifts.spine(), SHARES, stance, turned(stance, origin))
    body = whole(stance)
    ahead, high = body.com[0], body.com[1]
    about_z = body.about_com[2, 2] + body.kg * (ahead**2 + high**2)
    acts = -(OMEGA**2) * THETA
    weight = body.kg * G * (np.cos(THETA) * ahead - np.sin(THETA) * high)
    forces, moments = net_moments(motion.joints, motion.loads)
    inner = slice(5, -5)
    assert np.allclose(moments[inner, 0, 2], (about_z * acts + weight)[inner], atol=0.01)
    assert np.ptp(moments[inner, 0, 2]) > 100.0
    # the centre is pulled towards the axis and along its path
    pulled = body.kg * (acts[:, None] * np.stack(_across(body), 1))
    pulled -= (
        body.kg
        * ((OMEGA * SWING_RAD * np.cos(OMEGA * TIME_S)) ** 2)[:, None]
        * np.stack(_along(body), 1)
    )
    pulled[:, 1] += body.kg * G
    assert np.allclose(forces[inner, 0, :2], pulled[inner], atol=0.1)
    _, still = net_moments(motion.joints, motion.still)
    assert np.allclose(still[:, 0, 2], weight, atol=1e-9)


def _along(body: RigidPart) -> tuple[Array, Array]:
    x, y = body.com[:2]
    return np.cos(THETA) * x - np.sin(THETA) * y, np.sin(THETA) * x + np.cos(THETA) * y


def _across(body: RigidPart) -> tuple[Array, Array]:
    x, y = _along(body)
    return -y, x


def test_a_motion_that_does_not_move_has_the_stance() -> None:
    stance = lifts.stance()
    places = {name: np.repeat(at[None], 20, axis=0) for name, at in stance.items()}
    motion = move("stands", TIME_S[:20], lifts.spine(), SHARES, stance, places)
    assert np.allclose(motion.rotations, np.eye(3), atol=1e-12)
    assert np.allclose(motion.joints - motion.l5s1[:, None], lifts.spine().joints, atol=1e-12)
    assert np.allclose(motion.loads.forces, motion.still.forces, atol=1e-6)
    assert set(motion.loads.carriers) == set(BODIES[1:])


def test_what_turns_between_pelvis_and_thorax_is_shared_out() -> None:
    pelvis = np.array([rotation_zxy(-0.3, 0.1, 0.0)])
    thorax = np.array([rotation_zxy(-1.2, 0.2, 0.1)])
    found = shared_rotations(pelvis, thorax, SHARES)[0]
    assert np.allclose(found[0], pelvis[0])
    assert np.allclose(found[1:][-1], thorax[0])
    assert np.allclose(found[BODIES.index("T12")], thorax[0])  # nothing turns above L1L2
    steps = [found[k].T @ found[k + 1] for k in range(5)]
    bent = np.array([-np.arctan2(-one[0, 1], one[1, 1]) for one in steps])
    assert bent / bent.sum() == pytest.approx(SHARES[:5, 0], abs=0.02)


def test_a_mirrored_lift_mirrors() -> None:
    spine = lifts.spine()
    time_s, stance, places = _without_rbak()
    one = move("one", time_s, spine, SHARES, stance, places)
    other = move(
        "other",
        time_s,
        lifts.mirrored_spine(spine),
        SHARES,
        lifts.mirrored(stance),
        lifts.mirrored(places),
    )
    (f_one, m_one), (f_other, m_other) = (_net(motion) for motion in (one, other))
    assert np.allclose(f_other, f_one * [1.0, 1.0, -1.0], atol=1e-8)
    assert np.allclose(m_other, m_one * [-1.0, -1.0, 1.0], atol=1e-8)


def _net(motion: RecordedMotion) -> tuple[Array, Array]:
    return net_moments(motion.joints, motion.loads)


def _without_rbak() -> tuple[Array, dict[str, Array], dict[str, Array]]:
    cohort = lifts.lifts()
    rows = {row["trial"]: row for row in trial_rows(cohort, "s01")}
    stance = {n: at.mean(axis=0) for n, at in places_of(rows["stance"], cohort)[1].items()}
    time_s, places = smooth_places(rows["lift1"], cohort, 6.0)
    for part in (stance, places):
        part.pop("RBAK")
    return time_s, stance, places


def test_joints_below_carry_what_joints_above_do_and_more() -> None:
    motion = recorded_motion(lifts.lifts(), "s01", "lift2", lifts.spine())
    forces, moments = _net(motion)
    kg = -motion.still.forces[-1, :, 1] / G
    assert kg[-1] == pytest.approx(14.86, abs=0.02)  # as the plate weighs it
    assert 0.47 * 81.68 < kg[:-1].sum() < 0.52 * 81.68
    k = JOINTS.index("L4L5")
    own = motion.loads.carriers.index("L5")
    load = motion.loads.forces[:, own]
    assert np.allclose(forces[:, 0], forces[:, k] - load)
    arm = motion.joints[:, k] - motion.joints[:, 0]
    about = np.cross(motion.loads.at[:, own] - motion.joints[:, 0], load)
    expected = moments[:, k] + np.cross(arm, forces[:, k]) - about - motion.loads.moments[:, own]
    assert np.allclose(moments[:, 0], expected, atol=1e-9)


def test_hands_bear_what_a_plate_bears_no_more() -> None:
    risen = np.r_[np.zeros(40), np.linspace(0.0, 1.0, 10), np.ones(50)]
    for stood in (0.0, 15.0 * G):  # zeroed under the load, and not
        plates = {"feet": 800.0 + 15.0 * G * risen, "load": stood - 15.0 * G * risen}
        told = borne_by_plates(15.0, plates)
        assert told is not None
        assert told[0] == pytest.approx(15.0)
        assert np.allclose(told[1], risen)
    assert borne_by_plates(30.0, plates) is None
    heights = 0.1 + np.r_[np.zeros(40), 0.01 * np.arange(60)]
    assert borne_by_height(heights).argmax() == 41
    load = LiftedLoad(15.0, np.stack([0 * heights, heights, 0 * heights], 1), risen)
    assert load.lift_off == 45
    assert np.allclose(load.weight[-1], [0.0, -15.0 * G, 0.0])
    assert not load.inertia(0.02)[:40].any()


def test_a_filter_keeps_slow_motion_and_its_phase() -> None:
    slow = np.sin(2.0 * np.pi * TIME_S)
    assert np.abs(low_pass(slow, RATE_HZ, 6.0) - slow)[20:-20].max() < 2e-3
    at_cutoff = np.sin(2.0 * np.pi * 6.0 * TIME_S)
    kept = low_pass(at_cutoff, RATE_HZ, 6.0)[100:-100]
    assert kept.max() == pytest.approx(np.sqrt(0.5), abs=0.01)
    assert np.abs(acceleration(TIME_S**2, 1 / RATE_HZ) - 2.0).max() < 1e-6
    with pytest.raises(ValueError, match="cannot be filtered"):
        low_pass(slow, 10.0, 6.0)
    with pytest.raises(ValueError, match="too few"):
        low_pass(slow[:10], RATE_HZ, 6.0)


def test_names_of_markers_are_found_in_other_cases_and_behind_prefixes() -> None:
    names = ("Anna:LASI", "p1_rasi", "C 7", "clav", "LPSI", "lpsi", "T10")
    found = marker_places(names)
    assert found == {"LASI": 0, "RASI": 1, "C7": 2, "CLAV": 3, "LPSI": 4, "T10": 6}

"""Every kilogram has a place: shares, centres, arms along a line, loads in one hand or two."""

import re
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from trunk_to_scale import made_up_trunk

from spinepipe.frames import rotation_zxy
from spinepipe.muscles.masses import (
    ahead_cm,
    arm_loads,
    arm_masses,
    centre_shares,
    masses_of,
    shares,
)
from spinepipe.muscles.regressions import packaged
from spinepipe.muscles.scaling import scale_trunk
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.muscles.task import Hands
from spinepipe.muscles.trunk import BODIES, SLICES, THORAX

SHOULDERS = np.array([[0.0, 0.45, 0.18], [0.0, 0.45, -0.18]])
G = 9.81


def test_slices_sum_to_their_published_shares() -> None:
    masses = {m.name: m for m in masses_of(made_up_trunk(), REFERENCE)}
    slices = [masses[f"slice_{name}"].kg for name in SLICES]
    assert slices[0] == pytest.approx(0.011 * 75.1)
    assert slices[-1] == pytest.approx(0.026 * 75.1)
    np.testing.assert_allclose(np.diff(slices, 2), 0.0, atol=1e-14)
    assert sum(slices) == pytest.approx(0.3145 * 75.1)
    assert masses["head"].kg == pytest.approx(0.0694 * 75.1)


def test_masses_hang_on_the_body_of_their_vertebra() -> None:
    bodies = {m.name: m.body for m in masses_of(made_up_trunk(), REFERENCE)}
    assert bodies["slice_L5"] == BODIES.index("L5")
    assert bodies["slice_T12"] == BODIES.index("T12")
    assert {bodies[f"slice_T{n}"] for n in range(1, 12)} == {THORAX} == {bodies["head"]}


def test_slices_lie_ahead_as_published_and_grow_with_height() -> None:
    at = dict(zip(SLICES, ahead_cm(), strict=True))
    assert (at["T1"], at["T11"], at["L4"], at["L5"]) == (0.0, 5.0, 1.0, 1.0)
    assert (at["T7"], at["T8"]) == pytest.approx((4.0 - 0.5 * 4.0 / 6.5, 4.0 + 0.5 * 1.0 / 3.5))
    assert at["L3"] == pytest.approx(1.0 + 0.5 * 4.0 / 4.5)
    trunk = made_up_trunk()
    tall = Subject("male", 41.8, 1.2 * 1.730, 75.1)
    taller = scale_trunk(trunk, tall, REFERENCE, packaged())
    masses = masses_of(taller, tall, ahead_times=1.5)
    gaps = [m.at - v for m, v in zip(masses, taller.vertebrae, strict=False)]
    np.testing.assert_allclose(
        gaps, [[0.01 * 1.2 * 1.5 * cm, 0, 0] for cm in ahead_cm()], atol=1e-15
    )


def test_the_whole_body_is_100_percent() -> None:
    for sex, head, arms in (("male", 6.94, 9.88), ("female", 6.68, 8.98)):
        found = shares(replace(REFERENCE, sex=sex))
        assert sum(share.percent for share in found) == pytest.approx(100.0)
        carried = [share.percent for share in found if share.carried]
        assert sum(carried) == pytest.approx(31.45 + head + arms)
        assert not found[-1].carried


def test_what_the_trunk_carries_is_what_the_shares_say() -> None:
    woman = Subject("female", 30.0, 1.65, 60.0)
    carried = sum(m.kg for m in masses_of(made_up_trunk(), woman))
    arms = arm_loads(woman, SHOULDERS, Hands(), 0.6)
    carried -= sum(load.force[1] for load in arms) / G
    assert carried == pytest.approx(
        0.6 * sum(share.percent for share in shares(woman) if share.carried)
    )


def test_arms_that_hang_pull_straight_down_from_the_shoulders() -> None:
    loads = arm_loads(REFERENCE, SHOULDERS, Hands(kg=10.0), arm_length=0.65)
    assert sum(load.force[1] for load in loads) == pytest.approx(-G * (0.0988 * 75.1 + 10.0))
    held = {load.name: load for load in loads}
    np.testing.assert_allclose(held["left_hand_load"].at, [0.0, -0.20, -0.18], atol=1e-15)
    np.testing.assert_allclose(held["left_hand_load"].force, [0.0, -5.0 * G, 0.0])
    assert {load.body for load in loads} == {THORAX}
    assert all(load.at[0] == 0.0 for load in loads)


@pytest.mark.parametrize(
    ("sex", "centres", "percents"),
    [
        ("male", (0.5772, 0.4574, 0.3624), (2.71, 1.62, 0.61)),
        ("female", (0.5754, 0.4559, 0.3427), (2.55, 1.38, 0.56)),
    ],
)
def test_arms_are_those_of_de_leva_on_lengths_of_drillis(
    sex: Literal["male", "female"], centres: tuple[float, ...], percents: tuple[float, ...]
) -> None:
    """Entered again: de Leva 1996 Table 4; 0.186, 0.146, 0.108 of the height (Drillis 1966)."""
    hand = 0.186 + 0.146 + centres[2] * 0.108
    along = np.array([centres[0] * 0.186, 0.186 + centres[1] * 0.146, hand]) / hand
    np.testing.assert_allclose(centre_shares(sex), along, rtol=1e-14)
    person = replace(REFERENCE, sex=sex)
    shoulder, at = np.array([0.1, 0.5, 0.2]), np.array([0.4, 0.3, 0.1])
    arm = arm_masses("right", shoulder, at, person)
    assert [mass.kg for mass in arm] == pytest.approx([p / 100.0 * 75.1 for p in percents])
    for mass, share in zip(arm, along, strict=True):
        np.testing.assert_allclose(mass.at, (1.0 - share) * shoulder + share * at, atol=1e-15)


def test_a_load_in_both_hands_acts_at_its_middle() -> None:
    at = np.array([0.40, 0.20, 0.05])
    loads = arm_loads(REFERENCE, SHOULDERS, Hands(kg=20.0, at=at), arm_length=0.65)
    held = [load for load in loads if load.name.endswith("hand_load")]
    assert [load.force[1] for load in held] == pytest.approx([-10 * G, -10 * G])
    moment = sum(np.cross(load.at, load.force) for load in held)
    np.testing.assert_allclose(moment, np.cross(at, [0.0, -20 * G, 0.0]), atol=1e-12)


def test_one_hand_carries_and_the_other_hangs() -> None:
    at = np.array([0.0, -0.15, 0.34])
    hands = Hands(kg=19.8, at=at, holding="right")
    loads = {load.name: load for load in arm_loads(REFERENCE, SHOULDERS, hands, 0.65)}
    assert "left_hand_load" not in loads
    np.testing.assert_array_equal(loads["right_hand_load"].at, at)
    np.testing.assert_allclose(loads["left_hand"].at, SHOULDERS[1] - [0, 0.65, 0])
    mirrored = replace(hands, at=at * [1, 1, -1], holding="left")
    other = {load.name: load for load in arm_loads(REFERENCE, SHOULDERS, mirrored, 0.65)}
    for name, load in loads.items():
        side, rest = name.split("_", 1)
        twin = other[f"{'left' if side == 'right' else 'right'}_{rest}"]
        np.testing.assert_allclose(twin.at, load.at * [1, 1, -1], atol=1e-15)
        np.testing.assert_array_equal(twin.force, load.force)


def test_empty_hands_go_where_they_are_put() -> None:
    at = np.array([0.3, 0.4, 0.0])
    loads = {load.name: load for load in arm_loads(REFERENCE, SHOULDERS, Hands(at=at), 0.65)}
    np.testing.assert_allclose(loads["right_hand"].at, at + np.array([0, 0, 0.15]))
    assert "right_hand_load" not in loads


def test_a_hand_at_full_reach_is_within_it_and_one_beyond_is_told_with_its_distance() -> None:
    hands = Hands(kg=5.0, at=np.array([0.65, 0.45, 0.18]), holding="right")
    loads = {load.name: load for load in arm_loads(REFERENCE, SHOULDERS, hands, arm_length=0.65)}
    np.testing.assert_array_equal(loads["right_hand_load"].at, hands.at)
    far = replace(hands, at=np.array([0.8, 0.45, 0.18]))
    with pytest.raises(ValueError, match="right hand is 150 mm farther"):
        arm_loads(REFERENCE, SHOULDERS, far, arm_length=0.65)


@pytest.mark.parametrize(
    ("at", "says"),
    [
        ((0.8, 0.45, 0.18), r"a trunk that leans (\d+) deg further forwards would reach"),
        ((-0.6, 0.1, 0.18), r"a trunk that leans (\d+) deg further backwards would reach"),
        ((2.5, 0.0, 0.18), "no lean of the trunk would reach: bring the load nearer"),
    ],
)
def test_out_of_reach_the_least_lean_that_would_do_is_told(
    at: tuple[float, float, float], says: str
) -> None:
    """So much does, and a degree less does not."""
    far = Hands(kg=5.0, at=np.array(at), holding="right")
    with pytest.raises(ValueError, match=says) as told:
        arm_loads(REFERENCE, SHOULDERS, far, arm_length=0.65)
    found = re.search(says, str(told.value))
    assert found is not None
    for deg in map(int, found.groups()):
        sign = -1.0 if "forwards" in says else 1.0
        enough, less = (
            SHOULDERS @ rotation_zxy(sign * np.deg2rad(one), 0.0, 0.0).T for one in (deg, deg - 1)
        )
        arm_loads(REFERENCE, enough, far, arm_length=0.65)
        with pytest.raises(ValueError, match="farther"):
            arm_loads(REFERENCE, less, far, arm_length=0.65)

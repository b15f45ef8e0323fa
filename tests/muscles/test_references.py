"""Facts of postures and loads: entered again, and the rules that follow from them."""

import numpy as np
import pytest

from spinepipe.muscles.references import (
    STATUSES,
    hand_below_shoulder,
    joint_shares,
    largest_trunk_flexion,
    load_facts,
    measured_pressures,
    parted,
    pelvis_flexion,
    printed_percents,
    sacrum_lateral,
)
from spinepipe.muscles.trunk import LEVELS

DEG = np.pi / 180

PELVIS_DEG = {10: 2.6, 20: 5.5, 50: 15.9, 70: 24.4, 90: 34.0, 107.3: 43.3, 121: 51.2}
"""Worked out by others to a decimal; they did not round the line, which moves 0.01 deg."""


@pytest.mark.parametrize("trunk_deg", PELVIS_DEG)
def test_the_pelvis_follows_the_trunk(trunk_deg: float) -> None:
    found = pelvis_flexion(trunk_deg * DEG) / DEG
    assert found == pytest.approx(PELVIS_DEG[trunk_deg], abs=0.06)


def test_the_rhythm_has_the_ratios_that_were_measured() -> None:
    """Tafazzol 2014: lumbar over pelvis 2.51 about 15 deg, 1.34 about 105; the line is rounded."""
    for trunk_deg, ratio in ((15, 2.51), (105, 1.34)):
        pelvis = pelvis_flexion(trunk_deg * DEG) / DEG
        assert (0.9355 * trunk_deg - pelvis) / pelvis == pytest.approx(ratio, abs=0.01)
    assert pelvis_flexion(largest_trunk_flexion()) / DEG == pytest.approx(53.0, abs=2.0)


@pytest.mark.parametrize("trunk_deg", [-1.0, 125.0])
def test_beyond_what_was_measured_the_rhythm_is_not_known(trunk_deg: float) -> None:
    with pytest.raises(ValueError, match="from 0 to 121 deg"):
        pelvis_flexion(trunk_deg * DEG)


def test_the_partition_is_the_printed_one_summed_to_one() -> None:
    flexion = [6.0, 10.9, 14.1, 13.2, 16.9, 20.1, 18.7]
    lateral = [8.3, 2.8, 9.4, 18.3, 22.8, 25.6, 12.8]
    assert [printed_percents("flexion")[k] for k in reversed(LEVELS)] == flexion
    assert [printed_percents("lateral")[k] for k in reversed(LEVELS)] == lateral
    assert sum(flexion) == pytest.approx(99.9)
    np.testing.assert_allclose(joint_shares("flexion")[::-1], np.array(flexion) / 99.9, rtol=1e-14)
    assert joint_shares("lateral").sum() == pytest.approx(1.0, abs=1e-15)


def test_bodies_turn_from_the_pelvis_to_t11() -> None:
    found = parted(trunk=-50.0, pelvis=-15.9, direction="flexion")
    assert (found[0], found[-1]) == (-15.9, pytest.approx(-50.0))
    np.testing.assert_allclose(np.diff(found), -34.1 * joint_shares("flexion"), rtol=1e-13)


def test_the_sacrum_leans_a_tenth_of_the_trunk() -> None:
    assert sacrum_lateral(20 * DEG) == pytest.approx(2 * DEG)
    assert sacrum_lateral(-10 * DEG) == pytest.approx(-1 * DEG)


def test_measured_pressures_by_task() -> None:
    """Entered again: MPa, and whether it may be used for acceptance."""
    found = {}
    for row in measured_pressures():
        if row.task is not None:
            found.setdefault(row.task, []).append((row.value, row.status))
    assert found == {
        1: [(0.50, "confirmed")],
        2: [(1.10, "confirmed"), (1.00, "confirmed")],
        3: [(1.80, "confirmed")],
        4: [(1.10, "confirmed"), (1.08, "confirmed")],
        5: [(1.60, "from_memory")],
        6: [(2.30, "confirmed")],
        8: [(1.00, "from_memory")],
        9: [(0.60, "confirmed"), (0.55, "derived")],
    }


def test_every_fact_has_a_source_and_a_value_or_a_range() -> None:
    for pressure in measured_pressures():
        assert pressure.source
        assert pressure.value is not None or (pressure.low or 0.0) < (pressure.high or 0.0)
    units = {"mass": "kg", "anterior": "mm", "lateral": "mm"}
    for fact in load_facts():
        assert fact.source
        assert fact.status in STATUSES
        assert fact.unit == units.get(fact.quantity, "deg")


def test_loads_of_the_tasks() -> None:
    found = {(f.task, f.quantity, f.from_where): f.value for f in load_facts()}
    assert [found[task, "mass", ""] for task in (2, 3, 6, 8)] == [19.8] * 4
    assert found[8, "lateral", "L5S1"] == 340.0
    assert found[2, "anterior", "origin of the pelvis"] == 370.0
    assert found[3, "anterior", "origin of the pelvis"] == 580.0


def test_an_arm_hangs_stretches_and_bends() -> None:
    np.testing.assert_allclose(hand_below_shoulder(0.64, 0.0, 0.0), [0, -0.64, 0], atol=1e-15)
    np.testing.assert_allclose(hand_below_shoulder(0.64, np.pi / 2, 0), [0.64, 0, 0], atol=1e-15)
    bent = hand_below_shoulder(0.64, 0.0, np.pi / 2)
    assert bent[0] - bent[1] == pytest.approx(0.64)
    assert bent[0] > 0.0 > bent[1]
    np.testing.assert_allclose(
        hand_below_shoulder(0.64, 0.7, 0.3, trunk_flexion=0.7), hand_below_shoulder(0.64, 0, 0.3)
    )

"""Ranges of motion: the table again from its sources, what widening is, a cohort's own rows."""

import numpy as np
import pandas as pd
import pytest

from spinepipe.motion.bounds import FILE, NUMBERS, bounds
from spinepipe.motion.joint_tables import packaged_rows
from spinepipe.motion.skeleton import JOINTS
from spinepipe.units import COORDINATES, DEG_PER_RAD, ROTATIONS

WHITE_PANJABI_DEG = {
    **{"T1T2": (4, 5, 9), "T2T3": (4, 6, 8), "T3T4": (4, 5, 8), "T4T5": (4, 6, 8)},
    **{"T5T6": (4, 6, 8), "T6T7": (5, 6, 7), "T7T8": (6, 6, 7), "T8T9": (6, 6, 6)},
    **{"T9T10": (6, 6, 4), "T10T11": (9, 7, 2), "T11T12": (12, 9, 2), "T12L1": (12, 8, 2)},
    **{"L1L2": (12, 6, 2), "L2L3": (14, 6, 2), "L3L4": (15, 8, 2), "L4L5": (16, 6, 2)},
    "L5S1": (17, 3, 1),
}
"""Flexion and extension together, bending to one side, rotation to one side."""

WILKE_DEG = {
    "extension": lambda t: 14 if t == 1 else 8,
    "right_bending": lambda t: 12 if t <= 6 else 9,
    "left_rotation": lambda t: 12 if t <= 9 else 8,
}
"""Largest range of both sides together, by the number of the upper thoracic vertebra."""

FLEXION_SHARE = {"thoracic": 21.1 / (21.1 + 13.7), "lumbar": 51 / (51 + 16)}
"""Jiang 2025 Tables 1-3; Pearcy 1985 Table 4. T12L1 goes with the thorax."""


def expected_deg(joint: str, coordinate: str) -> tuple[float, float, str]:
    printed = WHITE_PANJABI_DEG[joint][ROTATIONS.index(coordinate)]
    share = (0.5, 0.5) if coordinate != "extension" else None
    if share is None:
        flexion = FLEXION_SHARE["thoracic" if joint.startswith("T") else "lumbar"]
        share = flexion, 1.0 - flexion
    else:
        printed *= 2
    low, high = (printed * part for part in share)
    status = "from_memory"
    if joint.count("T") == 2:
        rig = WILKE_DEG[coordinate](int(joint[1 : joint.index("T", 1)])) / 2
        status = "confirmed" if rig >= max(low, high) else status
        low, high = max(low, rig), max(high, rig)
    return -low, high, status


@pytest.mark.parametrize("coordinate", ROTATIONS)
@pytest.mark.parametrize("joint", JOINTS)
def test_rotations_are_the_wider_of_their_sources(joint: str, coordinate: str) -> None:
    found = bounds()
    at = JOINTS.index(joint), COORDINATES.index(coordinate)
    low, high, status = expected_deg(joint, coordinate)
    # printed to three digits
    np.testing.assert_allclose(DEG_PER_RAD * found.limits[at], [low, high], rtol=5e-3)
    assert found.status[at] == status


def test_translations_say_that_they_are_choices() -> None:
    found = bounds()
    lumbar = [joint.count("T") != 2 for joint in JOINTS]
    superior = COORDINATES.index("superior")
    lowest = np.where(lumbar, -4.5e-3, -3e-3)
    np.testing.assert_allclose(found.limits[:, superior, 0], lowest, rtol=1e-15)
    np.testing.assert_allclose(found.limits[:, [0, 2], 1], 3e-3, rtol=1e-15)
    assert set(found.status[:, [0, 2]].ravel()) == {"choice"}


def test_every_range_is_there_once() -> None:
    assert len(packaged_rows(FILE, NUMBERS)) == 17 * 6
    assert np.isfinite(bounds().limits).all()


def test_widening_moves_both_ends_from_zero() -> None:
    found = bounds()
    np.testing.assert_array_equal(found.widened(2.5), 2.5 * found.limits)


def own(**changed: object) -> pd.DataFrame:
    row = {"joint": "L4L5", "coordinate": "extension", "low": -20.0, "high": 8.0, "source": "film"}
    return pd.DataFrame([row | changed], index=[2])


@pytest.mark.parametrize(("low", "high"), [(0.0, 8.0), (-20.0, 0.0)])
def test_a_range_may_end_at_zero(low: float, high: float) -> None:
    """A joint that goes one way alone."""
    at = JOINTS.index("L4L5"), COORDINATES.index("extension")
    np.testing.assert_allclose(
        DEG_PER_RAD * bounds(own(low=low, high=high)).limits[at], [low, high], rtol=1e-14
    )


def test_a_row_keeps_the_status_that_it_tells() -> None:
    at = JOINTS.index("L4L5"), COORDINATES.index("extension")
    assert bounds(own(status="derived")).status[at] == "derived"


def test_lines_are_counted_as_an_editor_shows_them() -> None:
    """The header is the first."""
    rows = packaged_rows(FILE, NUMBERS)
    assert (rows.index[0], rows.index[-1]) == (2, 1 + 17 * 6)


def test_what_comes_along_cannot_be_written_over() -> None:
    found = bounds()
    for array in (found.limits, found.source, found.status):
        assert not array.flags.writeable


def test_a_cohort_s_own_rows_take_the_place_of_those_that_come_along() -> None:
    found, shipped = bounds(own()), bounds()
    at = JOINTS.index("L4L5"), COORDINATES.index("extension")
    np.testing.assert_allclose(found.limits[at], np.deg2rad([-20.0, 8.0]), rtol=1e-15)
    assert (found.source[at], found.status[at]) == ("film", "given")
    moved = (found.limits != shipped.limits).any(axis=-1)
    assert moved.sum() == 1

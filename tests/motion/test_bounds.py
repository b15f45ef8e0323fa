"""Ranges of motion: the table again from its sources, a cohort's own rows."""

import numpy as np
import pandas as pd
import pytest

from spinepipe.motion.joint_tables import BOUNDS_FILE, ENDS, bounds, packaged_rows
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

STATUS = packaged_rows(BOUNDS_FILE, ENDS).set_index(["joint", "coordinate"])["status"]
AT = JOINTS.index("L4L5"), COORDINATES.index("extension")


def expected_deg(joint: str, coordinate: str) -> tuple[float, float, str]:
    printed = WHITE_PANJABI_DEG[joint][ROTATIONS.index(coordinate)]
    low, high = float(printed), float(printed)
    if coordinate == "extension":
        flexion = FLEXION_SHARE["thoracic" if joint.startswith("T") else "lumbar"]
        low, high = printed * flexion, printed * (1.0 - flexion)
    status = "from_memory"
    if joint.count("T") == 2:
        rig = WILKE_DEG[coordinate](int(joint[1 : joint.index("T", 1)])) / 2
        status = "confirmed" if rig >= max(low, high) else status
        low, high = max(low, rig), max(high, rig)
    return -low, high, status


def test_rotations_are_the_wider_of_their_sources() -> None:
    found = DEG_PER_RAD * bounds()
    for k, joint in enumerate(JOINTS):
        for coordinate in ROTATIONS:
            low, high, status = expected_deg(joint, coordinate)
            # printed to three digits
            at = k, COORDINATES.index(coordinate)
            np.testing.assert_allclose(found[at], [low, high], rtol=5e-3, err_msg=joint)
            assert STATUS[joint, coordinate] == status


def test_translations_say_that_they_are_choices() -> None:
    found = bounds()
    lumbar = [joint.count("T") != 2 for joint in JOINTS]
    lowest = np.where(lumbar, -4.5e-3, -3e-3)
    np.testing.assert_allclose(found[:, COORDINATES.index("superior"), 0], lowest, rtol=1e-15)
    np.testing.assert_allclose(found[:, [0, 2], 1], 3e-3, rtol=1e-15)
    assert set(STATUS[:, "anterior"]) | set(STATUS[:, "right"]) == {"choice"}


def test_every_range_is_there_once_in_lines_as_an_editor_shows_them() -> None:
    rows = packaged_rows(BOUNDS_FILE, ENDS)
    assert (rows.index[0], rows.index[-1]) == (2, 1 + 17 * 6)
    assert np.isfinite(bounds()).all()


@pytest.mark.parametrize(("low", "high"), [(-20.0, 8.0), (0.0, 8.0), (-20.0, 0.0)])
def test_a_cohort_s_own_row_takes_the_place_of_that_which_comes_along(
    low: float, high: float
) -> None:
    """Also of a joint that goes one way alone."""
    row = {"joint": "L4L5", "coordinate": "extension", "low": low, "high": high, "source": "film"}
    found = bounds(pd.DataFrame([row], index=[2]))
    np.testing.assert_allclose(DEG_PER_RAD * found[AT], [low, high], rtol=1e-14)
    assert (found != bounds()).any(axis=-1).sum() == 1

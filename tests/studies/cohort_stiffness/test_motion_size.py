"""Motion that no load makes: the unit that explains it is named."""

from math import pi

import pytest

from spinepipe.studies.cohort_stiffness.motion_size import implausible


@pytest.mark.parametrize("slope", [0.2, 0.6, 1.0, 5.0, -3.0, None])
def test_motion_of_a_measured_size_is_left_alone(slope: float | None) -> None:
    """Motion against the load is another fault, and told elsewhere."""
    assert implausible(slope, "extension") == ""


@pytest.mark.parametrize("stiffer", [0.6, 1.0, 1.8])
@pytest.mark.parametrize(
    ("factor", "coordinate", "words"),
    [
        (pi / 180.0, "extension", "radians"),
        (180.0 / pi, "left_rotation", "degrees once more"),
        (1e-3, "right_bending", "N mm"),
        (1e-3, "anterior", "translations in m "),
        (1e3, "extension", "divided by 1000"),
        (1.0 / 25.4, "superior", "inches"),
    ],
)
def test_a_unit_is_named_whatever_the_joint(
    factor: float, coordinate: str, words: str, stiffer: float
) -> None:
    assert words in implausible(factor / stiffer, coordinate)


def test_a_fused_joint_is_no_unit() -> None:
    told = implausible(0.04, "extension")
    assert told.startswith("0.04 times the motion that published stiffness gives")
    assert "no unit explains it" in told

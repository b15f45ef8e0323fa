"""Motion that no load makes: the unit that explains it in all joints is named.

Catches a wrong unit of all motion that is named wrongly or not at all.
"""

from math import pi

from sweeps import sweep

from spinepipe.plausibility.score import implausible, unit_of


@sweep("slope", [0.2, 0.6, 1.0, 5.0, -3.0, None])
def test_motion_of_a_measured_size_is_left_alone(slope: float | None) -> None:
    """Motion against the load is another fault, and told elsewhere."""
    assert implausible(slope) == ""


@sweep(
    "factor, coordinate, words",
    [
        (pi / 180.0, "extension", "radians"),
        (180.0 / pi, "left_rotation", "degrees once more"),
        (1e-3, "right_bending", "N mm"),
        (1e-3, "anterior", "translations in m "),
        (1e3, "extension", "kN m and not N m"),
        (1.0 / 25.4, "superior", "inches"),
    ],
)
def test_a_unit_is_named_whatever_the_joints(factor: float, coordinate: str, words: str) -> None:
    """Joints are half as stiff as published, as stiff, and 1.8 times as stiff."""
    assert words in unit_of([factor / stiffer for stiffer in (0.6, 1.0, 1.8)], coordinate)


def test_a_fused_joint_is_no_unit() -> None:
    """It moves a tenth as far as expected, as moments in lbf in would have all joints do."""
    assert implausible(0.1) == "0.1 times the motion that published stiffness gives"
    assert unit_of([0.1, 0.9, 1.2], "extension") == ""
    assert "lbf in" in unit_of([0.1, 0.12, 0.14], "extension")


def test_no_unit_is_named_for_what_no_unit_makes() -> None:
    assert unit_of([0.045, 0.04], "extension") == ""
    assert unit_of([], "extension") == ""

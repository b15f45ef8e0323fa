"""The numbers of Jalalian et al. 2017, doi 10.1007/s11517-016-1576-8, and forms of claims.

Its Model-1 has tangent laws, its Model-2 linear ones by the scheme of Petit et al. 2004: here
`tangent` and `linear_regions`. The bending films took part in personalising, neutral and traction
did not.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import atanh, sqrt, tanh

from spinepipe.comparison.claim import Claim, Ours, Range, Run, Verdict, exactly

TABLE_1 = (
    ("female", 13, "1A", 49),
    ("female", 15, "1B", 53),
    ("female", 16, "1C", 46),
    ("female", 12, "1C", 48),
    ("female", 13, "2A", 53),
    ("female", 16, "2B", 53),
    ("female", 19, "2C", 48),
    ("female", 14, "2C", 55),
    ("female", 15, "3A", 59),
    ("female", 13, "4C", 86),
    ("female", 12, "5C", 62),
    ("female", 14, "6C", 59),
    ("male", 14, "2A", 59),
    ("male", 19, "2B", 48),
    ("male", 18, "2B", 61),
    ("male", 18, "3B", 46),
    ("male", 14, "3C", 53),
    ("male", 19, "3C", 70),
)
"""Sex, age (years), Lenke class and Cobb angle of the main curve (deg) of patients 1 to 18."""

ROTATION, FERGUSON = "rotation_r", "ferguson_angle"
PLACE, TILT = "location_LOC", "orientation_theta"
BENDING, UNSEEN, OPPOSITE = "bending", "neutral_traction", "opposite_rotating_vertebrae"
TANGENT, LINEAR = "tangent", "linear"

MEASURE = {ROTATION: "rotation", FERGUSON: "ferguson", PLACE: "place", TILT: "tilt"}
UNIT = {ROTATION: "deg", FERGUSON: "deg", PLACE: "mm", TILT: "deg"}
GROUP = {BENDING: "fitted", UNSEEN: "held_out"}
MODEL = {TANGENT: "tangent", LINEAR: "linear_regions"}
"""What the paper's measures, positions and models are called here."""

FILMS = {"fitted": "bending films (fitted)", "held_out": "neutral and traction films (held out)"}


@dataclass(frozen=True)
class Printed:
    """A printed error.

    Attributes
    ----------
    value : None where a figure alone has it. sd : over patients, or over vertebrae.
    """

    value: float | None
    where: str
    sd: float | None = None


ERRORS: Mapping[tuple[str, str, str], Printed] = {
    (BENDING, ROTATION, TANGENT): Printed(1.44, "section 3.1"),
    (BENDING, ROTATION, LINEAR): Printed(2.59, "section 3.1"),
    (UNSEEN, ROTATION, TANGENT): Printed(1.30, "section 3.1"),
    (UNSEEN, ROTATION, LINEAR): Printed(2.15, "section 3.1"),
    (BENDING, FERGUSON, TANGENT): Printed(1.0, "section 3.2"),
    (BENDING, FERGUSON, LINEAR): Printed(3.0, "section 3.2"),
    (BENDING, PLACE, TANGENT): Printed(0.83, "section 3.2, Fig 3", 0.42),
    (BENDING, TILT, TANGENT): Printed(1.38, "section 3.2, Fig 3", 0.39),
    (UNSEEN, PLACE, TANGENT): Printed(0.75, "section 3.2, Fig 4", 0.33),
    (UNSEEN, TILT, TANGENT): Printed(1.25, "section 3.2, Fig 4", 0.37),
    (BENDING, PLACE, LINEAR): Printed(None, "Fig 3"),
    (BENDING, TILT, LINEAR): Printed(None, "Fig 3"),
    (UNSEEN, PLACE, LINEAR): Printed(None, "Fig 4"),
    (UNSEEN, TILT, LINEAR): Printed(None, "Fig 4"),
    (OPPOSITE, ROTATION, TANGENT): Printed(1.31, "section 4", 0.91),
    (OPPOSITE, ROTATION, LINEAR): Printed(2.65, "section 4", 1.72),
}
"""By positions, quantity and model. Of rotations and Ferguson angles these are root mean squares
over everything, of places and tilts means over patients of such."""

EXAMPLE = {"left": 1.5, "right": 4.0}
"""Ferguson errors of the two spines of Fig 6, deg."""

EXAMPLE_SMALLER_PERCENT = 20.0

REDUCTION = {
    (ROTATION, "four_positions"): 44.0,
    (ROTATION, BENDING): 44.0,
    (ROTATION, UNSEEN): 40.0,
    (PLACE, "four_positions"): 55.0,
    (TILT, "four_positions"): 39.0,
    (ROTATION, OPPOSITE): 51.0,
    (FERGUSON, "fig6_example"): 63.0,
}
"""By how much less the tangent's error is than the linear one's, %."""

FERGUSON_REDUCTION = {"abstract": 67.0, "section_4": 66.0}
"""Of Ferguson angles, all four positions, %: two numbers are printed."""

REDUCTION_BY_RANGE = {"below_0.2": 46.0, "0.2_to_0.8": 32.0, "0.8_to_1": 45.0}
"""Of rotations by their share of the published end, all positions (section 4, Fig 7), %."""

ENLARGEMENT = 1.2
ENLARGEMENTS_TESTED = (0, 10, 20, 30, 40)
BEST_ENLARGEMENT = 20
"""Percent, by the smallest error of the laws (Appendix)."""

PATIENTS, SEGMENTS, DISPLACEMENTS = 18, 14, 504
LARGEST_MOMENT_NM, COVERED_PERCENT = 63.0, 99.0


def error(positions: str, quantity: str, model: str) -> float:
    """An error that is printed as a number."""
    value = ERRORS[positions, quantity, model].value
    assert value is not None, "a figure alone has it"
    return value


def printed_reduction(positions: str, quantity: str) -> float:
    """By how much less the tangent's printed error is than the linear one's, %."""
    tangent, linear = (error(positions, quantity, model) for model in (TANGENT, LINEAR))
    return 100.0 * (1.0 - tangent / linear)


def implied(positions: str, quantity: str) -> float:
    """J4: error of the linear model, of which the tangent's and the average reduction are told."""
    reduction = REDUCTION[quantity, "four_positions"]
    return error(positions, quantity, TANGENT) / (1.0 - reduction / 100.0)


YES_NO = "1: yes, 0: no"

PHANTOM = "phantom: says nothing of the patients"
OTHER_TRUTH = (
    "the phantom's segments obey another law (exponential and stop) of made-up size, under "
    "made-up forces"
)


def window(value: float) -> Range:
    """Half to twice a number of patients that are not ours."""
    what = f"half to twice {value:.3g}, a window chosen here; inside it is no agreement"
    return Range(value / 2.0, value * 2.0, what, chosen=True)


def window_of_percent(value: float) -> Range:
    """The same of a reduction, of which no more than all is possible."""
    half_to_twice = window(value)
    return Range(half_to_twice.low, min(2.0 * value, 100.0), half_to_twice.what, True)


def spread(value: float, sd: float) -> Range:
    """A mean over patients that are not ours, less and plus their SD."""
    what = "the paper's mean less and plus its SD over patients; inside it is no agreement"
    return Range(value - sd, value + sd, what)


def rounded(value: float, unit_of_last_digit: float) -> Range:
    """What rounds to a printed number."""
    half = unit_of_last_digit / 2.0
    return Range(value - half, value + half, "what rounds to the printed number")


def nearly(value: float, to: float = 1e-9) -> Range:
    """A number that arithmetic gives but for rounding."""
    return Range(value - to, value + to, f"the paper's value to {to:g}")


def correlation(r: float, n: int) -> Range:
    """95 % interval of a correlation of n pairs (Fisher)."""
    reach = 1.96 / sqrt(n - 3)
    what = f"95 % interval of the paper's {r:g}, of {n} pairs if every tilt was one"
    return Range(tanh(atanh(r) - reach), tanh(atanh(r) + reach), what)


def put_in(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float,
    ours: Callable[[Run], Ours],
    allowed: Range | None = None,
    outside: str = "this cohort or study is not as the paper's",
) -> Claim:
    """What the cohort or the study was made to have; without a range it has it exactly."""
    return Claim(
        key,
        where,
        quantity,
        unit,
        paper,
        allowed or exactly(paper),
        ours,
        outside,
        evidence=Verdict.CIRCULAR,
    )


def recomputed(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    allowed: Range,
    ours: float,
    note: str,
) -> Claim:
    """What the paper's other numbers or formulas give."""
    return Claim(
        f"closed_form.{key}",
        where,
        quantity,
        unit,
        paper,
        allowed,
        lambda run: Ours(ours),
        "the formula does not give the printed number",
        note,
        evidence=Verdict.RECOMPUTED,
    )


def contradicted(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float,
    ours: float,
    reason: str,
) -> Claim:
    """What the paper's other numbers or formulas exclude."""
    return Claim(
        key,
        where,
        quantity,
        unit,
        paper,
        Range(paper, paper, "the paper's value itself"),
        lambda run: Ours(ours),
        "",
        note="ours: from the paper's other numbers and formulas",
        contradicted=reason,
    )

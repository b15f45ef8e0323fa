"""What the paper's numbers and formulas say of each other: consistency checks J1 to J12.

Formulas are asked of the functions that this study uses, not written down again.
"""

from collections.abc import Iterator
from math import pi, sqrt

import numpy as np

from spinepipe.comparison.claim import Claim, Range
from spinepipe.effects.bounded_tangent import BoundedTangent
from spinepipe.effects.contract import Array
from spinepipe.studies.scoliosis.jalalian_2017.paper import (
    BENDING,
    COVERED_PERCENT,
    DISPLACEMENTS,
    ENLARGEMENT,
    EXAMPLE,
    FERGUSON,
    FERGUSON_REDUCTION,
    FILMS,
    GROUP,
    LARGEST_MOMENT_NM,
    LINEAR,
    MEASURE,
    OPPOSITE,
    PATIENTS,
    PLACE,
    REDUCTION,
    ROTATION,
    SEGMENTS,
    TABLE_1,
    TANGENT,
    TILT,
    UNIT,
    UNSEEN,
    YES_NO,
    contradicted,
    error,
    implied,
    nearly,
    printed_reduction,
    recomputed,
    rounded,
)
from spinepipe.studies.scoliosis.tangent_laws import Laws, Pairs, characterise, ends_of
from spinepipe.units import COORDINATES

_BENDING = COORDINATES.index("right_bending")

_TWO = Pairs(
    right=np.deg2rad([4.0, 3.0]),
    left=np.deg2rad([-3.0, -5.0]),
    arm_right=np.array([0.30, 0.15]),
    arm_left=np.array([0.28, 0.16]),
    apex=0,
)
"""Two made-up segments that turn with the bend, with other ends to the left and to the right."""

_EVEN = Pairs(np.array([0.1]), np.array([-0.1]), np.array([0.3]), np.array([0.3]), 0)
"""A segment that bends as far to the left as to the right."""

_TENFOLD = 10.0


def claims_of_own_numbers() -> Iterator[Claim]:
    """The checks in their order."""
    yield from _cohort()
    yield from _reductions()
    yield from _linear_model()
    yield from _shape()
    yield from _forces()
    yield from _ends_of_the_law()
    yield from _counts()


def _cohort() -> Iterator[Claim]:
    ages, cobbs = (np.array([row[at] for row in TABLE_1], dtype=float) for at in (1, 3))
    for key, what, unit, paper, ours in (
        ("age_mean", "mean age", "years", 15.0, ages.mean()),
        ("cobb_mean", "mean Cobb angle", "deg", 56.0, cobbs.mean()),
        ("cobb_median", "median Cobb angle", "deg", 53.0, np.median(cobbs)),
    ):
        allowed, where = rounded(paper, 1.0), "section 2.1, Table 1"
        yield recomputed(
            f"J1.{key}", where, what, unit, paper, allowed, float(ours), "J1: from Table 1"
        )


def _reductions() -> Iterator[Claim]:
    """J2, J3 and J12, and the example of Fig 6."""
    pooled = {
        model: sqrt(sum(error(one, ROTATION, model) ** 2 for one in (BENDING, UNSEEN)) / 2.0)
        for model in (TANGENT, LINEAR)
    }
    all_four = 100.0 * (1.0 - pooled[TANGENT] / pooled[LINEAR])
    for check, positions in (("J2", BENDING), ("J2", UNSEEN), ("J12", OPPOSITE)):
        yield _reduction(check, positions, ROTATION, REDUCTION[ROTATION, positions])
    yield contradicted(
        "improvement.rotation_r.four_positions",
        "abstract",
        "reduction of the error of rotations, four positions",
        "%",
        REDUCTION[ROTATION, "four_positions"],
        all_four,
        f"J2: the errors of section 3.1, pooled, give {all_four:.1f}; the abstract's number is "
        "that of the bending positions",
    )
    ferguson = printed_reduction(BENDING, FERGUSON)
    for where, paper in FERGUSON_REDUCTION.items():
        yield contradicted(
            f"improvement.ferguson_angle.four_positions.{where}",
            where.replace("_", " "),
            "reduction of the error of Ferguson angles, four positions",
            "%",
            paper,
            ferguson,
            "J3: 67 and 66 are printed for one number, and the only errors printed, 1 and 3 deg, "
            f"are of the bending positions, {ferguson:.1f}",
        )
    fig6 = REDUCTION[FERGUSON, "fig6_example"]
    yield recomputed(
        "improvement.ferguson_angle.fig6_example",
        "section 4, Fig 6",
        "reduction of the Ferguson error from the right to the left spine",
        "%",
        fig6,
        rounded(fig6, 1.0),
        100.0 * (1.0 - EXAMPLE["left"] / EXAMPLE["right"]),
        f"{EXAMPLE['left']:g} of {EXAMPLE['right']:g} deg",
    )


def _words(positions: str) -> str:
    return FILMS[GROUP[positions]] if positions in GROUP else "segments that turn against the bend"


def _reduction(check: str, positions: str, quantity: str, paper: float) -> Claim:
    tangent, linear = (error(positions, quantity, model) for model in (TANGENT, LINEAR))
    return recomputed(
        f"{check}.{positions}",
        "sections 3.1, 4",
        f"reduction of the error of rotations, {_words(positions)}",
        "%",
        paper,
        rounded(paper, 1.0),
        printed_reduction(positions, quantity),
        f"{check}: {tangent:g} of {linear:g} deg",
    )


def _linear_model() -> Iterator[Claim]:
    """J4: errors of the linear model, of which figures alone are printed."""
    for positions in (BENDING, UNSEEN):
        for quantity in (PLACE, TILT):
            reduction, tangent = (
                REDUCTION[quantity, "four_positions"],
                error(positions, quantity, TANGENT),
            )
            ends = [
                (tangent + 0.005 * way) / (1.0 - (reduction + 0.5 * way) / 100.0)
                for way in (-1.0, 1.0)
            ]
            yield recomputed(
                f"J4.{positions}.{quantity}",
                "section 3.2",
                f"{MEASURE[quantity]} error of the linear model, {_words(positions)}",
                UNIT[quantity],
                None,
                Range(ends[0], ends[1], "what the rounding of both numbers leaves"),
                implied(positions, quantity),
                f"J4: {tangent:g} is {reduction:g} % less, if the average holds of each pair of "
                "positions",
            )


def _shape() -> Iterator[Claim]:
    """J5 and J6: where the films lie on the law, and how much stiffer it is there."""
    ends = ends_of(_EVEN, ENLARGEMENT)
    share = float(_EVEN.right[0] / ends.upper[0])
    yield recomputed(
        "J5",
        "sections 2.3, 3.1",
        "rotation on a bending film over the end",
        "ratio",
        0.8,
        Range(0.8, 1.0, "more than the paper's bound, and no more than the end"),
        share,
        f"J5: 1 / {ENLARGEMENT:g}; of a segment that turns against a bend, on one film alone",
    )
    load = float(ends.load(_EVEN.right)[0])
    slope = _law(0.0, float(ends.lower[0]), float(ends.upper[0]))[1]
    tan_75 = 2.0 + sqrt(3.0)
    for key, what, closed, ours in (
        ("J6.load", "moment over A on a bending film, equal ends", tan_75, load),
        (
            "J6.secant",
            "secant over initial stiffness on a bending film, equal ends",
            tan_75 * 2.0 * ENLARGEMENT / pi,
            load / float(_EVEN.right[0]) / slope,
        ),
    ):
        allowed = nearly(closed, 1e-9)
        told = Range(allowed.low, allowed.high, f"tan 75 deg in closed form: {closed:.4g}")
        yield recomputed(key, "Eq 1", what, "ratio", None, told, ours, "J6: a derived expectation")


def _law(turn: float, lower: float, upper: float) -> tuple[float, float]:
    """Moment over A and its slope (1/rad) at a turn, between two ends, rad."""
    q = np.zeros((1, 6))
    q[0, _BENDING] = turn
    found = BoundedTangent().respond(q, np.array([[1.0, lower, upper]]), q)
    return float(found.load[0, _BENDING]), float(found.tangent[0, _BENDING, _BENDING])


def _forces() -> Iterator[Claim]:
    """J7: what grows with both forces, and what does not."""
    small, large = (
        characterise(_TWO, ends_of(_TWO, ENLARGEMENT), moment)
        for moment in (LARGEST_MOMENT_NM / _TENFOLD, LARGEST_MOMENT_NM)
    )
    in_r = large.rmse / small.rmse
    in_tau = _rmse_of_moments(large) / _rmse_of_moments(small)
    for key, what, expected, ours in (
        ("r_rmse", "error in rotation", 1.0, in_r),
        ("tau_rmse", "error in moment", _TENFOLD, in_tau),
        ("A", "A", _TENFOLD, float(large.stretch[0] / small.stretch[0])),
    ):
        yield recomputed(
            f"J7.{key}",
            "Eq 5",
            f"{what} when both forces are ten times as large, over what it was",
            "ratio",
            None,
            Range(expected - 1e-6, expected + 1e-6, f"{expected:g}, as scaling has it"),
            ours,
            "J7: two made-up segments; it holds for any",
        )
    yield contradicted(
        "equations.A_selection.unique",
        "Eq 5",
        "Eq 5 decides the size of A",
        YES_NO,
        1.0,
        float(abs(in_r - 1.0) > 1e-6),
        f"J7: with both forces ten times as large the error in moment is {in_tau:.3g} times as "
        f"large, so it is least at no force; the error in rotation is {in_r:.3g} times as large, "
        "so it decides the ratio of the forces alone",
    )


def _rmse_of_moments(laws: Laws) -> float:
    """Sum over segments of the root mean square of moment of the law less that of the force."""
    pairs = (
        (_TWO.right, laws.force_right_n * _TWO.arm_right),
        (_TWO.left, -laws.force_left_n * _TWO.arm_left),
    )
    errors: list[Array] = [laws.stretch * laws.shape.load(r) - moment for r, moment in pairs]
    return float(np.sqrt(np.mean(np.square(errors), axis=0)).sum())


def _ends_of_the_law() -> Iterator[Claim]:
    """J8 and J9, and Eqs 2 and 3."""
    tight = ends_of(_EVEN, 1.0)
    at_film = _law(float(_EVEN.right[0]), float(tight.lower[0]), float(tight.upper[0]))[0]
    yield contradicted(
        "results.enlargements_tested.finite_at_0",
        "Appendix, Fig 8",
        "the error in moment is a number with 0 % enlargement",
        YES_NO,
        1.0,
        float(np.isfinite(at_film)),
        "J8: the films then lie on the ends, where the moment is infinite; an error is plotted "
        "all the same, which can be one in rotation alone",
    )
    ends = ends_of(_TWO, ENLARGEMENT)
    lower, upper = float(ends.lower[0]), float(ends.upper[0])
    finite = sum(np.isfinite(_law(end, lower, upper)[0]) for end in (lower, upper))
    yield contradicted(
        "equations.tangent",
        "Eq 1",
        "ends that belong to the law: -pi/2 <= B r + C <= pi/2",
        "count",
        2.0,
        float(finite),
        "J9: the moment is infinite at both; < is meant",
    )
    b, c = (float(one[0]) for one in ends.shape)
    for key, where, what, paper, ours in (
        ("B", "Eq 2", "B r + C at the upper end", 0.5 * pi, b * upper + c),
        ("C", "Eq 2", "B r + C at the lower end", -0.5 * pi, b * lower + c),
        ("D", "Eq 3", "moment over A at r = 0", 0.0, _law(0.0, lower, upper)[0]),
    ):
        note = "of a made-up segment whose ends differ"
        yield recomputed(f"{key}", where, what, "", paper, nearly(paper), ours, note)


def _counts() -> Iterator[Claim]:
    """J10 and J11."""
    names = ("L4", "L3", "L2", "L1", *(f"T{number}" for number in range(12, 1, -1)))
    segments = len(names) - 1
    for key, what, paper, ours in (
        ("segments", "motion segments from L4 to T2", SEGMENTS, segments),
        (
            "displacements",
            "segments, two positions, patients",
            DISPLACEMENTS,
            segments * 2 * PATIENTS,
        ),
    ):
        yield recomputed(
            f"J10.{key}",
            "Eq 5, section 3.1",
            what,
            "count",
            float(paper),
            nearly(float(paper)),
            float(ours),
            "J10: counted",
        )
    sds = 1.0 / sqrt(1.0 - COVERED_PERCENT / 100.0)
    yield recomputed(
        "J11",
        "section 2.3",
        f"SD above the mean within which Chebyshev's theorem has {COVERED_PERCENT:g} %",
        "SD",
        None,
        nearly(10.0),
        sds,
        f"J11: {LARGEST_MOMENT_NM:g} N m must then be the mean and ten SD; neither is printed",
    )

"""The numbers of Jalalian 2017, entered a second time, and what they are allowed to be off by.

Ranges follow from how a number is printed: what rounds to it, its SD, half to twice of it.

Would catch a number of the paper that was entered wrongly, or a range wider than its print allows.
"""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest
from sweeps import sweep

from papers.engine import Claim, claims_of, judge
from papers.run import Run

CLAIMS = claims_of("jalalian_2017")
BY_ID = {claim.id: claim for claim in CLAIMS}

COUNTED = {
    "results.n_patients": 18,
    "results.n_patients.female": 12,
    "results.n_patients.male": 6,
    "results.xrays_per_patient": 5,
    "results.levels_measured.vertebrae": 15,
    "results.levels_measured.segments": 14,
    "results.n_motion_segments": 14,
    "results.observers": 2,
    "results.observers.repeats": 3,
    "results.intra_observer_reliability_1": 0.95,
    "results.intra_observer_reliability_1.spread": 0.03,
    "results.intra_observer_reliability_2": 0.92,
    "results.intra_observer_reliability_2.spread": 0.02,
    "results.range_enlargement": 1.2,
    **{f"results.enlargements_tested.{percent}": percent for percent in (0, 10, 20, 30, 40)},
    "results.enlargements_tested.best_of_laws": 20,
    "results.enlargements_tested.best_of_poses": 20,
    "results.moment_upper_bound": 63,
    "equations.A_selection": 63,
    "results.moment_coverage": 99,
    "results.joint_type": 3,
    "results.n_displacements_per_position_pair.bending": 504,
    "results.n_displacements_per_position_pair.neutral_traction": 504,
    "errors.fig6_example_left_spine.ferguson_angle.example": 1.5,
    "errors.fig6_example_right_spine.ferguson_angle.example": 4,
    "errors.fig6_example.smaller_by": 20,
    "improvement.rotation_r.four_positions": 44,
    "improvement.ferguson_angle.four_positions.abstract": 67,
    "improvement.ferguson_angle.four_positions.section_4": 66,
    "equations.A_selection.unique": 1,
    "results.enlargements_tested.finite_at_0": 1,
    "equations.tangent": 2,
}
"""Nothing else is allowed than the number itself."""

ROUNDED = {
    **{"results.age": 15, "results.age.low": 12, "results.age.high": 19},
    **{"results.cobb_mean": 56, "results.cobb_mean.low": 46, "results.cobb_mean.high": 86},
    "results.cobb_median": 53,
    **{"closed_form.J1.age_mean": 15, "closed_form.J1.cobb_mean": 56},
    "closed_form.J1.cobb_median": 53,
    **{"closed_form.J2.bending": 44, "closed_form.J2.neutral_traction": 40},
    "closed_form.J12.opposite_rotating_vertebrae": 51,
    "closed_form.improvement.ferguson_angle.fig6_example": 63,
}
"""What rounds to a whole number."""

JUST = {
    **dict.fromkeys(("equations.asymptote_right", "equations.asymptote_left"), (1.2, 1e-9)),
    "equations.asymptote_if_opposite": (1.2, 1e-9),
    **dict.fromkeys(("results.pixel_size", "results.theta_step"), (0.1, 1e-6)),
    **dict.fromkeys(("results.imposed_motion.place", "results.imposed_motion.tilt"), (0, 1e-6)),
    **{"results.origin_frame": (0, 1e-9), "closed_form.D": (0, 1e-9)},
    **{"closed_form.B": (np.pi / 2, 1e-9), "closed_form.C": (-np.pi / 2, 1e-9)},
    **{"closed_form.J10.segments": (14, 1e-9), "closed_form.J10.displacements": (504, 1e-9)},
}
"""Numbers, and what arithmetic leaves."""

REDUCTIONS = {
    **{"improvement.rotation_r.bending": 44, "improvement.rotation_r.neutral_traction": 40},
    "improvement.location_LOC.four_positions": 55,
    "improvement.orientation_theta.four_positions": 39,
    **{
        f"improvement.rotation_r.{part}.{films}": percent
        for part, percent in (
            *(("all.below_0.2", 46), ("all.0.2_to_0.8", 32), ("all.0.8_to_1", 45)),
            ("opposite_rotating_vertebrae", 51),
        )
        for films in ("fitted", "held_out")
    },
}
"""Half to twice, and no more than all."""


def ends(name: str) -> tuple[Any, ...]:
    claim = BY_ID[name]
    return claim.printed, claim.range.low, claim.range.high


def unprinted(name: str) -> tuple[Any, ...]:
    """What is allowed of a number that the paper does not print."""
    paper, *allowed = ends(name)
    assert paper is None
    return tuple(allowed)


@sweep("name, value", list(COUNTED.items()))
def test_what_is_counted_or_stated(name: str, value: float) -> None:
    assert ends(name) == (value, value, value)


@sweep("name, value", list(ROUNDED.items()))
def test_what_is_printed_in_whole_numbers(name: str, value: float) -> None:
    assert ends(name) == (value, value - 0.5, value + 0.5)


@sweep("name, value, to", [(n, *two) for n, two in JUST.items()])
def test_what_arithmetic_gives(name: str, value: float, to: float) -> None:
    assert ends(name) == pytest.approx((value, value - to, value + to), rel=1e-15, abs=1e-15)


@sweep("name, value", list(REDUCTIONS.items()))
def test_what_one_model_is_better_by(name: str, value: float) -> None:
    assert ends(name) == (value, value / 2, min(2 * value, 100))


ERRORS = [
    *(("bending.rotation_r.tangent", 1.44, None), ("bending.rotation_r.linear", 2.59, None)),
    ("neutral_traction.rotation_r.tangent", 1.30, None),
    ("neutral_traction.rotation_r.linear", 2.15, None),
    *(("bending.ferguson_angle.tangent", 1, None), ("bending.ferguson_angle.linear", 3, None)),
    ("bending.location_LOC.tangent", 0.83, 0.42),
    ("bending.orientation_theta.tangent", 1.38, 0.39),
    ("neutral_traction.location_LOC.tangent", 0.75, 0.33),
    ("neutral_traction.orientation_theta.tangent", 1.25, 0.37),
]


@sweep("name, mean, sd", ERRORS)
def test_errors_are_held_against_their_spread_or_half_to_twice(
    name: str, mean: float, sd: float | None
) -> None:
    low, high = (mean / 2, mean * 2) if sd is None else (mean - sd, mean + sd)
    assert ends(f"errors.{name}") == pytest.approx((mean, low, high))
    if sd is not None:
        assert ends(f"errors.{name}.sd") == (sd, sd / 2, sd * 2)


@sweep("model, mean, sd", [("tangent", 1.31, 0.91), ("linear", 2.65, 1.72)])
@sweep("films", ["fitted", "held_out"])
def test_errors_against_the_bend(model: str, mean: float, sd: float, films: str) -> None:
    """Of which the paper's SD is over vertebrae: the window is half to twice."""
    name = f"errors.opposite_rotating_vertebrae.rotation_r.{model}.{films}"
    assert ends(name) == (mean, mean / 2, mean * 2)
    assert ends(f"{name}.sd") == (sd, sd / 2, sd * 2)


@sweep(
    "name, tangent, less",
    [
        ("bending.location_LOC", 0.83, 55),
        ("bending.orientation_theta", 1.38, 39),
        ("neutral_traction.location_LOC", 0.75, 55),
        ("neutral_traction.orientation_theta", 1.25, 39),
    ],
)
def test_what_figures_alone_show_is_about_what_the_reductions_leave(
    name: str, tangent: float, less: float
) -> None:
    about = tangent / (1 - less / 100)
    assert unprinted(f"errors.{name}.linear") == pytest.approx((about / 2, about * 2))
    low, high = (
        (tangent - 0.005) / (1 - (less - 0.5) / 100),
        (tangent + 0.005) / (1 - (less + 0.5) / 100),
    )
    assert unprinted(f"closed_form.J4.{name}") == pytest.approx((low, high))


def test_what_has_ends_of_its_own() -> None:
    assert ends("results.ais_prevalence") == (None, 2, 3)
    assert ends("results.acceptable_ferguson_error") == (5, None, 5)
    assert ends("results.bending_displacement_fraction_of_R") == (0.8, 0.8, 1.0)
    assert ends("closed_form.J5") == (0.8, 0.8, 1.0)
    assert ends("equations.A") == (None, None, None)
    half_to_all = (100 / 3, 100)  # of 1 - 1 / 3
    assert unprinted("improvement.ferguson_angle.bending") == pytest.approx(half_to_all)
    tan_75 = 2 + np.sqrt(3)
    for name, value, to in (
        ("J6.load", tan_75, 1e-9),
        ("J6.secant", tan_75 * 2.4 / np.pi, 1e-9),
        *(("J7.r_rmse", 1, 1e-6), ("J7.tau_rmse", 10, 1e-6), ("J7.A", 10, 1e-6)),
        ("J11", 10, 1e-9),
    ):
        found = unprinted(f"closed_form.{name}")
        assert found == pytest.approx((value - to, value + to), rel=1e-12)


def test_shares_and_correlations_have_the_interval_of_their_counts() -> None:
    """Clopper and Pearson's of 388 of 504, and Fisher's of 18 x 5 x 14 pairs."""
    known = binomtest(388, 504).proportion_ci(0.95)
    found = ends("results.vertebrae_below_0.8R_neutral_traction")
    assert found[0] == 77
    assert found[1:] == pytest.approx((100 * known.low, 100 * known.high), abs=0.3)
    reach = 1.96 / np.sqrt(18 * 5 * 14 - 3)
    expected = np.tanh(np.arctanh(0.90) + reach * np.array([-1, 1]))
    found = ends("results.inter_observer_reliability")
    assert found == pytest.approx((0.9, *expected))


def test_every_number_is_entered_here_or_in_the_table_of_patients() -> None:
    """But for parts of the paper that another test of this file has by rule."""
    here = {*COUNTED, *ROUNDED, *JUST, *REDUCTIONS}
    by_rule = ("table_1.", "errors.", "closed_form.J")
    own = {"ais_prevalence", "acceptable_ferguson_error", "bending_displacement_fraction_of_R"}
    own |= {"vertebrae_below_0.8R_neutral_traction", "inter_observer_reliability"}
    others = [n for n in BY_ID if n not in here and not n.startswith(by_rule)]
    assert {name.split(".", 1)[1] for name in others} == own | {"A", "ferguson_angle.bending"}


def ours_of(claim: Claim, **tables: pd.DataFrame) -> dict[str, Any]:
    return judge(claim, Run(tables, {}))


@sweep("name, ours", [("B", np.pi / 2), ("C", -np.pi / 2), ("D", 0.0), ("J10.segments", 14)])
def test_formulas_give_what_is_printed(name: str, ours: float) -> None:
    row = ours_of(BY_ID[f"closed_form.{name}"])
    assert row["ours"] == pytest.approx(ours, abs=1e-12)
    assert row["verdict"] == "recomputed"


@sweep("key, ours", [("age_mean", 274 / 18), ("cobb_median", 53)])
def test_ages_and_angles_of_table_1(key: str, ours: float) -> None:
    assert ours_of(BY_ID[f"closed_form.J1.{key}"])["ours"] == pytest.approx(ours)


def test_classes_of_a_range_are_pooled_by_their_counts() -> None:
    """3 rotations off by 1 deg with the bend and 1 off by 3 against it: a mean square of 3."""
    where = {"films": "fitted", "range": "below_0.2"}
    rows = [
        {**where, "opposite": opposite, "model": model, "n": n, "rmse_deg": rmse * times}
        for model, times in (("tangent", 1.0), ("linear_regions", 4.0))
        for opposite, n, rmse in ((False, 3, 1.0), (True, 1, 3.0))
    ]
    rows[2]["rmse_deg"] = rows[3]["rmse_deg"] = 4.0
    row = ours_of(BY_ID["improvement.rotation_r.all.below_0.2.fitted"], by_range=pd.DataFrame(rows))
    assert row["ours"] == pytest.approx(100 * (1 - np.sqrt(3) / 4))
    assert "4 rotations" in row["reason"]

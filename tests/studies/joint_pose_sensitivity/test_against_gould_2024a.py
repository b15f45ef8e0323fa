"""The comparison with Gould et al. 2024: verdicts, contradicted numbers, missing parts.

Expected values are worked by hand from the small invented tables below, by formulas written out
here, or taken from the list of consistency checks of the paper.
"""

import csv
from functools import cache
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from study_cases import TABLES
from sweeps import sweep

from papers.engine import Claim, Evidence, claims_of, judge, judged
from papers.ranges import Range, binomial, normal_iqr, spearman_interval, spearman_threshold
from papers.run import NotComputed, Ours, Run
from spinepipe.anatomy import published
from spinepipe.studies.joint_pose_sensitivity import against_gould_2024a
from spinepipe.studies.joint_pose_sensitivity.landmark_precision import required_precision
from spinepipe.studies.joint_pose_sensitivity.tables import AGAINST_GOULD_2024A
from spinepipe.tables import from_rows, read, read_frame

CLAIMS = claims_of("gould_2024a")
ROOT = Path(__file__).parents[3]
CHECKS = ROOT.parent / "shared" / "published" / "consistency-checks.csv"

NOT_APPLICABLE = {"A35": "posterior ligaments intact or removed: two sentences, no number"}
"""Contradictions of the paper that are not about a number of ours."""

ALSO_CONTRADICTED = ("A19", "A27", "A28", "A30")
"""Checks whose verdict is worded otherwise: a copied column, opposite signs, a misprint."""

EMPTY_RUN = Run({})
ASKED = {"failed_when": "all"}
"""The settings that claims look at."""


# --- invented tables -----------------------------------------------------------------------------

SPREAD = {"low_quartile": 1.0, "median": 2.0, "high_quartile": 4.0, "iqr": 3.0}
ENDS = {"minimum": 0.5, "maximum": 9.0, "range": 8.5}
JOINTS = ("L1L2", "L2L3", "L3L4")
FITTED = ("anterior", "superior", "extension")


def frame(table: str, rows: list[dict[str, Any]]) -> pd.DataFrame:
    """Rows with all columns of a table, read as from a file; what is not given is empty."""
    columns = TABLES[table].columns
    whole = [dict.fromkeys(c.name for c in columns) | {"specimen": "s01"} | row for row in rows]
    kinds = {c.name: "float" for c in columns if c.type == "number"}
    return pd.DataFrame(whole, columns=[c.name for c in columns]).astype(kinds)


def summary() -> pd.DataFrame:
    """Every row that is looked up, with the same numbers."""
    places = [("poses", "equilibrium", dataset) for dataset in ("all", "reduced", "best")]
    places += [
        (f"{name}_bootstrap", loading, dataset)
        for name in ("start", "damping")
        for loading in ("equilibrium", "quasi_static", "dynamic")
        for dataset in ("all", "reduced")
    ]
    things = [("stiffness", "*", name) for name in FITTED]
    things += [("error", joint, name) for joint in JOINTS for name in FITTED]
    things += [
        (quantity, joint, name)
        for joint in JOINTS
        for quantity, names in (
            ("origin", ("anterior", "superior", "right")),
            ("orientation", ("extension", "right_bending", "left_rotation")),
        )
        for name in names
    ]
    keys = ("part", "loading", "dataset", "quantity", "joint", "coordinate")
    rows = [
        dict(zip(keys, (*place, *thing), strict=True))
        | {"unit": "", "n": 5, "percent_of_measured": 30.0}
        | SPREAD
        | ENDS
        for place in places
        for thing in things
    ]
    return frame("summary", rows)


def with_cell(table: pd.DataFrame, column: str, value: object, **where: object) -> pd.DataFrame:
    """A copy with one column changed in the rows that have the given values."""
    chosen = pd.Series(True, index=table.index)
    for name, wanted in where.items():
        chosen &= table[name] == wanted
    assert chosen.any()
    changed = table.copy()
    changed.loc[chosen, column] = value
    return changed


def counts() -> pd.DataFrame:
    """All fits solved; 380 of 500 have one stiffness at its start, none has all."""
    numbers = {"solved": 500, "near_start_any": 380, "near_start_all": 0, "outliers": 1}
    parts = ("poses", "equilibrium"), ("start_bootstrap", "quasi_static")
    rows = [
        {"part": part, "loading": loading, "fits": 500, "reduced": 119} | numbers
        for part, loading in parts
    ]
    return frame("counts", rows)


def outcome(family: str, test: str, joint: str, response: str, factor: str, **more: Any) -> Any:
    key = {"family": family, "test": test, "joint": joint, "response": response, "factor": factor}
    ended = {"stratum": "", "n": 10, "status": "done", "message": "", "family_size": 3}
    return key | ended | more


def statistics() -> pd.DataFrame:
    """A few tests of every family."""
    own = "error against stiffness"
    cell = "two-factor: anterior_error at L2L3 against stiffness"
    poses = ("0", "1", "2")
    rows = [
        outcome(own, "Spearman", "*", "anterior_error", "anterior_stiffness", effect=0.4, p=0.01),
        outcome(own, "Spearman", "*", "superior_error", "anterior_stiffness", effect=0.6, p=0.01),
        outcome("friedman", "Friedman", "L2L3", "anterior_error", "pose", p=0.04, p_bonferroni=0.1),
        outcome("normality", "chi_squared", "*", "L2L3_anterior_origin", "", p=0.01),
        outcome("normality", "chi_squared", "*", "L3L4_anterior_origin", "", p=0.20),
    ]
    rows += [
        outcome(
            cell,
            "spearman",
            "L2L3",
            "anterior_error",
            "anterior_stiffness",
            effect=effect,
            p=p,
            p_bonferroni=3.0 * p,
            stratum=stratum,
        )
        for stratum, effect, p in zip(poses, (-0.96, -0.98, 0.3), (0.001, 0.002, 0.4), strict=True)
    ]
    return frame("statistics", rows)


def tables() -> dict[str, pd.DataFrame]:
    """A complete small set."""
    fit = {
        "joint": "*",
        "anterior_n_per_m": 12000.0,
        "superior_n_per_m": 430000.0,
        "extension_nm_per_rad": 15.0,
    }
    best = {"stiffness": "calibrated", "pose": 1, "step": 1, "test": "flexion"}
    grid = {"joint": "L2L3", "coordinate": "anterior"}
    return {
        "summary": summary(),
        "counts": counts(),
        "statistics": statistics(),
        "calibrations": frame(
            "calibrations", [fit | {"pose": 0, "cost": 0.1}, fit | {"pose": 1, "cost": 0.2}]
        ),
        "success": frame("success", [{"pose": 0, "reduced": False}, {"pose": 1, "reduced": True}]),
        "simulations": frame(
            "simulations",
            [
                best | {"joint": "L1L2", "predicted_superior_mm": -0.148},
                best | {"joint": "L2L3", "error_anterior_mm": 0.01, "measured_anterior_mm": 0.4},
                best | {"joint": "L3L4", "error_anterior_mm": -0.05, "measured_anterior_mm": 0.5},
            ],
        ),
        "importance": frame(
            "importance",
            [
                grid | {"factor": "pose", "importance": 0.5, "leaves": 4, "r2": 0.3},
                grid | {"factor": "pose", "importance": 0.2, "leaves": 4, "r2": 0.3},
                grid | {"factor": "stiffness", "importance": 0.3, "leaves": 4, "r2": 0.3},
            ],
        ),
        "variance_shares": frame(
            "variance_shares",
            [grid | {"factor": "pose", "share": 0.2}, grid | {"factor": "stiffness", "share": 0.6}],
        ),
        "success_by_method": frame(
            "success_by_method",
            [{"method": "forward_run_default_step", "fits": 12, "successful": 3}],
        ),
        "landmark_precision": frame(
            "landmark_precision",
            [
                {
                    "stiffness": "calibrated",
                    "motion": "translation",
                    "sd_mm": sd,
                    "n": 60,
                    "limit": 1.0,
                    "below": below,
                    "below_low": 0.8,
                    "below_high": 1.0,
                }
                for sd, below in ((1.0, 1.0), (2.0, 0.9), (4.0, 0.5))
            ],
        ),
        "required_precision": frame(
            "required_precision",
            [
                {
                    "stiffness": "calibrated",
                    "motion": "both",
                    "share": 0.95,
                    "sd_mm": 1.5,
                    "sd_low_mm": 1.2,
                    "message": "",
                },
            ],
        ),
        "landmarks": frame(
            "landmarks",
            [
                {"landmark": "superior_endplate_centre", "sd_mm": 1.2},
                {"landmark": "left_pedicle_base", "sd_mm": 2.0},
            ],
        ),
        "bootstrap": frame(
            "bootstrap",
            [
                {
                    "bootstrap": "start",
                    "loading": "quasi_static",
                    "set": number,
                    "joint": "L2L3",
                    "anterior_n_per_m": value,
                }
                for number, value in enumerate((2.0, 2.01, 2.5))
            ],
        ),
    }


@cache
def complete() -> tuple[Any, ...]:
    """All rows of the complete set."""
    return tuple(judged(CLAIMS, Run(tables(), ASKED)))


def row_of(name: str, run: Run) -> dict[str, Any]:
    (claim,) = [claim for claim in CLAIMS if claim.id == name]
    return judge(claim, run)


# --- verdicts ------------------------------------------------------------------------------------


def missing(run: Run) -> Ours:
    raise NotComputed("this run made no table x")


def claim(value: float | None, low: float | None, high: float | None, wrong: str = "") -> Claim:
    return Claim(
        *("a", "Table 1", "something", "mm", 2.0),
        range=Range(low, high, "the paper's IQR"),
        ours=missing if value is None else lambda run: Ours(value),
        evidence=Evidence.CONTRADICTED if wrong else Evidence.INDEPENDENT,
        contradicted=wrong,
        outside="for a reason",
        note="a note",
    )


@sweep(
    "value, low, high, verdict",
    [
        (1.0, 1.0, 3.0, "inside"),
        (3.0, 1.0, 3.0, "inside"),
        (3.001, 1.0, 3.0, "outside"),
        (0.999, 1.0, 3.0, "outside"),
        (1e9, 1.0, None, "inside"),
        (-1e9, None, 3.0, "inside"),
        (3.001, None, 3.0, "outside"),
        (None, 1.0, 3.0, "not_computed"),
    ],
)
def test_verdict(value: float | None, low: float | None, high: float | None, verdict: str) -> None:
    assert judge(claim(value, low, high), EMPTY_RUN)["verdict"] == verdict


def test_reason_says_what_the_range_is_and_why_ours_is_outside() -> None:
    inside, outside = judge(claim(2.0, 1.0, 3.0), EMPTY_RUN), judge(claim(4.0, 1.0, 3.0), EMPTY_RUN)
    assert inside["reason"] == "range: the paper's IQR; a note"
    assert outside["reason"] == (
        "range: the paper's IQR; ours is 2 times the paper's; for a reason; a note"
    )
    absent = judge(claim(None, 1.0, 3.0), EMPTY_RUN)
    assert absent["reason"] == "range: the paper's IQR; this run made no table x; a note"
    assert absent["ours"] is None


@sweep("value", [2.0, 4.0, None])
def test_what_the_paper_contradicts_is_not_compared(value: float | None) -> None:
    row = judge(claim(value, 1.0, 3.0, "A1: 2 is not 3"), EMPTY_RUN)
    assert row["verdict"] == "contradicted"
    assert row["reason"].startswith("not compared: A1: 2 is not 3")
    assert row["ours"] == value


# --- ranges --------------------------------------------------------------------------------------


def test_wilson_interval_by_its_formula() -> None:
    n, p, z = 500, 124 / 500, 1.959964
    middle = p + z**2 / (2 * n)
    reach = z * sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    found = binomial(124, 500)
    ends = [100 * (middle + sign * reach) / (1 + z**2 / n) for sign in (-1, 1)]
    assert [found.low, found.high] == pytest.approx(ends, rel=1e-6)


def test_correlations_of_the_consistency_checks() -> None:
    """A22-A25: p of r = 0.18, the threshold, rho = 0.67 of 10 and tau = 0.12 of 123."""
    t = 0.18 * sqrt(121 / (1 - 0.18**2))
    found = row_of("closed_form.pose_correlation_p", EMPTY_RUN)["ours"]
    assert found == pytest.approx(2 * stats.t.sf(t, 121))
    assert spearman_threshold(0.05, 123) == pytest.approx(0.177, abs=5e-4)
    threshold = row_of("closed_form.spearman_threshold", EMPTY_RUN)["ours"]
    assert threshold == pytest.approx(spearman_threshold(0.05, 123))
    cells = {claim.id: claim.note for claim in CLAIMS}
    p = 2 * stats.t.sf(0.67 * sqrt(8 / (1 - 0.67**2)), 8)
    assert f"p = {p:.2g}" in cells["table_6.extension_stiffness.L2L3.anterior_error.coefficient"]
    p = 2 * stats.norm.sf(0.12 * sqrt(9 * 123 * 122 / (2 * 251)))
    cell = "table_6.extension_orientation.L2L3.extension_error.coefficient"
    assert f"p = {p:.2g}" in cells[cell]


def test_what_follows_from_the_paper() -> None:
    """From its load, motion, stiffness and Tables 4 and 7, as sections 2.1 to 3.3 print them."""
    paper = published("gould_2024a")
    force, best = paper["load"]["largest_compression_n"], paper["best_model"]["stiffness"]
    ten = paper["ten_best_stiffness"]
    origins = [
        iqr * sqrt(2.0) / (2 * stats.norm.ppf(0.75))
        for joint in JOINTS
        for iqr in paper["joint_origin"]["complete"][joint]["iqr"].values()
    ]
    turn = {
        joint: np.deg2rad(abs(paper["measured_motion"][joint]["extension_deg"]))
        for joint in ("L2L3", "L3L4")
    }
    expected = {
        "load.moment": force * paper["bodies"]["top_offset_mm"] / 1000,
        "load.lever_arm": 1000 * paper["load"]["flexion_moment_nm"] / force,
        "load.spring_moment.L2L3": best["extension_nm_per_rad"] * turn["L2L3"],
        "load.spring_moment.L3L4": best["extension_nm_per_rad"] * turn["L3L4"],
        "start_stiffness.anterior_in_box": paper["start_stiffness"]["anterior_n_per_m"],
        "best_model.anterior_in_box": best["anterior_n_per_m"],
        "closed_form.compression": 1000 * force / best["superior_n_per_m"],
        "closed_form.outlier": paper["outlier"]["extension_nm_per_rad"]
        / paper["start_stiffness"]["extension_nm_per_rad"],
        **{
            f"closed_form.ten_best_anterior_{kind}_percent": 100
            * ten[kind]["anterior_n_per_m"]
            / ten["median"]["anterior_n_per_m"]
            for kind in ("iqr", "range")
        },
        "landmarks.largest_resultant_sd": max(origins),
        "table_6.significance": paper["significance"]["p_below"],
    }
    found = {name: row_of(name, EMPTY_RUN)["ours"] for name in expected}
    assert found == pytest.approx(expected)


def test_interval_of_a_rank_correlation_by_hand() -> None:
    """atanh 0.33 = 0.34283; half width 1.95996 sqrt(1.05445 / 120) = 0.18373."""
    found = spearman_interval(0.33, 123)
    assert [found.low, found.high] == pytest.approx([0.1578, 0.4827], abs=1e-4)


def test_other_samples_keep_to_the_interval_of_an_iqr() -> None:
    """Of 4000 pairs of samples 95 % do: standard error 0.35 %, and the theory is asymptotic."""
    samples = np.random.default_rng(1).normal(size=(4000, 2, 123))
    low, high = np.percentile(samples, [25, 75], axis=-1)
    pairs = (high - low).tolist()
    kept = [normal_iqr(first, 123).holds(second) for first, second in pairs]
    assert np.mean(kept) == pytest.approx(0.95, abs=0.02)


# --- claims on the invented tables ---------------------------------------------------------------


def test_success_follows_the_rule_of_the_study() -> None:
    """500 - 380 = 120 of 500 by `any`, all of them by `all`; the paper has 124."""
    strict = row_of("counts.pose_samples_successful", Run(tables(), {"failed_when": "any"}))
    assert (strict["ours"], strict["verdict"]) == (pytest.approx(24.0), "inside")
    lax = row_of("counts.pose_samples_successful", Run(tables(), ASKED))
    assert (lax["ours"], lax["verdict"]) == (pytest.approx(100.0), "outside")
    assert "ours: 500 of 500" in lax["reason"]


@sweep(
    "name, ours, verdict",
    [
        ("success.forward_run_default_step", 25.0, "inside"),
        ("reduced.stiffness.extension.median", 2.0, "outside"),
        ("reduced.stiffness.anterior.iqr_percent", 150.0, "inside"),
        ("reduced.anterior_iqr_percent_over_extension", 1.0, "inside"),
        ("extension_iqr_over_middle.L1L2", 1.0, "inside"),
        ("best_model.stiffness.anterior", 12000.0, "inside"),
        ("best_model.error.anterior", 0.05, "inside"),
        ("best_model.error_percent.anterior", 10.0, "contradicted"),
        ("closed_form.compressive_force", 63.64, "inside"),
        ("closed_form.origin_iqr", 1.1446, "outside"),
        ("table_5.anterior_error.anterior_stiffness", 0.4, "inside"),
        ("table_5.superior_error.anterior_stiffness", 0.6, "outside"),
        ("table_5.superior_error.anterior_stiffness.sign", 0.6, "outside"),
        ("table_6.anterior_stiffness.L2L3.anterior_error.significant", 1.0, "inside"),
        ("table_6.anterior_stiffness.L2L3.anterior_error.coefficient", -0.97, "inside"),
        ("friedman.pose", 0.04, "inside"),
        ("normality.joint_frames", 1.0, "inside"),
        ("tree.L2L3.anterior", 0.7, "inside"),
        ("variance_share.L2L3.anterior", 0.25, "outside"),
        ("target.required_sd", 1.5, "outside"),
        ("target.share_below.translation", 90.0, "outside"),
        ("spread_bound.origin_iqr", 3.0, "outside"),
        ("reduced_against_complete.origin_median", 0.0, "inside"),
        ("closed_form.spearman_threshold", 0.177, "recomputed"),
        ("closed_form.compression", 0.1236, "recomputed"),
        ("load.moment", 2.7, "contradicted"),
        ("load.lever_arm", 18.52, "contradicted"),
        ("load.spring_moment.L3L4", 0.468, "contradicted"),
    ],
)
def test_cells_by_hand(name: str, ours: float, verdict: str) -> None:
    row = row_of(name, Run(tables(), ASKED))
    assert row["ours"] == pytest.approx(ours, rel=1e-3)
    assert row["verdict"] == verdict


def test_shift_of_the_reduced_dataset() -> None:
    """One median 1.5 mm lower in the reduced dataset: above the paper's 1 mm."""
    where = {"dataset": "reduced", "quantity": "origin", "joint": "L2L3", "coordinate": "right"}
    changed = tables() | {"summary": with_cell(summary(), "median", 0.5, **where)}
    row = row_of("reduced_against_complete.origin_median", Run(changed))
    assert (row["ours"], row["verdict"]) == (pytest.approx(1.5), "outside")


def test_start_over_damping_needs_a_spread() -> None:
    where = {"quantity": "stiffness", "coordinate": "anterior"}
    same = with_cell(summary(), "range", 1e-6, **where)
    row = row_of("stiffness_range.start_over_damping.anterior", Run({"summary": same}))
    assert row["verdict"] == "not_computed"
    assert "all fits end in the same stiffness" in row["reason"]


def test_start_over_damping_is_the_ratio_of_the_ranges() -> None:
    """17 over 8.5, as the paper's number is; that the medians differ does not enter."""
    where = {"quantity": "stiffness", "coordinate": "anterior", "part": "start_bootstrap"}
    wide = with_cell(with_cell(summary(), "range", 17.0, **where), "median", 8.0, **where)
    row = row_of("stiffness_range.start_over_damping.anterior", Run({"summary": wide}))
    assert (row["ours"], row["verdict"]) == (2.0, "inside")


def test_a_note_tells_how_many_fits_agree() -> None:
    row = row_of("stiffness_range.start.anterior", Run(tables(), ASKED))
    assert "ours: 2 of 3 fits within 1 % of the median" in row["reason"]
    kept = row_of("stiffness_range.start_without_outliers.anterior", Run(tables(), ASKED))
    assert "ours: 2 of 3 fits, outliers counted, within" in kept["reason"]


def test_what_is_not_computed_carries_the_message_of_the_table() -> None:
    """2 mm will not do, but nothing between it and the paper's 1.67 mm was sampled."""
    whole = tables()
    message = "2 mm will not do, the smallest that was sampled"
    needed = whole["required_precision"].assign(sd_mm=float("nan"), message=message)
    sampled = whole["landmark_precision"].query("sd_mm >= 2.0")
    changed = whole | {"required_precision": needed, "landmark_precision": sampled}
    row = row_of("target.required_sd", Run(changed))
    assert row["verdict"] == "not_computed"
    assert message in row["reason"]


@sweep("error, ours, verdict", [(0.5, 4.0, "inside"), (2.0, 1.0, "outside")])
def test_required_precision_outside_the_sampled_sds(
    error: float, ours: float, verdict: str
) -> None:
    """All errors below the limit of 1: even 4 mm will do. All above: even 1 mm will not."""
    found = required_precision(np.array([1.0, 4.0]), np.full((2, 60), error), 1.0, 0.95, 10, 1)
    whole, where = tables(), {"stiffness": "calibrated"}
    changed = with_cell(whole["required_precision"], "sd_mm", found.sd, **where)
    changed = with_cell(changed, "message", found.message, **where)
    row = row_of("target.required_sd", Run(whole | {"required_precision": changed}))
    assert (row["ours"], row["verdict"]) == (ours, verdict)
    assert found.message in row["reason"]


# --- contradicted numbers ------------------------------------------------------------------------


def test_every_contradiction_of_the_paper_is_told() -> None:
    if not CHECKS.is_file():
        pytest.skip("the list of consistency checks does not lie beside this repository")
    with CHECKS.open(encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row and row[0] == "gould-2024a"]
    wrong = {row[1] for row in rows if any("disagree" in cell for cell in row)}
    wrong |= set(ALSO_CONTRADICTED)
    told = " ".join(str(row["reason"]) for row in judged(CLAIMS, EMPTY_RUN))
    named = {check for check in wrong if f"{check}:" in told or f"({check}" in told}
    assert len(wrong) > 15
    assert wrong - named == set(NOT_APPLICABLE)


def test_contradicted_cells() -> None:
    """Which cells of Tables 2, 3, 6 and 8 exclude each other, by their consistency checks."""
    found = {claim.id: claim.contradicted.split(":")[0] for claim in CLAIMS}
    table = {name: check for name, check in found.items() if check}
    percents = {
        name.removesuffix(".largest_percent"): check
        for name, check in table.items()
        if name.endswith("largest_percent")
    }
    assert percents == {
        "damping_bootstrap.quasi_static.anterior": "A12",
        "damping_bootstrap.dynamic.anterior": "A12",
        "start_bootstrap.quasi_static.anterior": "A12",
        "start_bootstrap.dynamic.anterior": "A12",
        "damping_bootstrap.quasi_static.superior": "A13",
        "damping_bootstrap.dynamic.superior": "A13",
        "damping_bootstrap.dynamic.extension": "A14",
    }
    # Their size cannot be significant as printed. Their sign is printed, and is compared.
    notes = {claim.id: claim.note for claim in CLAIMS if claim.id.endswith("coefficient")}
    assert not set(notes) & set(table)
    assert {name: check for name in notes for check in ("A24", "A25") if check in notes[name]} == {
        "table_6.extension_orientation.L2L3.extension_error.coefficient": "A25",
        "table_6.extension_orientation.L3L4.extension_error.coefficient": "A25",
        "table_6.extension_stiffness.L2L3.anterior_error.coefficient": "A24",
        "table_6.extension_stiffness.L2L3.extension_error.coefficient": "A24",
    }
    copied = [name for name, check in table.items() if check == "A19"]
    assert copied == [
        *(f"joint_orientation.reduced.{joint}.extension.iqr" for joint in JOINTS),
        *(f"reduced_against_complete.extension_iqr_drop.{joint}" for joint in ("L1L2", "L3L4")),
    ]


@sweep("effect, verdict", [(0.15, "outside"), (-0.15, "inside")])
def test_a_sign_that_the_paper_has_otherwise_is_outside(effect: float, verdict: str) -> None:
    """Table 6, L2L3, flexion: tau -0.18 to -0.12, of which -0.12 cannot be significant (A25)."""
    cell = {"family": "two-factor: extension_error at L2L3 against pose", "joint": "L2L3"}
    told = outcome(
        **cell,
        test="Kendall",
        response="extension_error",
        factor="extension_orientation",
        effect=effect,
        p=1e-4,
        p_bonferroni=1e-3,
    )
    run = Run({"statistics": frame("statistics", [told])})
    row = row_of("table_6.extension_orientation.L2L3.extension_error.coefficient", run)
    assert (row["verdict"], row["ours"], row["limit"]) == (verdict, effect, "one_sided")
    assert "A25: 0.12 of 123 values" in row["reason"]


@sweep(
    "rho, joint, name, verdict",
    [
        (0.18, "L2L3", "extension", "inside"),
        (-0.17, "L2L3", "extension", "outside"),
        (0.05, "L3L4", "anterior", "outside"),
        (-0.6, "L3L4", "superior", "outside"),
        (0.1, "L2L3", "superior", "inside"),
    ],
)
def test_error_against_measured_motion(rho: float, joint: str, name: str, verdict: str) -> None:
    """Section 3.3: it depends in the anterior direction and in flexion, not in compression.

    The threshold of p = 0.05 in 123 pairs is 0.177.
    """
    own = ("error against motion", "Spearman", joint, f"{name}_error", f"{name}_measured")
    run = Run({"statistics": frame("statistics", [outcome(*own, effect=rho, p=0.01)])})
    row = row_of(f"error_depends_on_motion.{joint}.{name}", run)
    assert (row["paper"], row["verdict"]) == (float(name != "superior"), verdict)
    assert f"rho {rho:.2f}" in row["reason"]


@sweep("fits, verdict", [(3, "not_computed"), (10, "outside")])
def test_few_fits_tell_no_rate(fits: int, verdict: str) -> None:
    """Three of three leave 44 to 100 %: 3 / (3 + 1.96^2) and all."""
    rows = [{"method": "exact", "fits": fits, "successful": fits}]
    row = row_of("success.exact", Run({"success_by_method": frame("success_by_method", rows)}))
    assert row["verdict"] == verdict
    if fits == 3:
        assert "too few for a rate: 3 of 3 fits, 95 % interval 44 to 100 %" in row["reason"]


# --- missing parts -------------------------------------------------------------------------------


def test_ids_are_unique_and_every_claim_has_a_reason() -> None:
    assert len({claim.id for claim in CLAIMS}) == len(CLAIMS)
    assert [
        one.id for one in CLAIMS if one.evidence and not (one.outside or one.contradicted)
    ] == []


@sweep("name", ["summary", "statistics"])
def test_a_missing_table_is_told(name: str) -> None:
    without(name)


@pytest.mark.full
@sweep("name", sorted(tables()))
def test_any_missing_or_empty_table_is_told(name: str) -> None:
    without(name)


def without(name: str) -> None:
    """Nothing but what hangs on the table changes, and its rows say what is missing."""
    whole = tables()
    rest = {key: table for key, table in whole.items() if key != name}
    for run in (Run(rest, ASKED), Run(rest | {name: whole[name].iloc[:0]}, ASKED)):
        after = judged(CLAIMS, run)
        changed = [new for old, new in zip(complete(), after, strict=True) if old != new]
        assert changed
        assert {row["verdict"] for row in changed} <= {"not_computed", "contradicted"}
        assert all(f"table {name}" in row["reason"] for row in changed)
        from_rows(AGAINST_GOULD_2024A, after)


def test_stiffness_per_joint_is_not_compared_with_one_of_all_joints() -> None:
    changed = {
        name: table.assign(joint=table["joint"].replace("*", "L2L3"))
        for name, table in tables().items()
        if "joint" in table
    }
    rows = {row["id"]: row for row in judged(CLAIMS, Run(tables() | changed, ASKED))}
    for name in ("reduced.stiffness.anterior.median", "best_model.stiffness.anterior"):
        assert rows[name]["verdict"] == "not_computed"


def test_tests_without_a_result_are_no_result() -> None:
    empty = dict.fromkeys(("p", "p_bonferroni", "effect"), float("nan"))
    table = statistics().assign(**empty, status="constant", message="all errors are the same")
    row = row_of("table_5.anterior_error.anterior_stiffness", Run({"statistics": table}))
    assert row["verdict"] == "not_computed"
    assert "all errors are the same" in row["reason"]


def test_job_writes_the_table_with_its_origin(tmp_path: Path) -> None:
    output = tmp_path / "against_gould_2024a.parquet"
    against_gould_2024a.run(str(ROOT), "l1l4_joint_pose", [], str(output))
    rows = read_frame(output)
    assert list(rows["id"]) == [claim.id for claim in CLAIMS]
    assert set(rows["verdict"]) == {"not_computed", "contradicted", "recomputed"}
    assert read(output).schema.metadata[b"study"] == b"l1l4_joint_pose"

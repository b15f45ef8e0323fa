"""The comparison with Wang 2021: every number has its row; verdicts of made-up runs.

Numbers of the paper are entered here a second time; where the lists of its numbers lie beside this
repository, every row of them is looked for.
"""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from spinepipe.comparison.claim import Run, judged
from spinepipe.motion.skeleton import BODIES, JOINTS
from spinepipe.studies.tracking.settings import Bounds, Tracking
from spinepipe.studies.tracking.tables_of_studies import AGAINST_WANG_2021, WINDOWS
from spinepipe.studies.tracking.wang_2021.against import CLAIMS, asked_of
from spinepipe.tables import from_rows

PUBLISHED = Path(__file__).parents[4] / "shared" / "published"

FE, LB = "flexion_extension", "lateral_bending"
ASKED = {
    "rom_bound_increase": 150.0,
    "times_the_range": 2.5,
    "max_marker_deviation": 40.0,
    "intervals": 100,
}

AS_PRINTED = {
    "ik": (15.2, 4.04),
    "ik_constrained_christophy_2012": (24.3, 6.08),
    "ik_constrained_bruno_2015": (30.0, 9.0),
    "optk_zero": (15.4, 5.68),
    "optk_generic": (12.1, 3.50),
    "optk_calibrated": (10.1, 3.38),
    "optk_from_flexion": (9.0, 3.3),
    "optk_from_both": (8.5, 3.29),
}
"""Errors as the paper has them; a second set of ratios that is worse."""

ON = {**dict.fromkeys(("T1", "T3", "T7", "T11", "L2", "L4"), 3), "S1": 5}
ON |= dict.fromkeys(("T5", "T9", "T12", "L3"), 1)


def accuracy(errors: dict[str, tuple[float, float]]) -> pd.DataFrame:
    rows = [
        {"trial": trial, "approach": name, "measure": measure, "mean": value * factor}
        for name, both in errors.items()
        for measure, value in zip(("centre_mm", "angle_deg"), both, strict=True)
        for trial, factor in (("stood", 1.0), ("bent", 100.0))
    ]
    return pd.DataFrame(rows)


def cohort() -> dict[str, pd.DataFrame]:
    people = [f"s{k}" for k in range(10)]
    kinds = {"stood": "stance", "bent": FE, "leant": LB}
    return {
        "subjects": pd.DataFrame(
            {"specimen": people, "age_years": 68, "height_cm": 164.0, "mass_kg": 60.0}
        ),
        "trials": pd.DataFrame(
            [(who, *both) for who in people for both in kinds.items()],
            columns=["specimen", "trial", "kind"],
        ),
        "marker_set": pd.DataFrame(
            [(who, name) for who in people for name, count in ON.items() for _ in range(count)],
            columns=["specimen", "vertebra"],
        ),
    }


def ranges() -> pd.DataFrame:
    """Thoracic joints turn by 2 deg with dynamics, by 20 without; vertebrae slide by 6 mm."""
    rows = []
    for approach, turned, slid in (("ik", 20.0, 0.0), ("optk_from_both", 2.0, 6.0)):
        for joint in JOINTS:
            for axis in ("extension", "right_bending", "left_rotation"):
                rows.append((approach, joint, axis, turned, "deg"))
            for axis in ("anterior", "superior", "right"):
                rows.append((approach, joint, axis, slid, "mm"))
    rows.append(("ik_constrained_shojaei_2017", "T1T2", "extension", 120.0, "deg"))
    names = ["approach", "joint", "coordinate", "range", "unit"]
    return pd.DataFrame(rows, columns=names).assign(specimen="s0", trial="bent")


def sharing(lateral: list[float]) -> pd.DataFrame:
    """Shares of L5S1 to T12L1; forwards they become smaller downwards."""
    forwards = [0.1, 0.14, 0.16, 0.18, 0.2, 0.22]
    rows = [
        ("s0", trial, "optk_from_both", joint, window, share)
        for trial, shares in (("bent", forwards), ("leant", lateral))
        for joint, share in zip(JOINTS[:6], shares, strict=True)
        for window in WINDOWS
    ]
    names = ["specimen", "trial", "approach", "joint", "window", "share"]
    return pd.DataFrame(rows, columns=names)


def stiffness() -> pd.DataFrame:
    """Calibrated A and B are 0.8 and 1.5 times the generic ones; k = B (F + A)."""
    rows = []
    for approach, by_a, by_b in (("optk_generic", 1.0, 1.0), ("optk_from_both", 0.8, 1.5)):
        for joint in JOINTS:
            a, b = 1.2 * by_a, 30.0 * by_b
            ratio = b * (4.0 + a) / (30.0 * (4.0 + 1.2))
            low = b * (0.1 + a)
            rows.append(("s0", approach, joint, "extension", "positive", a, b, low, ratio))
    names = ["specimen", "approach", "joint", "coordinate", "side"]
    values = ["a", "b", "at_low_moment", "ratio_to_generic"]
    return pd.DataFrame(rows, columns=[*names, *values])


def complete() -> dict[str, pd.DataFrame]:
    fits = [
        ("s0", trial, approach, rmse, 12.0)
        for trial in ("bent", "leant")
        for approach, rmse in (("ik", 4.0), ("optk_from_both", 6.0), ("optk_calibrated", 5.0))
    ]
    levels = [("centre_mm", name) for name in BODIES[1:]]
    levels += [("angle_deg", name) for name in JOINTS[1:11]]
    names = ["specimen", "trial", "approach", "marker_rmse_mm", "cpu_s"]
    return {
        **cohort(),
        "accuracy": accuracy(AS_PRINTED),
        "errors": pd.DataFrame(levels, columns=["measure", "level"]),
        "ranges": ranges(),
        "sharing": sharing([0.1, 0.14, 0.16, 0.24, 0.2, 0.16]),
        "similarity": pd.DataFrame(
            {"trial": ["bent", "leant"], "cmc": [0.5, 0.7], "window": "20-80"}
        ).assign(approach="optk_from_both"),
        "fits": pd.DataFrame(fits, columns=names),
        "stiffness": stiffness(),
        "clusters": pd.DataFrame({"variability_mm": [0.25, 0.3], "variability_percent": 0.6}),
    }


def rows_of(**changed: pd.DataFrame) -> dict[str, dict[str, Any]]:
    rows = judged(CLAIMS, Run({**complete(), **changed}, ASKED))
    from_rows(AGAINST_WANG_2021, rows)
    return {str(row["id"]): dict(row) for row in rows}


def verdicts(prefix: str, rows: dict[str, dict[str, Any]]) -> set[str]:
    found = {row["verdict"] for name, row in rows.items() if name.startswith(prefix)}
    assert found, prefix
    return found


def published(name: str) -> list[dict[str, str]]:
    if not PUBLISHED.is_dir():
        pytest.skip("the lists of published numbers are not beside this repository")
    with (PUBLISHED / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_claim_has_a_name_of_its_own() -> None:
    names = [claim.id for claim in CLAIMS]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("file", "key", "prefix"),
    [
        ("wang-2021-results.csv", "id", "results"),
        ("wang-2021-equations.csv", "name", "equations"),
        ("wang-2021-markers.csv", "vertebra", "markers"),
    ],
)
def test_every_published_row_has_a_claim(file: str, key: str, prefix: str) -> None:
    names = {claim.id for claim in CLAIMS}
    for row in published(file):
        wanted = f"{prefix}.{row[key]}"
        assert any(name == wanted or name.startswith(f"{wanted}.") for name in names), wanted


def test_every_check_has_a_claim() -> None:
    checks = [row["id"] for row in published("consistency-checks.csv") if row["id"][0] == "W"]
    names = {claim.id.split(".")[1] for claim in CLAIMS if claim.id.startswith("closed_form.")}
    assert set(checks) <= names
    assert len(checks) == 10


def test_errors_are_the_published_ones() -> None:
    by_name = {claim.id: claim for claim in CLAIMS}
    for row in published("wang-2021-accuracy-by-approach.csv"):
        for measure, column in (("cog", "cog_error_mm"), ("angle", "joint_angle_error_deg")):
            assert by_name[f"accuracy.{row['approach']}.{measure}"].paper == float(row[column])


def test_single_numbers_are_the_published_ones() -> None:
    """Rows with one value, in the unit of the list; heights are mm there and cm here."""
    by_name = {claim.id: claim for claim in CLAIMS}
    scale = {"height": 0.1}
    seen = 0
    for row in published("wang-2021-results.csv"):
        claim = by_name.get(f"results.{row['id']}")
        if claim is None or claim.paper is None:
            continue
        try:
            value = float(row["value"])
        except ValueError:
            continue
        if claim.unit == "1: yes, 0: no":
            continue
        assert claim.paper == pytest.approx(value * scale.get(row["id"], 1.0)), row["id"]
        seen += 1
    assert seen > 20


def test_ranges_are_the_published_ones() -> None:
    by_name = {claim.id: claim for claim in CLAIMS}
    seen = 0
    for row in published("wang-2021-results.csv"):
        claim = by_name.get(f"results.{row['id']}")
        if claim is None or not (row["low"] and row["high"]) or claim.paper is not None:
            continue
        if claim.range.low is not None:
            assert (claim.range.low, claim.range.high) == (float(row["low"]), float(row["high"]))
            seen += 1
    assert seen >= 5


def test_errors_are_not_compared_and_shown() -> None:
    rows = rows_of()
    assert verdicts("accuracy.", rows) == {"not_computed"}
    told = rows["accuracy.OptK_PE_generic.cog"]
    assert told["reason"].count("not comparable") == 1
    assert "12.1 mm; optk_generic" in told["reason"]
    assert "24.3" in rows["accuracy.IK_cons.cog"]["reason"], "the best of the sets"
    assert "10.1" in rows["accuracy.OptK_PE_calibrated_highest.cog"]["reason"]


def test_the_papers_own_errors_are_in_its_order() -> None:
    rows = rows_of()
    for check in ("W3", "W8", "W9"):
        assert verdicts(f"order.{check}.", rows) == {"inside"}
    assert verdicts("closed_form.W8", rows) == {"recomputed"}
    assert verdicts("closed_form.W9", rows) == {"recomputed"}
    assert verdicts("closed_form.W3", rows) == {"contradicted"}


def test_another_order_is_told() -> None:
    """Dynamics alone that are better than inverse kinematics; calibrated no better than generic."""
    changed = {**AS_PRINTED, "optk_zero": (9.5, 3.40), "optk_calibrated": (12.5, 3.0)}
    rows = rows_of(accuracy=accuracy(changed))
    assert rows["order.W3.cog"]["verdict"] == "outside"
    assert rows["order.W8.IK.OptK_PE_0"]["verdict"] == "outside"
    assert rows["order.W8.OptK_PE_calibrated_highest.OptK_PE_generic"]["verdict"] == "outside"
    assert (
        "12.5 mm (optk_calibrated)"
        in (rows["order.W8.OptK_PE_calibrated_highest.OptK_PE_generic"]["reason"])
    )
    assert rows["order.W9.OptK_PE_calibrated_highest.OptK_PE_generic"]["verdict"] == "inside"
    assert rows["order.W8.OptK_PE_0.IK_cons"]["verdict"] == "inside"


def test_errors_are_those_in_stance() -> None:
    stances = cohort()["trials"]
    moving = stances[stances["kind"] != "stance"]
    rows = rows_of(trials=moving)
    assert rows["order.W3.cog"]["verdict"] == "not_computed"
    assert rows["results.motions"]["verdict"] == "outside"


def test_windows_of_the_paper() -> None:
    rows = rows_of()
    for name, ours in (
        ("rom_thoracic_fe_optk", 2.0),
        ("rom_thoracic_fe_ik", 20.0),
        ("rom_ik_cons3", 120.0),
        ("axial_translation_range", 6.0),
        ("marker_rmse_limit", 6.0),
    ):
        row = rows[f"results.{name}"]
        assert (row["verdict"], row["ours"]) == ("inside", pytest.approx(ours)), name
    assert rows["results.computation_time"]["verdict"] == "outside"
    assert rows["results.pe_parameter_multiplier"]["ours"] == pytest.approx((0.8 + 1.5) / 2.0)
    far = ranges()
    far["range"] *= 10.0
    rows = rows_of(ranges=far)
    assert rows["results.rom_thoracic_fe_optk"]["verdict"] == "outside"
    assert rows["results.rom_thoracic_fe_ik"]["verdict"] == "outside"
    assert rows["results.axial_translation_range"]["verdict"] == "outside"


def test_no_window_is_half_to_twice() -> None:
    for claim in CLAIMS:
        low, high, paper = claim.range.low, claim.range.high, claim.paper
        if paper and low and high and low != high:
            assert not np.isclose(low * 2.0, paper), claim.id


def test_sharing_is_judged_by_joint() -> None:
    rows = rows_of()
    assert rows["results.largest_msr_lateral"]["verdict"] == "inside"
    assert rows[f"results.msr_trend.{FE}"]["verdict"] == "inside"
    assert rows[f"results.msr_trend.{LB}"]["verdict"] == "outside"
    assert "L1L2 0.20, L2L3 0.24" in rows[f"results.msr_trend.{LB}"]["reason"]


def test_stiffness_at_moments() -> None:
    """At 0.1 N m 1.5 (0.1 + 0.96) / 1.3 = 1.22 times the generic one, and more at 4 N m."""
    rows = rows_of()
    assert rows["results.neutral_zone_moment"]["verdict"] == "circular"
    assert rows["results.stiffness_low_resistance_zone"]["verdict"] == "outside"
    assert rows["results.stiffness_high_resistance_zone"]["verdict"] == "inside"


def test_a_cohort_as_the_papers_is_circular() -> None:
    rows = rows_of()
    assert verdicts("markers.", rows) == {"circular"}
    for name in ("n_subjects", "age", "height", "weight", "motions", "intervals", "msr_window"):
        assert rows[f"results.{name}"]["verdict"] == "circular", name
    assert rows["results.dof_per_joint_ik"]["ours"] == 3.0
    assert rows["results.dof_per_joint_optk"]["ours"] == 6.0
    assert rows["closed_form.W5"]["ours"] == 2.5
    fewer = cohort()["marker_set"]
    rows = rows_of(marker_set=fewer[fewer["vertebra"] != "T5"])
    assert rows["markers.T5"]["verdict"] == "outside"
    assert rows["results.vertebrae_with_markers"]["ours"] == 9.0


def test_formulas_are_the_papers() -> None:
    """A (exp(B q) - 1) with 1.5 N m, 40 / rad and 0.03 rad; k = B (F + A); -A at the far end."""
    rows = rows_of()
    load = 1.5 * (np.exp(1.2) - 1.0)
    assert rows["equations.passive"]["ours"] == pytest.approx(load)
    assert rows["equations.tangent_stiffness"]["ours"] == pytest.approx(40.0 * (load + 1.5))
    assert rows["closed_form.W6"]["ours"] == pytest.approx(-1.0)
    assert "-1 times as much" in rows["closed_form.W6"]["reason"]
    for name in ("equations.passive", "equations.tangent_stiffness", "closed_form.W10"):
        assert rows[name]["verdict"] == "recomputed"


def test_a_run_without_tables_computes_nothing_and_says_so() -> None:
    rows = judged(CLAIMS, Run({}, {}))
    from_rows(AGAINST_WANG_2021, rows)
    found = {row["verdict"] for row in rows}
    assert found == {"not_computed", "contradicted", "recomputed"}
    assert all(row["reason"] for row in rows)


@pytest.mark.parametrize(("means", "times"), [("added", 2.5), ("of_the_range", 1.5)])
def test_settings_that_the_paper_has_numbers_for(means: str, times: float) -> None:
    bounds = Bounds(means=means)  # type: ignore[arg-type]
    settings = Tracking.model_construct(bounds=bounds, intervals=50, largest_deviation_mm=40.0)
    asked = asked_of(settings)
    assert (asked["times_the_range"], asked["intervals"]) == (times, 50)

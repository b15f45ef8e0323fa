"""Load points: what the readings exclude, slopes, and ranges with the point uncertain.

Expected values are closed forms of normal distributions, tables of F, or worked by hand.
"""

from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError
from study_cases import STUDY, Size, project
from sweeps import sweep

from papers.engine import claims_of, judge
from papers.run import StudyRun
from spinepipe.problems import InputError
from spinepipe.studies.joint_pose_sensitivity.load_point_effect import effect
from spinepipe.studies.joint_pose_sensitivity.over_load_point import allowed
from spinepipe.studies.joint_pose_sensitivity.settings import LoadPoint
from spinepipe.studies.read import check

NAN = float("nan")
FINE = tuple(float(x) for x in np.arange(-4.0, 4.01, 0.25))
MANY = 100_000
"""Degrees of freedom with which t is normal."""

Z = 1.959964


def tried(
    anterior: tuple[float, ...],
    superior: tuple[float, ...],
    value: Callable[[float, float], float],
    cost: Callable[[float, float], float] = lambda a, s: 1.0,
    half: float = 0.1,
    degrees: int = MANY,
    **more: Any,
) -> pd.DataFrame:
    """Fits of one specimen; regions of the logarithm go ``half`` to either side."""
    rows = []
    for a, s in product(anterior, superior):
        k = value(a, s)
        row: dict[str, Any] = {"specimen": "a", "joint": "*", "allowed": True}
        row |= {"anterior_shift_mm": a, "superior_shift_mm": s, "extension_nm_per_rad": k}
        row |= {"extension_low_nm_per_rad": k * np.exp(-half)}
        row |= {"extension_high_nm_per_rad": k * np.exp(half), "extension_identifiable": True}
        row |= {"cost": cost(a, s), "degrees_of_freedom": degrees, "status": "converged"}
        rows.append({**row, **more})
    return pd.DataFrame(rows)


def asked(anterior: tuple[float, ...], superior: tuple[float, ...], *sds: float) -> LoadPoint:
    return LoadPoint(
        anterior_mm=anterior, superior_mm=superior, anterior_sd_mm=sds[0], superior_sd_mm=sds[1]
    )


# --- what the readings exclude -------------------------------------------------------------------


@sweep(
    "degrees, unknowns, limit",
    [(3, 2, 1 + 2 * 199.5), (12, 2, 1 + 2 * 4.103 / 10), (11, 1, 1 + 4.965 / 10)],
)
def test_the_cost_may_rise_by_what_tables_of_f_say(
    degrees: int, unknowns: int, limit: float
) -> None:
    costs = (1.0, 0.998 * limit, 1.002 * limit)
    fits = [{"cost": cost, "degrees_of_freedom": degrees} for cost in costs]
    assert allowed([*fits, {**fits[0], "cost": None}], unknowns) == [True, True, False, None]


def test_too_few_readings_tell_nothing() -> None:
    fits = [{"cost": cost, "degrees_of_freedom": 2} for cost in (1.0, 1e9)]
    assert allowed(fits, 2) == [None, None]
    assert allowed([{"cost": None, "degrees_of_freedom": 9}], 2) == [None]


# --- slopes and ranges ---------------------------------------------------------------------------


def test_slopes_are_between_the_neighbours_of_the_stated_point() -> None:
    """k = 20 + 2 a + 0.1 s + 0.5 a^2: 2 per mm forward however curved, 0.1 per mm up."""
    points = (-2.0, -1.0, 0.0, 1.0, 3.0), (-20.0, 0.0, 10.0)
    rows = tried(*points, lambda a, s: 20 + 2 * a + 0.1 * s + 0.5 * a**2)
    found = effect(asked(*points, 0, 0), rows, "extension")
    assert found["per_mm_anterior"] == pytest.approx(2.0)
    assert found["per_mm_superior"] == pytest.approx(0.1)
    assert (found["stated"], found["points"], found["allowed"]) == (20.0, 15, 15)
    assert (found["lowest"], found["highest"]) == pytest.approx((16.0, 31.5))
    assert found["uncertain_low"] is None


def test_one_point_one_way_has_no_slope_that_way() -> None:
    rows = tried((0.0,), FINE, lambda a, s: 9.0 + s)
    found = effect(asked((0.0,), FINE, 0, 0), rows, "extension")
    assert found["per_mm_anterior"] is None
    assert found["per_mm_superior"] == pytest.approx(1.0)


@sweep("slope, sd", [(0.05, 1.0), (0.2, 1.0), (0.2, 0.5)])
def test_range_of_the_sum_of_two_normals(slope: float, sd: float) -> None:
    """log k moves by slope per mm: its SD is the root of (0.1 / 1.96)^2 + (slope SD)^2.

    31 equally probable places, cut off at 4 SDs, have an SD 1.7 % too small.
    """
    rows = tried((0.0,), FINE, lambda a, s: 20.0 * np.exp(slope * s))
    found = effect(asked((0.0,), FINE, 0, sd), rows, "extension")
    half = Z * np.hypot(0.1 / Z, slope * sd)
    assert found["uncertain_median"] == pytest.approx(20.0, rel=1e-3)
    assert np.log(found["uncertain_high"] / 20.0) == pytest.approx(half, rel=0.03)
    assert np.log(found["uncertain_low"] / 20.0) == pytest.approx(-half, rel=0.03)


def test_motion_that_tells_the_point_narrows_the_range() -> None:
    """cost^(-d/2) = exp(-(s - 1)^2 / 2): with a prior of SD 1 about 0, SD 0.71 about 0.5."""
    rows = tried(
        (0.0,),
        FINE,
        lambda a, s: 20.0 * np.exp(0.3 * s),
        lambda a, s: float(np.exp((s - 1.0) ** 2 / MANY)),
    )
    found = effect(asked((0.0,), FINE, 0, 1), rows, "extension")
    assert np.log(found["uncertain_median"] / 20.0) == pytest.approx(0.15, abs=0.005)
    half = Z * np.hypot(0.1 / Z, 0.3 * np.sqrt(0.5))
    width = np.log(found["uncertain_high"] / found["uncertain_low"])
    assert width == pytest.approx(2.0 * half, rel=0.04)


def test_two_ways_add_up() -> None:
    ways = tuple(range(-4, 5)), tuple(range(-40, 41, 10))
    shifts = tuple(tuple(map(float, way)) for way in ways)
    rows = tried(shifts[0], shifts[1], lambda a, s: 20.0 * np.exp(0.1 * a + 0.02 * s))
    found = effect(asked(shifts[0], shifts[1], 1, 10), rows, "extension")
    half = Z * np.sqrt((0.1 / Z) ** 2 + 0.1**2 + 0.2**2)
    assert np.log(found["uncertain_high"] / 20.0) == pytest.approx(half, rel=0.03)


def test_open_regions_stay_open_and_exact_fits_have_none() -> None:
    points = (0.0,), (-2.0, 0.0, 2.0)
    is_open = tried(*points, lambda a, s: 20.0, extension_high_nm_per_rad=NAN)
    found = effect(asked(*points, 0, 1), is_open, "extension")
    assert found["uncertain_high"] is None
    assert found["uncertain_low"] == pytest.approx(20.0 * np.exp(-0.1), rel=1e-3)
    exact = effect(asked(*points, 0, 1), tried(*points, lambda a, s: 20.0, degrees=0), "extension")
    assert exact["uncertain_median"] is None
    assert "as many unknowns as readings" in exact["message"]


def test_places_without_a_fit_are_told() -> None:
    """Between -4 and 0 mm nothing is known: half of the prior."""
    points = (0.0,), (-4.0, 0.0, 4.0)
    rows = tried(*points, lambda a, s: 20.0)
    rows.loc[0, "status"] = "unstable"
    rows.loc[0, ["extension_nm_per_rad", "cost"]] = NAN
    rows["allowed"] = pd.Series([None, True, True], dtype=object)
    found = effect(asked(*points, 0, 2), rows, "extension")
    assert found["message"] == "no fit at 48 % of the places of the load"  # 15 of 31
    assert (found["points"], found["fitted"], found["allowed"]) == (3, 2, 2)
    assert found["per_mm_superior"] is None


# --- settings and checks -------------------------------------------------------------------------


@sweep(
    "wrong, told",
    [
        ({"anterior_mm": [1, 2]}, "0 among them"),
        ({"superior_mm": [0, -1]}, "rising order"),
        ({"superior_mm": [-9, 0, 10], "superior_sd_mm": 5}, "superior_mm from -10 to 10 at least"),
    ],
)
def test_grids_hold_the_stated_point_and_reach_two_sds(wrong: dict[str, Any], told: str) -> None:
    with pytest.raises(ValidationError, match=told):
        LoadPoint.model_validate(wrong)


def test_pure_moments_have_no_load_point(tmp_path: Path) -> None:
    root = project(tmp_path, Size())
    study = root / "config" / "studies" / f"{STUDY}.yaml"
    study.write_text(study.read_text() + "load_point: {superior_mm: [-10, 0, 10]}\n")
    check(root, STUDY)
    loads = root / "config" / "cohorts" / "straight" / "loads.csv"
    table = pd.read_csv(loads)
    table["mz_nm"], table["fy_n"] = -table["step"], 0
    table.to_csv(loads, index=False)
    with pytest.raises(InputError, match="a pure moment has no point"):
        check(root, STUDY)


# --- comparison -----------------------------------------------------------------------------------


def claim(name: str, tables: dict[str, pd.DataFrame]) -> dict[str, Any]:
    (found,) = [one for one in claims_of("gould_2024a") if one.id == name]
    return judge(found, StudyRun(tables))


def test_lowering_of_the_load_by_hand() -> None:
    """k = 21.4 + 0.16 s is 13.4 at 50 mm lower and 14.9 at 40.6; the cost is 1 + s / 1000."""
    rows = tried((0.0, 1.0), (-60.0, 0.0, 20.0), lambda a, s: 21.4 + 0.16 * s + a)
    rows["cost"] = 1.0 + rows["superior_shift_mm"] / 1000.0
    found = claim("load_point.lower_for_best_model", {"stiffness_over_load_point": rows})
    assert found["ours"] == pytest.approx(40.625)
    assert found["verdict"] == "inside"
    assert "cost there is 0.96 times" in found["reason"]
    far = rows.assign(extension_nm_per_rad=rows["extension_nm_per_rad"] + 20.0)
    absent = claim("load_point.lower_for_median", {"stiffness_over_load_point": far})
    assert absent["verdict"] == "not_computed"
    assert "no height between" in absent["reason"]


def test_reasons_name_the_landmark_sd_from_the_table() -> None:
    """The range grows by 3.8 deg per mm, give or take a tenth: 8.44 deg stand for 2.2 mm."""
    name = "joint_orientation.complete.L1L2.extension.iqr"
    at = {"joint": "L1L2", "quantity": "orientation", "coordinate": "extension"}
    ends = {"iqr_low": 0.9, "iqr": 1.0, "iqr_high": 1.1}
    spread = pd.DataFrame(
        [
            {**at, "sd_mm": sd, **{end: 3.8 * sd * share for end, share in ends.items()}}
            for sd in (1.0, 2.0, 4.0)
        ]
    )
    where = {"part": "poses", "loading": "equilibrium", "dataset": "all"}
    summary = pd.DataFrame([{**at, **where, "iqr": 3.8}])
    landmarks = pd.DataFrame({"sd_mm": [1.0, 1.0]})
    tables = {"spread_over_landmark_sd": spread, "summary": summary, "landmarks": landmarks}
    found = claim(name, tables)
    assert found["verdict"] == "outside"
    told = "a landmark SD of 2.2 mm per axis (2.0 to 2.5) gives 8.44, the study's is 1 mm"
    assert told in found["reason"]
    assert "origins" not in found["reason"]
    origins = [
        {**one, "joint": joint, "quantity": "origin", "coordinate": way, "iqr": one["sd_mm"]}
        for one in spread.to_dict("records")
        for joint in ("L1L2", "L2L3", "L3L4")
        for way in ("anterior", "superior", "right")
    ]
    whole = pd.concat([spread, pd.DataFrame(origins)])
    both = claim(name, tables | {"spread_over_landmark_sd": whole})
    assert "origins then scatter by up to 2.2 mm, printed are 1.04 at most" in both["reason"]
    narrow = tables | {"spread_over_landmark_sd": spread[spread["sd_mm"] < 2.0]}
    assert "even a landmark SD of 1 mm per axis gives 3.8 only" in claim(name, narrow)["reason"]
    assert "landmark SD of" not in claim(name, {"summary": summary})["reason"]

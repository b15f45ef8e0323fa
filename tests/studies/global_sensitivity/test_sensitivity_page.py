"""The page of global sensitivity, from indices of a linear function in closed form.

Would catch a verdict without its condition, a number that no table has, a figure that does not fit.
"""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chain_cases import JOINTS, Chains
from page_rules import (
    all_verdicts,
    faults_of_chart,
    faults_of_page,
    faults_of_sentences,
    faults_of_told,
    verdicts,
)

from spinepipe.cohort import Cohort, read
from spinepipe.report.conclusions import Told, sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.schema import Table
from spinepipe.studies.global_sensitivity import charts
from spinepipe.studies.global_sensitivity.page import page
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import (
    BASE_MOTION,
    BASE_STIFFNESS,
    CONVERGENCE,
    DESIGN,
    FAILED_RUNS,
    INDICES,
    RESPONSES,
)
from spinepipe.tables import StudyTables, from_rows

Rows = list[dict[str, Any]]

PACKAGE = "spinepipe.studies.global_sensitivity"
SLOPES = {"load_size": 4.0, "load_point_x": 2.0, "mass": 0.2, "damping": 0.0, "dummy": 0.0}
"""Of independent standard normals: S1 = ST = slope squared over their sum, mu* = |slope|."""

WHOLE = sum(slope**2 for slope in SLOPES.values())
TESTS = {"flexion": "extension", "left_axial_rotation": "left_rotation"}
INDEX = {
    "sobol": ("S1", "ST"),
    "morris": ("mu_star", "sigma"),
    "latin_hypercube": ("PAWN", "S1_RBD"),
    "fast": ("S1", "ST"),
}
FLOOR = {"PAWN": 0.1, "S1_RBD": 0.02, **dict.fromkeys(("S1", "ST", "mu_star", "sigma"), 1e-12)}
MOTION = ("motion",)
HALF = 0.03
"""Half width of all intervals."""


def table(shape: Table, rows: Rows) -> pd.DataFrame:
    """Rows read back; cells that are not given are empty."""
    names = [column.name for column in shape.columns]
    return from_rows(shape, [{name: row.get(name) for name in names} for row in rows]).to_pandas()


def truth(index: str, factor: str) -> float:
    """Closed form of an index, but for PAWN, which only has to be in order."""
    slope = SLOPES.get(factor, 0.0)
    if index == "mu_star":
        return abs(slope)
    if index == "sigma":
        return 0.0
    share = slope**2 / WHOLE
    return 0.1 + 0.5 * share if index == "PAWN" else share


def places(specimens: Sequence[str], kinds: Sequence[str]) -> Rows:
    names = ("specimen", "output", "test", "joint", "coordinate")
    each = product(specimens, kinds, TESTS, JOINTS, ("extension", "left_rotation"))
    return [{**dict(zip(names, place, strict=True)), "step": 3} for place in each]


def indices(
    method: str = "sobol",
    specimens: Sequence[str] = ("a",),
    factors: Sequence[str] = tuple(SLOPES),
    kinds: Sequence[str] = ("motion", "joint_load"),
    failed: int = 0,
) -> pd.DataFrame:
    """Closed forms as a study's table."""
    rows = []
    for place, index, factor in product(places(specimens, kinds), INDEX[method], factors):
        size, floor = truth(index, factor), FLOOR.get(index, 0.0)
        low = max(size - HALF, 0.0) if size else 0.0
        ends = {} if method == "fast" else {"ci_low": low, "ci_high": size + HALF * (size > 0.0)}
        rows.append(
            {
                **place,
                **ends,
                "index": index,
                "factor": factor,
                "other": "",
                "estimate": size,
                "noise_floor_low": 0.5 * floor if "dummy" in factors else None,
                "noise_floor": floor if "dummy" in factors else None,
                "floor_replicates": 200 if "dummy" in factors else 0,
                "above_floor": low > floor if "dummy" in factors else None,
                "negligible": ends["ci_high"] < 0.01 if index == "ST" and ends else None,
                "conditional": failed > 0,
                "runs": 3072 - 12 * failed,
                "failed": failed,
                "status": "done",
                "message": "",
            }
        )
    return table(INDICES, rows)


def convergence(found: pd.DataFrame, off: float = 0.2) -> pd.DataFrame:
    """Estimates that are off by so much at a quarter of the runs, by a quarter of it at half."""
    grown = [
        {
            **row,
            "samples": runs // 12,
            "runs": runs,
            "estimate": row["estimate"] + wrong * off * (row["factor"] == "load_size"),
        }
        for runs, wrong in ((768, 1.0), (1536, 0.25), (3072, 0.0))
        for row in found.to_dict("records")
    ]
    return table(CONVERGENCE, [{str(k): v for k, v in row.items()} for row in grown])


def runs(n: int = 600, lost: int = 5, **groups: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Responses and design of the function itself; joint L4L5 moves twice as far as the others."""
    rng = np.random.default_rng(1)
    values = {name: rng.normal(size=n) for name in SLOPES}
    units = {"load_point_x": "mm"}
    values["load_size"] = np.exp(values["load_size"])
    output = sum(slope * values[name] for name, slope in SLOPES.items())
    design = [
        {
            "sample": k,
            "factor": name,
            "value": values[name][k],
            "group": groups.get(name, name),
            "unit": units.get(name, "1"),
        }
        for k in range(n)
        for name in SLOPES
    ]
    answers: Rows = []
    for k, test, joint in product(range(n), TESTS, JOINTS):
        gone, size = k < lost, (1.0 + (joint == "L4L5")) * np.asarray(output)[k]
        sizes = (
            {}
            if gone
            else {
                column.name: size for column in RESPONSES.columns if column.unit in ("deg", "N m")
            }
        )
        answers.append(
            {
                "specimen": "a",
                "sample": k,
                "test": test,
                "step": 3,
                "joint": joint,
                **sizes,
                "status": "unstable" if gone else "converged",
                "message": "",
            }
        )
    return table(RESPONSES, answers), table(DESIGN, design)


@pytest.fixture
def cohort(tmp_path: Path) -> Cohort:
    stiffness = np.array([[50.0, 60.0, 200.0]] * len(JOINTS))
    Chains({"a": stiffness, "b": stiffness}, tuple(TESTS), steps=4).write(tmp_path)
    return read(tmp_path / "config" / "cohorts" / "chains")


def study(method: str = "sobol", **more: Any) -> GlobalSensitivity:
    factors = [
        {"of": "load_size", "times": {"low": 0.9, "high": 1.1}},
        {"of": "load_point", "axis": "x", "offset_mm": {"sd": 2.0}},
        {"of": "mass", "times": {"sd": 0.1}},
        {"of": "damping", "times": {"sd": 0.1}},
    ]
    head = {"study": "probe", "kind": "global_sensitivity", "cohort": "chains", "factors": factors}
    return GlobalSensitivity.model_validate(
        {**head, "design": {"method": method, "samples": 256}, **more}
    )


def told_of(cohort: Cohort, asked: GlobalSensitivity, **tables: pd.DataFrame) -> Page:
    """The page of these tables, its rules held."""
    results = ResultTables(StudyTables(tables))
    made = page(asked, cohort, results)
    assert list(faults_of_told(made.told)) == []
    assert list(faults_of_page(made.html(asked, cohort, results))) == []
    return made


def one(made: Page, rule: str) -> Told:
    """The first sentence of a rule."""
    return next(found for found in made.told if found.rule == rule)


def spoilt(found: pd.DataFrame, **changes: tuple[Any, ...]) -> pd.DataFrame:
    """Indices with other estimates: ``(index, factor, joint or "", estimate)`` by any name."""
    found = found.copy()
    for index, factor, joint, size in changes.values():
        rows = (found["index"] == index) & (found["factor"] == factor)
        rows &= (found["joint"] == joint) if joint else True
        found.loc[rows, ["estimate", "ci_low", "ci_high"]] = size, size - HALF, size + HALF
        found.loc[rows, "above_floor"] = size - HALF > 0.0
    return found


def base(
    fits: Sequence[str] = ("fitted",), verdict: str = "near", ratio: float = 1.1, known: bool = True
) -> Any:
    """Tables of the spine that inputs start from."""
    fitted = [
        {
            **{"specimen": f"s{n}", "joint": "*", "coordinate": "extension", "unit": "N m/rad"},
            **{"source": source, "start": 51.0, "stiffness": 40.0, "low": 30.0, "high": 60.0},
            **{"identifiable": known if source == "fitted" else None},
            **{"status": "converged", "message": ""},
        }
        for n, source in enumerate(fits)
    ]
    measured = {"measured": 1.0, "ratio": ratio} if verdict in ("near", "far") else {}
    moved = {
        **{"specimen": "s0", "test": "flexion", "step": 3, "joint": "*", "coordinate": "extension"},
        **{"unit": "deg", "loaded": True, "predicted": ratio, "noise": 0.0, "verdict": verdict},
        **{"status": "converged", "message": "", **measured},
    }
    return {
        "base_stiffness": table(BASE_STIFFNESS, fitted),
        "base_motion": table(BASE_MOTION, [moved]),
    }


def failures(failed: int, of: int = 3072) -> pd.DataFrame:
    counts = dict.fromkeys(("low_third", "middle_third", "high_third", "tipped"), 0)
    row = {
        **{"specimen": "a", "test": "flexion", "factor": "mass", "unit": "1", "runs": of},
        **{"failed": failed, "not_converged": 0, "refused": 0, "left_out": failed, **counts},
        **{"mostly": "nowhere"},
    }
    return table(FAILED_RUNS, [row])


FITTED = {"stiffness": "fitted"}
WIDE = {"of": "stiffness", "coordinate": "extension", "times": {"low": 0.5, "high": 1.2}}
NARROW = {**WIDE, "times": {"low": 0.9, "high": 1.2}}


def cases() -> dict[str, tuple[dict[str, Any], dict[str, Any], set[tuple[str, str]]]]:
    """Made-up studies: settings, tables, and the verdicts that each must come to."""
    plain = indices()
    alone = spoilt(plain, a=("S1", "load_size", "", 0.1), b=("S1", "load_point_x", "", 0.3))
    close = spoilt(plain, a=("ST", "load_point_x", "", 0.78))
    apart = spoilt(plain, a=("ST", "load_point_x", JOINTS[0], 0.95))
    quiet = plain.assign(above_floor=False)
    none = plain.assign(estimate=np.nan, ci_low=np.nan, ci_high=np.nan, status="too_few")
    none = none.assign(message="too few runs are left")
    fixed = plain.assign(negligible=plain["negligible"] & (plain["factor"] == "nothing"))
    elsewhere = plain.assign(negligible=plain["negligible"] & (plain["output"] == "motion"))
    two = indices(specimens=("a", "b"))
    mine = (two["specimen"] == "b") & (two["index"] == "ST")
    leads = two["factor"].map({"load_size": 0.3, "load_point_x": 0.7}).where(mine)
    two["estimate"] = leads.fillna(two["estimate"])
    two["ci_low"] = (leads - HALF).fillna(two["ci_low"])
    two["ci_high"] = (leads + HALF).fillna(two["ci_high"])
    between = spoilt(plain, a=("S1", "load_size", "", 0.40), b=("S1", "load_point_x", "", 0.41))
    ran, design = runs()
    flat = ran.copy()
    angles = [column.name for column in RESPONSES.columns if column.unit in ("deg", "N m")]
    flat[angles] = np.random.default_rng(7).normal(size=(len(flat), len(angles)))
    falls = ran.copy()
    falls[angles] = -falls[angles] + 100.0
    partly = plain.copy()
    partly.loc[partly.index[:5], "status"] = "too_few"
    return {
        "clear": (
            {},
            {
                "indices": plain,
                "convergence": convergence(plain, 0.1),
                "failed_runs": failures(0),
                **base(["given"]),
            },
            {("leading", "clear"), ("interaction", "little"), ("negligible", "some")}
            | {("convergence", "level"), ("stiffness", "check_given"), ("base_spine", "ok")}
            | {("runs", "ok"), ("without", "ok"), ("dummy", "ok"), ("load", "one")}
            | {("share", rank) for rank in ("first", "second", "third")}
            | {("methods", "sobol"), ("spreads", "given")},
        ),
        "alone another leads": (
            FITTED,
            {"indices": alone, "convergence": convergence(alone, 0.5), **base()},
            {("leading", "with_others"), ("interaction", "much"), ("convergence", "moving")}
            | {("stiffness", "ok")},
        ),
        "intervals overlap": (
            {**FITTED, "factors": [WIDE]},
            {"indices": close, **base(["fitted", "at_bound"], "far", 3.0)},
            {("leading", "overlap"), ("load", "overlap"), ("stiffness", "check_bound")}
            | {("base_spine", "stop_far"), ("spread", "check")},
        ),
        "stiffness is open": (
            {**FITTED, "factors": [NARROW]},
            {"indices": plain, **base(known=False)},
            {("stiffness", "check_open")},
        ),
        "stiffness is nobody's": (
            {**FITTED, "factors": [NARROW]},
            {"indices": plain, **base(["not_free"])},
            {("stiffness", "check_free")},
        ),
        "joints differ": (
            {**FITTED, "factors": [NARROW]},
            {"indices": apart, **base(["fitted", "no_fit"], "no_equilibrium")},
            {
                ("leading", "by_joint"),
                ("load", "by_joint"),
                ("stiffness", "stop"),
                ("base_spine", "stop_falls"),
            }
            | {("spread", "ok")},
        ),
        "specimens differ": ({}, {"indices": two}, {("leading", "by_specimen")}),
        "alone the intervals overlap": ({}, {"indices": between}, {("leading", "clear")}),
        "negligible for motion alone": (
            {},
            {"indices": elsewhere},
            {("negligible", "of_first")},
        ),
        "nothing above the floor": (
            {},
            {"indices": quiet, "failed_runs": failures(30), **base(verdict="not_measured")},
            {("leading", "none"), ("load", "none"), ("runs", "check"), ("base_spine", "check")},
        ),
        "no index": (
            {},
            {"indices": none, "failed_runs": failures(1000)},
            {("leading", "no_index"), ("without", "check"), ("runs", "stop")},
        ),
        "nothing negligible": (
            {"dummy": False},
            {"indices": fixed, "responses": ran, "design": design},
            {("negligible", "none"), ("direction", "rises"), ("dummy", "check")},
        ),
        "falls": (
            {},
            {"indices": partly, "responses": falls, "design": design},
            {("direction", "falls"), ("without", "check")},
        ),
        "neither rises nor falls": (
            {},
            {"indices": plain, "responses": flat, "design": design},
            {("direction", "bent")},
        ),
        "fast": (
            {"design": {"method": "fast", "samples": 256}},
            {"indices": indices("fast")},
            {("methods", "fast"), ("negligible", "not_asked"), ("leading", "order_only")},
        ),
        "morris": (
            {"design": {"method": "morris", "samples": 256}},
            {"indices": indices("morris")},
            {("methods", "morris"), ("leading", "clear")},
        ),
        "latin hypercube": (
            {"design": {"method": "latin_hypercube", "samples": 256}},
            {"indices": indices("latin_hypercube")},
            {("methods", "latin_hypercube")},
        ),
    }


@pytest.mark.parametrize("name", list(cases()))
def test_a_made_up_study_comes_to_its_verdicts(name: str, cohort: Cohort) -> None:
    settings, tables, expected = cases()[name]
    made = told_of(cohort, study(**settings), **tables)
    assert expected <= verdicts(made.conclusions)


def test_every_sentence_is_reached_and_keeps_the_rules() -> None:
    reached = set().union(*(expected for _, _, expected in cases().values()))
    assert reached == all_verdicts(sentences_of(PACKAGE))
    assert list(faults_of_sentences(PACKAGE)) == []


def test_shares_are_those_of_the_closed_form(cohort: Cohort) -> None:
    """ST of a linear function is the square of a slope over the sum of squares."""
    made = told_of(cohort, study(), indices=indices())
    shares = [found.values["value"] for found in made.at("key")]
    expected = sorted((slope**2 for slope in SLOPES.values()), reverse=True)[:3]
    assert [one.number for one in shares] == pytest.approx(
        [100.0 * square / WHOLE for square in expected]
    )
    assert all(one.unit == "%" for one in shares)
    assert one(made, "negligible").values["count"].number == 1, "damping; mass reaches 3 %"


def test_an_effect_has_the_unit_of_its_output(cohort: Cohort) -> None:
    made = told_of(cohort, study("morris"), indices=indices("morris"))
    assert one(made, "leading").values["share"].unit == "°"
    units = [found.values["share"].unit for found in made.told if found.rule == "load"]
    assert units == ["°", "N m", "N m"], "the second test, then loads of both"


def test_runs_are_not_told_where_no_table_counts_them(cohort: Cohort) -> None:
    found = told_of(cohort, study(), indices=indices())
    assert not [one for one in found.told if one.rule == "runs"]


def test_flexion_falls_where_its_negative_extension_rises(cohort: Cohort) -> None:
    """The size of motion is told of: extension from -100 up is less flexion."""
    ran, design = runs()
    angles = [column.name for column in RESPONSES.columns if column.unit == "deg"]
    ran[angles] = ran[angles] - 100.0
    made = told_of(cohort, study(), indices=indices(), responses=ran, design=design)
    assert one(made, "direction").verdict == "falls"


@pytest.mark.parametrize("method", ["sobol", "morris", "latin_hypercube", "fast"])
@pytest.mark.parametrize("specimens", [("a",), ("a", "b")])
def test_figures_hold_their_words(method: str, specimens: tuple[str, ...], cohort: Cohort) -> None:
    found = indices(method, specimens)
    ran, design = runs(lost=0)
    tables = {"indices": found, "convergence": convergence(found)}
    every = {**tables, "responses": ran, "design": design}
    for draw in (charts.indices, charts.convergence, charts.runs):
        assert list(faults_of_chart(draw(study(method), cohort, every))) == []


def test_a_figure_without_results_says_why(cohort: Cohort) -> None:
    none = indices().assign(estimate=np.nan, status="too_few", message="too few runs are left")
    ran, design = runs(lost=600)
    tables = {"indices": none, "convergence": convergence(none), "responses": ran, "design": design}
    for draw in (charts.indices, charts.convergence, charts.runs):
        assert "too few runs are left" in draw(study(), cohort, tables).caption
    shown = charts.runs(study(), cohort, {**tables, "indices": indices()})
    assert shown.caption == "No run has an equilibrium."


def test_the_median_along_a_slope_is_the_slope() -> None:
    x = np.linspace(0.0, 1.0, 2000)
    at, (low, middle, high) = charts.running(x, 3.0 * x)
    np.testing.assert_allclose(middle, 3.0 * at, rtol=1e-3)
    assert (low < middle).all()
    assert (middle < high).all()

"""Figures and findings of global sensitivity, from indices of a linear function in closed form.

Would catch bars, intervals, floors and names that do not stand where the table has them, and
sentences with other numbers or without their conditions.
"""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chain_cases import JOINTS, Chains
from drawn import drawings
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from sweeps import sweep

from spinepipe.cohort import Cohort, read
from spinepipe.report.page.document import Picture, ResultTables
from spinepipe.report.style import style
from spinepipe.schema import Table
from spinepipe.studies.global_sensitivity.figures.panels import (
    choose_panels,
    leading,
    measures_of,
    outputs,
    pool,
)
from spinepipe.studies.global_sensitivity.figures.scatter import running
from spinepipe.studies.global_sensitivity.findings import (
    LEFT_OUT,
    driver,
    findings,
    most,
    opening,
    settled,
)
from spinepipe.studies.global_sensitivity.kind import KIND
from spinepipe.studies.global_sensitivity.largest_moment import largest_moment
from spinepipe.studies.global_sensitivity.page import document, shown_tables
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import CONVERGENCE, DESIGN, INDICES, RESPONSES
from spinepipe.tables import StudyTables, from_rows

Rows = list[dict[str, Any]]

ROOT = Path(__file__).resolve().parents[3]
DRAW = drawings("global_sensitivity")
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


def results(**tables: pd.DataFrame) -> ResultTables:
    return ResultTables(StudyTables(tables), {}, {})


def drawn(name: str, cohort: Cohort, **tables: pd.DataFrame) -> Figure:
    with style():
        return DRAW[name](study(), cohort, StudyTables(tables))


def top_factors(cohort: Cohort, *tables: pd.DataFrame) -> Figure:
    named = zip(("responses", "design", "indices"), tables, strict=True)
    return drawn("top_factors", cohort, **dict(named))


def titles(figure: Figure) -> list[str]:
    return [a.get_title("left")[4:] for a in figure.axes if a.get_visible()]


def said(figure: Figure) -> str:
    texts = [*figure.texts]
    for legend in figure.legends:
        texts += [legend.get_title(), *legend.get_texts()]
    return " ".join(" ".join(text.get_text() for text in texts).split())


def x_of(line: Any) -> Any:
    """Where a line's points are along x."""
    return np.asarray(line.get_xdata())


def bands(axis: Axes) -> list[Any]:
    """Patches as high as the panel."""
    patches: list[Any] = list(axis.patches)
    return [patch for patch in patches if patch.get_height() == 1.0]


def labels(axis: Axes) -> list[str]:
    """Names of rows from the top down."""
    return [label.get_text() for label in axis.get_yticklabels()][::-1]


def name_colors(axis: Axes) -> dict[str, Any]:
    """Colour of each row's name."""
    return {label.get_text(): label.get_color() for label in axis.get_yticklabels()}


def test_a_bar_for_each_index_of_each_factor_in_order(cohort: Cohort) -> None:
    figure = drawn("factor_indices", cohort, indices=indices())
    assert len(titles(figure)) == 12, "2 outputs x 2 tests x 3 joints"
    first = figure.axes[0]
    names = ["load size", "load point x", "mass", "damping", "dummy (no effect)"]
    assert labels(first) == names
    assert [len(bars) for bars in first.containers] == [5, 5]
    for bars in first.containers:
        widths = [bar.get_width() for bar in bars]
        assert widths == pytest.approx([slope**2 / WHOLE for slope in SLOPES.values()])
        np.testing.assert_allclose(np.diff([bar.get_y() for bar in bars]), -1.0)
    assert first.get_xlabel() == "share of variance"
    assert "3 072 runs, none failed" in said(figure)
    assert "total index ST first-order index S1 interval" in said(figure)


def test_intervals_are_drawn_at_their_ends(cohort: Cohort) -> None:
    axis = drawn("factor_indices", cohort, indices=indices(kinds=MOTION)).axes[0]
    ends = {tuple(np.round(x_of(line), 9)) for line in axis.lines}
    share = 16.0 / WHOLE
    assert (round(share - HALF, 9), round(share + HALF, 9)) in ends
    fast = drawn("factor_indices", cohort, indices=indices("fast", kinds=MOTION))
    assert "interval" not in said(fast)
    assert len(fast.axes[0].lines) == 1, "the line at 0"


def test_the_noise_floor_is_a_band_and_names_in_it_are_grey(cohort: Cohort) -> None:
    figure = drawn("factor_indices", cohort, indices=indices("latin_hypercube", kinds=MOTION))
    axis = figure.axes[0]
    (band,) = bands(axis)
    assert band.get_x() + band.get_width() == pytest.approx(FLOOR["PAWN"])
    dashed = [float(x_of(line)[0]) for line in axis.lines if line.get_linestyle() == "--"]
    assert sorted(dashed) == sorted([FLOOR["PAWN"], FLOOR["S1_RBD"]])
    assert band.get_x() == pytest.approx(0.5 * FLOOR["PAWN"])
    colors = [label.get_color() for label in axis.get_yticklabels()][::-1]
    assert colors[0] == "#000000"
    assert set(colors[2:]) == {"#767676"}
    assert "noise floor, an interval" in said(figure)
    assert "grey names: above the noise floor in no panel" in said(figure)
    sobol = drawn("factor_indices", cohort, indices=indices(kinds=MOTION))
    assert not bands(sobol.axes[0])
    assert "the noise floor is too low to be seen" in said(sobol)
    assert "grey names: negligible in every panel" in said(sobol)
    bare = drawn(
        "factor_indices", cohort, indices=indices(factors=tuple(SLOPES)[:-1], kinds=MOTION)
    )
    assert "no dummy, so no noise floor" in said(bare)


def test_what_is_negligible_is_grey_beside_its_line(cohort: Cohort) -> None:
    """Mass has an ST of 0.2 %: its name is black while its interval reaches over 1 %."""
    wide = drawn("factor_indices", cohort, indices=indices(kinds=MOTION)).axes[0]
    assert [0.01, 0.01] in [list(x_of(line)) for line in wide.lines]
    assert name_colors(wide)["mass"] == "#000000"
    assert name_colors(wide)["damping"] == "#767676"
    narrow = indices(kinds=MOTION)
    of_mass = narrow["factor"].eq("mass") & narrow["index"].eq("ST")
    narrow.loc[of_mass, ["ci_high", "negligible"]] = [0.004, True]
    axis = drawn("factor_indices", cohort, indices=narrow).axes[0]
    assert name_colors(axis)["mass"] == "#767676"


def test_panels_that_lack_failed_runs_have_a_dagger(cohort: Cohort) -> None:
    figure = drawn("factor_indices", cohort, indices=indices(failed=3, kinds=MOTION))
    assert all("\u2020\n" in title for title in titles(figure))
    assert "3 failed; \u2020: indices of inputs at which runs stand" in said(figure)
    whole = drawn("factor_indices", cohort, indices=indices(kinds=MOTION))
    assert not any("\u2020" in title for title in titles(whole))


def test_effects_have_the_unit_of_their_output(cohort: Cohort) -> None:
    figure = drawn("factor_indices", cohort, indices=indices("morris"))
    assert [axis.get_xlabel() for axis in figure.axes[:12]] == ["μ*, σ (°)"] * 6 + [
        "μ*, σ (N m)"
    ] * 6
    assert [bar.get_width() for bar in figure.axes[0].containers[0]] == list(SLOPES.values())


def test_each_test_is_shown_in_the_coordinate_that_it_loads(cohort: Cohort) -> None:
    assert largest_moment(cohort, "flexion") == ("extension", 3)
    assert largest_moment(cohort, "left_axial_rotation") == ("left_rotation", 3)
    assert largest_moment(cohort, "nobody did this") is None
    figure = drawn("factor_indices", cohort, indices=indices())
    assert titles(figure)[0] == "Flexion, L3L4\nMotion, flexion–extension"
    assert titles(figure)[-1] == "Left axial rotation, L5S1\nMoment, axial rotation"


def test_a_force_beside_the_spine_loads_by_its_lever() -> None:
    """The published experiment has no moment, only 54 N in front of the spine."""
    cohort = read(ROOT / "config" / "cohorts" / "palanca_l1l4")
    assert largest_moment(cohort, "flexion") == ("extension", 1)


def test_several_specimens_are_means_with_dots(cohort: Cohort) -> None:
    found = indices(specimens=("a", "b"))
    doubled = found["estimate"].where(found["specimen"] == "a", 0.5 * found["estimate"])
    figure = drawn("factor_indices", cohort, indices=found.assign(estimate=doubled))
    assert len(titles(figure)) == 4
    widths = [bar.get_width() for bar in figure.axes[0].containers[0]]
    assert widths[0] == pytest.approx(0.75 * 16.0 / WHOLE)
    (dots,) = {len(x_of(line)) for line in figure.axes[0].lines if line.get_marker() == "o"}
    assert dots == 6 * 2, "of load size and load point; smaller ones would blur the line at 0"
    assert "means over the joints of 2 specimens" in said(figure)


def test_factors_without_effect_leave_room_for_the_others(cohort: Cohort) -> None:
    many = (*SLOPES, *(f"landmark_{n}" for n in range(40)))
    figure = drawn("factor_indices", cohort, indices=indices(factors=many, kinds=MOTION))
    assert len(labels(figure.axes[0])) == 7
    assert labels(figure.axes[0])[-1] == "dummy (no effect)"
    assert "38 more factors without any effect" in said(figure)


def test_pooled_ends_are_means_of_ends() -> None:
    rows = pd.DataFrame(
        {
            "index": "ST",
            "factor": ["x", "x", "y"],
            "estimate": [0.2, 0.4, 0.1],
            "ci_low": [0.1, 0.2, 0.0],
            "ci_high": [0.3, 0.8, 0.2],
        }
    )
    one = pool(rows).iloc[0]
    found = [one[name] for name in ("estimate", "low", "high", "lowest", "highest", "places")]
    assert found == pytest.approx([0.3, 0.15, 0.55, 0.2, 0.4, 2])


def test_factors_are_in_order_over_outputs_of_different_units(cohort: Cohort) -> None:
    found = indices("morris")
    large = found["output"].eq("joint_load") & found["factor"].eq("mass")
    found.loc[large & found["index"].eq("mu_star"), "estimate"] = 4000.0
    measures = measures_of(found)
    assert measures is not None
    order = leading(outputs(cohort, found, measures), measures)
    assert order[:3] == ["mass", "load_size", "load_point_x"], "shares: 0.525, 0.5005, 0.25"


def test_calibrated_stiffness_has_its_own_panels(cohort: Cohort) -> None:
    found = indices(kinds=MOTION)
    own = found[(found["output"] == "motion") & (found["test"] == "flexion")]
    own = own[own["joint"] == JOINTS[0]].assign(output="stiffness", test="*", joint="*", step=None)
    figure = drawn("factor_indices", cohort, indices=pd.concat([found, own]))
    assert titles(figure)[-2:] == ["Stiffness, flexion–extension", "Stiffness, axial rotation"]


def test_convergence_shows_leading_factors_and_the_dummy(cohort: Cohort) -> None:
    found = indices()
    figure = drawn("index_convergence", cohort, convergence=convergence(found), indices=found)
    assert len(titles(figure)) == 4, "12 panels are too many: joints together"
    axis = figure.axes[0]
    line = next(line for line in axis.lines if line.get_label() == "load size")
    share = 16.0 / WHOLE
    np.testing.assert_allclose(x_of(line), [768, 1536, 3072])
    np.testing.assert_allclose(
        np.asarray(line.get_ydata(), dtype=float), [share + 0.2, share + 0.05, share]
    )
    key: Any = axis.get_legend()
    names = [text.get_text() for text in key.get_texts()]
    assert names == ["load size", "load point x", "mass", "dummy (no effect)"]
    assert axis.get_xscale() == "log"
    assert len(axis.collections) == 4, "a band for each line"
    whole = convergence(found).query("runs == 3072")
    alone = drawn("index_convergence", cohort, convergence=whole, indices=found)
    assert "no smaller part" in said(alone)


def test_runs_over_the_leading_factors(cohort: Cohort) -> None:
    responses, design = runs()
    figure = top_factors(cohort, responses, design, indices())
    first = figure.axes[:3]
    assert [axis.get_xlabel() for axis in first] == [
        "load size (times)",
        "load point x (mm)",
        "mass (times)",
    ]
    assert first[0].get_ylabel() == "Flexion, L4L5\nmotion in flexion–extension (°)"
    share = 16.0 / WHOLE
    expected = f"ST {share:.2f} ({share - HALF:.2f} to {share + HALF:.2f})"
    assert titles(figure)[0] == expected
    assert [axis.get_xscale() for axis in first[:2]] == ["log", "linear"]
    dots = first[0].lines[0]
    assert len(x_of(dots)) == 595, "5 of 600 runs have no equilibrium"
    assert "595 runs with an equilibrium" in said(figure)
    assert "5 runs without" in said(figure)
    (crosses,) = [line for line in first[0].lines if line.get_marker() == "x"]
    lost = design[design["factor"].eq("load_size") & design["sample"].lt(5)]["value"]
    assert sorted(x_of(crosses)) == sorted(lost), "of the samples that failed, at their values"
    none = top_factors(cohort, *runs(lost=0), indices())
    assert not [line for line in none.axes[0].lines if line.get_marker() == "x"]


def test_a_group_is_shown_by_the_member_that_the_output_follows(cohort: Cohort) -> None:
    responses, design = runs(load_size="rig", load_point_x="rig")
    grouped = indices(factors=("rig", "mass", "damping", "dummy"))
    grouped.loc[grouped["factor"] == "rig", "estimate"] = 0.99
    figure = top_factors(cohort, responses, design, grouped)
    assert figure.axes[0].get_xlabel() == "load size (times)"
    assert titles(figure)[0] == "in a group"
    assert "of a group the factor" in said(figure)


def test_running_median_of_a_line_is_the_line() -> None:
    x = np.arange(1000.0)
    at, (low, middle, high) = running(x, 2.0 * x)
    np.testing.assert_allclose(middle, 2.0 * at)
    assert np.all((low < middle) & (middle < high))
    levels = np.repeat([0.0, 1.0, 2.0, 3.0], 10)
    at, found = running(levels, levels**2)
    assert list(at) == [0.0, 1.0, 2.0, 3.0]
    assert list(found[1]) == [0.0, 1.0, 4.0, 9.0]


def test_nothing_to_show_is_said_with_its_reason(cohort: Cohort) -> None:
    why = "40 failed runs: 90 of 256 base samples left out"
    lost = indices().assign(status="too_many_failed", message=why, estimate=np.nan)
    responses, design = runs(60, 0)
    tables = {
        "indices": lost,
        "convergence": convergence(lost),
        "responses": responses,
        "design": design,
    }
    for name in DRAW:
        assert why in said(drawn(name, cohort, **tables))
    gone = responses.assign(status="unstable")
    assert "none has an equilibrium" in said(top_factors(cohort, gone, design, indices()))


def told(cohort: Cohort, found: pd.DataFrame, place: int = 0) -> str:
    measures = measures_of(found)
    assert measures is not None
    panel = outputs(cohort, found, measures)[place]
    return driver(panel, measures, cohort.joint_names).replace("\u00a0", " ")


def test_the_sentence_of_an_output_has_its_numbers(cohort: Cohort) -> None:
    words = told(cohort, indices())
    assert words.startswith("Flexion, motion in flexion–extension (share of the variance")
    assert "load size 80 % [77 to 83 %] and load point x 20 % [17 to 23 %]" in words
    assert "hardly any interaction" in words
    assert "overlap" not in words
    assert "Not above the dummy: mass and damping." in words
    assert "Negligible (interval below 1 % at every joint): damping." in words
    assert "Small, but not shown to be negligible: mass." in words
    effects = told(cohort, indices("morris"), place=2)
    assert "load size 4.00 N m [3.97 to 4.03 N m]" in effects
    pawn = told(cohort, indices("latin_hypercube"))
    assert "load size 0.50 [0.47 to 0.53] and load point x 0.20 [0.17 to 0.23]" in pawn


def test_intervals_that_overlap_leave_the_order_open(cohort: Cohort) -> None:
    found = indices()
    found.loc[found["factor"] == "load_point_x", "ci_high"] = 0.9
    assert "intervals of load size and load point x overlap" in told(cohort, found)


def test_joints_with_leaders_of_their_own_are_told_apart(cohort: Cohort) -> None:
    found = indices()
    swap = found["joint"].eq("L4L5") & found["output"].eq("motion")
    names = {"load_size": "load_point_x", "load_point_x": "load_size"}
    found.loc[swap, "factor"] = found.loc[swap, "factor"].replace(names)
    words = told(cohort, found)
    assert "at L3L4 load size 80 % [77 to 83 %], at L4L5 load point x 80 %" in words
    measures = measures_of(found)
    assert measures is not None
    panels = outputs(cohort, found, measures)
    assert most(panels, measures, cohort.joint_names) == (
        "Motion hangs most on load size or load point x, by test and joint; joint load on load "
        "size."
    )
    assert len(choose_panels(panels, cohort.joint_names, 12)) == 12
    assert len(choose_panels(panels, cohort.joint_names, 2)) == 2


@sweep("method", LEFT_OUT)
def test_failed_runs_are_told_with_the_rule(cohort: Cohort, method: str) -> None:
    found = results(indices=indices(method, failed=3, kinds=MOTION))
    sure = opening(study(method), cohort, found).how_sure
    assert "at most 3 failed" in sure
    assert LEFT_OUT[method] in sure
    assert "3\u2009036 runs or more" in sure
    none = results(indices=indices(method, kinds=MOTION))
    assert "none failed" in opening(study(method), cohort, none).how_sure


def test_how_far_indices_have_settled(cohort: Cohort) -> None:
    found = indices()
    measures = measures_of(found)
    assert measures is not None
    panels = outputs(cohort, found, measures)
    words = settled(convergence(found, off=0.4), panels, measures, cohort.joint_names)
    assert words.startswith("From 1\u2009536 runs to all of them, total index ST")
    assert words.endswith("changed by at most 0.10.")


def test_outputs_without_an_index_are_told(cohort: Cohort) -> None:
    found = indices()
    lost = (found["output"] == "joint_load") & (found["test"] == "flexion")
    found.loc[lost, ["status", "message"]] = ["too_many_failed", "far too many"]
    found.loc[lost, "estimate"] = np.nan
    (warning,) = opening(study(), cohort, results(indices=found)).warnings
    assert warning.startswith("6 of 24 outputs have no index")
    assert "far too many" in warning
    constant = found.assign(status=found["status"].replace("too_many_failed", "constant"))
    made = results(indices=constant)
    assert opening(study(), cohort, made).warnings == ()
    assert any("vary with no factor" in words for words in findings(study(), cohort, made))


def test_interactions_above_their_noise_are_told(cohort: Cohort) -> None:
    found = indices()
    pair = found[found["index"] == "S1"].query("factor == 'load_size'")
    numbers = {"estimate": 0.2, "ci_low": 0.15, "ci_high": 0.25, "noise_floor": 0.1}
    pair = pair.assign(index="S2", other="mass", above_floor=True, **numbers)
    both = results(indices=pd.concat([found, pair]))
    words = " ".join(findings(study(), cohort, both))
    assert "(S2): load size with mass 0.20 [0.15 to 0.25]." in words
    hidden = results(indices=pd.concat([found, pair.assign(above_floor=False)]))
    assert "no interaction of two factors" in " ".join(findings(study(), cohort, hidden))
    names = [shown.title for shown in shown_tables(cohort, both)]
    assert names[0] == "Leading factors of every output"
    assert "Interactions of two factors" in names


def test_a_design_too_small_for_any_index_still_has_a_page(cohort: Cohort) -> None:
    none = indices().assign(
        status="too_few", message="2 base samples", estimate=np.nan, ci_low=np.nan, ci_high=np.nan
    )
    made = results(indices=none, convergence=convergence(none))
    assert shown_tables(cohort, made) == []
    page = document(study(), cohort, made).html(study(), cohort)
    assert "2 base samples" in page


def test_the_page_opens_with_the_answer_and_fetches_nothing(cohort: Cohort) -> None:
    found = indices()
    svg = "<svg xmlns='http://www.w3.org/2000/svg'/>"
    pictures = {
        figure.name: Picture.of(figure.name, figure.title, svg, f"caption of {figure.name}")
        for figure in KIND.figures
    }
    tables = StudyTables({"indices": found, "convergence": convergence(found)})

    def page_of(asked: GlobalSensitivity) -> str:
        return document(asked, cohort, ResultTables(tables, {}, pictures)).html(asked, cohort)

    page = page_of(study(dummy=True))
    assert '<p class="headline">Motion and joint load' not in page, "each output by its name"
    assert "Motion hangs most on load size; joint load on load size." in page
    places_ = [page.index(f'<section id="{name}"') for name in ("findings", "figures", "tables")]
    assert places_ == sorted(places_)
    assert all(f"caption of {name}" in page for name in DRAW)
    assert "calibrated stiffness (outputs: stiffness: false)" in page
    assert "no dummy factor" in page_of(study(dummy=False))

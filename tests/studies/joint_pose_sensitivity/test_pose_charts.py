"""Figures of a joint-pose study: text fits, whatever the study is, and numbers are those of tables.

Catches text over text, a figure that fails where nothing was found, limits of agreement with other
intervals than theirs, zeros of step 0 as readings, and a paper's numbers beside another cohort.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd
import pose_tables as made
import pytest
from page_rules import faults_of_chart, faults_of_page
from scipy.stats import nct
from study_cases import FIGURES, STUDY, Size, drawing, project

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Drawing
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.rows import Rows
from spinepipe.report.page.study_page import ResultTables
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.page import page
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import StudyTables

Settings = tuple[JointPoseSensitivity, Cohort]
LONG = "specimen_with_a_name_of_40_letters_" + "x" * 5
NM_PER_DEG = np.pi / 180.0


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    """One specimen, ``a``, of two joints."""
    return study_and_cohort(str(project(tmp_path_factory.mktemp("one"), Size(("a",)))), STUDY)


def chart(name: str, study: Settings, tables: Mapping[str, list[made.Row]]) -> Chart:
    return drawing(name)(*study, made.frames({**made.whole(), **tables}))


def of_specimens(*names: str) -> dict[str, list[made.Row]]:
    """The same rows for each of them."""
    return {
        table: [{**row, "specimen": name} for name in names for row in rows]
        for table, rows in made.whole().items()
    }


@pytest.mark.parametrize("name", FIGURES)
def test_text_fits_for_one_specimen_and_for_long_names(
    name: str, study: Settings, tmp_path: Path
) -> None:
    assert list(faults_of_chart(chart(name, study, {}))) == []
    size = Size((LONG, "b", "c"))
    several = study_and_cohort(str(project(tmp_path, size)), STUDY)
    assert list(faults_of_chart(chart(name, several, of_specimens(*size.specimens)))) == []


@pytest.mark.parametrize("name", FIGURES)
def test_where_nothing_was_found_a_figure_says_so(name: str, study: Settings) -> None:
    """No fit is retained, none has a status to be used, no share or SD has a result."""
    gone = {
        "success": made.success(left_out=made.N),
        "variance_shares": [
            {**row, "status": "constant"} for row in made.whole()["variance_shares"]
        ],
        "stiffness_over_load_point": [
            {**row, "status": "unstable"} for row in made.over_load_point()
        ],
        "posterior": made.posterior(status="not_converged"),
        "landmark_precision": [{**row, "median": None} for row in made.precision(1.0)],
    }
    found = chart(name, study, gone)
    assert found.caption.endswith(".")
    assert not [panel for panel in found.panels if isinstance(panel, Rows | Curves)]
    assert list(faults_of_chart(found)) == []


@pytest.mark.parametrize("sds", [(1.0,), (0.5, 5.0), tuple(np.linspace(0.5, 4.0, 8).tolist())])
def test_any_number_of_landmark_precisions_can_be_read(
    sds: tuple[float, ...], study: Settings
) -> None:
    found = chart("landmark_precision", study, {"landmark_precision": made.precision(*sds)})
    assert list(faults_of_chart(found)) == []
    for panel in found.panels:
        rows = cast(Curves, panel).frame
        seen = rows[rows["series"] == "calibrated points"]
        assert list(seen["x"]) == list(sds)
        assert seen["y"].tolist() == pytest.approx((100.0 * np.exp(-0.1 * np.array(sds))).tolist())


def rows_of(found: Chart, title: str) -> pd.DataFrame:
    (panel,) = (one for one in found.panels if one.title == title)
    return cast(Rows, panel).frame


@pytest.mark.parametrize("zeroed", [False, True])
def test_limits_of_agreement_have_their_exact_intervals(zeroed: bool, study: Settings) -> None:
    """Twenty differences 0, 0.01, ... of step 1; step 0 counts unless motion is zeroed there.

    (limit - bias) sqrt(n) / SD is a noncentral t (Carkeet 2015), narrower towards the bias.
    """
    cohort = replace(study[1], zeroed_at_step_0=zeroed)
    rows = rows_of(chart("agreement", (study[0], cohort), {}), "Flexion–extension")
    differences = np.arange(20) * 0.01
    differences = differences if zeroed else np.r_[differences, np.zeros(20)]
    n, bias, sd = len(differences), differences.mean(), differences.std(ddof=1)
    middle, lower, upper = (rows.iloc[k] for k in range(3))
    assert middle["value"] == pytest.approx(bias)
    assert (lower["value"], upper["value"]) == pytest.approx(
        (bias - 1.96 * sd, bias + 1.96 * sd), abs=1e-5
    )
    off = 1.96 * np.sqrt(n)
    ends = bias + sd / np.sqrt(n) * nct.ppf([0.025, 0.975], n - 1, off)
    assert (upper["low"], upper["high"]) == pytest.approx(tuple(ends), rel=1e-6)
    assert (lower["low"], lower["high"]) == pytest.approx(tuple(2.0 * bias - ends[::-1]), rel=1e-6)
    assert upper["value"] - upper["low"] < upper["high"] - upper["value"]


def test_agreement_is_of_retained_poses(study: Settings) -> None:
    """Of 20 poses the first 5 are retained: differences of step 1 are 0 to 0.04."""
    kept = {"success": made.success(left_out=made.N - 5)}
    cohort = replace(study[1], zeroed_at_step_0=True)
    rows = rows_of(chart("agreement", (study[0], cohort), kept), "Flexion–extension")
    assert rows["value"].iloc[0] == pytest.approx(0.02)


def test_the_key_figure_has_the_numbers_of_the_page(study: Settings) -> None:
    rows = rows_of(chart("stiffness", study, {}), "Flexion–extension").set_index("series")
    palpation, load, readings = (
        rows.loc["palpation"],
        rows.loc["place of the load"],
        rows.loc["readings of one fit"],
    )
    names = ["low", "inner_low", "value", "inner_high", "high"]
    expected = np.array([9.05, 9.5, 10.0, 10.5, 10.95])
    assert palpation[names].astype(float).tolist() == pytest.approx(
        (expected * NM_PER_DEG).tolist()
    )
    half = 0.67449 * np.sqrt(2.0)
    assert load["inner_high"] == pytest.approx((10.0 + half) * NM_PER_DEG, rel=1e-5)
    assert (readings["low"], readings["high"]) == pytest.approx((8 * NM_PER_DEG, 14 * NM_PER_DEG))


def test_what_most_fits_do_not_identify_is_a_line_that_goes_on(study: Settings) -> None:
    lost = {
        "extension_identifiable": False,
        "extension_open_above": True,
        "extension_high_nm_per_rad": None,
    }
    rows = rows_of(
        chart(
            "stiffness", study, {"calibrations": [{**row, **lost} for row in made.calibrations()]}
        ),
        "Flexion–extension",
    )
    assert rows["value"].isna().all()
    line = rows.set_index("series").loc["readings of one fit"]
    assert line["low"] == pytest.approx(8.0 * NM_PER_DEG)
    assert np.isnan(line["high"])


def test_a_value_at_a_bound_is_drawn_as_open(study: Settings) -> None:
    """Two of twenty fits with other damping at the lower bound: no lower end of the middle 95 %."""
    fits = [
        {**row, "extension_nm_per_rad": 0.02}
        if row["bootstrap"] == "damping" and row["set"] < 2
        else row
        for row in made.bootstrap(damping=0.5)
    ]
    rows = rows_of(chart("bootstrap", study, {"bootstrap": fits}), "Flexion–extension").set_index(
        "row"
    )
    damped = rows.loc["damping, on a load ramp"]
    assert np.isnan(damped["low"])
    assert np.isfinite(damped[["inner_low", "value", "high"]].astype(float)).all()
    assert rows.loc["palpation", "inner_high"] == pytest.approx(5.0)


def test_points_without_a_region_are_not_drawn(study: Settings) -> None:
    tried = [
        {**row, "extension_identifiable": row["superior_shift_mm"] >= 0.0}
        for row in made.over_load_point()
    ]
    found = chart("load_point", study, {"stiffness_over_load_point": tried})
    assert [panel.title for panel in found.panels] == ["Flexion–extension", "Misfit"]
    lines = cast(Curves, found.panels[0]).frame
    assert len(lines) == 6
    assert lines["y"].min() == pytest.approx(8.0 * NM_PER_DEG)


@pytest.mark.parametrize("name", ["stiffness", "joint_pose"])
def test_numbers_of_the_paper_stand_beside_its_own_cohort_alone(name: str, study: Settings) -> None:
    rebuilt = replace(study[1], name="palanca_l1l4")
    texts = [chart(name, (study[0], cohort), {}).svg() for cohort in (study[1], rebuilt)]
    joints = name == "joint_pose"  # of joints with the paper's names
    assert ["Gould" in text for text in texts] == [False, True] or joints
    own = rows_of(chart("stiffness", (study[0], rebuilt), {}), "Flexion–extension").set_index(
        "series"
    )
    assert own.loc["Gould et al. 2024", "value"] == pytest.approx(13.4 * NM_PER_DEG, rel=0.01)


def test_a_page_with_its_figures_keeps_the_rules(study: Settings) -> None:
    tables = made.frames(made.whole())
    drawings = {name: Drawing.read(name, drawing(name)(*study, tables).svg()) for name in FIGURES}
    results = ResultTables(StudyTables(tables), {}, drawings)
    html = page(*study, results).html(*study, results)
    assert list(faults_of_page(html)) == []
    assert html.count('<article class="finding') == 5


def test_the_same_bytes_twice(study: Settings) -> None:
    first, again = (chart("stiffness", study, {}) for _ in range(2))
    assert first.svg() == again.svg()
    assert first.picture("png") == again.picture("png")

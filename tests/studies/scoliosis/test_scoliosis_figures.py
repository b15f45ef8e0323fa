"""Figures of scoliosis: drawn for any cohort of films, and true to the tables they come from.

Would catch words off a panel, figures that fail for few spines or films, and marks that are not
where the tables have them.
"""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from drawn import drawings
from page_rules import faults_of_chart
from scoliosis_cases import Size, cohort_of, shipped, study_of, tables_of
from sweeps import sweep

from spinepipe.studies.scoliosis.charts_of_films import curve, film_overlay, median_spine
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.personal import patient_of, tangent
from spinepipe.studies.scoliosis.personalise import rows_of
from spinepipe.studies.scoliosis.tables import DISPLACEMENTS, POSITIONS
from spinepipe.tables import from_rows
from spinepipe.units import MM_PER_M

DRAW = drawings("scoliosis")
SIZES = {
    "many spines, a pose lost": Size(8, lost=1),
    "nothing left out, reading unknown": Size(1, positions=(RIGHT, LEFT), noise_deg=None),
    "one exact law, one left-out film": Size(
        errors={"uniform": 0.0}, positions=(RIGHT, LEFT, "neutral")
    ),
}
TESTS = pd.DataFrame(
    {"family": "held_out/rotation", "response": ["tangent_fitted"], "factor": "uniform"}
    | {"p_holm": 0.01, "effect": -1.0}
)


def tables(size: Size) -> dict[str, pd.DataFrame]:
    """Made-up tables with one test and a few variants."""
    names = [f"p{n + 1:02d}" for n in range(size.patients)]
    rows = [
        {"specimen": name, "varied": kind, "value": value, "fitted": fitted, "moved_deg": 0.1}
        | {"rotation_rmse_deg": 0.3 + 0.01 * value + 0.1 * n}
        for n, name in enumerate(names)
        for kind, value in (("enlargement", 10.0), ("enlargement", 20.0), ("scale", 10.0))
        for fitted in (True, False)
    ]
    return tables_of(size) | {"statistics": TESTS, "variants": pd.DataFrame(rows)}


def draw(name: str, size: Size, **changed: pd.DataFrame) -> Any:
    """A figure of made-up tables."""
    return DRAW[name](study_of(size), cohort_of(size), tables(size) | changed)


@sweep("name", DRAW)
@sweep("size", SIZES)
def test_figures_of_any_size_are_in_order(name: str, size: str) -> None:
    chart = draw(name, SIZES[size])
    assert not list(faults_of_chart(chart))
    assert not [name for name in cohort_of(SIZES[size]).specimen_names if name in chart.svg()]


@sweep("name", DRAW)
def test_tables_without_rows_are_told_not_drawn(name: str) -> None:
    empty = {table: rows.iloc[:0] for table, rows in tables(Size()).items()}
    chart = DRAW[name](study_of(Size()), cohort_of(Size()), empty)
    assert len(chart.panels) == 1
    assert chart.panels[0].message == chart.caption


def test_differences_have_the_detectable_one_on_both_sides() -> None:
    """Errors of 0.3, 0.4, 0.5, 0.6 and 0.8 deg, times 1, 1.1 and 1.2 of three spines."""
    (panel,) = draw("differences", Size()).panels
    rows = panel.frame.set_index("row")
    assert rows["value"].to_dict() == pytest.approx(
        {"tangent, fitted": -0.55, "tangent, published": -0.44, "linear, by segment": -0.33}
        | {"linear, by region": -0.22}
    )
    assert rows.index[~rows["hollow"]].to_list() == ["tangent, fitted"]
    limit = 1.96 * 2**0.5 * 1.4  # a rotation of four tilts read to 0.7 deg
    assert sorted(panel.marks) == pytest.approx([-limit, limit])


def test_shares_of_bounded_ratios_are_counted_by_segment() -> None:
    """Ten segments from below are bounded on both sides, two on one, two on neither; but p01."""
    laws = tables(Size())["laws"]
    first = (laws["specimen"] == "p01") & (laws["model"] == "tangent_fitted")
    laws.loc[first & (laws["joint"] == "L3L4"), ["open_below", "identifiable"]] = [True, False]
    frame = draw("identifiable_ratios", Size(), laws=laws).panels[0].frame
    shares = frame.pivot_table(index="row", columns="series", values="share")
    assert shares.loc["L3–L4"].to_dict() == pytest.approx(
        {"both ends": 2 / 3, "one end": 1 / 3, "neither": 0.0}
    )
    assert shares.loc["T2–T3", "neither"] == 1.0
    assert list(frame["row"])[:2] == ["T2–T3", "T3–T4"], "the uppermost on top"


def test_the_spine_is_that_of_the_median_error() -> None:
    rows = tables_of(Size(5))["positions"]
    assert median_spine(rows) == "p03"
    rows.loc[rows["specimen"] == "p01", "rotation_rmse_deg"] = 9.0
    assert median_spine(rows) == "p04"
    assert median_spine(rows.iloc[:0]) is None


def test_vertebrae_are_off_by_what_the_solved_pose_is() -> None:
    """Off their places to the right in space; the lowest and the top one are where the film is."""
    cohort, study = shipped(1), study_of(Size(1))
    patient, made = patient_of(study, cohort, "p01"), rows_of(study, cohort, "p01", "tangent")
    found = {
        table.name: from_rows(table, made[table.name]).to_pandas()
        for table in (DISPLACEMENTS, POSITIONS)
    }
    film = patient.read.films["traction"]
    held = patient.fixed_end(tangent(patient, study).model).at(film.top).film
    panels = {panel.title: panel for panel in film_overlay(study, cohort, found).panels}
    frame = panels["Traction, left out"].frame  # type: ignore[attr-defined]
    off = MM_PER_M * (held.right - film.right)
    np.testing.assert_allclose(frame["x"], off, rtol=0, atol=1e-9)
    np.testing.assert_allclose(frame["x"].iloc[[0, -1]], 0.0, rtol=0, atol=1e-9)


def test_a_law_has_its_stiffness_at_rest_and_stays_inside_its_ends() -> None:
    row = pd.Series({"at_rest_nm_per_rad": 80.0, "lower_end_deg": -3.0, "upper_end_deg": 6.0})
    rotations, moments = curve(row, 1e-3)
    slope = np.gradient(moments, np.deg2rad(rotations))
    np.testing.assert_allclose(slope, 80.0, rtol=1e-3)
    rotations, _ = curve(row, 1e6)
    assert -3.0 < rotations.min() < -2.999
    assert 5.999 < rotations.max() < 6.0

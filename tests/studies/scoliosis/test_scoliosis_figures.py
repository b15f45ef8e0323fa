"""Figures of scoliosis: drawn for any cohort of films, and true to the tables they come from.

Would catch words off the page or upon each other, figures that fail for few patients, few films or
unknown noise, and marks that are not where the tables have them.
"""

from functools import cache
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from drawn import caption, drawings
from matplotlib.figure import Figure
from scoliosis_cases import Size, cohort_of, shipped, study_of, tables_of
from sweeps import sweep

from spinepipe.report.style import WIDTH_MM, style
from spinepipe.studies.scoliosis.errors import held_out_error
from spinepipe.studies.scoliosis.figures.errors_by_range import classified
from spinepipe.studies.scoliosis.figures.film_overlay import chosen, places, posed
from spinepipe.studies.scoliosis.figures.fitted_and_held_out import errors_of_patients
from spinepipe.studies.scoliosis.figures.load_displacement import curve
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.kind import KIND
from spinepipe.studies.scoliosis.personal import patient_of, tangent
from spinepipe.studies.scoliosis.personalise import rows_of
from spinepipe.studies.scoliosis.tables import DISPLACEMENTS
from spinepipe.tables import from_rows

DRAW = drawings("scoliosis")
SIZES = {
    "many patients, a pose lost": Size(8, lost=1),
    "nothing held out, reading unknown": Size(1, positions=(RIGHT, LEFT), noise_deg=None),
    "one exact linear model, one held-out film": Size(
        errors={"uniform": 0.0}, positions=(RIGHT, LEFT, "neutral")
    ),
}
"""Each figure is drawn once of each, and looked at by all tests."""


@cache
def drawn(name: str, size: str) -> Figure:
    """A figure of made-up tables of that size, laid out."""
    return draw(name, SIZES[size])


def draw(name: str, size: Size) -> Figure:
    """A figure of made-up tables, laid out."""
    with style():
        figure: Figure = DRAW[name](study_of(size), cohort_of(size), tables_of(size))
        figure.draw_without_rendering()
    return figure


def words(figure: Figure) -> str:
    """All words of a figure."""
    found = [text.get_text() for text in figure.findobj(lambda a: hasattr(a, "get_text"))]
    return " ".join(" ".join(str(text).split()) for text in found)


def test_every_figure_has_a_caption_and_tables_that_the_kind_makes() -> None:
    known = {table.name for table in KIND.tables}
    for figure in KIND.figures:
        told = caption("scoliosis", figure.name).read_text(encoding="utf-8")
        assert len(told) > 200, figure.name
        assert set(figure.reads) <= known, figure.name


@sweep("name", DRAW)
@sweep("size", SIZES)
def test_no_words_leave_the_page_or_stand_on_each_other(name: str, size: str) -> None:
    fits_the_page(drawn(name, size))


def fits_the_page(figure: Figure) -> None:
    assert figure.get_figwidth() * 25.4 == pytest.approx(WIDTH_MM)
    page = figure.bbox
    for axis in (one for one in figure.axes if one.get_visible()):
        for line in (axis.xaxis, axis.yaxis):
            low, high = sorted(line.get_view_interval())
            ticks = [t for t in line.get_major_ticks() if low <= t.get_loc() <= high]
            shown = [t.label1 for t in ticks if t.label1.get_visible() and t.label1.get_text()]
            boxes = [label.get_window_extent() for label in shown]
            for one, other in pairwise(boxes):
                assert not one.shrunk(0.98, 0.9).overlaps(other.shrunk(0.98, 0.9))
            for box in [*boxes, line.label.get_window_extent(), axis.title.get_window_extent()]:
                assert box.x0 > page.x0 - 1.0
                assert box.x1 < page.x1 + 1.0
    for legend in figure.legends:
        inside = legend.get_window_extent()
        assert page.x0 - 1.0 < inside.x0 < inside.x1 < page.x1 + 1.0, "the key is on the page"
        assert inside.y0 > page.y0 - 1.0


@sweep("name", DRAW)
def test_nothing_held_out_is_said(name: str) -> None:
    told = words(drawn(name, "nothing held out, reading unknown"))
    if name != "load_displacement":
        assert "Nothing is held out" in told
    assert "held out)" not in told


@sweep("name", DRAW)
def test_tables_without_rows_are_told_not_drawn(name: str) -> None:
    tables = tables_of(Size())
    empty = {table: rows.iloc[:0] for table, rows in tables.items()}
    with style():
        figure = DRAW[name](study_of(Size()), cohort_of(Size()), empty)
    assert not figure.axes
    assert len(words(figure)) > 30


def test_patients_are_chosen_by_their_error_not_by_hand() -> None:
    rows = tables_of(Size(5))["positions"]
    errors = held_out_error(rows)
    assert chosen(errors) == ["p01", "p03", "p05"]
    large = rows["specimen"] == "p01"
    rows.loc[large, "rotation_rmse_deg"] = 9.0
    assert chosen(held_out_error(rows)) == ["p02", "p04", "p01"]
    fitted = rows[rows["fitted"]]
    assert held_out_error(fitted)["p01"] == pytest.approx(9.0)
    assert chosen(errors.iloc[:1]) == ["p01"]


def test_errors_of_patients_leave_out_who_has_no_pose() -> None:
    tables = tables_of(Size(3, lost=1))
    found = errors_of_patients(*(tables[n] for n in ("positions", "displacements", "curves")))
    held_out = found[(found["films"] == "held_out") & (found["measure"] == "rotation")]
    assert set(held_out.loc[held_out["model"] == "tangent", "specimen"]) == {"p02", "p03"}
    kept = held_out[(held_out["model"] == "uniform") & (held_out["specimen"] == "p03")]
    assert float(kept["error"].iloc[0]) == pytest.approx(0.8 * 1.2)


def test_models_stand_where_their_poses_are() -> None:
    """Places of the overlay are those of the solved pose, out of the plane and all."""
    cohort, study = shipped(1), study_of(Size(1))
    patient = patient_of(study, cohort, "p01")
    rows = from_rows(
        DISPLACEMENTS, rows_of(study, cohort, "p01", "tangent")["displacements"]
    ).to_pandas()
    film = patient.read.films["traction"]
    held = patient.fixed_end(tangent(patient, study).model).at(film.top)
    at = posed(film, rows[rows["position"] == "traction"])
    np.testing.assert_allclose(at, places(held.film), rtol=0, atol=1e-9)
    np.testing.assert_allclose(at[-1], places(film)[-1], rtol=0, atol=1e-9)


def test_a_law_has_its_stiffness_at_rest_and_stays_inside_its_ends() -> None:
    row = pd.Series({"at_rest_nm_per_rad": 80.0, "lower_end_deg": -3.0, "upper_end_deg": 6.0})
    rotations, moments = curve(row, 1e-3)
    slope = np.gradient(moments, np.deg2rad(rotations))
    np.testing.assert_allclose(slope, 80.0, rtol=1e-3)
    rotations, _ = curve(row, 1e6)
    assert -3.0 < rotations.min() < -2.999
    assert 5.999 < rotations.max() < 6.0


def test_segments_against_a_bend_are_named_in_their_panels() -> None:
    figure = drawn("load_displacement", "many patients, a pose lost")
    told = {
        axis.get_title("left"): " ".join(t.get_text() for t in axis.texts) for axis in figure.axes
    }
    assert "against a bend\nheld at a bound" in told["T2T3"]
    assert told["L3L4"] == ""


def test_classes_are_those_of_the_table_and_opposite_ones_stand_apart() -> None:
    rows = tables_of(Size(1, errors={"uniform": 0.3}))["displacements"]
    found = classified(rows)
    counts = found[found["films"] == "held_out"]["range"].value_counts()
    # shares 0.1 + 0.08 k of 13 segments on two films, the 14th against a bend
    assert counts.to_dict() == {
        "below_0.2": 4, "0.2_to_0.8": 14, "0.8_to_1": 6, "beyond": 2, "opposite": 2,
    }  # fmt: skip
    assert (found[found["films"] == "fitted"]["range"] != "beyond").all()


def test_the_least_error_is_marked_on_each_line() -> None:
    panel = drawn("enlargement", "many patients, a pose lost").axes[0]
    marked = {
        float(np.asarray(line.get_xdata())[0])
        for line in panel.lines
        if line.get_markerfacecolor() == "#FFFFFF"
    }
    assert marked == {30.0, 10.0}
    lines = [np.asarray(line.get_xdata()) for line in panel.lines]
    assert all(0.0 not in x for x in lines), "no patient has a pose at 0 %"

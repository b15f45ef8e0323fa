"""Parts that pages share: numbers as printed, columns of tables, rows and axes of figures.

Catches a number rounded wrongly, a column that says nothing, ticks that stand on each other.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from page_rules import faults_of_chart
from sweeps import sweep

from spinepipe.report.forms.axes import log_ticks
from spinepipe.report.forms.chart import Panel
from spinepipe.report.forms.chart import saying as saying_chart
from spinepipe.report.forms.look import look
from spinepipe.report.forms.rows import Rows
from spinepipe.report.page.tables import sortable
from spinepipe.report.words import fixed, number, percent, tick
from spinepipe.schema import Column


@sweep(
    "value, text",
    [
        (20640.0, "20\u2009600"),
        (0.01344, "0.0134"),
        (-1.4, "\u22121.40"),
        (2.46e7, "2.46e7"),
        (0.0, "0"),
        (999.6, "1\u2009000"),
        (float("nan"), "none"),
    ],
)
def test_numbers_as_printed(value: float, text: str) -> None:
    assert number(value) == text


def test_other_numbers_as_printed() -> None:
    assert fixed(-0.001) == "0.00"
    assert fixed(-1.234) == "\u22121.23"
    assert (tick(20.0), tick(300000.0), tick(1e7), tick(0.5)) == (
        "20",
        "300\u2009000",
        "1e7",
        "0.5",
    )
    assert (percent(0, 5), percent(1, 500), percent(499, 500)) == ("0 %", "<1 %", ">99 %")
    assert percent(0, 0) == "none"


def test_ticks_of_logarithmic_axes_are_few() -> None:
    axis = Figure().subplots()
    axis.set_xscale("log")
    for low, high in ((1.4e4, 9e5), (9.0, 250.0), (30.0, 40.0), (1.0, 1e12)):
        axis.set_xlim(low, high)
        log_ticks(axis.xaxis, low, high, 3)
        shown = [x for x in axis.get_xticks() if low <= x <= high]
        assert 1 <= len(shown) <= 4, (low, high, shown)


def test_columns_that_say_nothing_are_left_out_and_units_stand_in_the_heading() -> None:
    columns = [
        Column("specimen", "text", "name"),
        Column("sd_mm", "number", "spread", "mm", nullable=True, empty="none"),
        Column("message", "text", "words"),
        Column("kept", "flag", "whether"),
    ]
    frame = pd.DataFrame(
        {"specimen": "a", "sd_mm": [0.1234, np.nan], "message": "", "kept": [True, False]}
    )
    found = sortable("t", "T", "about", frame, columns)
    assert [(head.name, head.unit) for head in found.heads] == [("sd", "mm"), ("kept", "")]
    assert found.heads[0].meaning == "spread; empty: none"
    assert [[cell.text for cell in row] for row in found.rows] == [["0.123", "yes"], ["", "no"]]
    assert found.rows[0][0].value == 0.1234
    assert found.rows[1][0].value is None
    long = sortable("t", "T", "about", pd.DataFrame({"specimen": list("ab") * 400}), columns)
    assert len(long.rows) == 200
    assert long.note == "The first 200 of 800 rows; all of them are in t.parquet."


def drawn(panel: Panel) -> Axes:
    """A panel of a chart on axes of its own."""
    with look():
        axes = Figure().subplots()
        panel.draw(axes)
    return axes


def test_series_that_a_row_alone_has_stand_in_its_middle() -> None:
    """Row one has both series, row two the second alone."""
    rows = [("one", "a", 1.0), ("one", "b", 2.0), ("two", "b", 3.0)]
    frame = pd.DataFrame(rows, columns=["row", "series", "value"])
    heights = [line.get_ydata() for line in drawn(Rows(frame=frame)).lines]
    found = {round(float(y), 3) for of in heights for y in np.atleast_1d(of)}
    assert found == {-0.155, 0.155, 1.0}


@sweep("low, high", [(119.0, 477.0), (1.0, 40.0), (0.2, 0.5), (160.0, 480.0), (30.0, 40.0)])
def test_numbers_of_a_logarithmic_axis_are_apart_and_plain(low: float, high: float) -> None:
    frame = pd.DataFrame({"row": ["one"], "value": [low], "low": [low], "high": [high]})
    axis = drawn(Rows(frame=frame, log=True, x_limits=(low, high))).xaxis
    shown = [x for x in axis.get_majorticklocs() if low <= x <= high]
    assert 2 <= len(shown) <= 6
    steps = np.diff(np.log10(shown)) / np.log10(high / low)
    assert steps.min() > 0.12
    assert not any("$" in axis.get_major_formatter()(x, None) for x in shown)


def test_a_figure_without_results_says_why_however_long_that_is() -> None:
    short = saying_chart(
        "Nothing", "No fit of any specimen that was tried ended with a stiffness; " * 3 + "so."
    )
    assert list(faults_of_chart(short)) == []
    assert short.panels[0].height > saying_chart("Nothing", "No.").panels[0].height

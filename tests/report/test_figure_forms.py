"""Forms of figures: what they draw stands where the frame has it, and fits.

Would catch a symbol at another place, an open end drawn closed, words over words, ids twice.
"""

import re
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from page_rules import faults_of_chart

from spinepipe.report.forms.chart import SVG, Chart, Drawing, Key, Panel, saying
from spinepipe.report.forms.curves import Curves, Scatter
from spinepipe.report.forms.heat_map import HeatMap, Shares
from spinepipe.report.forms.look import BASE, MEASURED, MODEL, look
from spinepipe.report.forms.rows import BeforeAfter, Rows, ordered

TWO = {"one": MODEL, "two": BASE}


def rows(names: str = "abc") -> pd.DataFrame:
    """Two series of each row; b has an open end, c none."""
    n = len(names)
    one = pd.DataFrame(
        {
            "row": list(names),
            "series": "one",
            "value": np.arange(n) + 1.0,
            "low": [0.5, np.nan, np.nan][:n],
            "high": [2.0, 3.0, np.nan][:n],
        }
    )
    return pd.concat([one, one.assign(series="two", value=one["value"] + 0.5)])


def panels() -> dict[str, Panel]:
    """One panel of each form."""
    x = np.linspace(-8.0, 8.0, 9)
    curve = pd.DataFrame({"x": x, "y": x**3 / 60.0, "series": "one"})
    points = curve.assign(series="measured", x_low=x - 0.5, x_high=x + 0.5)
    cells = pd.DataFrame(
        {"row": list("aabb"), "column": list("cdcd"), "value": [1.0, -2.0, 0.3, np.nan]}
    )
    shares = pd.DataFrame(
        {"row": list("aabb"), "series": ["one", "two"] * 2, "share": [0.7, 0.3, 0.05, 0.95]}
    )
    change = pd.DataFrame({"row": list("ab"), "before": [4.0, 3.0], "after": [2.0, 2.9]})
    return {
        "rows": Rows(title="T", x_label="x (mm)", frame=rows(), looks=TWO, marks={2.0: "limit"}),
        "bars": Rows(frame=rows(), looks=TWO, bars=True),
        "log": Rows(frame=rows(), looks=TWO, log=True),
        "curves": Curves(frame=pd.concat([curve, points]),
                         looks={"one": MODEL, "measured": MEASURED},
                         points=("measured",), x_label="rotation (°)", y_label="moment (N m)"),
        "scatter": Scatter(frame=curve, identity=True, x_label="measured", y_label="model"),
        "agreement": Scatter(frame=curve, limits={5.0: "upper"}, bands=((4.0, 6.0),)),
        "heat map": HeatMap(frame=cells, x_label="to"),
        "shares": Shares(frame=shares, looks=TWO, x_label="share (%)"),
        "before and after": BeforeAfter(frame=change, before=BASE, after=MODEL, x_label="misfit"),
    }  # fmt: skip


@pytest.mark.parametrize("form", list(panels()))
def test_a_form_fits_alone_and_beside_others(form: str) -> None:
    keys = [Key(look_, name) for name, look_ in TWO.items()]
    for n in (1, 3):
        chart = Chart("Title", [panels()[form]] * n, "What is seen.", keys)
        assert list(faults_of_chart(chart)) == []
        for kind, start in (("pdf", b"%PDF"), ("png", b"\x89PNG")):
            assert chart.picture(kind).startswith(start)
            assert chart.picture(kind) == chart.picture(kind), "the same bytes each time"


def drawn(panel: Panel) -> Axes:
    """The axes of a panel."""
    with look():
        axes = Figure().subplots()
        panel.draw(axes)
    return axes


def test_symbols_and_intervals_stand_where_the_frame_has_them() -> None:
    axes = drawn(panels()["rows"])
    symbols = [line for line in axes.lines if line.get_marker() in ("o", "s")]
    assert [list(np.asarray(line.get_xdata())) for line in symbols] == [[1, 2, 3], [1.5, 2.5, 3.5]]
    assert all(line.get_ydata()[0] < line.get_ydata()[1] for line in symbols), "from the top down"
    top, bottom = symbols[0].get_ydata()[0], symbols[1].get_ydata()[0]
    assert top < bottom, "the first series stands above the second"
    ends = [segment[:, 0] for part in axes.collections for segment in part.get_segments()]
    assert [0.5, 2.0] in [list(one) for one in ends]
    assert len(ends) == 4, "none where no end is known"
    assert min(one[0] for one in ends) < 0.5, "an open end reaches the edge"
    above = Rows(frame=rows().assign(low=100.0, high=[110.0, np.nan, 120.0] * 2), looks=TWO)
    ends = [s[:, 0] for part in drawn(above).collections for s in part.get_segments()]
    assert max(one[1] for one in ends) > 120.0, "the edge of all, not of what was drawn before"


def test_a_hollow_symbol_is_not_to_be_trusted() -> None:
    frame = rows().assign(hollow=[True, False, False] * 2)
    faces = {line.get_markerfacecolor() for line in drawn(Rows(frame=frame, looks=TWO)).lines}
    assert "#ffffff" in faces


def test_moment_over_rotation_has_its_axes_through_zero() -> None:
    axes = drawn(panels()["curves"])
    assert sum(set(np.round(np.ravel(line.get_data()), 9)) >= {0.0} for line in axes.lines) >= 2
    xs = [list(np.asarray(line.get_xdata())) for line in axes.lines]
    assert [0, 1] in xs, "the horizontal axis through zero"


def test_equal_things_lie_on_the_line_of_equality() -> None:
    axes = drawn(Scatter(frame=pd.DataFrame({"x": [1.0, 2.0], "y": [1.0, 2.0]}), identity=True))
    assert axes.get_xlim() == axes.get_ylim()


def test_cells_have_their_numbers_and_empty_ones_say_so() -> None:
    axes = drawn(panels()["heat map"])
    assert [text.get_text() for text in axes.texts] == ["1.0", "−2.0", "0.30", "–"]
    assert len(axes.patches) == 3
    shades = [patch.get_facecolor()[3] for patch in axes.patches]
    assert shades[1] == max(shades), "the largest size is fullest, whatever its sign"


def test_parts_of_a_bar_follow_each_other() -> None:
    axes = drawn(panels()["shares"])
    spans = [(bar.get_x(), bar.get_width()) for bar in axes.patches]
    assert spans == pytest.approx([(0, 70), (70, 30), (0, 5), (5, 95)])
    assert [text.get_text() for text in axes.texts] == ["70 %", "30 %", "95 %"], "5 % has no room"


def test_a_page_takes_the_panels_apart_and_ids_stay_one() -> None:
    names = '"><script>alert(1)</script>'
    chart = Chart(
        names, [panels()["curves"], panels()["rows"]], f"See {names}.", [Key(MODEL, names)]
    )
    svg = chart.svg()
    root = ElementTree.fromstring(svg)
    assert root.findtext(f"{{{SVG}}}title") == names
    found = Drawing.read("a_figure", svg)
    assert (found.title, len(found.panels)) == (names, 3), "legend and two panels"
    page = "".join(found.labelled(names))
    assert "<script>" not in page
    ids = re.findall(r'\sid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert all(f'id="{name}"' in page for name in re.findall(r'(?:href="|url\()#([^")]+)', page))
    assert "var(--model)" in page
    assert "#0b62a8" not in page


def test_text_stays_text() -> None:
    svg = Chart("T", [panels()["rows"]], "C.").svg()
    assert ">x (mm)</text>" in svg
    assert "DejaVuSans-" not in svg, "no outlines"


def test_a_figure_without_anything_says_why() -> None:
    chart = saying("T", "No run has an equilibrium.")
    assert list(faults_of_chart(chart)) == []
    assert "No run has an equilibrium." in chart.svg()


def test_rows_come_in_the_order_that_is_asked_for() -> None:
    frame = pd.DataFrame({"row": list("cab"), "value": [1, 2, 3]})
    assert list(ordered(frame, "row", ["b", "a"])["row"]) == ["b", "a", "c"]

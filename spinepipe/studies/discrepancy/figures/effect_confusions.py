"""Figure: which effects these tests could tell apart, and which gap they could show."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import Array, finite
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLUE, GREY, blank, note, saying
from spinepipe.report.words import fixed
from spinepipe.studies.discrepancy.figures.gap_map import draw_heat, empty_cell, name_cells
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import NOT_TESTABLE
from spinepipe.studies.discrepancy.verdict import Verdict, read_verdict
from spinepipe.studies.discrepancy.words import general
from spinepipe.tables import StudyTables

_SQUARE_MM, _BESIDE_MM, _SCALE_MM = 5.4, 34.0, 24.0
_MOST_WITH_NUMBERS = 22
_LEAST_SHARE = 0.05
"""Smaller shares are shown as 0: they do not matter."""

WORDS = (
    "Beyond what base and nuisance take up; read along a row. Computed from the tests alone, "
    "before residuals are looked at. Below 0.05: 0."
)
HEADINGS = ("Share of one effect's gap that another explains", "Smallest gap named")


def effect_confusions_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """Effects against effects, and beside them the smallest gap at which each is seen."""
    verdict = read_verdict(tables.files["verdict"])
    confusions, candidates = tables["confusions"], tables["candidates"]
    hidden = _hidden(candidates, verdict)
    names = list(dict.fromkeys([*confusions["effect"], *confusions["other"]]))
    rows = [*names, *(name for name in hidden if name not in names)]
    if not rows:
        return saying("Nothing can be shown: no effect could be tried.")
    figure = blank(len(rows) * _SQUARE_MM + _BESIDE_MM + _SCALE_MM)
    left, right = side_by_side(figure, 2, 2, width_ratios=[3.0, 1.0], sharey=True)
    grid = _square(confusions, rows, names)
    decimals = 2 if len(rows) <= _MOST_WITH_NUMBERS else None
    image = draw_heat(left, np.where(grid < _LEAST_SHARE, 0.0, grid), Normalize(0.0, 1.0), decimals)
    name_cells(left, [general(name) for name in rows], [general(name) for name in names], True)
    _detectable(right, rows, hidden, _gaps(candidates, verdict))
    for index, (axis, words) in enumerate(zip((left, right), HEADINGS, strict=True)):
        head(axis, index, words)
    left.set_ylabel("effect that is there")
    left.set_xlabel("effect that is taken for it")
    bar = figure.colorbar(image, ax=[left, right], location="bottom", aspect=60, shrink=0.6)
    bar.set_label("share: 0 told apart at once, 1 not at all")
    bar.outline.set_linewidth(0.4)
    explain_marks(figure, [empty_cell("the same effect, or not testable here")], WORDS, 1)
    return figure


def _square(confusions: pd.DataFrame, rows: Sequence[str], names: Sequence[str]) -> Array:
    """(R, N) shares; NaN on the diagonal and where there is none."""
    other = confusions[confusions["effect"] != confusions["other"]]
    if other.empty:
        return np.full((len(rows), max(1, len(names))), np.nan)
    wide = other.pivot_table("share", "effect", "other", aggfunc="first")
    return wide.reindex(index=list(rows), columns=list(names)).to_numpy(float)


def _hidden(candidates: pd.DataFrame, verdict: Verdict) -> list[str]:
    """Effects of which no form can be tested."""
    design = candidates[candidates["stage"] == "design"]
    testable = set(design.loc[design["status"] != NOT_TESTABLE, "effect"])
    told = [one.name for one in verdict.not_testable]
    names = dict.fromkeys([*design["effect"], *told])
    return [name for name in names if name not in testable or name in told]


def _gaps(candidates: pd.DataFrame, verdict: Verdict) -> dict[str, float]:
    """Smallest detectable gap of each effect: that of the verdict, else of its best form."""
    design = candidates[candidates["detectable_gap"].notna()]
    found = design.groupby("effect")["detectable_gap"].min()
    told = {one.name: one.gap for one in verdict.smallest_detectable}
    return {str(name): float(gap) for name, gap in found.items()} | told


def _detectable(
    axis: Axes, rows: Sequence[str], hidden: Sequence[str], gaps: Mapping[str, float]
) -> None:
    for y, name in enumerate(rows):
        if name in hidden:
            note(axis, 0.02, y, "not testable here", GREY)
        elif name in gaps:
            axis.barh(y, gaps[name], height=0.55, color=BLUE, lw=0, zorder=3)
            axis.annotate(
                fixed(gaps[name]),
                (gaps[name], y),
                (2.0, 0.0),
                va="center",
                textcoords="offset points",
                fontsize=5.5,
            )
    most = max(finite(list(gaps.values())), default=1.0)
    axis.set_xlim(0.0, 1.3 * most)
    axis.set_xlabel("gap (noise SD)")
    axis.spines["left"].set_visible(False)
    axis.tick_params(axis="y", length=0.0, labelleft=False)

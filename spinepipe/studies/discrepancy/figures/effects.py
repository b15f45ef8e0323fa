"""Figure: evidence for each effect, round by round of the search.

Figure: which effects these tests could tell apart, and which gap they could show.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from spinepipe.cohort import Cohort
from spinepipe.report.marks import Array, finite
from spinepipe.report.panels import explain_marks, head, sections, side_by_side
from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, blank, note, saying
from spinepipe.report.words import fixed, number, plain, short, tick
from spinepipe.studies.discrepancy.figures.gap_map import draw_heat, empty_cell, name_cells
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import NOT_TESTABLE
from spinepipe.studies.discrepancy.verdict import Verdict, read_verdict
from spinepipe.tables import Tables

_SQUARE_MM, _BESIDE_MM, _SCALE_MM = 5.4, 34.0, 24.0
_MOST_WITH_NUMBERS = 22
_LEAST_SHARE = 0.05
"""Smaller shares are shown as 0: they do not matter."""

WORDS = (
    "Beyond what base and nuisance take up; read along a row. Computed from the tests alone, "
    "before residuals are looked at. Below 0.05: 0."
)
HEADINGS = ("Share of one effect's gap that another explains", "Smallest gap named")


def effect_confusions_figure(study: Discrepancy, cohort: Cohort, tables: Tables) -> Figure:
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
    name_cells(left, [plain(name) for name in rows], [plain(name) for name in names], True)
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


MOST_ROUNDS, _ACROSS = 3, 2
SCREEN, REFIT = "screen", "refit"
PALE = "#B9B9B9"
_ROW_MM, _AROUND_MM, _KEY_MM = 4.4, 20.0, 15.0
_ROOM_FOR_NUMBERS = 12.0
_LINEAR_TO = 10.0
"""Log evidence up to which the axis is linear, beyond it is logarithmic."""


def effect_evidence_figure(study: Discrepancy, cohort: Cohort, tables: Tables) -> Figure:
    """A panel for each round: the best form of each effect, screened and refitted."""
    verdict = read_verdict(tables.files["verdict"])
    rounds = looks(tables["candidates"])[:MOST_ROUNDS]
    if not rounds:
        return saying("No evidence can be shown: no effect was tried.")
    longest = max(len(found) for found in rounds)
    (panels,), figure = sections([(len(rounds), longest * _ROW_MM + _AROUND_MM)], _KEY_MM, _ACROSS)
    threshold = verdict.threshold.log_evidence
    low, high = _reach(rounds, threshold)
    for index, (axis, found) in enumerate(zip(panels, rounds, strict=True)):
        _draw(axis, found, verdict)
        axis.set_ylim(len(found) - longest - 0.7, len(found) - 0.3)
        axis.set_xscale("symlog", linthresh=_LINEAR_TO)
        axis.set_xlim(low, high)
        axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: tick(value)))
        axis.set_xlabel("log evidence for the effect")
        head(axis, index, _title(rounds[:index]))
        if threshold is not None:
            axis.axvline(threshold, color=BLACK, lw=0.8, ls="--", zorder=5)
    explain_marks(figure, _handles(verdict), _words(verdict), len(_handles(verdict)))
    return figure


def looks(candidates: pd.DataFrame) -> list[pd.DataFrame]:
    """Rounds in which effects entered and the one that found no more.

    Later ones, which try each effect's rivals in its place, repeat what these show.
    """
    found: list[pd.DataFrame] = []
    for one in evidence_by_round(candidates):
        if any(one.sort_index().equals(other.sort_index()) for other in found):
            break
        found.append(one)
        if not np.isfinite(one[REFIT]).any():
            break
    return found


def evidence_by_round(candidates: pd.DataFrame) -> list[pd.DataFrame]:
    """Of each round a row per effect with columns ``screen`` and ``refit``, the best one last.

    The best form of an effect stands for it. NaN: not refitted, or no fit has a result.
    """
    found = []
    rows = candidates[candidates["log_evidence"].notna()]
    for round_ in range(1, 100):
        stages = {name: rows[rows["stage"] == f"{name} {round_}"] for name in (SCREEN, REFIT)}
        if all(part.empty for part in stages.values()):
            break
        best = {name: part.groupby("effect")["log_evidence"].max() for name, part in stages.items()}
        one = pd.DataFrame(best)
        order = one[REFIT].fillna(-np.inf).rename("order").to_frame().assign(second=one[SCREEN])
        found.append(one.loc[order.sort_values(["order", "second"], kind="stable").index])
    return found


def _draw(axis: Axes, found: pd.DataFrame, verdict: Verdict) -> None:
    for y, (name, row) in enumerate(found.iterrows()):
        refitted = np.isfinite(row[REFIT])
        if np.isfinite(row[SCREEN]):
            axis.plot([row[SCREEN]], [y], "|", color=BLACK, ms=7.0, mew=1.1, zorder=6)
        value = row[REFIT] if refitted else row[SCREEN]
        axis.barh(
            y,
            value,
            height=0.62,
            color=_color(str(name), verdict),
            alpha=1.0 if refitted else 0.45,
            lw=0,
            zorder=3,
        )
        words = fixed(float(value), 1) if abs(value) < 100.0 else number(float(value), 4)
        note(axis, 1.0, y, words, ha="right")
    axis.set_yticks(range(len(found)), [plain(str(name)) for name in found.index])
    for label, name in zip(axis.get_yticklabels(), found.index, strict=True):
        label.set_fontweight(
            "bold" if name in verdict.named or name in verdict.candidates_in_set else "normal"
        )
    axis.axvline(0.0, color=GREY, lw=0.6, zorder=2)
    axis.spines["left"].set_visible(False)


def _color(name: str, verdict: Verdict) -> str:
    if name in verdict.named:
        return BLUE
    return GREEN if name in verdict.candidates_in_set else PALE


def _reach(rounds: list[pd.DataFrame], threshold: float | None) -> tuple[float, float]:
    values = finite(pd.concat(rounds).to_numpy(float))
    low = min(0.0, float(values.min()))
    high = max(_LINEAR_TO, float(values.max()), 1.5 * (threshold or 0.0))
    return 1.2 * low - 1.0, _ROOM_FOR_NUMBERS * high


def _title(before: list[pd.DataFrame]) -> str:
    """What the effects are beside: the best refit of each round before."""
    names = [plain(str(one[REFIT].idxmax())) for one in before]
    return f"Beside {short(' and '.join(names), 44)}" if names else "First effect"


def _handles(verdict: Verdict) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = []
    if verdict.named:
        handles.append(Patch(facecolor=BLUE, lw=0, label="named"))
    if verdict.candidates_in_set:
        handles.append(Patch(facecolor=GREEN, lw=0, label="cannot be told apart"))
    handles += [
        Patch(facecolor=PALE, lw=0, label="other effect, refitted"),
        Patch(facecolor=PALE, alpha=0.45, lw=0, label="screened only"),
        Line2D([], [], color=BLACK, marker="|", ms=6.0, mew=1.1, lw=0, label="at the screen"),
    ]
    if verdict.threshold.log_evidence is not None:
        handles.append(Line2D([], [], color=BLACK, lw=0.8, ls="--", label="threshold"))
    return handles


def _words(verdict: Verdict) -> str:
    told = "Best form of each effect (places, shape); linear up to 10, logarithmic beyond"
    threshold, false_alarm = verdict.threshold.log_evidence, verdict.threshold.false_alarm
    if threshold is None or false_alarm is None:
        return f"{told}."
    return (
        f"{told}; the threshold {number(threshold, 2)} is passed in "
        f"{tick(100.0 * false_alarm)} % of data sets that lack nothing."
    )

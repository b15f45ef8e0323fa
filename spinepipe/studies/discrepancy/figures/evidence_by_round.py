"""Figure: log evidence of every effect in every round of the search, and what came of it.

A round tries all effects beside those that are in the model; later ones try them in the place of
one that is. What a round led to is seen from the model of the next.

Log evidence is the natural logarithm of the ratio of marginal likelihoods, with the effect over
without it: above zero it speaks for the effect. An effect has several forms (variant, how values
differ between places, shape); that of most evidence stands for it. Of a screen the table has the
evidence of all forms together (their mean, by the forms' shares) in the best one's row.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import Array
from spinepipe.report.panels import explain_marks
from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, VERMILLION, WHITE, blank, saying
from spinepipe.report.words import count, fixed, number, short, tick
from spinepipe.studies.discrepancy.figures.gap_map import draw_heat, empty_cell, name_cells
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.verdict import Verdict, read_verdict
from spinepipe.studies.discrepancy.words import general
from spinepipe.tables import StudyTables

SCREEN, REFIT, NO_FIT = "screen", "refit", "no_fit"
"""Ways of trying: all effects in the linearised problem, the leading few by the full simulator.

The third is no way, but a column: see `EvidenceRound`.
"""

ENTERED, LEFT, REPLACED = "entered", "left", "replaced"
MOST_ROUNDS = 12
"""Columns at most; see `rounds_shown`."""

_EVENTS = {
    ENTERED: ("^", BLUE, "entered after it"),
    LEFT: ("v", VERMILLION, "left after it"),
    REPLACED: ("X", VERMILLION, "gave way after it"),
}
"""Marker, colour and words of what a round led to."""

_IN_PLACE = re.compile(r"^in place of (?P<names>.+?)(?P<trial>, beside .+)? \(\d+\)$")
"""Round as `SearchState.stage` names it: ``in place of X (2)``, of two effects ``X and Y``.

With ``, beside Z`` it is a trial: Z already in the place of X, and all others tried beside it.
Rounds in which effects may enter are a number alone and do not match.
"""

_ROW_MM, _TURNED_MM, _WRAPPED_MM, _KEY_MM = 4.8, 30.0, 14.0, 17.0
"""Height of a row, of headings (turned, or wrapped), and of the key below."""

_FULL = 6
"""Rounds whose columns fill the figure; of more the headings are turned."""

_DARK = 0.62
"""Share of the colour scale above which numbers are white, to be read on dark cells."""

_LEAST_DECADES = 1.0
"""Powers of ten above the threshold that colours span at least, lest little looks like much."""

_NO_TRACE = 0.05
"""Log evidence below this, of either sign, is printed as 0: the tests say nothing of the effect."""


@dataclass(frozen=True)
class EvidenceRound:
    """One look at all effects.

    Attributes
    ----------
    stage : its name, as in the table ``candidates`` but without ``screen`` or ``refit``.
    beside : effects in the model, once for each form. without : those that were taken out of it,
        in whose place the others were tried; none in a round in which effects may enter.
    trial : whether it tried two effects in the place of one. The model was then changed for the
        trial alone, so that it says nothing of what the round before led to.
    evidence : a row per effect with ``screen`` and ``refit``, the log evidence of its best form,
        NaN where none has any, and ``no_fit``: whether it was refitted and no form has a result, so
        that it is no rival.
    events : effects that entered, left or gave way after it, by name.
    """

    stage: str
    beside: tuple[str, ...]
    without: tuple[str, ...]
    trial: bool
    evidence: pd.DataFrame
    events: dict[str, str] = field(default_factory=dict)

    @property
    def shown(self) -> pd.Series:
        """Log evidence by effect: of its refit, else of the screen."""
        return self.evidence[REFIT].fillna(self.evidence[SCREEN])

    @property
    def words(self) -> str:
        """What the effects were tried beside, or in whose place."""
        if self.without:
            return f"in place of {_counted(self.without)}"
        return f"beside {_counted(self.beside)}" if self.beside else "base alone"


def _counted(names: Sequence[str]) -> str:
    """Names in plain words, forms of one effect counted: ``nonlinear stiffening × 2, creep``."""
    times = Counter(names)
    return ", ".join(general(name) + (f" × {n}" if n > 1 else "") for name, n in times.items())


def rounds(candidates: pd.DataFrame, end: Sequence[str] = ()) -> list[EvidenceRound]:
    """All rounds in their order, each with what it led to.

    What a round led to is the difference between its model and that of the next one; trials are
    passed over.

    Parameters
    ----------
    candidates : the table of that name. Its stages of the search count, ``design`` does not.
    end : effects that the verdict names or cannot tell apart: the model after the last round.
        Empty: nothing is said of what the last round led to.
    """
    if candidates["log_evidence"].isna().all():
        return []
    # "screen 2" is the way and the round; rows of a round may be of both ways
    way = candidates["stage"].str.partition(" ")
    looked = candidates.assign(way=way[0], round=way[2])
    looked = looked[looked["way"].isin((SCREEN, REFIT))]
    found = [_round(str(name), part) for name, part in looked.groupby("round", sort=False)]
    steps = [one for one in found if not one.trial]
    for one, later in pairwise(steps):
        one.events.update(_events(_model(one), _model(later)))
    if end and steps:
        # a verdict names an effect once, whatever its forms: it has as many as it had, or one
        known = {name: _model(steps[-1]).get(name, 1) for name in end}
        steps[-1].events.update(_events(_model(steps[-1]), Counter(known)))
    return found


def _round(stage: str, rows: pd.DataFrame) -> EvidenceRound:
    """A round from its rows of the table, with their ``way``."""
    best = rows.groupby(["effect", "way"])["log_evidence"].max().unstack("way")
    evidence = best.reindex(columns=[SCREEN, REFIT])
    refitted = evidence.index.isin(rows.loc[rows["way"] == REFIT, "effect"])
    evidence[NO_FIT] = refitted & evidence[REFIT].isna()
    place = _IN_PLACE.match(stage)
    beside = tuple(name for name in str(rows["beside"].iloc[0]).split(", ") if name)
    without = tuple(place["names"].split(" and ")) if place else ()
    return EvidenceRound(stage, beside, without, bool(place and place["trial"]), evidence)


def _model(one: EvidenceRound) -> Counter[str]:
    """How many forms of each effect were in the model when the search came to the round."""
    return Counter([*one.beside, *one.without])


def _events(before: Counter[str], later: Counter[str]) -> dict[str, str]:
    """What entered, and what left, or gave way where something entered at the same time."""
    # differences of counts keep what is above zero
    entered, gone = later - before, before - later
    lost = REPLACED if entered else LEFT
    return dict.fromkeys(sorted(entered), ENTERED) | dict.fromkeys(sorted(gone), lost)


def evidence_by_round_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """Effects by rounds: the log evidence in each cell, coloured where it passes the threshold.

    Names are bold where the verdict has them: blue for certain, green for one of a set.
    """
    verdict = read_verdict(tables.files["verdict"])
    end = (*verdict.named, *verdict.candidates_in_set)
    every = rounds(tables["candidates"], end)
    if not every:
        return saying("No evidence can be shown: no effect was tried.")
    shown = rounds_shown(every)
    wide = pd.concat([one.shown.rename(column) for column, one in enumerate(shown)], axis=1)
    # effects with evidence for or against them in some round, most evidence first
    traced = wide[(wide.abs() >= _NO_TRACE).any(axis=1)]
    most = (traced if len(traced) else wide).max(axis=1)
    names = list(most.sort_values(ascending=False, kind="stable").index)
    grid = wide.loc[names].to_numpy(float)
    turned = len(shown) > _FULL
    labels = _TURNED_MM if turned else _WRAPPED_MM
    figure = blank(len(names) * _ROW_MM + labels + _KEY_MM)
    axis = _panel(figure, len(shown))
    threshold = verdict.threshold.log_evidence
    forms = [one.evidence.reindex(names) for one in shown]
    failed = np.column_stack([one[NO_FIT].fillna(False).to_numpy(bool) for one in forms])
    # what was refitted without a result is white, whatever the screen said of it
    levels, scale = _levels(np.where(failed, -np.inf, grid), threshold)
    image = draw_heat(axis, levels, scale, None, levels <= 0.0)
    _numbers(axis, grid, forms, levels, scale)
    _mark(axis, names, shown)
    heads = [f"{every.index(one) + 1}  {short(one.words, 34)}" for one in shown]
    if not turned:
        heads = [f"round {fill(head, 17)}" for head in heads]
    name_cells(axis, [general(name) for name in names], heads, turned)
    for label, name in zip(axis.get_yticklabels(), names, strict=True):
        if name in end:
            label.set(fontweight="bold", color=BLUE if name in verdict.named else GREEN)
    if threshold is not None:
        _scale_bar(figure, axis, image, threshold, scale)
    hidden = len(wide) - len(names)
    told = _words(every, shown, hidden, verdict)
    if failed.any():
        told += " In brackets: screened, but no refit of it has a result, so it is no rival."
    explain_marks(figure, _handles(shown, grid), told, 5)
    return figure


def _panel(figure: Figure, columns: int) -> Axes:
    """A panel that is as wide as its columns need; of few rounds the cells are no wider."""
    spare = max(_FULL - columns, 0)
    if not spare:
        return figure.subplots()
    left, right = figure.subplots(1, 2, width_ratios=[columns, 0.75 * spare])
    right.set_visible(False)
    panel: Axes = left
    return panel


def rounds_shown(every: Sequence[EvidenceRound]) -> list[EvidenceRound]:
    """At most `MOST_ROUNDS`, in their order.

    The first, which has the base alone, and those that led to something go before the others.
    """
    if len(every) <= MOST_ROUNDS:
        return list(every)
    ranked = sorted(range(len(every)), key=lambda n: (n > 0 and not every[n].events, n))
    return [every[n] for n in sorted(ranked[:MOST_ROUNDS])]


def _levels(grid: Array, threshold: float | None) -> tuple[Array, Normalize]:
    """Colours (R, C) of R effects in C rounds: powers of ten above the threshold, 0 below it.

    Without a threshold all is white. NaN stays NaN and is hatched.

    Parameters
    ----------
    grid : (R, C) log evidence. threshold : log evidence that noise seldom exceeds, above zero.
    """
    if threshold is None:
        return np.where(np.isfinite(grid), 0.0, np.nan), Normalize(0.0, 1.0)
    beyond = np.log10(np.maximum(grid, threshold) / threshold)
    return beyond, Normalize(0.0, max(_LEAST_DECADES, float(np.nanmax(beyond))))


def _numbers(
    axis: Axes, grid: Array, by_way: Sequence[pd.DataFrame], levels: Array, scale: Normalize
) -> None:
    """The log evidence in each cell: bold where refitted, small where only screened.

    Parameters
    ----------
    grid : (R, C) log evidence. by_way : `EvidenceRound.evidence` of each column, rows as of grid.
    levels, scale : of `_levels`.
    """
    for row, column in np.argwhere(np.isfinite(grid)):
        value = float(grid[row, column])
        refitted = np.isfinite(by_way[column][REFIT].iloc[row])
        words = fixed(value, 1) if abs(value) < 100.0 else number(value, 4)
        words = f"({words})" if by_way[column][NO_FIT].iloc[row] else words
        dark = scale(levels[row, column]) > _DARK
        axis.text(
            column + 0.06,
            row,
            words,
            ha="center",
            va="center",
            fontsize=6.0 if refitted else 5.0,
            fontweight="bold" if refitted else "normal",
            color=WHITE if dark else BLACK if refitted or levels[row, column] else GREY,
            zorder=3,
            in_layout=False,
        )


def _mark(axis: Axes, names: Sequence[str], shown: Sequence[EvidenceRound]) -> None:
    """What was in the model of a round, and what the round led to."""
    for column, one in enumerate(shown):
        for name in one.beside:
            if name in names:
                corner = (column - 0.47, names.index(name) - 0.44)
                outline = Rectangle(corner, 0.94, 0.88, fill=False, ec=BLUE, lw=1.2, zorder=4)
                axis.add_patch(outline)
        for name, event in one.events.items():
            if name in names:
                marker, color, _ = _EVENTS[event]
                at = ([column - 0.39], [names.index(name)])
                how = {"mec": WHITE, "mew": 0.5, "zorder": 5}
                axis.plot(*at, marker, color=color, ms=5.0, **how)  # type: ignore[arg-type]


def _scale_bar(figure: Figure, axis: Axes, image: object, threshold: float, to: Normalize) -> None:
    """The colours' key, from the threshold on; told in log evidence, though powers of ten are even.

    Powers of ten within 1.5 times the threshold are left out, as they would stand upon its own.
    """
    bar = figure.colorbar(image, ax=axis, location="right", aspect=30, shrink=0.8)  # type: ignore[arg-type]
    most = threshold * 10.0 ** float(to.vmax or 0.0)
    ticks = [threshold, *(x for d in range(7) for x in (10.0**d,) if 1.5 * threshold < x < most)]
    bar.set_ticks([float(np.log10(x / threshold)) for x in ticks])
    bar.set_ticklabels([f"{tick(round(x, 1))}" for x in ticks])
    bar.set_label("log evidence")
    bar.outline.set_linewidth(0.4)


def _handles(shown: Sequence[EvidenceRound], grid: Array) -> list[Line2D | Patch]:
    """Keys of the marks that are there."""
    handles: list[Line2D | Patch] = []
    if any(one.beside for one in shown):
        handles.append(Patch(fill=False, ec=BLUE, lw=1.2, label="in the model"))
    happened = {event for one in shown for event in one.events.values()}
    handles += [
        Line2D([], [], marker=marker, color=color, ms=5.0, lw=0, label=words)
        for event, (marker, color, words) in _EVENTS.items()
        if event in happened
    ]
    if np.isnan(grid).any():
        handles.append(empty_cell("no form of it had a result"))
    return handles


def _words(
    every: Sequence[EvidenceRound], shown: Sequence[EvidenceRound], hidden: int, verdict: Verdict
) -> str:
    """The sentence below the figure; ``hidden``: how many effects have no row."""
    told = [
        "A column is a round of the search; best form of each effect; bold: refitted by the full "
        "simulator, else screened",
    ]
    threshold, false_alarm = verdict.threshold.log_evidence, verdict.threshold.false_alarm
    if threshold is not None and false_alarm is not None:
        told.append(
            f"white: below the threshold {number(threshold, 2)}, which "
            f"{tick(100.0 * false_alarm)} % of data sets that lack nothing pass"
        )
    if verdict.named or verdict.candidates_in_set:
        told.append("blue names: named, green: cannot be told apart")
    if hidden:
        told.append(f"{count(hidden, 'effect')} without a trace in these tests left out")
    if len(shown) < len(every):
        told.append(f"{len(shown)} of {count(len(every), 'round')}, those that changed the model")
    return "; ".join(told) + "."

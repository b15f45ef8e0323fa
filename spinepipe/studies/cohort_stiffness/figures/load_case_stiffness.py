"""Figure: stiffness fitted to one load case as a multiple of that fitted to all of them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import BAR_PT, finite, quartiles, spread_out
from spinepipe.report.panels import explain_marks, head, log_ticks, sections
from spinepipe.report.style import BLACK, GREY, OURS, WHITE, saying
from spinepipe.report.words import AXIS, case, count, short
from spinepipe.studies.cohort_stiffness.figures.stiffness_by_level import ends_shown, unconstrained
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS, OF_JOINTS, SHARED
from spinepipe.studies.cohort_stiffness.settings import ALL, CohortStiffness, load_cases
from spinepipe.units import COORDINATES

_KEYS = ["specimen", "representation", "joint", "coordinate"]
_SHOWN = (SHARED[0], OF_JOINTS[0])
_ROW_MM, _AROUND_MM, _KEY_MM = 13.0, 15.0, 22.0
_LEAST_REACH, _FARTHEST = 1.15, 30.0

_FEW, _MOST_INTERVALS = 12, 120
"""Fits of a row that keep their order; and that have an interval each."""


def load_case_stiffness_figure(
    study: CohortStiffness, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A line of panels per representation, a panel per coordinate, a row per load case."""
    stiffness = tables["stiffness"]
    cases = load_cases(stiffness["fitted_to"])
    if len(cases) < 2:
        return saying("One load case: nothing to compare fits of single load cases with.")
    found = ratios(stiffness, tables["errors"])
    found = found[found["ratio"].notna()]
    shown = [name for name in _SHOWN if name in set(found["representation"])]
    shown = shown or list(dict.fromkeys(found["representation"]))[:1]
    if not shown:
        return saying("No stiffness was found both for a load case by itself and for all of them.")
    names = [name for name in COORDINATES if name in set(found["coordinate"])]
    height = _ROW_MM * len(cases) + _AROUND_MM
    lines, figure = sections([(len(names), height)] * len(shown), _KEY_MM)
    names_of_cases = []
    for test in cases[::-1]:  # on two lines
        words = short(case(test), 32).split(" ")
        halves = words[: -(-len(words) // 2)], words[-(-len(words) // 2) :]
        names_of_cases.append("\n".join(" ".join(half) for half in halves if half))
    number_of = 0
    for representation, axes in zip(shown, lines, strict=True):
        for index, (name, axis) in enumerate(zip(names, axes, strict=True)):
            head(axis, number_of, AXIS[name])
            number_of += 1
            here = found[
                (found["representation"] == representation) & (found["coordinate"] == name)
            ]
            _draw(axis, here, cases)
            axis.set_yticks(range(len(cases)), names_of_cases)
            place = axis.get_subplotspec()
            axis.tick_params(labelleft=place is None or place.is_first_col())
            if index == 0:
                axis.set_ylabel(IN_WORDS[representation], fontweight="bold")
    tested = [_tested(study, tables["statistics"], name) for name in shown]
    _explain(figure, found[found["representation"].isin(shown)], tested)
    return figure


def ratios(stiffness: pd.DataFrame, errors: pd.DataFrame) -> pd.DataFrame:
    """One row per fit to a single load case, with the ratio and its interval.

    The interval is that of the fit to the single load case alone. Where joints share an unknown,
    the first joint stands for all.

    Returns
    -------
    Columns ``fitted_to``, those of the keys, ``ratio``, ``low``, ``high``, ``doubted``, and
    ``loaded``: whether that load case drives the coordinate.
    """
    own = stiffness[stiffness["source"] == "own"]
    first = own["joint"] == own["joint"].iloc[0] if len(own) else own["joint"].notna()
    own = own[~own["representation"].isin(SHARED) | first]
    single = own[own["fitted_to"].isin(load_cases(stiffness["fitted_to"]))]
    whole = own.loc[own["fitted_to"] == ALL, [*_KEYS, "stiffness"]]
    both = single.merge(whole.rename(columns={"stiffness": "whole"}), on=_KEYS, how="left")
    divided = {
        new: both[old].astype(float) / both["whole"].astype(float)
        for new, old in (("ratio", "stiffness"), ("low", "low"), ("high", "high"))
    }
    driven = errors[errors["loaded"].astype(bool)] if len(errors) else errors
    pairs = set(zip(driven["test"], driven["coordinate"], strict=True)) if len(errors) else set()
    loads = [key in pairs for key in zip(both["fitted_to"], both["coordinate"], strict=True)]
    return both[[*_KEYS, "fitted_to"]].assign(**divided, doubted=unconstrained(both), loaded=loads)


def _draw(axis: Axes, rows: pd.DataFrame, cases: Sequence[str]) -> None:
    axis.set_xscale("log")
    axis.axvline(1.0, color=BLACK, lw=0.6, zorder=1)
    low, high = _reach(rows)
    axis.set_xlim(low, high)
    log_ticks(axis.xaxis, low, high, 5)
    axis.set_ylim(-0.55, len(cases) - 0.4)
    axis.spines["left"].set_visible(False)
    axis.set_xlabel("stiffness, this load case / all")
    for y, test in enumerate(cases[::-1]):
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=0)
        here = rows[rows["fitted_to"] == test]
        if not len(here):
            place = axis.get_yaxis_transform()
            axis.text(0.02, y, "no result", transform=place, color=GREY, fontsize=6.0, va="center")
            continue
        _draw_row(axis, here, y)


def _reach(rows: pd.DataFrame) -> tuple[float, float]:
    """Both ways equally far, as far as stiffness that the data hold goes."""
    held = rows[~rows["doubted"]] if (~rows["doubted"]).any() else rows
    # The axis is logarithmic and symmetric about 1: half and twice are equally far.
    sizes = np.abs(np.log(finite(held[["ratio", "low", "high"]])))
    far = float(np.exp(sizes.max())) if len(sizes) else _LEAST_REACH
    end = min(_FARTHEST, max(_LEAST_REACH, far * 1.05))
    return 1.0 / end, end


def _draw_row(axis: Axes, rows: pd.DataFrame, y: int) -> None:
    """Each fit with its interval; where there are many, dots with their middle half."""
    loaded = bool(rows["loaded"].any())
    color = OURS if loaded else GREY
    low, high = axis.get_xlim()
    n = len(rows)
    # In order around the middle of the row where they are few, else mixed.
    shifts = 0.5 * spread_out(n) if n > _FEW else 0.3 - 0.6 * (np.arange(n) + 0.5) / n
    if n > _MOST_INTERVALS:
        dots: dict[str, Any] = {"color": color, "ms": 1.8, "mew": 0, "alpha": 0.3, "zorder": 3}
        axis.plot(np.clip(rows["ratio"], low, high), y + shifts, "o", **dots, rasterized=True)
    else:
        for at, row in zip(y + shifts, rows.to_dict("records"), strict=True):
            _draw_fit(axis, row, float(at), color, n <= _FEW)
    if n > _FEW:  # of all fits: without those not held by the data the median would be biased
        middle = quartiles(np.clip(finite(rows["ratio"]), low, high))
        axis.plot([middle.median] * 2, [y - 0.36, y + 0.36], color=BLACK, lw=1.2, zorder=6)
        bar: dict[str, Any] = {"color": BLACK, "lw": BAR_PT * 0.5, "alpha": 0.8, "zorder": 5}
        axis.plot([middle.low, middle.high], [y, y], **bar, solid_capstyle="butt")


def _draw_fit(axis: Axes, row: dict[Any, Any], y: float, color: str, roomy: bool) -> None:
    """One fit with its interval, or its side where it is beyond the axis."""
    low, high = axis.get_xlim()
    x = min(max(row["ratio"], low), high)
    beyond = x != row["ratio"]
    ends = ends_shown(row, low, high)
    if ends and not beyond:
        width, alpha = (0.8, 1.0) if roomy else (0.5, 0.45)
        axis.plot(ends, [y, y], color=color, lw=width, alpha=alpha, zorder=3, solid_capstyle="butt")
    shape = "o" if not beyond else "<" if x == low else ">"
    face = WHITE if row["doubted"] or beyond else color
    symbol: dict[str, Any] = {"ms": 3.0 if roomy else 2.2, "mew": 0.6, "zorder": 4}
    axis.plot([x], [y], shape, color=color, mfc=face, **symbol, clip_on=False)


def _explain(figure: Figure, rows: pd.DataFrame, tested: Sequence[str]) -> None:
    symbol: dict[str, Any] = {"marker": "o", "ms": 3.0, "lw": 0.8}
    handles = [
        Line2D([], [], color=OURS, **symbol, label="this load case loads it"),
        Line2D([], [], color=GREY, **symbol, label="it does not"),
    ]
    if rows["doubted"].any():
        label = "not identifiable or at a bound"
        handles.append(Line2D([], [], color=GREY, mfc=WHITE, **symbol, label=label))
    words = (
        "Symbol: a specimen, or a joint of it; line: 95 % interval of the fit to this load case; "
        f"black, where more than {_FEW} stand in a row: median and middle half; lines are left out "
        f"of rows of more than {_MOST_INTERVALS}; ◁▷: beyond the axis."
    )
    told = " ".join(part for part in (words, *tested) if part)
    explain_marks(figure, handles, told, len(handles))


def _tested(study: CohortStiffness, statistics: pd.DataFrame, representation: str) -> str:
    """How many specimens the nested F test calls load-case specific."""
    if not len(statistics):
        return ""
    family = statistics["family"] == f"load_case_specific/{representation}"
    known = statistics.loc[family, "p_holm"].dropna()
    if not len(known):
        return ""
    many = int((known < study.significance).sum())
    return (
        f"{IN_WORDS[representation].capitalize()}: separate stiffness is significantly better in "
        f"{many} of {count(len(known), 'specimen')} (nested F test, Holm)."
    )

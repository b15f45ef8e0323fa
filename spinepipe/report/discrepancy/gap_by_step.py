"""Figure: measured and modelled motion along the load steps, where they disagree most."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.report.cohort.named import case, short
from spinepipe.report.discrepancy.verdict import Verdict
from spinepipe.report.layout import explain_marks
from spinepipe.report.sections import sections
from spinepipe.report.style import BLACK, GREY, OURS, THEIRS, saying
from spinepipe.report.words import AXIS, POSITIVE, number

MOST_PLACES, FEWEST_PLACES = 6, 3
CLEARLY = 1.5
"""Beyond the fewest, places are shown where the base is off by more than so many noise SD."""

PLACE = ["specimen", "test", "joint", "coordinate"]

_PANEL_MM, _KEY_MM = 56.0, 15.0
_BAND_SD = 1.96


def gap_by_step_figure(
    cohort: Cohort, verdict: Verdict, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each of the places where the base model is farthest off."""
    gap = tables["gap"]
    places = worst_places(gap)
    if not places:
        return saying("No motion can be shown: the base model has no pose.")
    added = not gap["base"].fillna(0.0).equals(gap["with_effects"].fillna(0.0))
    (panels,), figure = sections([(len(places), _PANEL_MM)], _KEY_MM)
    for index, (axis, place) in enumerate(zip(panels, places, strict=True)):
        rows = gap[(gap[PLACE] == list(place)).all(axis=1)].sort_values("step")
        _draw(axis, rows, added)
        _label(axis, index, place, len(cohort.specimen_names))
    explain_marks(figure, _handles(added), _words(places, gap), 4)
    return figure


def worst_places(gap: pd.DataFrame) -> list[tuple[Any, ...]]:
    """Places of the largest residual of the base in noise SD, of like places the worst specimen."""
    rows = gap[gap["base"].notna() & (gap["noise_sd"] > 0.0)]
    squares = ((rows["measured"] - rows["base"]) / rows["noise_sd"]) ** 2
    size = squares.groupby([rows[key] for key in PLACE], sort=False).mean().rename("size")
    ordered = size.sort_values(ascending=False, kind="stable").reset_index()
    like = ordered.drop_duplicates(PLACE[1:]).head(MOST_PLACES).reset_index()
    like = like[(like.index < FEWEST_PLACES) | (like["size"] > CLEARLY**2)]
    return [tuple(row) for row in like[PLACE].itertuples(index=False)]


def _draw(axis: Axes, rows: pd.DataFrame, with_effects: bool) -> None:
    x, measured = rows["step"].to_numpy(float), rows["measured"].to_numpy(float)
    band = _BAND_SD * rows["noise_sd"].to_numpy(float)
    axis.fill_between(x, measured - band, measured + band, color=GREY, alpha=0.25, lw=0, zorder=1)
    axis.plot(x, measured, "o", color=BLACK, ms=2.2, mew=0.0, zorder=4)
    axis.plot(x, rows["base"].to_numpy(float), color=THEIRS, ls="--", lw=1.2, zorder=3)
    if with_effects:
        axis.plot(x, rows["with_effects"].to_numpy(float), color=OURS, lw=1.4, zorder=3)
    axis.set_xlim(float(x.min()) - 0.3, float(x.max()) + 0.3)


def _label(axis: Axes, index: int, place: tuple[Any, ...], specimens: int) -> None:
    specimen, test, joint, coordinate = place
    whose = f", {short(str(specimen), 14)}" if specimens > 1 else ""
    axis.set_title(f"{chr(ord('a') + index)}   {joint}{whose}\n{short(case(str(test)), 34)}")
    unit = "mm" if coordinate in ("anterior", "superior", "right") else "°"
    axis.set_ylabel(f"{AXIS[coordinate].lower()} ({unit}), + {POSITIVE[coordinate]}")
    axis.set_xlabel("load step")
    axis.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axis.tick_params(axis="y", length=2.5)


def _handles(with_effects: bool) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=BLACK, marker="o", ms=2.6, lw=0, label="measured, mean of cycles"),
        Patch(facecolor=GREY, alpha=0.25, lw=0, label="its noise, 95 %"),
        Line2D([], [], color=THEIRS, ls="--", lw=1.2, label="base model"),
    ]
    if with_effects:
        handles.append(Line2D([], [], color=OURS, lw=1.4, label="with the effects"))
    return handles


def _words(places: list[tuple[Any, ...]], gap: pd.DataFrame) -> str:
    rows = gap[(gap[PLACE] == list(places[0])).all(axis=1)]
    off = ((rows["measured"] - rows["base"]) / rows["noise_sd"]).to_numpy(float)
    worst = float(np.sqrt(np.nanmean(off**2)))
    return (
        "The places where the base model is farthest off, each in the specimen where it is worst; "
        f"in a the base is off by {number(worst, 2)} noise SD (root mean square)."
    )

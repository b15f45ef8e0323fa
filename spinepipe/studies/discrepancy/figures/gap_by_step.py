"""Figure: measured less modelled motion along the load steps, where they disagree most."""

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
from spinepipe.report.cohort.named import short
from spinepipe.report.discrepancy.verdict import Verdict
from spinepipe.report.discrepancy.words import capital, plain
from spinepipe.report.layout import explain_marks
from spinepipe.report.sections import sections
from spinepipe.report.style import BLACK, GREY, INK, OURS, SMALL_PT, THEIRS, saying
from spinepipe.report.words import AXIS, number, unit

MOST_PLACES, FEWEST_PLACES = 6, 3
CLEARLY = 1.5
"""Beyond the fewest, places are shown where the base is off by more than so many noise SD."""

PLACE = ["specimen", "test", "joint", "coordinate"]

MODELS: dict[str, dict[str, Any]] = {
    "base": {"color": THEIRS, "ls": "--", "lw": 1.0, "marker": "s", "ms": 3.0, "mew": 0.0},
    "with_effects": {"color": OURS, "ls": "-", "lw": 1.2, "marker": "o", "ms": 2.6, "mew": 0.0},
}
"""How each model is drawn."""

_PANEL_MM, _KEY_MM = 50.0, 17.0
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
        _reach(axis, rows["measured"].to_numpy(float), unit(place[-1]))
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
    axis.fill_between(x, -band, band, color=GREY, alpha=0.25, lw=0, zorder=1)
    axis.axhline(0.0, color=BLACK, lw=0.5, zorder=2)
    for name, look in MODELS.items() if with_effects else [("base", MODELS["base"])]:
        axis.plot(x, measured - rows[name].to_numpy(float), zorder=3, **look)
    axis.set_xlim(float(x.min()) - 0.3, float(x.max()) + 0.3)


def _label(axis: Axes, index: int, place: tuple[Any, ...], specimens: int) -> None:
    specimen, test, joint, coordinate = place
    whose = f", {short(str(specimen), 14)}" if specimens > 1 else ""
    axis.set_title(
        f"{chr(ord('a') + index)}   {joint}{whose}\n{short(capital(plain(str(test))), 34)}"
    )
    axis.set_ylabel(f"{AXIS[coordinate].lower()} ({unit(coordinate)})")
    axis.set_xlabel("load step")
    axis.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axis.tick_params(axis="y", length=2.5)


def _reach(axis: Axes, measured: np.ndarray, of: str) -> None:
    """How far the joint moved: the size of the motion that the difference is a part of."""
    ends = (number(float(end), 2) for end in (measured.min(), measured.max()))
    words = f"moved {' to '.join(ends)}{of if of == '°' else f' {of}'}"
    axis.text(0.02, 1.0, words, transform=axis.transAxes, va="top", fontsize=SMALL_PT,
              color=INK[GREY], in_layout=False)  # fmt: skip
    axis.margins(y=0.18)


def _handles(with_effects: bool) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Patch(facecolor=GREY, alpha=0.25, lw=0, label="noise of the mean of the cycles, 95 %"),
        Line2D([], [], label="measured less base model", **MODELS["base"]),
    ]
    if with_effects:
        label = "measured less model with the effects"
        handles.append(Line2D([], [], label=label, **MODELS["with_effects"]))
    return handles


def _words(places: list[tuple[Any, ...]], gap: pd.DataFrame) -> str:
    rows = gap[(gap[PLACE] == list(places[0])).all(axis=1)]
    off = ((rows["measured"] - rows["base"]) / rows["noise_sd"]).to_numpy(float)
    worst = float(np.sqrt(np.nanmean(off**2)))
    return (
        "The places where the base model is farthest off, each in the specimen where it is worst; "
        f"in a the base is off by {number(worst, 2)} noise SD (root mean square)."
    )

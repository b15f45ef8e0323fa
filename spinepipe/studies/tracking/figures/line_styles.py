"""How approaches and persons are told apart in all figures of this kind, in colour and without."""

from collections.abc import Iterable, Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, PURPLE, SKY, VERMILLION, LineStyle
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.words import short_of, sort_approaches

STYLES = (
    LineStyle(VERMILLION, "o", "-"),
    LineStyle(BLUE, "s", "-"),
    LineStyle(GREEN, "D", (0, (5.0, 1.5))),
    LineStyle(PURPLE, "v", (0, (2.5, 1.2))),
    LineStyle(SKY, "^", (0, (5.0, 1.5, 1.0, 1.5))),
)

_FIXED = ("ik", "optk_generic", "optk_from_both", "optk_zero", "optk_calibrated")
OWN = dict(zip(_FIXED, STYLES, strict=True))
"""Approaches that look the same in all figures."""

FURTHER = ("optk_from_both", "optk_zero", "optk_calibrated", "ik_springs", "ik_smooth")
"""Approaches that stand beside those that the study draws, in this order, while there is room."""


def choose_approaches(study: Tracking, there: Iterable[str], most: int = 3) -> list[str]:
    """A few approaches of those that are there, in the order of the settings."""
    present = set(there)
    wanted = dict.fromkeys((*study.drawn_approaches, *FURTHER, *sort_approaches(present)))
    return sort_approaches([name for name in wanted if name in present][:most])


def styles_of_approaches(names: Sequence[str]) -> dict[str, LineStyle]:
    """A look of each approach; those without one of their own take what is left."""
    taken = [OWN[name] for name in names if name in OWN]
    spare = [look for look in STYLES if look not in taken] or list(STYLES)
    others = [name for name in names if name not in OWN]
    left = {name: spare[k % len(spare)] for k, name in enumerate(others)}
    return {name: OWN.get(name) or left[name] for name in names}


def styles_of(names: Sequence[str]) -> dict[str, LineStyle]:
    """A look of each person or trial; they come again after the last."""
    return {name: STYLES[k % len(STYLES)] for k, name in enumerate(names)}


def key_of(looks: dict[str, LineStyle], marks: bool = True) -> list[Line2D]:
    """Marks of a legend, of approaches."""
    bare: dict[str, Any] = {} if marks else {"marker": ""}
    return [Line2D([], [], **look.line(**bare), label=short_of(n)) for n, look in looks.items()]


def trials_of(rows: pd.DataFrame) -> list[str]:
    """Trials in the order of the table."""
    return [str(name) for name in dict.fromkeys(rows["trial"])]


def show_ticks(axis: Axes) -> None:
    """Ticks of an upright axis that is a scale, not a list."""
    axis.tick_params(axis="y", size=2.5, width=0.6)


def persons_words(n: int) -> str:
    """How spread over persons is shown, or why there is none."""
    return "One person: no spread." if n < 2 else f"{n} persons."


def zero_line(axis: Axes) -> None:
    """A thin line through zero."""
    axis.axhline(0.0, color=BLACK, lw=0.5, zorder=0)


def say_empty(axis: Axes, words: str) -> None:
    """A panel without anything to show says why."""
    axis.text(0.5, 0.5, words, ha="center", va="center", color=GREY, transform=axis.transAxes)
    axis.set_axis_off()

"""How approaches and persons are told apart in all figures of this kind, in colour and without."""

from collections.abc import Iterable, Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, PURPLE, SKY, VERMILLION, LineStyle
from spinepipe.report.words import plain
from spinepipe.status import Status
from spinepipe.studies.tracking.reload_motions import AXIS
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.words import in_order, short_of

LOOKS = (
    LineStyle(VERMILLION, "o", "-"),
    LineStyle(BLUE, "s", "-"),
    LineStyle(GREEN, "D", (0, (5.0, 1.5))),
    LineStyle(PURPLE, "v", (0, (2.5, 1.2))),
    LineStyle(SKY, "^", (0, (5.0, 1.5, 1.0, 1.5))),
)

FURTHER = ("optk_from_both", "optk_zero", "optk_calibrated", "ik_springs", "ik_smooth")
"""Approaches that stand beside those that the study draws, in this order, while there is room."""

MOTIONS = ("extension positive", "bending to the right positive", "rotation to the left positive")
"""How rotations that motions are about are counted, in the order of `moved.AXIS`."""


def chosen(study: Tracking, there: Iterable[str], most: int = 3) -> list[str]:
    """A few approaches of those that are there, in the order of the settings."""
    present = set(there)
    wanted = dict.fromkeys((*study.drawn_approaches, *FURTHER, *in_order(present)))
    return in_order([name for name in wanted if name in present][:most])


OWN = {
    "ik": LOOKS[0],
    "optk_generic": LOOKS[1],
    "optk_from_both": LOOKS[2],
    "optk_zero": LOOKS[3],
    "optk_calibrated": LOOKS[4],
}
"""Approaches that look the same in all figures."""


def looks_of_approaches(names: Sequence[str]) -> dict[str, LineStyle]:
    """A look of each approach; those without one of their own take what is left."""
    taken = [OWN[name] for name in names if name in OWN]
    spare = [look for look in LOOKS if look not in taken] or list(LOOKS)
    others = [name for name in names if name not in OWN]
    left = {name: spare[k % len(spare)] for k, name in enumerate(others)}
    return {name: OWN.get(name) or left[name] for name in names}


def looks_of(names: Sequence[str]) -> dict[str, LineStyle]:
    """A look of each person or trial; they come again after the last."""
    return {name: LOOKS[k % len(LOOKS)] for k, name in enumerate(names)}


def key_of(looks: dict[str, LineStyle], marks: bool = True) -> list[Line2D]:
    """Marks of a legend, of approaches."""
    bare: dict[str, Any] = {} if marks else {"marker": ""}
    return [Line2D([], [], **look.line(**bare), label=short_of(n)) for n, look in looks.items()]


def trials_of(rows: pd.DataFrame) -> list[str]:
    """Trials in the order of the table."""
    return [str(name) for name in dict.fromkeys(rows["trial"])]


def about(kind: str) -> str:
    """Which way the rotation that a kind of motion is about is counted."""
    return MOTIONS[AXIS[kind]]


def turns_about(rows: pd.DataFrame, trial: str, kinds: dict[tuple[str, str], str]) -> str | None:
    """The kind of a trial of a table, None of one in which nothing turns."""
    own = rows.loc[rows["trial"] == trial, "specimen"].unique()
    found = [kinds.get((str(who), trial)) for who in own]
    return next((kind for kind in found if kind in AXIS), None)


def scale(axis: Axes) -> None:
    """Ticks of an upright axis that is a scale, not a list."""
    axis.tick_params(axis="y", size=2.5, width=0.6)


def persons_words(n: int) -> str:
    """How spread over persons is shown, or why there is none."""
    return "One person: no spread." if n < 2 else f"{n} persons."


def settled(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Rows whose fit settled, with all markers near enough."""
    return rows["status"] == Status.CONVERGED.value


def zero_line(axis: Axes, across: bool = True) -> None:
    """A thin line through zero."""
    (axis.axhline if across else axis.axvline)(0.0, color=BLACK, lw=0.5, zorder=0)


def says(axis: Axes, words: str) -> None:
    """A panel without anything to show says why."""
    axis.text(0.5, 0.5, words, ha="center", va="center", color=GREY, transform=axis.transAxes)
    axis.set_axis_off()


def trial_words(trial: str) -> str:
    """A trial in words."""
    return plain(trial)

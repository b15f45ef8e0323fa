"""Figure: what the motion of every joint hangs on."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.range_of_motion.panels import EVERY, key, panels
from spinepipe.report.style import BLUE, GREEN, GREY, VERMILLION, saying
from spinepipe.report.words import count

_ROW_MM = 6.5
_MARKS: dict[str, tuple[str, str, str]] = {
    "specimen": (BLUE, "o", "specimen"),
    "pose": (GREEN, "s", "joint frames"),
    "stiffness": (VERMILLION, "D", "stiffness"),
    "rest": (GREY, "^", "rest"),
}
"""Colour, shape and name of each factor: shapes tell them apart without colours."""


def variance_figure(cohort: Cohort, variance: pd.DataFrame) -> Figure:
    """Shares with intervals per joint and test, from ``rom_variance``.

    Of several specimens those of the cohort, or of the first where the cohort has none.
    """
    done = variance[variance["status"] == "done"]
    whole = done[done["specimen"] == EVERY]
    shown = whole if len(whole) else done[done["specimen"] == done["specimen"].min()]
    if shown.empty:
        why = "; ".join(dict.fromkeys(variance["message"].iloc[:1]))
        return saying(f"No shares of variance can be shown: {why}.")
    tests = list(dict.fromkeys(shown["test"]))
    axes, figure = panels(tests, cohort.joint_names, _ROW_MM)
    factors = [name for name in _MARKS if shown[f"{name}_share"].notna().any()]
    for axis, test in zip(axes, tests, strict=True):
        _draw(axis, shown[shown["test"] == test], cohort.joint_names, factors)
    handles = [
        Line2D([], [], color=_MARKS[name][0], marker=_MARKS[name][1], ms=3.5, lw=0.8,
               label=_MARKS[name][2])
        for name in factors
    ]  # fmt: skip
    key(figure, handles, _words(shown))
    return figure


def _draw(axis: Axes, rows: pd.DataFrame, joints: tuple[str, ...], factors: list[str]) -> None:
    """One test: the factors of a joint one below the other."""
    for y, joint in enumerate(joints):
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=1)
        for row in rows[rows["joint"] == joint].to_dict("records"):
            for number, name in enumerate(factors):
                color, shape, _ = _MARKS[name]
                at = y + 0.3 - 0.6 * number / (len(factors) - 1)
                ends = [100.0 * row[f"{name}_low"], 100.0 * row[f"{name}_high"]]
                axis.plot(ends, [at, at], color=color, lw=0.8, solid_capstyle="butt", zorder=3)
                axis.plot([100.0 * row[f"{name}_share"]], [at], shape, color=color, ms=2.6,
                          mew=0.0, clip_on=False, zorder=4)  # fmt: skip
    axis.set_xlim(0.0, 100.0)
    axis.set_xlabel("share of variance (%)")


def _words(shown: pd.DataFrame) -> str:
    first = shown.iloc[0]
    poses = (
        f"{count(int(first['n_poses']), 'drawn pose')} each"
        if first["specimen"] == EVERY
        else (f"{count(int(first['n_poses']), 'drawn pose')} of {first['specimen']}")
    )
    sets = count(int(first["n_stiffness"]), "drawn stiffness set")
    specimens = count(int(first["n_specimens"]), "specimen")
    return f"symbol: estimate, line: 95 % interval; {specimens}, {poses}, {sets}"

"""A drawn motion on paper: its first frame and the one farthest from it, seen from two sides."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.report.panels import explain_marks, head
from spinepipe.report.style import (
    BLACK,
    BLUE,
    GREY,
    TALLEST_MM,
    VERMILLION,
    WIDTH_MM,
    blank,
    picture,
    style,
)
from spinepipe.report.words import fixed
from spinepipe.studies.tracking.in_space_motions import Frame, MotionInSpace

_VIEWS = (("From the right", 0, "forwards (mm)"), ("From behind", 2, "to the right (mm)"))
_WIDTH_MM, _AROUND_MM, _KEY_MM, _MARGIN_MM, _LARGEST = 130.0, 20.0, 12.0, 12.0, 0.3
"""Width of both views on paper, what is around them, margin in the body, scale at most."""


def still(one: MotionInSpace) -> bytes:
    """A motion from the right and from behind."""
    with style():
        return picture(still_figure(one), "svg")


def still_figure(one: MotionInSpace) -> Figure:
    """The same as a figure: the first frame light, the farthest one dark."""
    far = farthest(one)
    figure, axes = _views(one, far)
    shown = {BLACK: far} if far is one.frames[0] else {GREY: one.frames[0], BLACK: far}
    for index, (axis, (title, across, label)) in enumerate(zip(axes, _VIEWS, strict=True)):
        head(axis, index, title)
        for color, frame in shown.items():
            _draw(axis, frame, across, color)
        axis.set_aspect("equal", adjustable="box")
        axis.set_xlabel(label)
        axis.tick_params(axis="y", size=2.5)
    axes[0].set_ylabel("up (mm)")
    lines = [
        Line2D([], [], color=color, marker="s", ms=2.5, label=f"joints at {fixed(frame.time_s)} s")
        for color, frame in shown.items()
    ]
    rings: dict[str, Any] = {"ls": "", "ms": 4.0, "mfc": "none", "mew": 0.7}
    measured = Line2D([], [], marker="o", mec=VERMILLION, label="as measured", **rings)
    modelled = Line2D([], [], marker="o", ls="", ms=2.5, color=BLUE, label="of the model")
    explain_marks(figure, [*lines, measured, modelled], "", 2)
    return figure


def farthest(one: MotionInSpace) -> Frame:
    """The frame whose joints are farthest from those of the first, on average."""
    start = one.frames[0].places
    apart = [float(np.linalg.norm(f.places - start, axis=1).mean()) for f in one.frames]
    return one.frames[int(np.argmax(apart))]


def _draw(axis: Axes, frame: Frame, across: int, color: str) -> None:
    """Joints as a chain, markers as rings and dots, lines between both."""
    faint = 0.45 if color == GREY else 1.0
    axis.plot(frame.places[:, across], frame.places[:, 1], "s-", color=color, ms=2.2, lw=1.2)
    for a, b in zip(frame.modelled, frame.measured, strict=True):
        axis.plot([a[across], b[across]], [a[1], b[1]], color=BLUE, lw=0.5, alpha=faint, zorder=2)
    rings: dict[str, Any] = {
        "mec": VERMILLION,
        "mfc": "none",
        "mew": 0.7,
        "ms": 3.6,
        "alpha": faint,
    }
    axis.plot(frame.measured[:, across], frame.measured[:, 1], "o", **rings)
    dots: dict[str, Any] = {"mfc": BLUE, "mew": 0.0, "ms": 2.0, "alpha": faint}
    axis.plot(frame.modelled[:, across], frame.modelled[:, 1], "o", **dots)


def _views(one: MotionInSpace, far: Frame) -> tuple[Figure, list[Axes]]:
    """Two panels as wide as what they show, so that both have one scale."""
    first = one.frames[0]
    clouds = [cloud for f in (first, far) for cloud in (f.places, f.modelled, f.measured)]
    points = np.vstack(clouds)
    low, high = np.nanmin(points, axis=0) - _MARGIN_MM, np.nanmax(points, axis=0) + _MARGIN_MM
    wide = [float((high - low)[across]) for _, across, _ in _VIEWS]
    tall = float(high[1] - low[1])
    room = TALLEST_MM - _AROUND_MM - _KEY_MM
    per_mm = min(_WIDTH_MM / sum(wide), room / tall, _LARGEST)
    figure = blank(per_mm * tall + _AROUND_MM + _KEY_MM, WIDTH_MM)
    axes = list(figure.subplots(1, 2, sharey=True, width_ratios=wide))
    for axis, (_, across, _) in zip(axes, _VIEWS, strict=True):
        axis.set_xlim(low[across], high[across])
        axis.set_ylim(low[1], high[1])
    return figure, axes

"""The spine in 3-D for the page: bodies and markers of drawn motions, frame by frame.

On paper stand the first frame of a motion and the one farthest from it, seen from two sides.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.motion.skeleton import BODIES
from spinepipe.report.page.scene import BONE, TITLES, aspect, light_axis
from spinepipe.report.page.space import Space
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
from spinepipe.report.words import count, fixed, plain
from spinepipe.studies.tracking.words import short_of
from spinepipe.units import ROTATIONS

MEASURED, MODELLED = "measured", "modelled"

_XYZ = ["x_mm", "y_mm", "z_mm"]
_TURNS = [f"{name}_deg" for name in ROTATIONS]

MOST_SCENES, MOST_FRAMES = 18, 600
"""Scenes, and frames of all scenes together: a frame takes about 4 kB of the page."""

BONES = "bones"
GROUPS = {
    BONES: "vertebrae",
    MEASURED: "markers as measured",
    MODELLED: "markers of the model",
}
"""What can be switched on and off."""

_CORNERS = np.array([[x, y, z] for y in (0, 1) for x in (-0.5, 0.5) for z in (-0.5, 0.5)], float)
_FACES = np.array(
    [
        *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)),
        *((2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
    ]
)
"""Triangles of a box, by its corners."""

_TALL, _DEEP, _WIDE = 0.78, 0.95, 1.25
"""A vertebra's box over the distance to the next joint; the rest is disc."""

_PELVIS_MM = (60.0, -45.0, 80.0)
"""Depth, height and width of the box below the lowest joint."""

_MARGIN_MM = 15.0

_VIEWS = (("From the right", 0, "forwards (mm)"), ("From behind", 2, "to the right (mm)"))
_WIDTH_MM, _AROUND_MM, _KEY_MM, _STILL_MARGIN_MM, _LARGEST = 130.0, 20.0, 12.0, 12.0, 0.3
"""Width of both views on paper, what is around them, margin in the body, scale at most."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One instant.

    Attributes
    ----------
    turns, places : (B, 3, 3) and (B, 3) mm of bodies. modelled : (M, 3) mm.
    measured : (M, 3) mm, NaN where a marker was not seen.
    """

    time_s: float
    turns: Array
    places: Array
    modelled: Array
    measured: Array


@dataclass(frozen=True, eq=False)
class MotionInSpace:
    """One motion as it is drawn.

    Attributes
    ----------
    bodies, markers : their names, in the order of all frames.
    """

    name: str
    bodies: tuple[str, ...]
    markers: tuple[str, ...]
    frames: tuple[Frame, ...]


def motions_of(drawn: pd.DataFrame) -> Iterator[MotionInSpace]:
    """Every person, trial and approach of the table drawn, dynamics before the other approaches."""
    if drawn.empty:
        return
    several = drawn["specimen"].nunique() > 1
    keys = ["specimen", "trial", "approach"]
    groups = dict(iter(drawn.groupby(keys, sort=False, observed=True)))
    place = {key: k for k, key in enumerate(dict.fromkeys(key[:2] for key in groups))}
    order = sorted(groups, key=lambda key: (place[key[:2]], not str(key[2]).startswith("optk")))
    for person, trial, approach in order:
        rows = groups[person, trial, approach]
        words = [plain(str(trial)), short_of(str(approach))]
        yield _motion(", ".join([str(person), *words] if several else words), rows)


def _motion(name: str, rows: pd.DataFrame) -> MotionInSpace:
    # by kind and frame, in the order of the skeleton and of the marker set
    of_kind = {kind: rows[rows["kind"] == kind] for kind in ("body", MODELLED, MEASURED)}
    there = set(of_kind["body"]["name"])
    bodies = tuple(body for body in BODIES if body in there)
    markers = tuple(str(marker) for marker in dict.fromkeys(of_kind[MODELLED]["name"]))
    times = of_kind["body"].groupby("frame")["time_s"].first().sort_index()
    angles = np.deg2rad(_grid(of_kind["body"], times.index, bodies, _TURNS))
    turns = np.array([[rotation_zxy(*of_body) for of_body in frame] for frame in angles])
    places = _grid(of_kind["body"], times.index, bodies, _XYZ)
    cells = [_grid(of_kind[kind], times.index, markers, _XYZ) for kind in (MODELLED, MEASURED)]
    each = zip(times.astype(float).tolist(), turns, places, *cells, strict=True)
    return MotionInSpace(name, bodies, markers, tuple(Frame(*frame) for frame in each))


def _grid(
    rows: pd.DataFrame, frames: "pd.Index[int]", names: tuple[str, ...], columns: list[str]
) -> Array:
    """(F, N, C) cells by frame and name, NaN where there is no row."""
    at = pd.MultiIndex.from_product([frames, names])
    found = rows.set_index(["frame", "name"])[columns].astype(float).reindex(at)
    return found.to_numpy(float).reshape(len(frames), len(names), len(columns))


def spine_in_space(drawn: pd.DataFrame) -> Space:
    """All that is drawn in 3-D; nothing without rows of the table drawn."""
    every = list(motions_of(drawn))
    if not every:
        return Space()
    kept = page_motions(every)
    first = next((one for one in kept if len(one.frames) > 1), kept[0])
    with style():
        paper = picture(still_figure(first), "svg")
    return Space(
        "The spine in 3-D",
        "Motion",
        f"A spine in space: {', '.join(GROUPS.values())}",
        {one.name: _scene(one) for one in kept},
        GROUPS,
        paper,
        f"Vertebrae and markers from the right and from behind: {first.name}",
        _caption(first.name, len(kept), len(every)),
    )


def page_motions(every: list[MotionInSpace]) -> list[MotionInSpace]:
    """As many of the first motions as the page can hold, what moves before what stands."""
    kept: list[MotionInSpace] = []
    for one in sorted(every, key=lambda one: len(one.frames) < 2):
        frames = sum(len(other.frames) for other in kept) + len(one.frames)
        if len(kept) < MOST_SCENES and frames <= MOST_FRAMES:
            kept.append(one)
    return kept


def boxes(one: MotionInSpace, frame: Frame) -> Array:
    """(8 B, 3) mm, corners of a box for each body, as large in all frames as in the first."""
    # a box is as high as the way to the next joint of the first frame; the uppermost as the last
    start = one.frames[0].places
    apart = np.linalg.norm(np.diff(start, axis=0), axis=1)
    above = np.append(apart, apart[-1] if len(apart) else abs(_PELVIS_MM[1]))
    corners = []
    for body, height, turn, place in zip(one.bodies, above, frame.turns, frame.places, strict=True):
        size = np.array([_DEEP, _TALL, _WIDE]) * height
        if body == BODIES[0]:
            size = np.array(_PELVIS_MM)
        corners.append(place + (_CORNERS * size) @ turn.T)
    return np.concatenate(corners)


def _scene(one: MotionInSpace) -> Any:
    """The first frame as a figure; of a motion with what changes from frame to frame."""
    parts = list(_parts(one))
    # ends of the box that holds all frames
    clouds = [np.concatenate([boxes(one, f), f.modelled, f.measured]) for f in one.frames]
    low, high = _ends(np.concatenate(clouds), _MARGIN_MM)
    ends = zip(low.round().tolist(), high.round().tolist(), strict=True)
    box = [dict(zip("xyz", map(list, ends), strict=True))]
    axes = {
        f"{letter}axis": {**light_axis(letter, title), "range": box[0][letter]}
        for letter, title in zip("xyz", TITLES, strict=True)
    }
    camera = {"up": {"x": 0, "y": 1, "z": 0}, "eye": {"x": -1.6, "y": 0.35, "z": 1.35}}
    camera["center"] = {"x": 0, "y": -0.1, "z": 0}
    layout = {
        "template": "none",
        "scene": {**axes, "aspectmode": "manual", "aspectratio": aspect(box), "camera": camera},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "showlegend": False,
    }
    scene = json.loads(go.Figure(data=parts, layout=layout).to_json(engine="json"))
    if len(one.frames) > 1:
        scene["frames"] = [
            {"name": f"{fixed(frame.time_s)} s", **_coordinates(one, frame)} for frame in one.frames
        ]
    return scene


def _ends(points: Array, margin_mm: float) -> tuple[Array, Array]:
    """(3,) mm each, ends of the box that holds points (N, 3), with a margin."""
    return np.nanmin(points, axis=0) - margin_mm, np.nanmax(points, axis=0) + margin_mm


def _parts(one: MotionInSpace) -> Iterator[Any]:
    """Traces of the first frame, in the order of what `_coordinates` changes."""
    first = _coordinates(one, one.frames[0])
    corners, links, measured, modelled, apart = (
        {letter: first[letter][k] for letter in "xyz"} for k in range(5)
    )
    # one mesh of all boxes: the triangles of the first, eight corners further for each body
    faces = np.concatenate([_FACES + 8 * k for k in range(len(one.bodies))])
    i, j, k = faces.T.tolist()
    yield go.Mesh3d(
        **corners,
        **{"i": i, "j": j, "k": k, "color": BONE, "opacity": 0.75, "flatshading": True},
        **{"hoverinfo": "skip", "meta": BONES, "name": "vertebrae"},
    )
    yield go.Scatter3d(
        **links,
        **{"mode": "lines+markers", "line": {"color": GREY, "width": 4}},
        **{"marker": {"color": GREY, "size": 2}, "text": list(one.bodies)},
        **{"hoverinfo": "text", "meta": BONES, "name": "joint centres"},
    )
    yield _markers(measured, one.markers, MEASURED, "circle-open", VERMILLION, 5)
    yield _markers(modelled, one.markers, MODELLED, "circle", BLUE, 3)
    yield go.Scatter3d(
        **apart,
        **{"mode": "lines", "line": {"color": BLUE, "width": 2}, "hoverinfo": "skip"},
        **{"meta": MODELLED, "name": "from model to measured"},
    )


def _markers(
    places: Mapping[str, Any], names: tuple[str, ...], group: str, symbol: str, color: str, px: int
) -> Any:
    return go.Scatter3d(
        **places,
        **{"mode": "markers", "marker": {"color": color, "size": px, "symbol": symbol}},
        **{"text": [f"{name}, {group}" for name in names], "hoverinfo": "text"},
        **{"meta": group, "name": GROUPS[group]},
    )


def _coordinates(one: MotionInSpace, frame: Frame) -> dict[str, list[Any]]:
    """Places of every trace by axis: corners, joints, markers, and lines between markers."""
    # lines from model to measured are one trace, broken by an empty point after each
    gap = np.full_like(frame.modelled, np.nan)
    apart = np.stack([frame.modelled, frame.measured, gap], axis=1).reshape(-1, 3)
    clouds = (boxes(one, frame), frame.places, frame.measured, frame.modelled, apart)
    return {letter: [_plain(cloud[:, k]) for cloud in clouds] for k, letter in enumerate("xyz")}


def _plain(values: Array) -> list[float | None]:
    """To 0.1 mm; None where there is nothing."""
    return [None if np.isnan(value) else value for value in np.round(values, 1).tolist()]


def _caption(first: str, shown: int, every: int) -> str:
    more = f" {shown} of {count(every, 'motion')} are here." if every > shown else ""
    return (
        "Motions that the study draws. Boxes stand for vertebrae: their places and turns are "
        "those of the model, their shape is made up from the distances between joints. Rings: "
        "markers as measured, on the skin; dots: where the model has them; lines join the two. "
        "Time runs from the first frame to the last, in equal steps that are thinned out. "
        f"On paper: the first frame and the one farthest from it, {first}.{more}"
    )


def still_figure(one: MotionInSpace) -> Figure:
    """A motion from the right and from behind: the first frame light, the farthest one dark."""
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
    rings: dict[str, Any] = {"mec": VERMILLION, "mfc": "none", "mew": 0.7}
    rings |= {"ms": 3.6, "alpha": faint}
    axis.plot(frame.measured[:, across], frame.measured[:, 1], "o", **rings)
    dots: dict[str, Any] = {"mfc": BLUE, "mew": 0.0, "ms": 2.0, "alpha": faint}
    axis.plot(frame.modelled[:, across], frame.modelled[:, 1], "o", **dots)


def _views(one: MotionInSpace, far: Frame) -> tuple[Figure, list[Axes]]:
    """Two panels as wide as what they show, so that both have one scale."""
    first = one.frames[0]
    clouds = [cloud for f in (first, far) for cloud in (f.places, f.modelled, f.measured)]
    low, high = _ends(np.vstack(clouds), _STILL_MARGIN_MM)
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

"""The spine in 3-D for the page: bodies and markers of drawn motions, frame by frame."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import BODIES
from spinepipe.report.page.scene import BONE, TITLES, aspect, light_axis
from spinepipe.report.page.space import Space
from spinepipe.report.style import BLUE, GREY, VERMILLION
from spinepipe.report.words import count, fixed
from spinepipe.studies.tracking.in_space_motions import (
    MEASURED,
    MODELLED,
    Frame,
    MotionInSpace,
    motions_of,
)
from spinepipe.studies.tracking.in_space_still import still

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


def spine_in_space(drawn: pd.DataFrame) -> Space:
    """All that is drawn in 3-D; nothing without rows of the table drawn."""
    every = list(motions_of(drawn))
    if not every:
        return Space()
    kept = bounded(every)
    first = next((one for one in kept if len(one.frames) > 1), kept[0])
    return Space(
        "The spine in 3-D",
        "Motion",
        f"A spine in space: {', '.join(GROUPS.values())}",
        {one.name: _scene(one) for one in kept},
        GROUPS,
        still(first),
        f"Vertebrae and markers from the right and from behind: {first.name}",
        _caption(first.name, len(kept), len(every)),
    )


def bounded(every: list[MotionInSpace]) -> list[MotionInSpace]:
    """As many of the first motions as the page can hold, what moves before what stands."""
    moving = [one for one in every if len(one.frames) > 1]
    standing = [one for one in every if len(one.frames) < 2]
    kept: list[MotionInSpace] = []
    for one in [*moving, *standing]:
        frames = sum(len(other.frames) for other in kept) + len(one.frames)
        if len(kept) < MOST_SCENES and frames <= MOST_FRAMES:
            kept.append(one)
    return kept


def boxes(one: MotionInSpace, frame: Frame) -> Array:
    """(8 B, 3) mm, corners of a box for each body, as large in all frames as in the first."""
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
    low, high = _reach(one)
    box = [dict(zip("xyz", ([a, b] for a, b in zip(low, high, strict=True)), strict=True))]
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
            {"name": f"{fixed(frame.time_s)} s", **_moved(one, frame)} for frame in one.frames
        ]
    return scene


def _reach(one: MotionInSpace) -> tuple[list[float], list[float]]:
    """Ends of the box that holds all frames, mm."""
    clouds = [np.concatenate([boxes(one, f), f.modelled, f.measured]) for f in one.frames]
    points = np.concatenate(clouds)
    low, high = np.nanmin(points, axis=0) - _MARGIN_MM, np.nanmax(points, axis=0) + _MARGIN_MM
    return low.round().tolist(), high.round().tolist()


def _parts(one: MotionInSpace) -> Iterator[Any]:
    """Traces of the first frame, in the order of what `_moved` changes."""
    first = _moved(one, one.frames[0])
    corners, links, measured, modelled, apart = (
        {letter: first[letter][k] for letter in "xyz"} for k in range(5)
    )
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


def _moved(one: MotionInSpace, frame: Frame) -> dict[str, list[Any]]:
    """Places of every trace by axis: corners, joints, markers, and lines between markers."""
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

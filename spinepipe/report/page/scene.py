"""3-D view of a segment: vertebrae, its own joint frames, sampled ones, and the loads."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import Landmarks
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.report.specimen import AXIS_COLORS, SpecimenView, largest_load
from spinepipe.report.style import BLACK, GREY
from spinepipe.status import Status
from spinepipe.units import MM_PER_M, ROTATIONS

CORNERS = 20
LONE_DISC_MM = 6.0
"""Thickness drawn of a vertebra of which only one endplate is known."""

_USUAL_RADIUS_MM = 18.0
_PEDICLES = ("left_pedicle_base", "right_pedicle_base")

MOST_POSES = 100
GROUPS = {
    "vertebrae": "vertebrae and landmarks",
    "own": "the cohort's own joint frames",
    "sampled": "sampled joint frames",
    "loads": "loads",
}
"""What can be switched on and off."""

BONE = "#c8b89a"
_BOX = 1.45
_OWN_MM, _SAMPLED_MM, _ARROW_SHARE = 11.0, 16.0, 0.18
TITLES = ("anterior (mm)", "superior (mm)", "right (mm)")


def scenes(views: Sequence[SpecimenView], cohort: Cohort, poses: pd.DataFrame) -> dict[str, Any]:
    """A plotly figure, as plain data, of each specimen; `poses` may have no rows."""
    return {view.specimen: _scene(view, cohort, poses) for view in views}


def groups_of(drawn: Mapping[str, Any]) -> dict[str, str]:
    """Those of `GROUPS` of which a scene shows something."""
    shown = {trace["meta"] for scene in drawn.values() for trace in scene["data"]}
    return {name: words for name, words in GROUPS.items() if name in shown}


def as_script(scene: Mapping[str, Any]) -> str:
    """JSON that can stand inside a script element, whatever a specimen is called."""
    text = json.dumps(scene, sort_keys=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _scene(view: SpecimenView, cohort: Cohort, poses: pd.DataFrame) -> Any:
    parts = [
        *_vertebrae(view, cohort),
        *_frames(list(view.frames), "own", _OWN_MM, 8.0, 1.0),
        *(
            _frames(_sampled(poses, view.specimen), "sampled", _SAMPLED_MM, 1.0, 0.3)
            if len(poses)
            else ()
        ),
        *_once(_loads(view)),
    ]
    axes = {
        f"{letter}axis": light_axis(letter, title)
        for letter, title in zip("xyz", TITLES, strict=True)
    }
    camera = {"up": {"x": 0, "y": 1, "z": 0}, "eye": {"x": 1.1, "y": 0.35, "z": 1.7}}
    camera["center"] = {"x": 0, "y": -0.07, "z": 0}
    layout = {
        "template": "none",
        "scene": {**axes, "aspectmode": "manual", "aspectratio": aspect(parts), "camera": camera},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "legend": {"orientation": "h", "y": 0.0, "yanchor": "top"},
        "showlegend": True,
    }
    return json.loads(go.Figure(data=parts, layout=layout).to_json(engine="json"))


def light_axis(letter: str, title: str) -> dict[str, Any]:
    """A light grid; few ticks across the spine, more along it."""
    light = {"backgroundcolor": "white", "gridcolor": "#dddddd", "zerolinecolor": "#bbbbbb"}
    return {"title": {"text": title}, "nticks": 10 if letter == "y" else 4, **light}


def aspect(parts: list[Any]) -> dict[str, float]:
    """Lengths of the box, equal millimetres along all its sides, so that the view holds it."""
    sizes = {}
    for letter in "xyz":
        values = [v for part in parts for v in (part[letter] or ()) if v is not None]
        sizes[letter] = max(values) - min(values)
    return {letter: round(_BOX * size / max(sizes.values()), 4) for letter, size in sizes.items()}


def _vertebrae(view: SpecimenView, cohort: Cohort) -> Iterator[Any]:
    above = [view.frames[0], *view.frames]  # the fixed vertebra is tilted like the first joint
    tilts = dict(zip(cohort.vertebrae, above, strict=True))
    for vertebra, solid in solids(view.points, tilts, MM_PER_M).items():
        (x, y, z), (i, j, k) = _columns(solid.points), solid.triangles.T.tolist()
        yield go.Mesh3d(
            x=x,
            y=y,
            z=z,
            i=i,
            j=j,
            k=k,
            color=BONE,
            opacity=0.35,
            flatshading=True,
            hoverinfo="name",
            name=vertebra,
            meta="vertebrae",
        )
    yield from _landmarks(view)


def _landmarks(view: SpecimenView) -> Iterator[Any]:
    """Landmarks as points; lines from the pedicle bases to the middle of the endplate centres."""
    names = [f"{v} {name.replace('_', ' ')}" for v, named in view.points.items() for name in named]
    points = [p * MM_PER_M for named in view.points.values() for p in named.values()]
    if not points:
        return
    x, y, z = _columns(np.array(points))
    yield go.Scatter3d(
        x=x,
        y=y,
        z=z,
        mode="markers",
        marker={"size": 3, "color": GREY},
        text=names,
        hoverinfo="text+x+y+z",
        name="landmarks",
        meta="vertebrae",
    )
    ends = []
    for named in view.points.values():
        plates = [p for name, p in named.items() if name.endswith("endplate_centre")]
        bases = [p for name, p in named.items() if name.endswith("pedicle_base")]
        middle = np.mean(plates, axis=0) if plates else None
        ends += [(middle * MM_PER_M, p * MM_PER_M) for p in bases if middle is not None]
    x, y, z = _lines(ends)
    yield go.Scatter3d(
        x=x,
        y=y,
        z=z,
        mode="lines",
        line={"color": GREY, "width": 3},
        hoverinfo="name",
        name="pedicle bases",
        meta="vertebrae",
    )


def _frames(
    frames: list[Pose], group: str, length_mm: float, width: float, opacity: float
) -> Iterator[Any]:
    """One line trace per axis, through all frames, with gaps between them."""
    for number, (axis, color) in enumerate(AXIS_COLORS.items()):
        ends = [
            (
                frame.origin * MM_PER_M,
                frame.origin * MM_PER_M + length_mm * frame.rotation[:, number],
            )
            for frame in frames
        ]
        x, y, z = _lines(ends)
        name = f"{axis} axis, {group}"
        yield go.Scatter3d(
            x=x,
            y=y,
            z=z,
            mode="lines",
            line={"color": color, "width": width},
            opacity=opacity,
            hoverinfo="name",
            name=name,
            meta=group,
        )


def _sampled(poses: pd.DataFrame, specimen: str) -> list[Pose]:
    """Frames of at most so many sampled poses, evenly spaced over all that have frames."""
    if poses.empty:
        return []
    rows = poses[(poses["specimen"] == specimen) & (poses["status"] == Status.CONVERGED.value)]
    numbers = rows["pose"].unique()
    step = max(1, -(-len(numbers) // MOST_POSES))
    kept = rows[rows["pose"].isin(numbers[::step])]
    origins = kept[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / MM_PER_M
    angles = np.deg2rad(kept[[f"{name}_deg" for name in ROTATIONS]].to_numpy(float))
    return [Pose(rotation_zxy(*a), origin) for a, origin in zip(angles, origins, strict=True)]


def _loads(view: SpecimenView) -> Iterator[Any]:
    """The largest load of each test: force as an arrow that ends at its point, moment as a line."""
    heights = [frame.origin[1] * MM_PER_M for frame in view.frames]
    length = max(25.0, _ARROW_SHARE * (max(heights) - min(heights)))
    for case in view.cases:
        for wrench in largest_load(case):
            point = wrench.point * MM_PER_M
            for vector, unit, color in (
                (wrench.force, "N", BLACK),
                (wrench.moment, "N m", GREY),
            ):
                size = float(np.linalg.norm(vector))
                if size > 1e-9:
                    words = f"{case.test}: {size:.4g} {unit}"
                    yield from _arrow(point, length * vector / size, color, words)


def _once(parts: Iterator[Any]) -> Iterator[Any]:
    """The same traces, of which each name stands in the legend once: a cycle repeats its load."""
    seen: set[str] = set()
    for part in parts:
        part.showlegend = part.type == "scatter3d" and part.name not in seen
        seen.add(part.name)
        yield part


def _arrow(tip: Array, along: Array, color: str, words: str) -> Iterator[Any]:
    """A line that ends at a point, with a head; its length has no scale."""
    look: dict[str, Any] = {"hoverinfo": "name", "name": words, "meta": "loads"}
    x, y, z = _lines([(tip - along, tip)])
    line = {"color": color, "width": 6}
    yield go.Scatter3d(x=x, y=y, z=z, mode="lines", line=line, **look)
    at, (u, v, w) = _columns(tip[None, :]), _columns(along[None, :])
    yield go.Cone(
        x=at[0],
        y=at[1],
        z=at[2],
        u=u,
        v=v,
        w=w,
        anchor="tip",
        sizemode="absolute",
        sizeref=5,
        colorscale=[[0, color], [1, color]],
        showscale=False,
        **look,
    )


def _columns(points: Array) -> list[list[float | None]]:
    """Columns of (n, 3) as plain numbers to 0.01 mm."""
    columns: list[list[float | None]] = np.round(points, 2).T.tolist()
    return columns


def _lines(ends: list[tuple[Array, Array]]) -> list[list[float | None]]:
    """Columns x, y, z of line pieces with a gap after each."""
    columns: list[list[float | None]] = [[], [], []]
    for start, end in ends:
        for column, a, b in zip(columns, start, end, strict=True):
            column += [round(float(a), 2), round(float(b), 2), None]
    return columns


@dataclass(frozen=True)
class Solid:
    """A drum: corners of its lower and upper face, mm.

    Attributes
    ----------
    points : (2 * CORNERS + 2, 3) lower ring, upper ring, the two centres.
    triangles : (n, 3) indices into the points.
    """

    points: Array
    triangles: Array


def solids(points: Landmarks, frames: Mapping[str, Pose], mm_per_m: float) -> dict[str, Solid]:
    """Drum of each vertebra; one without endplate centres has none.

    Parameters
    ----------
    points : landmarks, m.
    frames : of each vertebra, the joint frame that gives a lone endplate its tilt.
    """
    widths = [
        float(np.linalg.norm(named[_PEDICLES[1]] - named[_PEDICLES[0]]))
        for named in points.values()
        if set(_PEDICLES) <= set(named)
    ]
    radius = 0.5 * mm_per_m * float(np.mean(widths)) if widths else _USUAL_RADIUS_MM
    found = {}
    for vertebra, named in points.items():
        ends = _ends(named, frames[vertebra].rotation[:, 1], mm_per_m)
        if ends is not None:
            found[vertebra] = _drum(*ends, radius)
    return found


def _ends(named: Mapping[str, Array], up: Array, mm_per_m: float) -> tuple[Array, Array] | None:
    """Centres of the lower and upper face."""
    low, high = (named.get(f"{side}_endplate_centre") for side in ("inferior", "superior"))
    if low is not None and high is not None:
        return low * mm_per_m, high * mm_per_m
    if high is not None:
        return high * mm_per_m - LONE_DISC_MM * up, high * mm_per_m
    if low is not None:
        return low * mm_per_m, low * mm_per_m + LONE_DISC_MM * up
    return None


def _drum(low: Array, high: Array, radius: float) -> Solid:
    axis = (high - low) / np.linalg.norm(high - low)
    across = np.cross(axis, [1.0, 0.0, 0.0])  # none of a body that lies along x
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    ring = radius * (
        np.outer(np.cos(angles), across) + np.outer(np.sin(angles), np.cross(axis, across))
    )
    points = np.vstack([low + ring, high + ring, low, high])
    # two triangles for each facet of the side, then a fan around the centre of each face
    first = np.arange(CORNERS)
    following = (first + 1) % CORNERS
    sides = [
        (first, following, first + CORNERS),
        (following, following + CORNERS, first + CORNERS),
        (first, following, np.full(CORNERS, 2 * CORNERS)),
        (first + CORNERS, following + CORNERS, np.full(CORNERS, 2 * CORNERS + 1)),
    ]
    return Solid(points, np.vstack([np.column_stack(side) for side in sides]))

"""The trunk in 3-D for the page: muscles as lines coloured by stress, the spine between them."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_hex
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.page.scene import TITLES, aspect, light_axis
from spinepipe.report.page.space import Space
from spinepipe.report.panels import head
from spinepipe.report.style import (
    BLACK,
    GREY,
    TALLEST_MM,
    VERMILLION,
    WIDTH_MM,
    blank,
    picture,
    style,
)
from spinepipe.report.words import count, fixed, number, plain
from spinepipe.studies.trunk_loads.forms import HANDS
from spinepipe.studies.trunk_loads.words import newton

MOST_SCENES = 12
SPINE, LOAD = "spine", "load"
"""Groups besides those of muscles."""

COLORS = [to_hex(color) for color in colormaps["viridis_r"](np.linspace(0.06, 1.0, 9))]
"""Slack to stressed, light to dark: the order is the same for colour-blind readers and in grey."""

LEAST_MPA = 0.05
"""The colour bar reaches this far at least."""

_XYZ = ["x_mm", "y_mm", "z_mm"]
_LINE_PX, _SPINE_PX = 4.0, 9.0
_VIEWS = (("From the right", "x_mm", "forwards (mm)"), ("From behind", "z_mm", "to the right (mm)"))
_WIDTH_MM, _AROUND_MM, _MARGIN_MM, _LARGEST = 135.0, 22.0, 12.0, 0.4
"""Width of both views on paper, what is around them, margin in the body, scale at most."""


@dataclass(frozen=True, eq=False)
class DrawnTask:
    """One task of one person, as it is drawn.

    Attributes
    ----------
    paths, levels : rows of the tables. load_mm : (3,) where the load in the hands is; None without
        one, or where the hands hang and the task does not say where.
    """

    name: str
    paths: pd.DataFrame
    levels: pd.DataFrame
    load_kg: float
    load_mm: tuple[float, float, float] | None


def trunk_in_space(cohort: Cohort, paths: pd.DataFrame, levels: pd.DataFrame) -> Space:
    """All that is drawn in 3-D; nothing without rows of the table paths."""
    if paths.empty:
        return Space()
    every = list(_drawn_tasks(cohort, paths, levels))
    shown = every[:MOST_SCENES]
    top = max(LEAST_MPA, *(float(one.paths["stress_mpa"].max()) for one in shown))
    groups = {str(name): plain(str(name)) for name in dict.fromkeys(paths["group"])}
    groups[SPINE] = "joint centres"
    if any(one.load_mm for one in shown):
        groups[LOAD] = "load in the hands"
    with style():
        paper = picture(still_figure(shown[0], top), "svg")
    return Space(
        "The trunk in 3-D",
        "Task",
        f"A trunk in space: muscles as lines coloured by stress ({', '.join(groups.values())})",
        {one.name: _scene(one, top) for one in shown},
        groups,
        paper,
        f"Muscles and joint centres from the right and from behind: {shown[0].name}",
        _caption(shown[0].name, len(shown), len(every)),
    )


def _drawn_tasks(cohort: Cohort, paths: pd.DataFrame, levels: pd.DataFrame) -> Iterator[DrawnTask]:
    """Every person and task of the table paths."""
    several = paths["specimen"].nunique() > 1
    asked = cohort.further.get("tasks", pd.DataFrame())
    for (person, task), rows in paths.groupby(["specimen", "task"], sort=False):
        own = levels[(levels["specimen"] == person) & (levels["task"] == task)]
        name = f"{plain(str(task))}, {person}" if several else plain(str(task))
        told = asked[asked["task"] == task] if len(asked) else asked
        yield DrawnTask(name, rows, own.dropna(subset=_XYZ), *_load(told))


def _load(asked: pd.DataFrame) -> tuple[float, tuple[float, float, float] | None]:
    """Mass in the hands, and where."""
    if asked.empty or not {"hand_load_kg", *HANDS} <= set(asked):
        return 0.0, None
    row = asked.iloc[0]
    kg = float(row["hand_load_kg"]) if pd.notna(row["hand_load_kg"]) else 0.0
    if kg <= 0.0 or row[list(HANDS)].isna().any():
        return kg, None
    x, y, z = (float(row[name]) for name in HANDS)
    return kg, (x, y, z)


def _scene(one: DrawnTask, top: float) -> Any:
    parts = [*_muscles(one.paths), *_spine(one.levels), *_hands(one)]
    axes = {
        f"{letter}axis": light_axis(letter, title)
        for letter, title in zip("xyz", TITLES, strict=True)
    }
    camera = {"up": {"x": 0, "y": 1, "z": 0}, "eye": {"x": 1.2, "y": 0.35, "z": 1.6}}
    bar = {"title": {"text": "stress (MPa)"}, "len": 0.6, "thickness": 14}
    scale = [[k / (len(COLORS) - 1), color] for k, color in enumerate(COLORS)]
    layout = {
        "template": "none",
        "scene": {**axes, "aspectmode": "manual", "aspectratio": aspect(parts), "camera": camera},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "showlegend": False,
        "coloraxis": {"cmin": 0.0, "cmax": round(top, 4), "colorscale": scale, "colorbar": bar},
    }
    return json.loads(go.Figure(data=parts, layout=layout).to_json(engine="json"))


def _muscles(paths: pd.DataFrame) -> Iterator[Any]:
    """One trace of each group, with gaps between fascicles."""
    for group, rows in paths.groupby("group", sort=False):
        columns: dict[str, list[Any]] = {name: [] for name in ("x", "y", "z", "text", "color")}
        for muscle, path in rows.groupby("muscle", sort=False):
            stress = float(path["stress_mpa"].iloc[0])
            for name, column in zip("xyz", _XYZ, strict=True):
                columns[name] += [*path.sort_values("point")[column].round(1).tolist(), None]
            columns["text"] += [f"{muscle}: {fixed(stress, 3)} MPa"] * (len(path) + 1)
            columns["color"] += [round(stress, 4)] * (len(path) + 1)
        color = columns.pop("color")
        yield go.Scatter3d(
            **columns,
            mode="lines",
            line={"color": color, "coloraxis": "coloraxis", "width": _LINE_PX},
            hoverinfo="text",
            name=plain(str(group)),
            meta=str(group),
        )


def _spine(levels: pd.DataFrame) -> Iterator[Any]:
    if levels.empty:
        return
    x, y, z = (levels[name].round(1).tolist() for name in _XYZ)
    words = [
        f"{row['level']}: compression {newton(row['compression_n'])}, "
        f"shear forwards {newton(row['shear_anterior_n'])}"
        for row in levels.to_dict("records")
    ]
    yield go.Scatter3d(
        x=x,
        y=y,
        z=z,
        text=words,
        mode="lines+markers",
        line={"color": GREY, "width": _SPINE_PX},
        marker={"color": BLACK, "size": 4},
        hoverinfo="text",
        name="joint centres",
        meta=SPINE,
    )


def _hands(one: DrawnTask) -> Iterator[Any]:
    if one.load_mm is None:
        return
    x, y, z = one.load_mm
    yield go.Scatter3d(
        x=[x],
        y=[y],
        z=[z],
        text=[f"{number(one.load_kg)} kg in the hands"],
        mode="markers+text",
        textposition="top center",
        marker={"color": VERMILLION, "size": 9, "symbol": "square"},
        hoverinfo="text",
        name="load in the hands",
        meta=LOAD,
    )


def _caption(first: str, shown: int, every: int) -> str:
    more = f" The first {shown} of {count(every, 'posture')}." if every > shown else ""
    return (
        "Muscles of the tasks that the study draws: each fascicle is a line along its path, where "
        "it lies on vertebrae round them, and its colour is its pull over its cross-section, "
        "active and passive. One colour scale for all tasks. Grey: through the centres of the "
        "joints, from L5S1 to T11T12; pointing at one tells its load. Square: load in the hands, "
        "where the task says where it is. Ribs, arms and head are not drawn. On paper: "
        f"{first}.{more}"
    )


def still_figure(one: DrawnTask, top: float) -> Figure:
    """A task from the right and from behind, for paper; the most stressed fascicles in front."""
    figure, axes = _views(one)
    shades = LinearSegmentedColormap.from_list("stress", COLORS)
    stress = one.paths.groupby("muscle", sort=False)["stress_mpa"].first().sort_values()
    paths: Mapping[str, pd.DataFrame] = {
        str(name): rows.sort_values("point") for name, rows in one.paths.groupby("muscle")
    }
    for index, (axis, (title, across, label)) in enumerate(zip(axes, _VIEWS, strict=True)):
        head(axis, index, title)
        lines = [paths[str(name)][[across, "y_mm"]].to_numpy(float) for name in stress.index]
        bundle = LineCollection(lines, cmap=shades, norm=Normalize(0.0, top), lw=0.9, zorder=2)
        bundle.set_array(stress.to_numpy(float))
        axis.add_collection(bundle)
        axis.plot(
            one.levels[across], one.levels["y_mm"], "o-", color=GREY, mfc=BLACK, mew=0, ms=2.5
        )
        if one.load_mm is not None:
            x, y, z = one.load_mm
            axis.plot([x if across == "x_mm" else z], [y], "s", color=VERMILLION, ms=5.0)
        axis.set_aspect("equal", adjustable="box")
        axis.set_xlabel(label)
        axis.tick_params(axis="y", size=2.5)
    axes[0].set_ylabel("up (mm)")
    figure.colorbar(bundle, ax=axes, label="stress (MPa)", shrink=0.5, aspect=30)
    return figure


def _views(one: DrawnTask) -> tuple[Figure, list[Axes]]:
    """Two panels as wide as what they show, so that both have one scale."""
    load = [] if one.load_mm is None else [one.load_mm]
    points = np.vstack([one.paths[_XYZ], one.levels[_XYZ], *(np.array([at]) for at in load)])
    low, high = points.min(axis=0) - _MARGIN_MM, points.max(axis=0) + _MARGIN_MM
    wide = [float((high - low)["xyz".index(across[0])]) for _, across, _ in _VIEWS]
    per_mm = min(
        _WIDTH_MM / sum(wide), (TALLEST_MM - _AROUND_MM) / float(high[1] - low[1]), _LARGEST
    )
    figure = blank(per_mm * float(high[1] - low[1]) + _AROUND_MM, WIDTH_MM)
    axes = list(figure.subplots(1, 2, sharey=True, width_ratios=wide))
    for axis, (_, across, _) in zip(axes, _VIEWS, strict=True):
        k = "xyz".index(across[0])
        axis.set_xlim(low[k], high[k])
        axis.set_ylim(low[1], high[1])
    return figure, axes

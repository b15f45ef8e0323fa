"""Recorded lifts in 3-D for the page: spine, muscles and what hands bear, frame by frame."""

import numpy as np
import pandas as pd

from spinepipe.muscles.trunk import BODIES, LEVELS
from spinepipe.report.viewer.scene import Scene, SceneStep, Timeline
from spinepipe.report.words import capital, fixed, plain
from spinepipe.studies.trunk_loads.lift_rows import L4L5, lifts_of, of_lift
from spinepipe.studies.trunk_loads.samples import Tables
from spinepipe.studies.trunk_loads.scenes import (
    LEAST_MPA,
    doubt,
    muscle_lines,
    poses_between,
    scales,
    spine_bodies,
)
from spinepipe.studies.trunk_loads.words import newton

MOST_LIFTS = 4
"""A frame takes some 10 kB of the page."""

FAINTEST = 0.03
"""Of the largest stress: lines of less are left out."""

LEAST_BORNE_N = 5.0

_XYZ = ["x_mm", "y_mm", "z_mm"]


def lift_scenes(tables: Tables) -> list[Scene]:
    """A scene of each lift, a step of each frame whose muscles are stored."""
    lifts = lifts_of(tables)[:MOST_LIFTS]
    paths, loads = (tables.get(name, pd.DataFrame()) for name in ("lift_paths", "lift_loads"))
    if paths.empty or loads.empty:
        return []
    top_mpa = max(LEAST_MPA, float(paths["stress_mpa"].max()))
    top_n = max(1.0, float(loads["compression_n"].max()))
    caption = (
        f"{scales(top_mpa, top_n)}). "
        "Curve: compression of L4–L5. Vertebrae from T10 up, ribs, arms, head and load are "
        "not drawn; vertebrae are schematic and drawn without twist."
    )
    several = len({specimen for specimen, _ in lifts}) > 1
    found = []
    for specimen, trial in lifts:
        own = {
            name: of_lift(tables[f"lift_{name}"], specimen, trial)
            for name in ("loads", "frames", "paths")
        }
        title = f"{specimen}, {plain(trial)}" if several else capital(plain(trial))
        found.append(_scene(title, own, (top_mpa, top_n), caption))
    return found


def _scene(
    title: str,
    own: dict[str, pd.DataFrame],
    top: tuple[float, float],
    caption: str,
) -> Scene:
    loads, frames, paths = own.values()
    top_mpa, top_n = top
    by_time = dict(iter(loads.groupby("time_s")))
    borne = frames.set_index("time_s")
    lines = dict(iter(paths[paths["stress_mpa"] >= FAINTEST * top_mpa].groupby("time_s")))
    steps, bodies = [], None
    for time in paths["time_s"].unique():
        rows = by_time[time].set_index("level").reindex(LEVELS)
        centres = rows[_XYZ].to_numpy(float)
        poses = poses_between(centres)
        if bodies is None:
            bodies = spine_bodies(BODIES, centres, poses)
        steps.append(
            SceneStep(
                f"{fixed(float(time))} s",
                _says(float(time), rows, borne.loc[time]),
                poses,
                disc=np.clip(rows["compression_n"].to_numpy(float) / top_n, 0.0, 1.0),
                muscles=muscle_lines(lines.get(time, paths.iloc[:0]), top_mpa),
            )
        )
    course_of = loads[loads["level"] == L4L5].sort_values("time_s")
    course = Timeline(
        course_of["time_s"].to_numpy(float),
        course_of["compression_n"].to_numpy(float),
        paths["time_s"].unique().astype(float),
        f"compression of L4–L5, up to {newton(float(course_of['compression_n'].max()))}",
    )
    return Scene(title, "Time", bodies or (), steps, caption, pause_ms=140, course=course)


def _says(time_s: float, rows: pd.DataFrame, frame: pd.Series) -> str:
    load = newton(float(rows["compression_n"].to_numpy(float)[LEVELS.index(L4L5)]))
    newtons = float(frame["load_n"])
    hands = f", hands bear {newton(newtons)}" if newtons > LEAST_BORNE_N else ""
    return f"{fixed(time_s)} s: L4–L5 carries {load}{hands}.{doubt(rows)}"

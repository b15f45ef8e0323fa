"""The trunk in 3-D for the page: of each person the spine and the muscles, task by task."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.viewer.meshes import Endplate, spine_meshes
from spinepipe.report.viewer.scene import (
    Muscle,
    Scene,
    SceneBody,
    SceneLoad,
    SceneStep,
    bodies_at,
    posed_axes,
)
from spinepipe.report.words import capital, count, fixed, number, plain
from spinepipe.studies.trunk_loads.forms import HANDS
from spinepipe.studies.trunk_loads.words import ENDED, newton
from spinepipe.units import STANDARD_GRAVITY

MOST_PERSONS = 8

LEAST_MPA = 0.05
"""The widest line stands for this stress at least."""

_XYZ = ["x_mm", "y_mm", "z_mm"]


def trunk_scenes(cohort: Cohort, paths: pd.DataFrame, levels: pd.DataFrame) -> list[Scene]:
    """A scene of each person, a step of each task whose posture is known.

    Parameters
    ----------
    paths, levels : rows of the tables of these names; without paths there are no scenes.
    """
    if paths.empty:
        return []
    placed = levels.dropna(subset=_XYZ)
    persons = list(dict.fromkeys(paths["specimen"]))
    shown = [name for name in persons if (placed["specimen"] == name).any()][:MOST_PERSONS]
    # one scale for all persons and tasks
    top_mpa = max(LEAST_MPA, float(paths["stress_mpa"].max()))
    top_n = max(1.0, float(placed.loc[placed["specimen"].isin(shown), "compression_n"].max()))
    caption = _caption(top_mpa, top_n, len(shown), len(persons))
    scenes = []
    for person in shown:
        own, lines = placed[placed["specimen"] == person], paths[paths["specimen"] == person]
        scene = _scene(cohort, str(person), own, lines, (top_mpa, top_n), caption)
        scenes += [] if scene is None else [scene]
    return scenes


def _scene(
    cohort: Cohort,
    person: str,
    levels: pd.DataFrame,
    paths: pd.DataFrame,
    top: tuple[float, float],
    caption: str,
) -> Scene | None:
    """One person; nothing where no task has a place of every joint."""
    tasks: dict[str, tuple[pd.DataFrame, Array]] = {}
    for task, rows in levels.groupby("task", sort=False):
        rows = rows.set_index("level").reindex(cohort.joint_names)
        centres = rows[_XYZ].to_numpy(float)
        if np.isfinite(centres).all():
            tasks[str(task)] = rows, centres
    if not tasks:
        return None
    # tasks whose muscles are stored come first, and the first of them shapes the vertebrae
    drawn = [str(task) for task in dict.fromkeys(paths["task"]) if task in tasks]
    order = [*drawn, *(task for task in tasks if task not in drawn)]
    start = poses_between(tasks[order[0]][1])
    bodies = spine_bodies(cohort.vertebrae, tasks[order[0]][1], start)
    top_mpa, top_n = top
    asked = cohort.further.get("tasks", pd.DataFrame())
    steps = []
    for task in order:
        rows, centres = tasks[task]
        poses = poses_between(centres)
        muscles = muscle_lines(paths[paths["task"] == task], top_mpa)
        disc = np.clip(rows["compression_n"].to_numpy(float) / top_n, 0.0, 1.0)
        told = asked[asked["task"] == task] if len(asked) else asked
        loads, says = _hands(told, poses[-1], len(bodies) - 1)
        says = f"{capital(plain(task))}{says}. {_loads_in_words(rows, cohort.vertebrae)}"
        says += "" if muscles else " Its muscle forces are not stored by line."
        steps.append(
            SceneStep(capital(plain(task)), says, poses, loads=loads, disc=disc, muscles=muscles)
        )
    return Scene(person, "Task", bodies, steps, caption, one_scale=False)


def spine_bodies(vertebrae: Sequence[str], centres: Array, poses: Array) -> list[SceneBody]:
    """Vertebrae as large as the gaps between joints (J, 3) mm ask for, in poses (J + 1, 6)."""
    middle = posed_axes(0.5 * (poses[:-1] + poses[1:]))
    joints = [Endplate(at, turn) for at, turn in zip(centres, middle, strict=True)]
    meshes = spine_meshes(vertebrae, joints)
    return bodies_at(vertebrae, meshes, poses[:, :3], posed_axes(poses))


def poses_between(centres: Array) -> Array:
    """(J + 1, 6) poses, mm and deg, of vertebrae between joints (J, 3) mm.

    A vertebra's frame is at the joint below it, its y axis points to the joint above; it is turned
    there by the shortest way, so that twist is not shown. The first and the last vertebra are
    turned like their neighbours; the first one's frame is at the joint above it.
    """
    along = np.diff(centres, axis=0)
    along = np.vstack([along[:1], along, along[-1:]]) if len(along) else np.array([[0, 1.0, 0]] * 2)
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross([0.0, 1.0, 0.0], along)
    sine = np.linalg.norm(across, axis=1)
    angle_deg = np.rad2deg(np.arctan2(sine, along[:, 1]))
    turns = across * (angle_deg / np.maximum(sine, 1e-12))[:, None]
    return np.column_stack([np.vstack([centres[:1], centres]), turns])


def muscle_lines(paths: pd.DataFrame, top_mpa: float) -> list[Muscle]:
    """Fascicles of one task; ``paths``: rows of the table paths, maybe none."""
    if paths.empty:
        return []
    rows = paths.sort_values(["muscle", "point"])
    names, stress = rows["muscle"].to_numpy(), rows["stress_mpa"].to_numpy(float)
    starts = np.flatnonzero(np.append(True, names[1:] != names[:-1]))
    lines = np.split(rows[_XYZ].to_numpy(float), starts[1:])
    return [
        Muscle(path, share)
        for path, share in zip(lines, (stress[starts] / top_mpa).tolist(), strict=True)
    ]


def _hands(asked: pd.DataFrame, thorax: Array, body: int) -> tuple[list[SceneLoad], str]:
    """Weight in the hands, held by the uppermost vertebra of pose (6,), and in words."""
    if asked.empty or not {"hand_load_kg", *HANDS} <= set(asked):
        return [], ""
    kg, *place = asked.iloc[0][["hand_load_kg", *HANDS]].to_numpy(float).tolist()
    if not kg > 0.0:
        return [], ""
    words = f" with {number(kg)} kg in the hands"
    if not np.isfinite(place).all():
        return [], words
    at = (np.array(place) - thorax[:3]) @ posed_axes(thorax[None, :])[0]
    return [SceneLoad("force", body, at, kg * STANDARD_GRAVITY)], words


def _loads_in_words(rows: pd.DataFrame, vertebrae: Sequence[str]) -> str:
    """Largest compression and its level; and how the task ended where it did not converge."""
    sides = dict(zip(rows.index, pairwise(vertebrae), strict=True))
    loads = rows["compression_n"].dropna()
    if loads.empty:
        return f"No forces were found.{doubt(rows)}"
    lower, upper = sides[str(loads.idxmax())]
    level = f"{upper}–{lower}"
    return f"Largest compression {newton(float(loads.max()))}, at {level}.{doubt(rows)}"


def doubt(rows: pd.DataFrame) -> str:
    """How rows of table levels or lift_loads ended where their numbers are no solution."""
    ended = [ENDED[status] for status in rows["status"].dropna().unique() if status in ENDED]
    return f" Do not use: it ended {ended[0]}." if ended else ""


def scales(top_mpa: float, top_n: float) -> str:
    """What discs and lines stand for."""
    return (
        f"Discs: the warmer, the more compression (up to {newton(top_n)}). Lines: muscles, the "
        f"wider and darker, the more stress (up to {fixed(top_mpa)} MPa"
    )


def _caption(top_mpa: float, top_n: float, shown: int, every: int) -> str:
    more = f" The first {shown} of {count(every, 'person')}." if every > shown else ""
    return (
        f"{scales(top_mpa, top_n)}; in print, those above a tenth of it); one scale for all. "
        "Vertebrae are schematic, lie between joint centres and are drawn without twist; ribs, "
        f"arms and head are not drawn.{more}"
    )

"""The spine in 3-D for the page: vertebrae and markers of drawn motions, frame by frame."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.motion.skeleton import BODIES
from spinepipe.report.viewer.meshes import Endplate, spine_meshes
from spinepipe.report.viewer.scene import (
    Scene,
    SceneBody,
    SceneStep,
    bodies_at,
    posed_axes,
    rotation_vector,
)
from spinepipe.report.words import count, fixed, plain
from spinepipe.studies.tracking.words import short_of
from spinepipe.units import ROTATIONS

MOST_SCENES, MOST_FRAMES = 18, 270
"""Scenes, and frames of all scenes together: a frame takes about 2 kB of the page."""

MOST_FRAMES_EACH = 25

_XYZ = ["x_mm", "y_mm", "z_mm"]
_TURNS = [f"{name}_deg" for name in ROTATIONS]


def tracking_scenes(drawn: pd.DataFrame) -> list[Scene]:
    """A scene of each motion, what moves before what stands; none without rows of the table drawn.

    Frames of a motion are thinned out evenly, its first and its last one stay.
    """
    every = sorted(_motions(drawn), key=lambda motion: motion[1]["frame"].nunique() < 2)
    kept: list[tuple[str, pd.DataFrame, list[int]]] = []
    for name, rows in every[:MOST_SCENES]:
        frames = np.sort(rows["frame"].unique())
        places = np.linspace(0, len(frames) - 1, min(len(frames), MOST_FRAMES_EACH))
        chosen = frames[np.round(places).astype(int)].tolist()
        if sum(len(other) for _, _, other in kept) + len(chosen) <= MOST_FRAMES:
            kept.append((name, rows, chosen))
    caption = _caption(len(kept), len(every))
    shaped: dict[tuple[str, ...], list[SceneBody]] = {}
    return [_scene(name, rows, chosen, caption, shaped) for name, rows, chosen in kept]


def _motions(drawn: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Every person, trial and approach with its rows, dynamics before the other approaches."""
    if drawn.empty:
        return
    several = drawn["specimen"].nunique() > 1
    keys = ["specimen", "trial", "approach"]
    groups = dict(iter(drawn.groupby(keys, sort=False, observed=True)))
    place = {key: k for k, key in enumerate(dict.fromkeys(key[:2] for key in groups))}
    order = sorted(groups, key=lambda key: (place[key[:2]], not str(key[2]).startswith("optk")))
    for person, trial, approach in order:
        words = [plain(str(trial)), short_of(str(approach))]
        rows = groups[person, trial, approach]
        yield ", ".join([str(person), *words] if several else words), rows


def _scene(
    title: str,
    rows: pd.DataFrame,
    frames: list[int],
    caption: str,
    shaped: dict[tuple[str, ...], list[SceneBody]],
) -> Scene:
    """One motion at these frames; ``shaped`` keeps the vertebrae of a person for all motions."""
    of_kind = {kind: rows[rows["kind"] == kind] for kind in ("body", "modelled", "measured")}
    names = [name for name in BODIES if name in set(of_kind["body"]["name"])]
    markers = list(dict.fromkeys(of_kind["modelled"]["name"]))
    angles = np.deg2rad(_grid(of_kind["body"], frames, names, _TURNS))
    turns = np.array([[rotation_zxy(*of_body) for of_body in frame] for frame in angles])
    places = _grid(of_kind["body"], frames, names, _XYZ)
    vectors = rotation_vector(turns.reshape(-1, 3, 3)).reshape(places.shape)
    poses = np.concatenate([places, vectors], axis=2)
    seen = [_grid(of_kind[kind], frames, markers, _XYZ) for kind in ("modelled", "measured")]
    times = of_kind["body"].groupby("frame")["time_s"].first().astype(float)
    steps = [
        SceneStep(
            f"{fixed(times[frame])} s",
            _says(float(times[frame]), both),
            pose,
            markers=both if len(markers) else None,
        )
        for frame, pose, both in zip(frames, poses, np.concatenate(seen, axis=2), strict=True)
    ]
    person = (str(rows["specimen"].iloc[0]), *names)
    if person not in shaped:
        shaped[person] = _bodies(names, poses[0])
    return Scene(title, "Time", shaped[person], steps, caption, pause_ms=100)


def _bodies(names: list[str], poses: Array) -> list[SceneBody]:
    """Vertebrae shaped by the first frame: a body's frame is at the joint below it.

    The first one's, the pelvis, is at the joint above it.
    """
    axes = posed_axes(poses)
    joints = [Endplate(pose[:3], turn) for pose, turn in zip(poses[1:], axes[1:], strict=True)]
    meshes = spine_meshes(names, joints)
    return bodies_at(names, meshes, poses[:, :3], axes)


def _says(time_s: float, markers: Array) -> str:
    """Time, and how far the markers of the model (first three columns) are from the measured."""
    apart = np.linalg.norm(markers[:, :3] - markers[:, 3:], axis=1)
    apart = apart[np.isfinite(apart)]
    words = f"{fixed(time_s)} s."
    if not len(apart):
        return words
    rms = fixed(float(np.sqrt(np.mean(apart**2))), 1)
    return f"{words} Markers of the model are {rms} mm (RMS) from the measured ones."


def _grid(rows: pd.DataFrame, frames: list[int], names: list[str], columns: list[str]) -> Array:
    """(F, N, C) cells by frame and name, NaN where there is no row."""
    at = pd.MultiIndex.from_product([frames, names])
    found = rows.set_index(["frame", "name"])[columns].astype(float).reindex(at)
    return found.to_numpy(float).reshape(len(frames), len(names), len(columns))


def _caption(shown: int, every: int) -> str:
    more = f" {shown} of {count(every, 'motion')} are here." if every > shown else ""
    return (
        "Vertebrae are where the model has them; their shape is schematic, sized by the distance "
        "of the joints. Rings: markers as measured, on the skin; dots: where the model has them. "
        f"Frames are thinned out.{more}"
    )

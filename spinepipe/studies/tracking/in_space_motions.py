"""Motions of the table drawn as arrays again, for the 3-D view and for paper."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.motion.skeleton import BODIES
from spinepipe.report.words import plain
from spinepipe.studies.tracking.words import short_of
from spinepipe.units import ROTATIONS

MEASURED, MODELLED = "measured", "modelled"

_XYZ = ["x_mm", "y_mm", "z_mm"]
_TURNS = [f"{name}_deg" for name in ROTATIONS]


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
        yield _shown(", ".join([str(person), *words] if several else words), rows)


def _shown(name: str, rows: pd.DataFrame) -> MotionInSpace:
    of_kind = {kind: rows[rows["kind"] == kind] for kind in ("body", MODELLED, MEASURED)}
    there = set(of_kind["body"]["name"])
    bodies = tuple(body for body in BODIES if body in there)
    markers = tuple(str(marker) for marker in dict.fromkeys(of_kind[MODELLED]["name"]))
    times = of_kind["body"].groupby("frame")["time_s"].first().sort_index()
    turned = _grid(of_kind["body"], times.index, bodies, _TURNS)
    cells = [_grid(of_kind[kind], times.index, markers, _XYZ) for kind in (MODELLED, MEASURED)]
    places = _grid(of_kind["body"], times.index, bodies, _XYZ)
    frames = (
        Frame(time, _rotations(turned[k]), places[k], cells[0][k], cells[1][k])
        for k, time in enumerate(times.astype(float).tolist())
    )
    return MotionInSpace(name, bodies, markers, tuple(frames))


def _grid(
    rows: pd.DataFrame, frames: "pd.Index[int]", names: tuple[str, ...], columns: list[str]
) -> Array:
    """(F, N, C) cells by frame and name, NaN where there is no row."""
    at = pd.MultiIndex.from_product([frames, names])
    found = rows.set_index(["frame", "name"])[columns].astype(float).reindex(at)
    return found.to_numpy(float).reshape(len(frames), len(names), len(columns))


def _rotations(angles_deg: Array) -> Array:
    return np.array([rotation_zxy(*angles) for angles in np.deg2rad(angles_deg)])

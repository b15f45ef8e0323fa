"""From a cohort's tables to what the engine takes: frames, bodies, models, load cases. SI."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort, memoize_per_cohort
from spinepipe.decomposition import eigh
from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, joint_pose, rotation_zxy
from spinepipe.model import (
    Body,
    LoadCase,
    LoadStep,
    ScopedEffect,
    SpineModel,
)
from spinepipe.units import MM_PER_M, ROTATIONS, STANDARD_GRAVITY

Landmarks = Mapping[str, Mapping[str, Array]]
"""Points in m, ground: vertebra to landmark to (3,)."""

FOLLOWER_LOAD = "follower_load"
"""The effect by which a cohort's ``follower_n`` acts."""

STRICTLY_INSIDE = 1e-6
"""Share of the largest moment by which an inertia keeps off the limit: PyBullet needs some."""

_POINT = ["x_mm", "y_mm", "z_mm"]
_ORIENTATION = [f"{name}_deg" for name in ROTATIONS]
_INERTIA = ["ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "ixy_kg_m2", "ixz_kg_m2", "iyz_kg_m2"]


def landmarks(cohort: Cohort, specimen: str) -> dict[str, dict[str, Array]]:
    """Landmarks of a specimen as the cohort lists them."""
    assert cohort.landmarks is not None
    rows = cohort.landmarks[cohort.landmarks["specimen"] == specimen]
    points = rows[_POINT].to_numpy(float) / MM_PER_M
    found: dict[str, dict[str, Array]] = {}
    for vertebra, name, point in zip(rows["vertebra"], rows["landmark"], points, strict=True):
        found.setdefault(vertebra, {})[name] = point
    return found


def frames_from_landmarks(vertebrae: Sequence[str], points: Landmarks) -> tuple[Pose, ...]:
    """Joint frames in ground, caudal to cranial.

    Raises
    ------
    ValueError
        Naming the joint whose landmarks define no frame.
    """
    frames = []
    for lower, upper in pairwise(vertebrae):
        try:
            frames.append(joint_pose(points[lower], points[upper]))
        except ValueError as error:
            raise ValueError(f"joint {upper}{lower}: {error}") from error
    return tuple(frames)


def joint_frames(cohort: Cohort, specimen: str) -> tuple[Pose, ...]:
    """Joint frames in ground at the neutral pose; joint by joint, ``joints.csv`` counts first."""
    given = _given_frames(cohort, specimen)
    points = {} if cohort.landmarks is None else landmarks(cohort, specimen)
    sides = zip(cohort.joint_names, pairwise(cohort.vertebrae), strict=True)
    return tuple(
        given[joint] if joint in given else joint_pose(points[lower], points[upper])
        for joint, (lower, upper) in sides
    )


def _given_frames(cohort: Cohort, specimen: str) -> dict[str, Pose]:
    """Frames that ``joints.csv`` gives of a specimen, by joint."""
    if cohort.joints is None:
        return {}
    rows = cohort.joints[cohort.joints["specimen"] == specimen]
    origins = rows[_POINT].to_numpy(float) / MM_PER_M
    angles = np.deg2rad(rows[_ORIENTATION].to_numpy(float))
    poses = (Pose(rotation_zxy(*a), origin) for a, origin in zip(angles, origins, strict=True))
    return dict(zip(rows["joint"], poses, strict=True))


@memoize_per_cohort
def bodies(cohort: Cohort, specimen: str) -> tuple[Body, ...]:
    """Moving vertebrae; massless where the cohort lists no body, points without inertia.

    Kept per cohort object: thousands of models of one specimen share them.
    """
    names = cohort.vertebrae[1:]
    if cohort.bodies is None:
        return tuple(_massless(name) for name in names)
    rows = cohort.bodies[cohort.bodies["specimen"] == specimen]
    found = {name: rows[rows["vertebra"] == name] for name in names}
    return tuple(_body(name, row) if len(row) else _massless(name) for name, row in found.items())


def _massless(name: str) -> Body:
    return Body(name, 0.0, np.zeros(3), np.zeros((3, 3)))


def _body(name: str, row: pd.DataFrame) -> Body:
    com = row[["com_x_mm", "com_y_mm", "com_z_mm"]].to_numpy(float)[0] / MM_PER_M
    xx, yy, zz, xy, xz, yz = np.nan_to_num(row[_INERTIA].to_numpy(float)[0])
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Body(name, float(row["mass_kg"].iloc[0]), com, _possible(inertia))


def _possible(inertia: Array) -> Array:
    """The inertia (3, 3), lifted onto what a body can have where rounding left it just off.

    Flat bodies and rods sit exactly on the limit (one principal moment the sum of the others),
    and figures in files are rounded; the reader has refused what is further off than that.
    """
    moments, axes = eigh(inertia)
    short = moments[2] * (1.0 + STRICTLY_INSIDE) - moments[0] - moments[1]
    if short <= 0.0:
        return inertia
    lifted = moments + np.array([short, short, 0.0]) / 2.0
    possible: Array = axes @ np.diag(np.maximum(lifted, 0.0)) @ axes.T
    return possible


@memoize_per_cohort
def followers(cohort: Cohort, specimen: str) -> dict[str, float]:
    """Tension in N of the follower load of each test that has one."""
    table = cohort.loads
    if table is None:
        return {}
    rows = table[table["specimen"].isin([specimen, "*"]) & (table["follower_n"] > 0.0)]
    first = rows.drop_duplicates("test")
    return dict(zip(first["test"], first["follower_n"].astype(float), strict=True))


def cables(tension_n: Mapping[str, float], n_joints: int) -> tuple[ScopedEffect, ...]:
    """Cables through the centres of all joints, one per test; its tension is known, not fitted."""
    cable, joints = create(FOLLOWER_LOAD), tuple(range(n_joints))
    beside = [parameter.default for parameter in cable.parameters[1:]]
    return tuple(
        ScopedEffect(cable, joints, np.array([[force, *beside]]), (test,))
        for test, force in tension_n.items()
    )


def spine_model(
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    effects: tuple[ScopedEffect, ...],
    damping: Array,
    tension_n: Mapping[str, float] | None = None,
) -> SpineModel:
    """The model of a specimen with these joint frames and effects.

    Behind the effects come the follower loads of its tests.

    Parameters
    ----------
    damping : (6,) SI.
    tension_n : of the follower load of each test that has one; None: as ``loads.csv`` says.
    """
    n = len(cohort.joint_names)
    told = followers(cohort, specimen) if tension_n is None else tension_n
    return SpineModel(
        specimen=specimen,
        joints=cohort.joint_names,
        frames=frames,
        bodies=bodies(cohort, specimen),
        gravity=STANDARD_GRAVITY if cohort.gravity else np.zeros(3),
        damping=np.tile(damping, (n, 1)),
        effects=(*effects, *cables(told, n)),
    )


def load_cases(
    cohort: Cohort, specimen: str, tests: Sequence[str], shift: Array
) -> tuple[LoadCase, ...]:
    """Cycles of the named tests of a specimen; ``shift`` (3,) m is added to every load point."""
    assert cohort.loads is not None
    rows = cohort.loads[cohort.loads["specimen"].isin([specimen, "*"])]
    coms = {body.name: body.com for body in bodies(cohort, specimen)}
    cases = []
    for test in tests:
        of_test = rows[rows["test"] == test]
        for cycle in _cycles(cohort, specimen, test):
            of_cycle = of_test[of_test["cycle"].isna() | (of_test["cycle"] == cycle)]
            if len(of_cycle):
                steps = _steps(cohort, of_cycle, coms, shift)
                cases.append(
                    LoadCase(test, cycle, _preloaded(cohort, specimen, test, steps, shift))
                )
    return tuple(cases)


def _preloaded(
    cohort: Cohort, specimen: str, test: str, steps: tuple[LoadStep, ...], shift: Array
) -> tuple[LoadStep, ...]:
    """The steps with what acts all along; it is there at step 0, before anything is read."""
    table = cohort.preload
    if table is None:
        return steps
    rows = table[table["specimen"].isin([specimen, "*"]) & table["test"].isin([test, "*"])]
    places, forces, moments = _placed(cohort, rows, {})
    preload = tuple(
        Wrench(body, point + shift, force, moment)
        for (body, point), force, moment in zip(places, forces, moments, strict=True)
    )
    return tuple(replace(step, wrenches=(*step.wrenches, *preload)) for step in steps)


def _placed(
    cohort: Cohort, rows: pd.DataFrame, coms: Mapping[str, Array]
) -> tuple[list[tuple[int, Array]], Array, Array]:
    """Body and point (3,) m, force (K, 3) N and moment (K, 3) N m of each row of loads.

    Without a point a force acts at the vertebra's centre of mass; a moment has none.
    """
    moving = {name: index for index, name in enumerate(cohort.vertebrae[1:])}
    points = rows[["px_mm", "py_mm", "pz_mm"]].to_numpy(dtype=float) / MM_PER_M
    vertebrae = rows["vertebra"].tolist()
    for place in np.flatnonzero(np.isnan(points).any(axis=1)):
        points[place] = coms.get(vertebrae[place], np.zeros(3))
    forces = rows[["fx_n", "fy_n", "fz_n"]].to_numpy(dtype=float)
    moments = rows[["mx_nm", "my_nm", "mz_nm"]].to_numpy(dtype=float)
    bodies_of = [moving[name] for name in vertebrae]
    return list(zip(bodies_of, points, strict=True)), forces, moments


def _cycles(cohort: Cohort, specimen: str, test: str) -> list[int]:
    """Cycle numbers of a test that the loads or the motion of the specimen name, else 1."""
    assert cohort.loads is not None
    numbers: set[int] = set()
    for table in (cohort.loads, cohort.motion):
        if table is not None:
            here = table[table["specimen"].isin([specimen, "*"]) & (table["test"] == test)]
            numbers |= set(here["cycle"].dropna().astype(int))
    return sorted(numbers) or [1]


def _steps(
    cohort: Cohort, rows: pd.DataFrame, coms: Mapping[str, Array], shift: Array
) -> tuple[LoadStep, ...]:
    where, forces, moments = _placed(cohort, rows, coms)
    numbers, times = rows["step"].to_numpy(), rows["time_s"].to_numpy(dtype=float)
    steps = []
    for step in np.unique(numbers):
        places = np.flatnonzero(numbers == step)
        wrenches = tuple(
            Wrench(where[at][0], where[at][1] + shift, forces[at], moments[at])
            for at in places.tolist()
        )
        told = times[places][~np.isnan(times[places])]
        steps.append(LoadStep(int(step), wrenches, float(told[0]) if len(told) else None))
    return tuple(steps)


def on_bushings(
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    stiffness: Array,
    damping: Array,
    others: tuple[ScopedEffect, ...] = (),
    tension_n: Mapping[str, float] | None = None,
) -> SpineModel:
    """Model of a specimen on linear bushings; stiffness (6,) for all joints or (J, 6).

    The bushings are its first effect, ``others`` come after them, follower loads last, see
    `spine_model`.
    """
    n = len(cohort.joint_names)
    values = np.broadcast_to(stiffness, (n, 6)).copy()
    bushing = ScopedEffect(create("linear_bushing"), tuple(range(n)), values)
    return spine_model(cohort, specimen, frames, (bushing, *others), damping, tension_n)

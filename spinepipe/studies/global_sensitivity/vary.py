"""A specimen with the values of factors: many spines, and each test of all of them.

What the factors add up to becomes joint frames, models and loads.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, SMALLEST_LENGTH_M, SMALLEST_SINE, Pose, joint_pose
from spinepipe.model import LoadCase, ScopedEffect
from spinepipe.statics.batched.spines import Cases, Spines
from spinepipe.studies.global_sensitivity.factors import FactorChange, Of
from spinepipe.studies.global_sensitivity.start import (
    INFERIOR,
    LEFT,
    RIGHT,
    SUPERIOR,
    DescribedSpecimen,
    Flags,
)


@dataclass(frozen=True, eq=False)
class Variation:
    """Changes of M spines with J joints and J + 1 vertebrae; factors multiply, offsets add up.

    Attributes
    ----------
    stiffness : (M, J, 6) factors.
    landmarks : (M, J + 1, 4, 3) m, ground, of the landmarks that make frames, in their order.
    frames : (M, J, 6) m and rad: how far each joint frame is moved along, then turned about its
        own axes, as `transform_of` says.
    load_points : (M, 3) m, ground.
    load_turns : (M, 3) rad, rotation vector in ground: several axes are turned about at once, in
        no order.
    load_sizes : (M,) factors.
    masses : (M, J) factors. coms : (M, J, 3) m, ground.
    damping : (M,) factors.
    """

    stiffness: Array
    landmarks: Array
    frames: Array
    load_points: Array
    load_turns: Array
    load_sizes: Array
    masses: Array
    coms: Array
    damping: Array

    @classmethod
    def none(cls, count: int, n_joints: int) -> "Variation":
        """Nothing is changed, that many times."""
        offsets, factors = np.zeros, np.ones
        return cls(
            stiffness=factors((count, n_joints, 6)),
            landmarks=offsets((count, n_joints + 1, len(FRAME_LANDMARKS), 3)),
            frames=offsets((count, n_joints, 6)),
            load_points=offsets((count, 3)),
            load_turns=offsets((count, 3)),
            load_sizes=factors(count),
            masses=factors((count, n_joints)),
            coms=offsets((count, n_joints, 3)),
            damping=factors(count),
        )


@dataclass(frozen=True, eq=False)
class Frames:
    """Joint frames in ground of M spines: (M, J, 3, 3) and (M, J, 3) m, and who has none, why."""

    rotations: Array
    origins: Array
    refused: dict[int, str]


@dataclass(frozen=True, eq=False)
class SpineSamples:
    """Spines of a specimen, for those of the samples that make a spine.

    Attributes
    ----------
    spines : K of them.
    cases : of each of the specimen's tests, of these K spines.
    kept : (K,) which sample each is.
    refused : the other samples, and why they make no spine.
    """

    spines: Spines
    cases: tuple[Cases, ...]
    kept: NDArray[np.int64]
    refused: dict[int, str]


def vary(start: DescribedSpecimen, changes: Sequence[FactorChange], values: Array) -> SpineSamples:
    """Give factors their values.

    Landmarks are moved first; the joint frames that they make are then moved along their own axes
    and turned. A mass takes its inertia along. Loads keep their points when bodies are moved.

    Parameters
    ----------
    changes : D factors; several that change the same add up.
    values : (M, D) m, rad or factors, by sample.
    """
    values = np.asarray(values, dtype=float)
    total = variation(changes, values, start.model.joints, start.vertebrae)
    frames = varied_frames(start, total)
    same = Spines.of(start.model, len(values))
    bushing = same.values[0] * total.stiffness
    refused = _out_of_bounds(start.model.effects[0], start.model.joints, bushing) | frames.refused
    spines = Spines(
        like=start.model,
        rotations=frames.rotations,
        origins=frames.origins,
        masses=same.masses * total.masses,
        coms=same.coms + total.coms,
        inertias=same.inertias * total.masses[..., None, None],
        damping=same.damping * total.damping[:, None, None],
        values=(bushing,),
    )
    cases = tuple(varied_cases(test.case, total) for test in start.tests)
    # the spines that are spines
    kept = np.setdiff1d(np.arange(len(spines)), list(refused)).astype(np.int64)
    if refused:
        spines = spines.part(kept)
        cases = tuple(case.part(kept) for case in cases)
    return SpineSamples(spines, cases, kept, dict(sorted(refused.items())))


def _out_of_bounds(scoped: ScopedEffect, joints: Sequence[str], values: Array) -> dict[int, str]:
    """Samples whose stiffness (M, J, 6) no model may have, each with the first reason."""
    refused: dict[int, str] = {}
    for place, limits in enumerate(scoped.effect.parameters):
        found = values[:, :, place]
        for sample, joint in np.argwhere((found < limits.low) | (found > limits.high)).tolist():
            value = f"{limits.name} is {found[sample, joint]:.6g} {limits.unit}"
            allowed = f"allowed {limits.low:.3g} to {limits.high:.3g}"
            refused.setdefault(sample, f"joint {joints[joint]}: {value}, {allowed}")
    return refused


def variation(
    changes: Sequence[FactorChange], values: Array, joints: Sequence[str], vertebrae: Sequence[str]
) -> Variation:
    """Changes with their values as one variation.

    Parameters
    ----------
    values : (M, D) of D changes: m, rad, or factors.
    joints, vertebrae : of the spine, caudal to cranial.
    """
    total = Variation.none(len(values), len(joints))
    for change, column in zip(changes, values.T, strict=True):
        _apply(total, change, column, joints, vertebrae)
    return total


def _apply(
    total: Variation,
    change: FactorChange,
    column: Array,
    joints: Sequence[str],
    vertebrae: Sequence[str],
) -> None:
    """Change a variation by one change with its values (M,), of all places where it names none."""

    def places(names: Sequence[str]) -> list[int]:
        return [names.index(name) for name in change.at or names]

    axis, each = change.axis, column[:, None]
    match change.of:
        case Of.STIFFNESS:
            total.stiffness[:, places(joints), axis] *= each
        case Of.LANDMARK:
            point = FRAME_LANDMARKS.index(change.landmark)
            for vertebra in change.at:
                total.landmarks[:, vertebrae.index(vertebra), point, axis] += column
        case Of.JOINT_CENTRE:
            total.frames[:, places(joints), axis] += each
        case Of.JOINT_AXES:
            total.frames[:, places(joints), 3 + axis] += each
        case Of.LOAD_POINT:
            total.load_points[:, axis] += column
        case Of.LOAD_DIRECTION:
            total.load_turns[:, axis] += column
        case Of.LOAD_SIZE:
            total.load_sizes[:] *= column
        case Of.MASS:
            total.masses[:, places(vertebrae[1:])] *= each
        case Of.CENTRE_OF_MASS:
            total.coms[:, places(vertebrae[1:]), axis] += each
        case Of.DAMPING:
            total.damping[:] *= column


def varied_frames(start: DescribedSpecimen, change: Variation) -> Frames:
    """First the landmarks are moved, then the frames that they make."""
    count = len(change.frames)
    rotations = np.tile([frame.rotation for frame in start.model.frames], (count, 1, 1, 1))
    origins = np.tile([frame.origin for frame in start.model.frames], (count, 1, 1))
    refused = _from_landmarks(start, change.landmarks, rotations, origins)
    _moved(change.frames, rotations, origins)
    return Frames(rotations, origins, refused)


def _from_landmarks(
    start: DescribedSpecimen, offsets: Array, rotations: Array, origins: Array
) -> dict[int, str]:
    """Replace frames of joints one of whose vertebrae has a moved landmark."""
    refused: dict[int, str] = {}
    # frames of joints that no landmark moves stay the cohort's own, to the last bit
    moved = np.any(offsets, axis=(0, 2, 3))
    points = start.points + offsets
    for joint, name in enumerate(start.model.joints):
        if start.given[joint] or not np.any(moved[joint : joint + 2]):
            continue
        of = (points[:, joint], points[:, joint + 1])
        known = (start.known[joint], start.known[joint + 1])
        made = many_joint_frames(*of, *known)
        rotations[:, joint], origins[:, joint] = made.rotations, made.origins
        for sample in np.flatnonzero(~made.defined).tolist():
            reason = "the landmarks are at the edge of defining no frame"
            try:
                one_joint_frame(of[0][sample], of[1][sample], *known)
            except ValueError as error:
                reason = str(error)
            refused.setdefault(sample, f"joint {name}: {reason}")
    return refused


def _moved(by: Array, rotations: Array, origins: Array) -> None:
    """Move each frame along its own axes, then turn it, as ``frame @ transform_of(by)`` does."""
    for joint in np.flatnonzero(by.any(axis=(0, 2))):
        own = rotations[:, joint]
        origins[:, joint] += (own @ by[:, joint, :3, None])[..., 0]
        # Euler angles in the sequence Z, X', Y'', as `frames.transform_of` has them
        rotations[:, joint] = own @ Rotation.from_euler("ZXY", by[:, joint, 3:]).as_matrix()


def varied_cases(case: LoadCase, change: Variation) -> Cases:
    """One test of M spines: force and moment of each load are turned together and scaled."""
    same = Cases.of(case, len(change.load_sizes))
    turn = Rotation.from_rotvec(change.load_turns).as_matrix()
    # force and moment of a load turn and grow together, about its own point
    by = change.load_sizes[:, None, None] * turn
    points = same.points.copy()
    for row, step in enumerate(case.steps):  # where a step has fewer loads, the rest is nobody's
        points[:, row, : len(step.wrenches)] += change.load_points[:, None]
    return Cases(case, points, _turned(by, same.forces), _turned(by, same.moments))


def _turned(by: Array, vectors: Array) -> Array:
    """(M, T, W, 3) vectors turned by (M, 3, 3)."""
    turned: Array = (by[:, None, None] @ vectors[..., None])[..., 0]
    return turned


@dataclass(frozen=True, eq=False)
class ManyFrames:
    """One joint's frame of M landmark sets.

    Attributes
    ----------
    rotations : (M, 3, 3); the identity where there is no frame.
    origins : (M, 3) m, ground.
    defined : (M,) whether the landmarks define a frame.
    """

    rotations: Array
    origins: Array
    defined: Flags


def many_joint_frames(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> ManyFrames:
    """Frames of a joint from landmarks (M, 4, 3) m of its two vertebrae, see `joint_pose`.

    Parameters
    ----------
    in_lower, in_upper : (4,) which landmarks a vertebra has; those of the facing endplates are
        there, and one of the two vertebrae has all. What it has not may hold any number.
    """
    # axes of each vertebra that has all landmarks; the joint's are their mean on the rotation group
    sides = [points for points, there in ((lower, in_lower), (upper, in_upper)) if there.all()]
    rotations, defined = zip(*(_vertebra_rotations(points) for points in sides), strict=True)
    whole: Flags = np.logical_and.reduce(defined)
    stacked = np.stack(rotations, axis=1)
    stacked[~whole] = np.eye(3)
    mean = Rotation.from_matrix(stacked).mean(axis=1).as_matrix()
    return ManyFrames(mean, (upper[:, INFERIOR] + lower[:, SUPERIOR]) / 2.0, whole)


def _vertebra_rotations(points: Array) -> tuple[Array, Flags]:
    """(M, 3, 3) ISB axes of a vertebra and (M,) whether there are any, from (M, 4, 3) landmarks."""
    # ISB axes: z along the pedicle bases to the right, x in front, across both lines
    z, wide = _directions(points[:, LEFT], points[:, RIGHT])
    y0, high = _directions(points[:, INFERIOR], points[:, SUPERIOR])
    normal = np.cross(y0, z)
    sine = np.linalg.norm(normal, axis=1)
    defined = wide & high & (sine >= SMALLEST_SINE)
    x = normal / np.where(defined, sine, 1.0)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=2), defined


def _directions(start: Array, end: Array) -> tuple[Array, Flags]:
    """(M, 3) unit vectors, and (M,) whether the points are far enough apart to have one."""
    line = end - start
    length = np.linalg.norm(line, axis=1)
    apart = length >= SMALLEST_LENGTH_M
    return line / np.where(apart, length, 1.0)[:, None], apart


def one_joint_frame(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> Pose:
    """The frame of one landmark set (4, 3) of each vertebra, by `joint_pose` itself."""
    sides = ((lower, in_lower), (upper, in_upper))
    named = (
        {name: p for name, p, there in zip(FRAME_LANDMARKS, points, given, strict=True) if there}
        for points, given in sides
    )
    return joint_pose(*named)

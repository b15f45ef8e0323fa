"""A specimen with the values of factors: many spines, and each test of all of them.

What the factors add up to becomes joint frames, models and loads.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.model import LoadCase, ScopedEffect
from spinepipe.statics.batched.spines import Cases, Spines
from spinepipe.studies.global_sensitivity.change import FactorChange, Of
from spinepipe.studies.global_sensitivity.many_frames import many_joint_frames, why_none
from spinepipe.studies.global_sensitivity.start import DescribedSpecimen


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
class Varied:
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


def vary(start: DescribedSpecimen, changes: Sequence[FactorChange], values: Array) -> Varied:
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
    return _of_kept(spines, cases, refused)


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


def _of_kept(spines: Spines, cases: tuple[Cases, ...], refused: dict[int, str]) -> Varied:
    """The spines that are spines."""
    kept = np.setdiff1d(np.arange(len(spines)), list(refused)).astype(np.int64)
    if refused:
        spines = spines.part(kept)
        cases = tuple(case.part(kept) for case in cases)
    return Varied(spines, cases, kept, dict(sorted(refused.items())))


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
    places = _Places(tuple(joints), tuple(vertebrae))
    for change, column in zip(changes, values.T, strict=True):
        if change.of is not Of.NOTHING:
            _APPLY[change.of](total, change, places, column)
    return total


@dataclass(frozen=True)
class _Places:
    joints: tuple[str, ...]
    vertebrae: tuple[str, ...]

    def of_joints(self, change: FactorChange) -> list[int]:
        return [self.joints.index(name) for name in change.at or self.joints]

    def of_bodies(self, change: FactorChange) -> list[int]:
        """Places among the moving vertebrae."""
        moving = self.vertebrae[1:]
        return [moving.index(name) for name in change.at or moving]


def _stiffness(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.stiffness[:, places.of_joints(change), change.axis] *= column[:, None]


def _landmark(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    point = FRAME_LANDMARKS.index(change.landmark)
    for vertebra in change.at:
        total.landmarks[:, places.vertebrae.index(vertebra), point, change.axis] += column


def _joint_centre(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.frames[:, places.of_joints(change), change.axis] += column[:, None]


def _joint_axes(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.frames[:, places.of_joints(change), 3 + change.axis] += column[:, None]


def _load_point(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.load_points[:, change.axis] += column


def _load_direction(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.load_turns[:, change.axis] += column


def _load_size(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.load_sizes[:] *= column


def _mass(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.masses[:, places.of_bodies(change)] *= column[:, None]


def _centre_of_mass(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.coms[:, places.of_bodies(change), change.axis] += column[:, None]


def _damping(total: Variation, change: FactorChange, places: _Places, column: Array) -> None:
    total.damping[:] *= column


_APPLY: dict[Of, Callable[[Variation, FactorChange, _Places, Array], None]] = {
    Of.STIFFNESS: _stiffness,
    Of.LANDMARK: _landmark,
    Of.JOINT_CENTRE: _joint_centre,
    Of.JOINT_AXES: _joint_axes,
    Of.LOAD_POINT: _load_point,
    Of.LOAD_DIRECTION: _load_direction,
    Of.LOAD_SIZE: _load_size,
    Of.MASS: _mass,
    Of.CENTRE_OF_MASS: _centre_of_mass,
    Of.DAMPING: _damping,
}


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
            reason = why_none(of[0][sample], of[1][sample], *known)
            refused.setdefault(sample, f"joint {name}: {reason}")
    return refused


def _moved(by: Array, rotations: Array, origins: Array) -> None:
    """Move each frame along its own axes, then turn it, as ``frame @ transform_of(by)`` does."""
    for joint in np.flatnonzero(by.any(axis=(0, 2))):
        own = rotations[:, joint]
        origins[:, joint] += (own @ by[:, joint, :3, None])[..., 0]
        rotations[:, joint] = own @ Rotation.from_euler("ZXY", by[:, joint, 3:]).as_matrix()


def varied_cases(case: LoadCase, change: Variation) -> Cases:
    """One test of M spines: force and moment of each load are turned together and scaled."""
    same = Cases.of(case, len(change.load_sizes))
    turn = Rotation.from_rotvec(change.load_turns).as_matrix()
    by = change.load_sizes[:, None, None] * turn
    points = same.points.copy()
    for row, step in enumerate(case.steps):  # where a step has fewer loads, the rest is nobody's
        points[:, row, : len(step.wrenches)] += change.load_points[:, None]
    return Cases(case, points, _turned(by, same.forces), _turned(by, same.moments))


def _turned(by: Array, vectors: Array) -> Array:
    """(M, T, W, 3) vectors turned by (M, 3, 3)."""
    turned: Array = (by[:, None, None] @ vectors[..., None])[..., 0]
    return turned

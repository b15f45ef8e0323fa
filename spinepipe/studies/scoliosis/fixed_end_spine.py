"""A patient's spine as a model that is held at its uppermost vertebra, and films of its poses.

Films show the coronal plane; the model is a chain in space. Joints sit at the back end of the
superior endplate of the lower vertebra and turn about three axes; translations are locked. The
uppermost vertebra is put where a film has it; it may be kept from tipping to the front or back,
which no coronal film shows (docs/decisions/0019). The erect film is the neutral pose. Ground axes:
anterior, up, right; the lowest vertebra is ground.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.model import Body, ScopedEffect, SpineModel
from spinepipe.statics.prescribed import PrescribedResult, alone, hold_at
from spinepipe.statics.prescribed_chain import (
    Ask,
    PrescribedChain,
    PrescribedPlace,
    Prescription,
    Tilt,
)
from spinepipe.studies.scoliosis.films import Film
from spinepipe.studies.scoliosis.settings import SagittalProfile
from spinepipe.units import COORDINATES, MM_PER_M

BENDING = COORDINATES.index("right_bending")
ANTERIOR, UP, RIGHT = np.eye(3)

LEAST_NM_PER_RAD = 1e-4
"""The least that a bushing may have: a millionth of a joint, which the tangent carries."""

MASS_KG, RADIUS_M = 0.5, 0.03
"""Of a vertebra, which nothing hangs on: spines are held at rest and have no weight."""


def geometry(
    patient: str, joints: Sequence[str], erect: Film, profile: SagittalProfile
) -> SpineModel:
    """The chain of a patient, without effects.

    Parameters
    ----------
    joints : S names, caudal to cranial.
    """
    count = len(joints)
    points = np.column_stack([np.zeros(count + 1), erect.up, erect.right])
    right, up = erect.joints(profile.endplate_share).T
    back = np.full(count, -0.5 * profile.endplate_depth_mm / MM_PER_M)
    places = np.column_stack([back, up, right])
    tilts = 0.5 * (erect.tilt[1:] + erect.tilt[:-1])
    inertia = np.eye(3) * 0.4 * MASS_KG * RADIUS_M**2
    bodies = (
        Body(joint, MASS_KG, at, inertia) for joint, at in zip(joints, points[1:], strict=True)
    )
    return SpineModel(
        specimen=patient,
        joints=tuple(joints),
        frames=tuple(
            Pose(rotation_zxy(0.0, t, 0.0), at) for t, at in zip(tilts, places, strict=True)
        ),
        bodies=tuple(bodies),
        gravity=np.zeros(3),
        damping=np.ones((count, 6)),
        effects=(),
    )


def with_springs(model: SpineModel, springs: Array) -> SpineModel:
    """The chain on linear springs (S, 6), N/m and N m/rad."""
    bushing = ScopedEffect(create("linear_bushing", {}), _all(model), springs)
    return replace(model, effects=(bushing,))


def with_laws(model: SpineModel, springs: Array, laws: Array) -> SpineModel:
    """The chain on bounded tangents (S, 3) in lateral bending and springs in the rest."""
    others = springs.copy()
    # the tangent bends in place of the spring; a bushing may not have nothing at all
    others[:, BENDING] = LEAST_NM_PER_RAD
    tangent = ScopedEffect(create("bounded_tangent", {}), _all(model), laws)
    return replace(model, effects=(*with_springs(model, others).effects, tangent))


def _all(model: SpineModel) -> tuple[int, ...]:
    return tuple(range(model.n_joints))


@dataclass(frozen=True)
class SpinePose:
    """A position as a model has it.

    Attributes
    ----------
    film : places and tilts of all vertebrae in the coronal plane. r : (S,) rad, turned since erect.
    points, lines : (S, 3) m, centres, and lines through the endplates, of all but the lowest.
    axes : (n, 6) twist of each coordinate: angular, and linear at the origin of ground.
    """

    result: PrescribedResult
    film: Film
    r: Array
    points: Array
    lines: Array
    axes: Array

    @property
    def film_by(self) -> Array:
        """(3, S, n) change of right, up and tilt of all vertebrae but the lowest with q (n,)."""
        # a unit twist (w, v) moves a point p by v + w x p, and turns a line u by w x u; the tilt is
        # the angle of u in the coronal plane. A joint carries the vertebrae above it alone.
        around, along = self.axes[:, :3].T, self.axes[:, 3:].T
        x, y, z = self.points.T[..., None]
        right = along[2] + around[0] * y - around[1] * x
        up = along[1] + around[2] * x - around[0] * z
        x, y, z = self.lines.T[..., None]
        tilt = around[0] - x * (around[1] * y + around[2] * z) / (y**2 + z**2)
        carried = np.arange(len(self.axes)) // 6 <= np.arange(len(self.points))[:, None]
        return np.stack([right, up, tilt]) * carried

    def answers_to(self, held_by: Array, top_by: Array | None = None) -> Array:
        """(n, m) change of the pose.

        Parameters
        ----------
        held_by : (n, m) changes of what the joints hold. top_by : (3, m) m, m and rad, of where
            the uppermost vertebra is held.
        """
        assert self.result.answers is not None  # a pose that was found has them
        if top_by is None:
            return self.result.answers.to(held_by)[0]
        level = np.zeros((len(self.result.pushes) - len(top_by), top_by.shape[1]))
        return self.result.answers.to(held_by, np.vstack([top_by, level]))[0]


@dataclass(frozen=True, eq=False)
class FixedEndSpine:
    """A model whose uppermost vertebra is put where a film has it.

    Attributes
    ----------
    ask : who answers Newton's questions.
    """

    chain: PrescribedChain
    erect: Film
    ask: Ask = alone

    @classmethod
    def of(cls, model: SpineModel, erect: Film, level: bool) -> "FixedEndSpine":
        """The spine of a model; `level` tells whether its top may not tip to the front."""
        top = model.n_joints - 1
        point, line = np.array([0.0, erect.up[-1], erect.right[-1]]), _lines(erect.tilt[-1])
        grips: tuple[Prescription, ...] = (
            PrescribedPlace(top, point, RIGHT),
            PrescribedPlace(top, point, UP),
            Tilt(top, line, UP, RIGHT),
        )
        if level:
            grips = (*grips, Tilt(top, ANTERIOR, ANTERIOR, UP))
        # translations are locked, rotations free
        free = np.tile([False] * 3 + [True] * 3, model.n_joints)
        return cls(PrescribedChain(model, grips, free), erect)

    def with_values(self, *values: Array) -> "FixedEndSpine":
        """The same spine with other values of its laws."""
        return replace(self, chain=self.chain.with_values(values))

    def with_model(self, model: SpineModel) -> "FixedEndSpine":
        """The same spine on other stiffness."""
        return self.with_values(*(scoped.values for scoped in model.effects))

    def at(self, top: Array, start: PrescribedResult | None = None) -> SpinePose:
        """The pose with the uppermost vertebra at a place (right, up; m) and tilt (rad)."""
        wanted = np.concatenate([top, np.zeros(len(self.chain.prescriptions) - len(top))])
        result = hold_at(self.chain, wanted, start, self.ask)
        erect, (axes, turned, shifted) = self.erect, self.chain.motion(result.q)
        centres = np.column_stack([np.zeros(len(turned)), erect.up[1:], erect.right[1:]])
        points = (turned @ centres[..., None])[..., 0] + shifted
        lines = (turned @ _lines(erect.tilt[1:])[..., None])[..., 0]
        above = (points[:, 2], points[:, 1], np.arctan2(lines[:, 2], lines[:, 1]))
        film = Film(*(np.append(a[0], b) for a, b in zip(erect.rows, above, strict=True)))
        return SpinePose(
            result, film, film.turned - erect.turned, points, lines, axes.reshape(-1, 6)
        )


def _lines(tilts: Array | float) -> Array:
    """(..., 3) the lines through the centres of vertebrae's endplates."""
    return np.stack([np.zeros_like(tilts), np.cos(tilts), np.sin(tilts)], axis=-1)

"""A patient's spine as a model that is held at its uppermost vertebra, and films of its poses.

Films show the coronal plane; the model is a chain in space. Joints sit at the back end of the
superior endplate of the lower vertebra and turn about three axes; translations are locked. The
uppermost vertebra is put where a film has it; it may be kept from tipping to the front or back,
which no coronal film shows (docs/decisions/0019). The erect film is the neutral pose. Ground axes:
anterior, up, right; the lowest vertebra is ground.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System
from spinepipe.statics.motion import ChainMotion
from spinepipe.statics.prescribed import Held, Place, Prescription, Tilt, hold_at
from spinepipe.studies.scoliosis.films import Film
from spinepipe.studies.scoliosis.settings import Profile
from spinepipe.units import COORDINATES, MM_PER_M
from spinepipe.world import Chain

BENDING = COORDINATES.index("right_bending")
ANTERIOR, UP, RIGHT = np.eye(3)

LEAST_NM_PER_RAD = 1e-4
"""The least that a bushing may have: a millionth of a joint, which the tangent carries."""

MASS_KG, RADIUS_M = 0.5, 0.03
"""Of a vertebra, which nothing hangs on: spines are held at rest and have no weight."""


def geometry(patient: str, joints: Sequence[str], erect: Film, profile: Profile) -> SpineModel:
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
    others[:, BENDING] = LEAST_NM_PER_RAD
    tangent = ScopedEffect(create("bounded_tangent", {}), _all(model), laws)
    return replace(model, effects=(*with_springs(model, others).effects, tangent))


def _all(model: SpineModel) -> tuple[int, ...]:
    return tuple(range(model.n_joints))


@dataclass(frozen=True)
class Posed:
    """A position as a model has it.

    Attributes
    ----------
    film : places and tilts of all vertebrae in the coronal plane. r : (S,) rad, turned since erect.
    """

    held: Held
    film: Film
    r: Array

    def answers_to(self, held_by: Array, top_by: Array | None = None) -> Array:
        """(n, m) change of the pose.

        Parameters
        ----------
        held_by : (n, m) changes of what the joints hold. top_by : (3, m) m, m and rad, of where
            the uppermost vertebra is held.
        """
        assert self.held.answers is not None  # a pose that was found has them
        if top_by is None:
            return self.held.answers.to(held_by)[0]
        level = np.zeros((len(self.held.pushes) - len(top_by), top_by.shape[1]))
        return self.held.answers.to(held_by, np.vstack([top_by, level]))[0]


class HeldSpine:
    """A model whose uppermost vertebra is put where a film has it."""

    def __init__(self, model: SpineModel, erect: Film, level: bool) -> None:
        """Load the chain; `level` tells whether the uppermost vertebra may not tip to the front."""
        case = LoadCase("held", 1, (LoadStep(0, ()),))
        self.system, self.erect = System(Chain(model), model, case), erect
        self.free = np.tile([False] * 3 + [True] * 3, model.n_joints)
        top = model.n_joints - 1
        point, line = np.array([0.0, erect.up[-1], erect.right[-1]]), _line(erect.tilt[-1])
        self.grips: tuple[Prescription, ...] = (
            Place(top, point, RIGHT),
            Place(top, point, UP),
            Tilt(top, line, UP, RIGHT),
        )
        if level:
            self.grips = (*self.grips, Tilt(top, ANTERIOR, ANTERIOR, UP))
        centres = [np.array([0.0, *at]) for at in zip(erect.up[1:], erect.right[1:], strict=True)]
        self.shown: tuple[tuple[Prescription, ...], ...] = (
            tuple(Place(body, at, RIGHT) for body, at in enumerate(centres)),
            tuple(Place(body, at, UP) for body, at in enumerate(centres)),
            tuple(Tilt(body, _line(t), UP, RIGHT) for body, t in enumerate(erect.tilt[1:])),
        )

    def with_model(self, model: SpineModel) -> "HeldSpine":
        """The same spine on other stiffness."""
        other = copy(self)
        other.system = self.system.with_model(model)
        return other

    def at(self, top: Array, start: Held | None = None) -> Posed:
        """The pose with the uppermost vertebra at a place (right, up; m) and tilt (rad)."""
        wanted = np.concatenate([top, np.zeros(len(self.grips) - len(top))])
        held = hold_at(self.system, self.grips, wanted, self.free, start)
        film = self.film(held.q)
        return Posed(held, film, film.turned - self.erect.turned)

    def film_by(self, q: Array) -> Array:
        """(3, S, n) change of right, up and tilt of all vertebrae but the lowest with q (n,)."""
        motion = ChainMotion(self.system.chain, q)
        return np.array([[one.slope(motion) for one in each] for each in self.shown])

    def film(self, q: Array) -> Film:
        """What a film of the pose q (n,) shows."""
        motion, erect = ChainMotion(self.system.chain, q), self.erect
        right, up, tilt = [erect.right[0]], [erect.up[0]], [erect.tilt[0]]
        for body in range(len(erect.tilt) - 1):
            moved = motion.displacement(body)
            point = moved.apply(np.array([0.0, erect.up[body + 1], erect.right[body + 1]]))
            line = moved.rotation @ _line(erect.tilt[body + 1])
            right.append(float(point[2]))
            up.append(float(point[1]))
            tilt.append(float(np.arctan2(line[2], line[1])))
        return Film(np.array(right), np.array(up), np.array(tilt))


def _line(tilt: float) -> Array:
    """(3,) the line through the centres of a vertebra's endplates."""
    return np.array([0.0, np.cos(tilt), np.sin(tilt)])

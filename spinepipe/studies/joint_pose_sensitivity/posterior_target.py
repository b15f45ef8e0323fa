"""What the posterior of a specimen is made of: its problem, priors, and what they stand for.

The joint frames are those in which motion is told, with each joint's laws offset and tilted to
where landmarks put it (`spinepipe.cohort.landmark_frames`). So landmarks are unknowns with exact
derivatives, and motion is compared in one frame throughout: components that were not measured need
not be taken for zero, as fits in sampled poses have to.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spinepipe.calibration import Evaluator, Fit, Problem
from spinepipe.calibration.posterior import ResidualNoise, Target, between, noise_of
from spinepipe.cohort import Cohort
from spinepipe.cohort.landmark_frames import FrameDisplacements, LandmarkFrames
from spinepipe.effects import create
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import ScopedEffect
from spinepipe.statics import free_parameters
from spinepipe.studies.joint_pose_sensitivity.landmarks import Landmarks
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import TRANSLATIONS, to_si


@dataclass(frozen=True)
class StiffnessAndLandmarks:
    """z: first the stiffnesses, uniform in their logarithm, then landmarks' axes about where felt.

    Attributes
    ----------
    low, high : (p,) bounds of the logarithms, as moves from the model's. free : places of the
        landmarks that move a joint and are not certain.
    """

    low: Array
    high: Array
    landmarks: Landmarks
    free: Indices
    frames: LandmarkFrames

    @property
    def size(self) -> int:
        """Stiffnesses and three axes of each free landmark."""
        return len(self.low) + 3 * len(self.free)

    def placed(self, z: Array) -> FrameDisplacements:
        """The joints' frames at points z (P, m)."""
        points = np.tile(self.landmarks.points, (len(z), 1, 1))
        moved = z[:, len(self.low) :].reshape(len(z), -1, 3)  # of free landmarks, in their SDs
        points[:, self.free] += moved * self.landmarks.sd[self.free, None]
        return self.frames.at(points, self.free)

    def at(self, numbers: Sequence[int], z: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Moves of the logarithms, then offsets and tilts, and their derivatives."""
        count = len(self.low)
        moves, slopes = between(self.low, self.high, z[:, :count])
        # offsets and tilts by landmarks, chain rule; each stiffness hangs on its own z alone
        placed, sd = self.placed(z), self.landmarks.sd[self.free, None]
        x = np.hstack([moves, _in_order(placed.by).reshape(len(z), -1)])
        jacobian = np.zeros((*x.shape, z.shape[1]))
        jacobian[:, np.arange(count), np.arange(count)] = slopes
        by_z = _in_order(placed.by_points * sd)
        jacobian[:, count:, count:] = by_z.reshape(len(z), x.shape[1] - count, -1)
        return x, jacobian, placed.defined


@dataclass(frozen=True)
class StiffnessInPoses:
    """z: stiffnesses alone; each search has joint frames of its own.

    Attributes
    ----------
    by : (P, J, 6) offset in m and tilt in rad of each search's frames.
    """

    low: Array
    high: Array
    by: Array

    @property
    def size(self) -> int:
        """Stiffnesses."""
        return len(self.low)

    def at(self, numbers: Sequence[int], z: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Moves of the logarithms, then the frames of each search."""
        count = len(self.low)
        moves, slopes = between(self.low, self.high, z)
        x = np.hstack([moves, _in_order(self.by[list(numbers)]).reshape(len(z), -1)])
        jacobian = np.zeros((*x.shape, count))
        jacobian[:, np.arange(count), np.arange(count)] = slopes
        return x, jacobian, np.ones(len(z), dtype=bool)


def _in_order(by: Array) -> Array:
    """(P, 6, J, ...) of (P, J, 6, ...): unknowns stand offset by offset, each joint by joint."""
    return by.swapaxes(1, 2)


@dataclass(frozen=True)
class SpecimenPosterior:
    """Problem and priors of one specimen.

    Attributes
    ----------
    alone : the problem with its stiffnesses alone, in the frames in which motion is told.
    problem : the same with offset and tilt of each joint as further unknowns, last.
    scatter : SD of the weighted residuals beyond the declared error, mm and degrees.
    """

    settings: JointPoseSensitivity
    cohort: Cohort
    alone: Problem
    problem: Problem
    landmarks: Landmarks
    scatter: float

    @cached_property
    def evaluator(self) -> Evaluator:
        """Of the problem; a reading that was zeroed shares the error of step 0."""
        return Evaluator(self.problem)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """(p,) each, of the logarithms of stiffness: the study's, inside those of the fit."""
        count, drawn_in = len(self.alone.free), self.evaluator.problem
        factor = self.settings.posterior.stiffness_factor
        reach = np.inf if factor is None else np.log(factor)
        low, high = drawn_in.lower[:count], drawn_in.upper[:count]
        return np.maximum(low, -reach), np.minimum(high, reach)

    @property
    def noise(self) -> ResidualNoise:
        """Of the residuals, as the study says; of readings zero where no SD is declared."""
        sd = self.cohort.reading_sd()
        return noise_of(self.evaluator, to_si(np.zeros(6) if sd is None else sd), self.scatter)

    @cached_property
    def unknowns(self) -> StiffnessAndLandmarks:
        """Stiffnesses, and landmarks that are not certain and move a joint."""
        marks = self.landmarks
        frames = LandmarkFrames(self.cohort.vertebrae, marks.names, self.alone.model.frames)
        moving = frames.moving(marks.points)
        free = moving[marks.sd[moving] > 0.0]
        return StiffnessAndLandmarks(*self.bounds, marks, free, frames)

    def target(self) -> Target:
        """Over stiffnesses and landmarks."""
        return Target(self.evaluator, self.unknowns, self.noise)


def problem_of(root: str, settings: JointPoseSensitivity, specimen: str) -> Problem:
    """A specimen's problem with its stiffnesses alone, in the frames in which motion is told.

    Readings that were zeroed are whitened, as noise is told of one reading.

    Raises
    ------
    RefusedModel
        When frames and loads make no model.
    """
    alone = calibration_problem(root, settings, specimen)
    return replace(alone, correlated=any(case.zeroed for case in alone.cases))


def scatter_of(settings: JointPoseSensitivity, found: Fit) -> float:
    """SD of the weighted residuals that a fit leaves; 0 where the declared error is believed.

    Raises
    ------
    ValueError
        Where a fit leaves none, because it has as many unknowns as readings.
    """
    if settings.posterior.noise == "declared":
        return 0.0
    freedom = found.uncertainty.degrees_of_freedom
    if freedom < 1:
        raise ValueError("a fit with as many unknowns as readings leaves no scatter to go by")
    return float(np.sqrt(found.cost / freedom))


def posterior_of(
    settings: JointPoseSensitivity,
    cohort: Cohort,
    alone: Problem,
    landmarks: Landmarks,
    scatter: float,
) -> SpecimenPosterior:
    """The posterior of a problem with its stiffnesses alone."""
    joints = range(alone.model.n_joints)
    moved = [
        ScopedEffect(create(name), tuple(joints), np.zeros((len(joints), 3)))
        for name in ("joint_centre_offset", "axes_tilt")
    ]
    model = alone.model.with_effects((*alone.model.effects, *moved))
    first = len(alone.model.effects)
    tilts = [parameter.name for parameter in moved[1].effect.parameters]
    free = (
        *alone.free,
        *free_parameters(model, first, TRANSLATIONS, "per_joint"),
        *free_parameters(model, first + 1, tilts, "per_joint"),
    )
    # landmarks have a prior and no bounds
    anywhere = np.full(len(free) - len(alone.free), np.inf)
    problem = replace(
        alone,
        model=model,
        free=free,
        lower=np.concatenate([alone.lower, -anywhere]),
        upper=np.concatenate([alone.upper, anywhere]),
    )
    return SpecimenPosterior(settings, cohort, alone, problem, landmarks, scatter)


def stiffness_values(alone: Problem, moves: Sequence[Array] | Array) -> Array:
    """(..., p) N/m and N m/rad of moves (..., p) of the logarithms; of an unknown's first joint."""
    start = [alone.model.effects[p.effect].values[p.rows[0], p.column] for p in alone.free]
    found: Array = np.array(start) * np.exp(np.asarray(moves))
    return found

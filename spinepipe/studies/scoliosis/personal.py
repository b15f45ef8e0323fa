"""The stiffness of a patient's segments in each of the models that are compared.

What a film of bending gives, and what all models share: geometry, the other rotations, and the
force that bends, a pull at the uppermost vertebra. Films decide ratios between segments; the size,
the geometric mean over segments of the stiffness at rest, comes from outside (`settings.Scale`) and
is one for all models, so that they differ by what they make of the films alone.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spinepipe.calibration.descent import DescentTolerances
from spinepipe.calibration.profile import RegionEnds
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics.prescribed import PrescribedResult
from spinepipe.status import PrescribedStatus, Status
from spinepipe.studies.scoliosis.curve_angles import SpinalCurve, curves, lumbar_apex
from spinepipe.studies.scoliosis.films import ERECT, LEFT, RIGHT, Film, PatientFilms, read_films
from spinepipe.studies.scoliosis.fixed_end_spine import (
    BENDING,
    FixedEndSpine,
    SpinePose,
    geometry,
    with_laws,
    with_springs,
)
from spinepipe.studies.scoliosis.optima import FilmOptimum, best, optimum
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tangent_laws import (
    EndRotations,
    Flags,
    LinearShape,
    Pairs,
    characterise,
    ends_of,
)
from spinepipe.units import DEG_PER_RAD, MM_PER_M

FARTHEST_MULTIPLIER = np.log(10.0)
"""Petit 2004 reports multipliers of regions up to 10."""

START_SHARES = (-0.5, 0.5)
"""Multipliers that a fit starts from, as logarithms over the farthest; and all alike."""

SETTLED = DescentTolerances(cost=1e-6, step=1e-4, slope=1e-10, evaluations=50)
"""Multipliers to a ten-thousandth."""

POSED = (PrescribedStatus.CONVERGED, PrescribedStatus.UNREACHABLE)
"""How a solve may end whose pose is held against the film."""

ERRORS = ("rotation_rmse_deg", "place_rmse_mm", "tilt_rmse_deg")

Regions = NDArray[np.int64]


@dataclass(frozen=True)
class Patient:
    """Films of a patient and the chain that they make.

    Attributes
    ----------
    chain : without effects.
    size : geometric mean over segments of the lateral stiffness at rest in all models, N m/rad.
    springs : (S, 6) stiffness of all segments before personalisation: as published to each other,
        lateral bending of that size.
    pairs : what the bending films give.
    level : whether the uppermost vertebra is kept from tipping to the front.
    """

    name: str
    read: PatientFilms
    chain: SpineModel
    size: float
    springs: Array
    pairs: Pairs
    level: bool

    @property
    def erect(self) -> Film:
        """The film that all others are held against."""
        return self.read.films[ERECT]

    def fixed_end(self, model: SpineModel) -> FixedEndSpine:
        """A model of the patient, to be held where films have its top."""
        return FixedEndSpine.of(model, self.erect, self.level)

    def errors(self, position: str, posed: SpinePose) -> dict[str, float | None]:
        """Root mean square errors of a pose, what the film has of segments and vertebrae.

        None without a pose, or where no two neighbours are read.
        """
        if posed.result.status not in POSED:
            return dict.fromkeys(ERRORS)
        film, read = self.read.films[position], self.read.compared(position)[1:]
        away = np.hypot(posed.film.right - film.right, posed.film.up - film.up)[1:]
        turned = (posed.r - self.read.turned(position))[self.read.compared_turns(position)]
        errors = (
            DEG_PER_RAD * turned,
            MM_PER_M * away[read],
            DEG_PER_RAD * (posed.film.tilt - film.tilt)[1:][read],
        )
        sizes = (float(np.sqrt(np.mean(one**2))) if len(one) else None for one in errors)
        return dict(zip(ERRORS, sizes, strict=True))

    @cached_property
    def curves(self) -> tuple[SpinalCurve, ...]:
        """Its curves on the erect film, caudal to cranial."""
        return curves(self.erect)


class Fitting(NamedTuple):
    """How a fit to the films ended, and how many distinct optima its starts have found."""

    status: Status
    n_optima: int


@dataclass(frozen=True)
class PersonalModel:
    """A personalised model.

    Attributes
    ----------
    at_rest : (S,) N m/rad, lateral stiffness at the erect pose.
    ends : of a tangent law; none of a linear one.
    constrained : (S,) segments whose stiffness was held at the least or at the most.
    free : number of parameters taken from this patient's films.
    decided : of how many the films decided; all, where the model draws them to no population.
    ratio_range : (2, S) 95 % interval of the segments' ratios; none where the model gives none.
    by_films : (S,) how far the films let each ratio go; none where they were not asked.
    fitting : none where nothing is fitted through the simulator.
    """

    model: SpineModel
    at_rest: Array
    ends: EndRotations | None
    constrained: Flags
    free: int
    decided: float
    ratio_range: Array | None = None
    by_films: tuple[RegionEnds, ...] | None = None
    fitting: Fitting | None = None

    @property
    def ratio(self) -> Array:
        """(S,) stiffness at rest over the geometric mean of the segments."""
        found: Array = self.at_rest / geometric_mean(self.at_rest)
        return found


def patient_of(study: Scoliosis, cohort: Cohort, name: str) -> Patient:
    """A patient of a cohort whose films are sound."""
    read = read_films(cohort, name)
    erect = read.films[ERECT]
    joints = cohort.joint_names[read.lowest : read.lowest + len(read.vertebrae) - 1]
    chain = geometry(name, joints, erect, study.profile)
    right, left = (
        arms(
            study.profile.endplate_share,
            read.films[position if study.arm == "film" else ERECT],
            study.direction == "across_chord",
        )
        for position in (RIGHT, LEFT)
    )
    # the segment below the apical vertebra of the thoracolumbar or lumbar curve
    apex = max(lumbar_apex(erect, read.vertebrae) - 1, 0)
    pairs = Pairs(read.turned(RIGHT), read.turned(LEFT), right, left, apex)
    size = size_of(pairs, study)
    stated = np.array(study.stiffness.in_order(), dtype=float)
    springs = np.tile(stated * size / stated[BENDING], (chain.n_joints, 1))
    return Patient(name, read, chain, size, springs, pairs, not study.top_may_tip)


def arms(share: float, film: Film, across_chord: bool) -> Array:
    """(S,) m, from each joint to the line of a pull at the uppermost vertebra.

    Parameters
    ----------
    share : where the joint is on the way from the centre below to the centre above.
    across_chord : the pull is across the line from the lowest to the uppermost vertebra, else
        along the ground of the lowest.
    """
    top = film.top[:2]
    along = top if across_chord else np.array([0.0, 1.0])
    found: Array = (top - film.joints(share)) @ (along / np.linalg.norm(along))
    return found


def size_of(pairs: Pairs, study: Scoliosis) -> float:
    """Geometric mean over segments of the stiffness at rest that all models have, N m/rad."""
    if study.scale.of == "mean_stiffness":
        return study.scale.mean_stiffness_nm_per_rad
    ends = ends_of(pairs, study.enlargement)
    laws = characterise(pairs, ends, study.scale.apical_moment_nm)
    return geometric_mean(ends.at_rest(laws.stretch))


def geometric_mean(values: Array) -> float:
    """Of positive values."""
    return float(np.exp(np.mean(np.log(values))))


def tangent(patient: Patient, study: Scoliosis) -> PersonalModel:
    """The published model: tangent laws of the two bending films."""
    ends = ends_of(patient.pairs, study.enlargement)
    laws = characterise(patient.pairs, ends, study.scale.apical_moment_nm)
    at_rest = ends.at_rest(laws.stretch)
    # all models have one size: films decide ratios, the scale comes from outside
    factor = patient.size / geometric_mean(at_rest)
    model = model_of_law(patient, factor * at_rest, ends)
    free = 3 * len(at_rest) + 1
    return PersonalModel(model, factor * at_rest, ends, laws.constrained, free, free)


def linear_per_segment(patient: Patient, study: Scoliosis) -> PersonalModel:
    """A spring for each segment from the same pairs."""
    laws = characterise(patient.pairs, LinearShape(), study.scale.apical_moment_nm)
    at_rest = laws.stretch * patient.size / geometric_mean(laws.stretch)
    model = model_of_law(patient, at_rest, None)
    free = len(at_rest) + 1
    return PersonalModel(model, at_rest, None, laws.constrained, free, free)


def uniform(patient: Patient, study: Scoliosis) -> PersonalModel:
    """The same spring everywhere: nothing is taken from the films."""
    return _springs(patient, patient.springs[:, BENDING], 0)


def _springs(patient: Patient, at_rest: Array, free: int) -> PersonalModel:
    model = model_of_law(patient, at_rest, None)
    return PersonalModel(model, at_rest, None, np.zeros(len(at_rest), dtype=bool), free, free)


def linear_regions(patient: Patient, study: Scoliosis) -> PersonalModel:
    """Petit's scheme: a multiplier of the springs for each curve, by the curves' Ferguson angles.

    With the uppermost vertebra held in place only ratios of the multipliers count.
    """
    fit, found, n_optima = region_optimum(patient)
    free = fit.by_logs.shape[1]
    if found is None:
        personal = _springs(patient, patient.springs[:, BENDING], free)
        if not free:
            return personal
        # no start has poses with the uppermost vertebra where the films have it
        return replace(personal, fitting=Fitting(Status.NOT_CONVERGED, n_optima))
    # multipliers are over the last region's, which is held where any other is
    held = np.append(found.at_bound, found.at_bound.any())
    personal = _springs(patient, fit.stiffness(found.x), free)
    fitting = Fitting(found.status, n_optima)
    return replace(personal, constrained=held[fit.regions], fitting=fitting)


def region_optimum(
    patient: Patient, shares: Sequence[float] = START_SHARES
) -> tuple["RegionFit", FilmOptimum | None, int]:
    """The best of all optima of the multipliers, and how many distinct ones were found.

    Parameters
    ----------
    shares : of the farthest multiplier, as logarithms, which starts combine.
    """
    fit = RegionFit(patient, _regions(patient))
    free = fit.by_logs.shape[1]
    reach = np.full(free, FARTHEST_MULTIPLIER)
    limits = -reach, reach, np.ones(free)
    starts = [np.zeros(free), *(reach * one for one in product(shares, repeat=free))]
    ends = [optimum(fit, fit.missed, [one], {}, limits, SETTLED) for one in starts if free]
    return fit, *best(ends, limits[2])


class RegionFit:
    """Ferguson angles of both bending films as a least squares problem."""

    def __init__(self, patient: Patient, regions: Regions) -> None:
        self.patient, self.start = patient, patient.springs[:, BENDING]
        self.regions = regions
        # columns sum to nought, so that the geometric mean stays; the last multiplier follows
        own = np.eye(int(regions.max()) + 1)[regions]
        self.by_logs = (own - own.mean(axis=0))[:, :-1]  # (S, k - 1) of the segments' logarithms
        self.spine = patient.fixed_end(with_springs(patient.chain, patient.springs))
        self.near: dict[str, PrescribedResult] = {}

    def stiffness(self, logs: Array) -> Array:
        """(S,) N m/rad; the geometric mean stays."""
        found: Array = self.start * np.exp(self.by_logs @ logs)
        return found

    def missed(self, logs: Array) -> tuple[Array, Array] | None:
        """Errors of the angles, rad, right and left film, and by each logarithm."""
        patient, springs = self.patient, self.stiffness(logs)
        spine = self.spine.with_values(with_bending(patient, springs))
        errors, slopes = [], []
        for position in (RIGHT, LEFT):
            film = patient.read.films[position]
            posed = spine.at(film.top, self.near.get(position))
            if posed.result.status is not PrescribedStatus.CONVERGED:
                return None
            self.near[position] = posed.result
            q = posed.result.q.reshape(-1, 6)
            # a spring k exp(b x) holds k exp(b x) q: its change with x is b times that
            held_by = np.zeros((*q.shape, len(logs)))
            held_by[:, BENDING] = (springs * q[:, BENDING])[:, None] * self.by_logs
            change = posed.answers_to(held_by.reshape(q.size, -1))
            shown = posed.film_by[:2] @ change
            for one in patient.curves:
                errors.append(one.ferguson(posed.film) - one.ferguson(film))
                slopes.append(np.einsum("av,avn->n", one.ferguson_by(posed.film)[:, 1:], shown))
        return np.array(errors), np.array(slopes)


def _regions(patient: Patient) -> Regions:
    """(S,) number of the curve that each segment belongs to."""
    tops = [one.upper for one in patient.curves[:-1]]
    return np.searchsorted(np.array(tops), np.arange(patient.chain.n_joints), side="right")


def model_of_law(patient: Patient, at_rest: Array, ends: EndRotations | None) -> SpineModel:
    """The model of a personal law: (S,) N m/rad at rest; tangents where it has ends."""
    if ends is None:
        return with_springs(patient.chain, with_bending(patient, at_rest))
    stretch = at_rest / ends.at_rest(np.ones(len(at_rest)))
    values = np.column_stack([stretch, ends.lower, ends.upper])
    return with_laws(patient.chain, patient.springs, values)


def with_bending(patient: Patient, at_rest: Array) -> Array:
    """(S, 6) springs with this lateral stiffness."""
    springs = patient.springs.copy()
    springs[:, BENDING] = at_rest
    return springs


WAYS: Mapping[str, Callable[[Patient, Scoliosis], PersonalModel]] = {
    "tangent": tangent,
    "linear_regions": linear_regions,
    "linear_per_segment": linear_per_segment,
    "uniform": uniform,
}
"""How a model is personalised from the films of one patient alone, by its name in a study."""

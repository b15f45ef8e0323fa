"""The stiffness of a patient's segments in each of the models that are compared.

What a film of bending gives, and what all models share: geometry, the other rotations, and the
force that bends, a pull at the uppermost vertebra. Films decide ratios between segments; the size
comes from outside (`settings.Scale`), so that models differ by what they make of the films alone.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.decomposition import bounded_least_squares
from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics.prescribed import Held
from spinepipe.studies.scoliosis.curve_angles import Curve, curves, lumbar_apex
from spinepipe.studies.scoliosis.films import ERECT, LEFT, RIGHT, Film, Read, read_films
from spinepipe.studies.scoliosis.held_spine import (
    BENDING,
    HeldSpine,
    geometry,
    with_laws,
    with_springs,
)
from spinepipe.studies.scoliosis.settings import Scale, Scoliosis
from spinepipe.studies.scoliosis.tangent_laws import (
    Ends,
    Flags,
    Laws,
    Pairs,
    Straight,
    characterise,
    ends_of,
)

FARTHEST_MULTIPLIER = np.log(10.0)
"""Petit 2004 reports multipliers of regions up to 10."""

MULTIPLIER_STEP = 1e-5

LAST_STEP = 1e-6
"""Relative step at which multipliers have arrived."""


@dataclass(frozen=True)
class Patient:
    """Films of a patient and the chain that they make.

    Attributes
    ----------
    chain : without effects. springs : (S, 6) stiffness of all segments before personalisation.
    apex : segment below the apical vertebra of the thoracolumbar or lumbar curve.
    """

    name: str
    read: Read
    chain: SpineModel
    springs: Array
    pairs: Pairs
    apex: int

    @property
    def erect(self) -> Film:
        """The film that all others are held against."""
        return self.read.films[ERECT]

    @cached_property
    def curves(self) -> tuple[Curve, ...]:
        """Its curves on the erect film, caudal to cranial."""
        return curves(self.erect)


@dataclass(frozen=True)
class Personal:
    """A personalised model.

    Attributes
    ----------
    at_rest : (S,) N m/rad, lateral stiffness at the erect pose.
    ends : of a tangent law; none of a linear one.
    constrained : (S,) segments whose stiffness was held at the least.
    free : number of parameters taken from this patient's films.
    """

    model: SpineModel
    at_rest: Array
    ends: Ends | None
    constrained: Flags
    free: int
    force_ratio: float | None = None


def patient_of(study: Scoliosis, cohort: Cohort, name: str) -> Patient:
    """A patient of a cohort whose films are sound."""
    read = read_films(cohort, name)
    erect = read.films[ERECT]
    chain = geometry(name, cohort.joint_names, erect, study.profile)
    right, left = (
        arms(
            study.profile.endplate_share,
            read.films[position if study.arm == "film" else ERECT],
            study.direction == "across_chord",
        )
        for position in (RIGHT, LEFT)
    )
    return Patient(
        name,
        read,
        chain,
        np.tile(np.array(study.stiffness.in_order(), dtype=float), (chain.n_joints, 1)),
        Pairs(read.turned(RIGHT), read.turned(LEFT), right, left),
        max(lumbar_apex(erect, cohort.vertebrae) - 1, 0),
    )


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


def tangent(patient: Patient, study: Scoliosis) -> Personal:
    """The published model: tangent laws of the two bending films."""
    ends = ends_of(patient.pairs, study.enlargement)
    laws = characterise(patient.pairs, ends, patient.apex, study.scale.apical_moment_nm)
    b, c = ends.shape
    at_rest = laws.stretch * b * (1.0 + np.tan(c) ** 2)
    factor = _factor(study.scale, at_rest)
    values = np.column_stack([factor * laws.stretch, ends.lower, ends.upper])
    model = with_laws(patient.chain, patient.springs, values)
    return _personal(model, factor * at_rest, ends, laws, 3 * len(at_rest) + 1)


def linear_per_segment(patient: Patient, study: Scoliosis) -> Personal:
    """A spring for each segment from the same pairs."""
    laws = characterise(patient.pairs, Straight(), patient.apex, study.scale.apical_moment_nm)
    at_rest = _factor(study.scale, laws.stretch) * laws.stretch
    model = with_springs(patient.chain, _with_bending(patient, at_rest))
    return _personal(model, at_rest, None, laws, len(at_rest) + 1)


def _personal(
    model: SpineModel, at_rest: Array, ends: Ends | None, laws: Laws, free: int
) -> Personal:
    return Personal(model, at_rest, ends, laws.constrained, free, laws.ratio)


def uniform(patient: Patient, study: Scoliosis) -> Personal:
    """The same spring everywhere: nothing is taken from the films."""
    stated = patient.springs[:, BENDING]
    at_rest = _factor(study.scale, stated) * stated
    model = with_springs(patient.chain, _with_bending(patient, at_rest))
    return Personal(model, at_rest, None, np.zeros(len(at_rest), dtype=bool), 0)


def linear_regions(patient: Patient, study: Scoliosis) -> Personal:
    """Petit's scheme: a multiplier of the springs for each curve, by the curves' Ferguson angles.

    With the uppermost vertebra held in place only ratios of the multipliers count: their geometric
    mean is one.
    """
    regions = _regions(patient)
    count = int(regions.max()) + 1
    start = uniform(patient, study)
    spine = HeldSpine(start.model, patient.erect)

    def stiffness(logs: Array) -> Array:
        every = np.append(logs, -logs.sum())
        found: Array = start.at_rest * np.exp(every[regions])
        return found

    near: dict[str, Held] = {}

    def missed(logs: Array) -> Array:
        springs = _with_bending(patient, stiffness(logs))
        held = spine.with_model(with_springs(patient.chain, springs))
        found = []
        for position in (RIGHT, LEFT):
            film = patient.read.films[position]
            posed = held.at(film.top, near.get(position))
            near[position] = posed.held
            found += [one.ferguson(posed.film) - one.ferguson(film) for one in patient.curves]
        return np.array(found)

    best = np.zeros(count - 1)
    if count > 1:
        reach = np.full(count - 1, FARTHEST_MULTIPLIER)
        ended = bounded_least_squares(
            missed, best, _differences(missed), (-reach, reach), xtol=LAST_STEP
        )
        best = ended.x
    at_rest = stiffness(best)
    model = with_springs(patient.chain, _with_bending(patient, at_rest))
    return Personal(model, at_rest, None, np.zeros(len(at_rest), dtype=bool), count - 1)


def _differences(missed: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """Central differences; poses are solved far more sharply than these steps."""

    def jacobian(logs: Array) -> Array:
        steps = MULTIPLIER_STEP * np.eye(len(logs))
        columns = [(missed(logs + s) - missed(logs - s)) / (2.0 * MULTIPLIER_STEP) for s in steps]
        return np.stack(columns, axis=1)

    return jacobian


def _regions(patient: Patient) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    """(S,) number of the curve that each segment belongs to."""
    tops = [one.upper for one in patient.curves[:-1]]
    return np.searchsorted(np.array(tops), np.arange(patient.chain.n_joints), side="right")


def _with_bending(patient: Patient, at_rest: Array) -> Array:
    """(S, 6) springs with this lateral stiffness."""
    springs = patient.springs.copy()
    springs[:, BENDING] = at_rest
    return springs


def _factor(scale: Scale, at_rest: Array) -> float:
    """What the laws are to be multiplied by for the size that is stated from outside."""
    if scale.of == "apical_moment":
        return 1.0
    return scale.mean_stiffness_nm_per_rad / float(at_rest.mean())


WAYS: Mapping[str, Callable[[Patient, Scoliosis], Personal]] = {
    "tangent": tangent,
    "linear_regions": linear_regions,
    "linear_per_segment": linear_per_segment,
    "uniform": uniform,
}
"""How each model is personalised, by its name in a study."""

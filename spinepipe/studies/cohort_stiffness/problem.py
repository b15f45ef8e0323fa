"""What is fitted: a specimen's model in one representation, its readings and their weights."""

from collections.abc import Sequence

import numpy as np

from spinepipe.calibrate import MeasuredCase, Problem
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.jobs.cohort_stiffness.tested import TestedCycle
from spinepipe.jobs.inputs import on_bushings, stiffness_of_joints
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.statics import free_parameters
from spinepipe.studies import CohortStiffness
from spinepipe.studies.coordinates import Damping
from spinepipe.units import COORDINATES, ROTATIONS, STIFFNESS_COLUMNS, TRANSLATIONS

LEVEL_REPRESENTATIONS = ("level_ratio", "literature_levels")
"""Representations that start from the published values of each level."""

GROUPING = {
    "per_specimen": "per_specimen",
    "level_ratio": "per_specimen",
    "per_joint": "per_joint",
    "partially_pooled": "per_joint",
}
"""Which joints share an unknown: those that keep their ratios move together."""


def start_stiffness(study: CohortStiffness, cohort: Cohort, representation: str) -> Array:
    """(J, 6) SI: the published stiffness a representation starts from."""
    levels = {}
    if representation in LEVEL_REPRESENTATIONS:
        levels = {joint: study.level_stiffness[joint] for joint in cohort.joint_names}
    return stiffness_of_joints(cohort, study.stiffness, levels)


def stiff_model(
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    stiffness: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> SpineModel:
    """A specimen with this stiffness (J, 6) SI and ``others``, effects besides the bushings.

    Equilibria do not hang on damping.
    """
    damping = np.array(Damping().in_order(), dtype=float)
    return on_bushings(cohort, specimen, frames, stiffness, damping, others)


def calibration_problem(
    study: CohortStiffness,
    cohort: Cohort,
    specimen: str,
    representation: str,
    frames: tuple[Pose, ...],
    tested: Sequence[TestedCycle],
    others: tuple[ScopedEffect, ...] = (),
) -> Problem:
    """The fit of one representation to these tests; ``others`` are effects besides the bushings.

    Raises
    ------
    RefusedModel
        When frames and loads make no model.
    """
    start = start_stiffness(study, cohort, representation)
    model = stiff_model(cohort, specimen, frames, start, others)
    names = [STIFFNESS_COLUMNS[COORDINATES.index(name)] for name in study.free]
    free = free_parameters(model, 0, names, GROUPING[representation])
    reach = np.full(len(free), np.log(study.bound_factor))
    cases = tuple(
        MeasuredCase(one.case, _in_cost(study, one), cohort.zeroed_at_step_0) for one in tested
    )
    shared = study.cost == "measurement_sd" and cohort.zeroed_at_step_0
    weights = _weights(study, cohort)
    return Problem(model, cases, free, weights, -reach, reach, correlated=shared)


def _in_cost(study: CohortStiffness, one: TestedCycle) -> Array:
    """(T, J, 6) readings that enter the cost, NaN elsewhere."""
    readings = one.measured.copy()
    if study.steps == "peak":
        others = np.arange(len(readings)) != one.peak
        readings[others] = np.nan
    if study.cost == "published" and one.loaded != "left_rotation":
        readings[:, :, COORDINATES.index("left_rotation")] = np.nan
    return readings


def _weights(study: CohortStiffness, cohort: Cohort) -> Array:
    """(6,) per mm2 and deg2."""
    if study.cost == "published":
        return np.array([float(name in ROTATIONS) for name in COORDINATES])
    sd = study.measurement_sd or cohort.measurement_sd
    assert sd is not None  # asked for when the study was checked
    of = dict.fromkeys(TRANSLATIONS, sd.translation_mm)
    of |= dict.fromkeys(ROTATIONS, sd.rotation_deg)
    return np.array([of[name] ** -2.0 if name in study.free else 0.0 for name in COORDINATES])

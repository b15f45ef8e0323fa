"""The base that is asked what it lacks: linear joints, alike at all levels or not, or a file's."""

from collections.abc import Sequence

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import spine_model
from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.model.file import ModelFile, effects_for
from spinepipe.statics import FreeParameter, free_parameters
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

BUSHING, PER_SPECIMEN = "linear_bushing", "per_specimen"
DAMPING = np.array([2000.0] * 3 + [10.0] * 3)
"""N s/m and N m s/rad; poses at rest do not hang on it, only the verdict that they are stable."""


def base_model(
    cohort: Cohort,
    readings: SpecimenReadings,
    stiffness: Array,
    file: ModelFile | None,
) -> SpineModel:
    """The model of a specimen where its fit starts: (6,) SI for all joints, or as in the file."""
    joints = cohort.joint_names
    if file is not None:
        effects = effects_for(file, readings.specimen, joints)
    else:
        values = np.tile(stiffness, (len(joints), 1))
        effects = (ScopedEffect(create(BUSHING), tuple(range(len(joints))), values),)
    return spine_model(cohort, readings.specimen, readings.frames, effects, DAMPING)


def base_parameters(
    model: SpineModel, grouping: str, coordinates: Sequence[str]
) -> tuple[FreeParameter, ...]:
    """The stiffnesses that are fitted along with everything: of the coordinates that are read.

    A model file's bushings keep the ratios of their joints: ``per_specimen`` moves them together.
    """
    names = [STIFFNESS_COLUMNS[COORDINATES.index(name)] for name in coordinates]
    bushings = [
        index for index, scoped in enumerate(model.effects) if scoped.effect.name == BUSHING
    ]
    return tuple(
        parameter
        for index in bushings
        for parameter in free_parameters(model, index, names, grouping)
    )


def bushing_stiffness(model: SpineModel) -> Array:
    """(J, 6) N/m and N m/rad, of all linear bushings of each joint together."""
    total = np.zeros((model.n_joints, len(COORDINATES)))
    for scoped in model.effects:
        if scoped.effect.name == BUSHING:
            total[list(scoped.joints)] += scoped.values
    return total

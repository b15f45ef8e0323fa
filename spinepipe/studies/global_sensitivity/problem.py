"""The fit of a spine's stiffness to its measured motion: what is free, how it counts, how far."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spinepipe.calibrate import Problem
from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import measured_cycles
from spinepipe.cohort.specimen import joint_frames
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import free_parameters
from spinepipe.studies.global_sensitivity.settings import SampleCalibration
from spinepipe.studies.global_sensitivity.start import DescribedSpecimen
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS


def problem_of(
    options: SampleCalibration,
    cohort: Cohort,
    start: DescribedSpecimen,
    model: SpineModel,
    cases: Sequence[LoadCase],
    free: Sequence[str],
) -> Problem:
    """One stiffness for all joints in each free coordinate.

    Parameters
    ----------
    start : the specimen as the cohort has it.
    model, cases : its spine and loads, perhaps with other joint frames and load points, into which
        the readings are brought.
    free : coordinates.
    """
    names = [STIFFNESS_COLUMNS[COORDINATES.index(name)] for name in free]
    unknown = free_parameters(model, 0, names, "per_specimen")
    reach = np.full(len(unknown), np.log(options.bound_factor))
    specimen = model.specimen
    nominal = joint_frames(cohort, specimen)
    tested = measured_cycles(cohort, specimen, [test.case for test in start.tests])
    measured = tuple(
        replace(one.in_frames(nominal, model.frames), case=case)
        for case, one in zip(cases, tested, strict=True)
    )
    weights = np.array(options.weights.in_order(), dtype=float)
    return Problem(model, measured, unknown, weights, -reach, reach)

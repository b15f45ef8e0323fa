"""One batch of samples of a specimen: spines and loads made from the drawn values of factors."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.global_sensitivity.drawn import drawn_values
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.start import Start, start_of
from spinepipe.studies.global_sensitivity.vary import Varied, vary
from spinepipe.studies.parts import stiffness_of_joints


@dataclass(frozen=True, eq=False)
class Batch:
    """Samples ``first`` to ``first + count`` of a specimen."""

    first: int
    count: int
    start: Start
    varied: Varied


def batch_of(
    root: str,
    study: GlobalSensitivity,
    cohort: Cohort,
    design: str,
    specimen: str,
    number: int,
    all_steps: bool,
) -> Batch:
    """Batch of that number.

    Parameters
    ----------
    design : the design's file. all_steps : of the tests, or those that the study asks for.
    """
    size = study.batch_size(len(study.chosen_specimens(cohort)))
    first = number * size
    values = drawn_values(design, study, slice(first, first + size))
    start = start_of_specimen(root, study.study, specimen, all_steps, cohort.digest)
    return Batch(first, len(values), start, vary(start, study.changes, values))


@lru_cache(maxsize=16)
def start_of_specimen(root: str, study: str, specimen: str, all_steps: bool, _digest: str) -> Start:
    """The specimen as the cohort has it; ``_digest`` is that of its cohort."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    return start_of(
        cohort,
        specimen,
        stiffness_of_joints(cohort, settings.stiffness, settings.level_stiffness),
        np.array(settings.damping.in_order()),
        settings.chosen_tests(cohort),
        all_steps,
    )

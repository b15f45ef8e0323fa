"""One batch of samples of a specimen: spines and loads made from the drawn values of factors."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.global_sensitivity.sampling import factor_values
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.start import DescribedSpecimen, start_of
from spinepipe.studies.global_sensitivity.tables import EVERY
from spinepipe.studies.global_sensitivity.vary import SpineSamples, vary
from spinepipe.studies.parts import stiffness_of_joints
from spinepipe.tables import read_frame
from spinepipe.units import COORDINATES


@dataclass(frozen=True, eq=False)
class Batch:
    """Samples ``first`` to ``first + count`` of a specimen."""

    first: int
    count: int
    start: DescribedSpecimen
    varied: SpineSamples


def made_of_batches(
    job: str,
    study: GlobalSensitivity,
    cohort: Cohort,
    specimen: str,
    design: str,
    base: Sequence[str],
) -> dict[str, str]:
    """Metadata of the files of a job, which hang on how many samples are in a batch too."""
    size = str(study.batch_size(len(study.chosen_specimens(cohort))))
    read = [mark_of(path) for path in (design, *base)]
    return provenance(job, study, cohort, [specimen], [size, *read])


def batch_of(
    root: str,
    study: GlobalSensitivity,
    cohort: Cohort,
    design: str,
    base: Sequence[str],
    specimen: str,
    number: int,
    all_steps: bool,
) -> Batch:
    """Batch of that number.

    Parameters
    ----------
    design : the design's file. base : that of the specimen's fitted stiffness, or none.
    all_steps : of the tests, or those that the study asks for.
    """
    size = study.batch_size(len(study.chosen_specimens(cohort)))
    first = number * size
    values = factor_values(design, study, slice(first, first + size))
    fitted = tuple(stamp(path) for path in base)
    start = start_of_specimen(root, study.study, specimen, all_steps, cohort.digest, fitted)
    return Batch(first, len(values), start, vary(start, study.changes, values))


@lru_cache(maxsize=16)
def start_of_specimen(
    root: str, study: str, specimen: str, all_steps: bool, _digest: str, fitted: tuple[Stamp, ...]
) -> DescribedSpecimen:
    """The specimen before factors change it; ``_digest`` is that of its cohort."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    given = stiffness_of_joints(cohort, settings.start_stiffness, settings.level_stiffness)
    return start_of(
        cohort,
        specimen,
        base_stiffness(fitted[0][0]) if fitted else given,
        np.array(settings.damping.in_order()),
        settings.chosen_tests(cohort),
        all_steps,
    )


def base_stiffness(path: str) -> Array:
    """(6,) N/m and N m/rad of all joints, from the job's file of ``base_stiffness``."""
    rows = read_frame(path)
    found = rows[rows["joint"] == EVERY].set_index("coordinate")["stiffness"]
    values: Array = found[list(COORDINATES)].to_numpy(float)
    return values

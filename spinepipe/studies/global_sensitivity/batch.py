"""One batch of samples of a specimen: spines and loads made from the drawn values of factors."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pyarrow.parquet as pq

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.sensitivity.global_indices import Design, draw
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


def design_of(study: GlobalSensitivity) -> Design:
    """The design that the study's seed gives."""
    own = study.design
    groups = tuple(factor.group for factor in study.factors)
    return draw(
        own.method,
        tuple(factor.label for factor in study.factors),
        own.samples,
        study.seed,
        groups=groups if any(groups) else None,
        second_order=own.second_order,
        levels=own.levels,
        harmonics=own.harmonics,
        dummy=study.dummy,
    )


def drawn_values(path: str, study: GlobalSensitivity, part: slice) -> Array:
    """(n, D) values of some samples of ``design.parquet``, m, rad or multipliers."""
    result: Array = _values(stamp(path), len(study.factor_names))[part] / np.array(study.per_si)
    return result


@lru_cache(maxsize=2)
def _values(where: Stamp, factors: int) -> Array:
    column = pq.read_table(where[0], columns=["value"]).column("value")
    values: Array = column.to_numpy().reshape(-1, factors)
    return values

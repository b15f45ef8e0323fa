"""Job: the stiffness sets that all specimens are moved with."""

from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.designs import sample_factors
from spinepipe.effects.contract import Array
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.studies import RangeOfMotion
from spinepipe.tables import STIFFNESS_SETS, to_arrow, write
from spinepipe.units import STIFFNESS_COLUMNS


def run(root: str, study: str, output: str) -> None:
    """Write ``stiffness_sets.parquet``."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    joints = cohort.joint_names
    factors = sample_factors(settings.stiffness_spread, 6, settings.stiffness_sets, settings.seed)
    values = (factors[:, None, :] * own_stiffness(settings, cohort)).reshape(-1, 6)
    columns: dict[str, list[Any]] = {
        "stiffness": np.repeat(np.arange(len(factors)), len(joints)).tolist(),
        "joint": list(joints) * len(factors),
        **dict(zip(STIFFNESS_COLUMNS, values.T.tolist(), strict=True)),
    }
    made_by = provenance("range_of_motion.draw_stiffness", settings, cohort)
    write(to_arrow(STIFFNESS_SETS, columns), output, made_by)


def own_stiffness(settings: RangeOfMotion, cohort: Cohort) -> Array:
    """(J, 6) stiffness that the study names, SI."""
    values = np.tile(np.array(settings.stiffness.in_order()), (len(cohort.joint_names), 1))
    for joint, level in settings.level_stiffness.items():
        values[cohort.joint_names.index(joint), 3:] = level.in_order()
    return values

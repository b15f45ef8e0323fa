"""Job: the stiffness sets that all specimens are moved with."""

from typing import Any

import numpy as np

from spinepipe.designs import sample_factors
from spinepipe.jobs.inputs import stiffness_of_joints, study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.studies import RangeOfMotion
from spinepipe.tables import STIFFNESS_SETS, to_arrow, write
from spinepipe.units import STIFFNESS_COLUMNS


def run(root: str, study: str, output: str) -> None:
    """Write ``stiffness_sets.parquet``."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    joints = cohort.joint_names
    factors = sample_factors(settings.stiffness_spread, 6, settings.stiffness_sets, settings.seed)
    own = stiffness_of_joints(cohort, settings.stiffness, settings.level_stiffness)
    values = (factors[:, None, :] * own).reshape(-1, 6)
    columns: dict[str, list[Any]] = {
        "stiffness": np.repeat(np.arange(len(factors)), len(joints)).tolist(),
        "joint": list(joints) * len(factors),
        **dict(zip(STIFFNESS_COLUMNS, values.T.tolist(), strict=True)),
    }
    made_by = provenance("range_of_motion.draw_stiffness", settings, cohort)
    write(to_arrow(STIFFNESS_SETS, columns), output, made_by)

"""True motions of lumbar joints, where a cohort knows them, in the shape of tracked ones."""

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.frames import zxy_angles
from spinepipe.motion.skeleton import BODIES, LUMBAR_JOINTS, body_poses
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.error_metrics import joint_rotations, truths
from spinepipe.studies.tracking.persons import skeleton_in
from spinepipe.studies.tracking.tables import TRACKED
from spinepipe.studies.tracking.tracked_motions import IN_ORDER
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, DISPLAY_PER_SI

TRUTH = "truth"
"""Stands in the column `approach`."""

FEWEST_INSTANTS = 10
"""Of a truth that is a course over time: X-rays of a few postures are none."""


def true_motions(cohort: Cohort) -> pd.DataFrame:
    """Rows of the shape of table `tracked`, lumbar joints turned as in truth, all else at rest.

    Rotations are from the model's neutral pose, as coordinates of joints are, so that a neutral
    pose that was told wrong is in both. Sizes of bones do not count.
    """
    parts = [pd.DataFrame(columns=list(TRACKED.names))]
    lumbar = slice(0, len(LUMBAR_JOINTS))
    for truth in truths(dict(cohort.further)):
        frames = len(truth.time_s)
        if frames < FEWEST_INSTANTS or not truth.turned[:, : len(LUMBAR_JOINTS) + 1].all():
            continue
        skeleton = skeleton_in(cohort, truth.specimen, subject_of(cohort, truth.specimen))
        rest = np.zeros((1, len(BODIES), len(COORDINATES)))
        neutral = joint_rotations(body_poses(skeleton, rest)[0])
        turned = np.swapaxes(neutral, -1, -2) @ joint_rotations(truth.turns)
        q = np.zeros((frames, len(BODIES), len(COORDINATES)))
        q[:, 1:, 3:][:, lumbar] = zxy_angles(turned)[:, lumbar]
        values = (q * DISPLAY_PER_SI).reshape(-1, len(COORDINATES))
        rows = pd.DataFrame(values, columns=list(COORDINATE_COLUMNS))
        rows["frame"] = np.repeat(np.arange(frames), len(BODIES))
        rows["time_s"] = np.repeat(truth.time_s, len(BODIES))
        rows["joint"] = list(IN_ORDER) * frames
        parts.append(rows.assign(specimen=truth.specimen, trial=truth.trial, approach=TRUTH))
    return pd.concat(parts[1:] or parts, ignore_index=True)

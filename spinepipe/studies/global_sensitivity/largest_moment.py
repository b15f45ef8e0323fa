"""Which coordinate a test loads, and at which step most: where figures and findings look."""

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import DRIVEN
from spinepipe.cohort.specimen import joint_frames
from spinepipe.units import MM_PER_M


def largest_moment(
    cohort: Cohort, test: str, specimen: str | None = None
) -> tuple[str, int] | None:
    """Coordinate and step of a test's largest moment about the most cranial joint.

    None where the cohort has no such test, or nothing turns that joint.

    Parameters
    ----------
    specimen : whose loads and joints are looked at; None: the first's.
    """
    if cohort.loads is None or test not in cohort.tests:
        return None
    rows = cohort.loads[cohort.loads["test"] == test]
    specimen = specimen or cohort.specimen_names[0]
    own = rows[rows["specimen"].isin([specimen, "*"])]
    rows = own if len(own) else rows
    rows = rows[rows["cycle"].isna() | (rows["cycle"] == rows["cycle"].min())]
    # (n, 3) N m, ground: each row's moment and that of its force about the most cranial joint
    forces, moments, points_mm = (
        rows[[f"{letter}{axis}_{unit}" for axis in "xyz"]].fillna(0.0).to_numpy(float)
        for letter, unit in (("f", "n"), ("m", "nm"), ("p", "mm"))
    )
    about = joint_frames(cohort, specimen)[-1].origin
    turning = moments + np.cross(points_mm / MM_PER_M - about, forces)
    by_step = pd.DataFrame(turning).groupby(rows["step"].to_numpy()).sum()
    size = np.linalg.norm(by_step, axis=1)
    if not size.any():
        return None
    peak = int(size.argmax())
    return DRIVEN[int(np.abs(by_step.iloc[peak]).argmax())], int(by_step.index[peak])

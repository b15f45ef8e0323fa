"""Job: how far every joint moves in every motion."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.skeleton import JOINTS, PELVIS
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import RANGES
from spinepipe.studies.tracking.tracked_motions import motions
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATE_UNITS, COORDINATES, DISPLAY_PER_SI


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``ranges.parquet``."""
    settings, cohort = study_of_kind(Tracking, root, study)
    rows = list(range_rows(read_frames(tables)["tracked"]))
    write(from_rows(RANGES, rows), output, provenance("ranges", settings, cohort))


def range_rows(tracked: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows by motion, joint and coordinate; one frame has no range, and the pelvis is no joint."""
    for motion in motions(tracked):
        if len(motion.q) < 2:
            continue
        reach = np.ptp(motion.q[:, PELVIS + 1 :], axis=0) * DISPLAY_PER_SI
        for joint, of_joint in zip(JOINTS, reach.tolist(), strict=True):
            for coordinate, value in zip(COORDINATES, of_joint, strict=True):
                unit = COORDINATE_UNITS[coordinate]
                place = {"joint": joint, "coordinate": coordinate}
                yield motion.names | place | {"range": value, "unit": unit}

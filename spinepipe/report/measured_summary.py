"""What was measured of each specimen, test and joint: how far, under what load, how well again."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_response import LoadedCycle, joint_loads
from spinepipe.cohort.measured import measured_specimen
from spinepipe.report.words import plain
from spinepipe.units import COORDINATE_UNITS, COORDINATES, LOAD_UNITS, from_si


def measured_summary(cohort: Cohort, tests: Sequence[str] | None = None) -> pd.DataFrame:
    """Each joint's motion in the coordinate that a test loads; none where none was read of it.

    ``repeats_within`` : largest SD over cycles of one load step, in the unit of the motion.
    """
    rows: list[dict[str, object]] = []
    for name in cohort.specimen_names:
        one = measured_specimen(cohort, str(name), list(tests or cohort.tests))
        for test in one.tests:
            tested = [cycle for cycle in one.tested if cycle.case.test == test]
            at = next((cycle.loaded for cycle in tested if cycle.loaded), None)
            if at is None:
                continue
            cycles = [
                LoadedCycle(
                    one.specimen,
                    cycle.case,
                    one.frames,
                    joint_loads(one.frames, cycle.case),
                    cycle.readings,
                )
                for cycle in tested
            ]
            for joint, label in enumerate(cohort.joint_names):
                rows += _rows(cycles, joint, at, (one.specimen, test, label))
    return pd.DataFrame(rows)


def _rows(
    cycles: Sequence[LoadedCycle], joint: int, at: str, place: tuple[str, str, str]
) -> Iterator[dict[str, object]]:
    c = COORDINATES.index(at)
    motion = [from_si(cycle.from_rest)[:, joint, c] for cycle in cycles]
    read = np.concatenate(motion)
    if not np.isfinite(read).any():
        return
    load = np.concatenate([cycle.loads[:, joint, c] for cycle in cycles])
    low, high = np.nanmin(read), np.nanmax(read)
    alike = len({len(one) for one in motion}) == 1 and len(motion) > 1
    steps = np.stack(motion) if alike else np.empty((0, 0))
    steps = steps[:, np.isfinite(steps).all(axis=0)]
    within = f"{steps.std(axis=0, ddof=1).max():.2g}" if steps.size else "-"
    yield {
        **dict(zip(("specimen", "test", "joint"), place, strict=True)),
        "motion": plain(at),
        "load": f"{load.min():.3g} to {load.max():.3g} {LOAD_UNITS[at]}",
        "range": f"{low:.3g} to {high:.3g} {COORDINATE_UNITS[at]}",
        "cycles": len(cycles),
        "repeats_within": within,
    }

"""Job: how far joints move, over poses, stiffness sets and specimens."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.statistics import ComputationStatus
from spinepipe.studies.range_of_motion.grid import MotionGrid, read_grid
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import EVERY, ROM_SUMMARY
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATE_UNITS, COORDINATES

_QUANTILES = {
    "median": 50.0,
    "low_quartile": 25.0,
    "high_quartile": 75.0,
    "percentile_5": 5.0,
    "percentile_95": 95.0,
}


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``rom_summary.parquet``."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    grid = read_grid(tables[0], settings, cohort)
    made_by = provenance("rom_summary", settings, cohort)
    write(from_rows(ROM_SUMMARY, list(summary_rows(grid))), output, made_by)


def summary_rows(grid: MotionGrid) -> Iterator[dict[str, Any]]:
    """Rows of each specimen and, where there are several, of all of them together."""
    groups = [(name, slice(at, at + 1)) for at, name in enumerate(grid.specimens)]
    if len(groups) > 1:
        groups.append((EVERY, slice(None)))
    for specimen, which in groups:
        for number, test in enumerate(grid.tests):
            asked = grid.asked[which, :, :, number]
            if asked.any():
                motion = grid.motion[which, :, :, number][asked]
                for row in _test_rows(grid, motion, grid.loaded[number]):
                    yield {"specimen": specimen, "test": test, **row}


def _test_rows(grid: MotionGrid, motion: Array, loaded: str) -> Iterator[dict[str, Any]]:
    """Rows of one test; motion (runs, J, 6). A run has an equilibrium of all joints or of none."""
    solved = motion[np.isfinite(motion).all(axis=(1, 2))]
    numbers = {"n": len(solved), "n_without": len(motion) - len(solved)}
    status, message = ComputationStatus.TOO_FEW, "no run has an equilibrium"
    found = np.full((len(_QUANTILES), *solved.shape[1:]), np.nan)
    if len(solved):
        status, message = ComputationStatus.DONE, ""
        found = np.percentile(solved, list(_QUANTILES.values()), axis=0)
    for joint, name in enumerate(grid.joints):
        for at, coordinate in enumerate(COORDINATES):
            yield {
                "joint": name,
                "coordinate": coordinate,
                "role": "loaded" if coordinate == loaded else "coupled",
                "unit": COORDINATE_UNITS[coordinate],
                **numbers,
                **dict(zip(_QUANTILES, found[:, joint, at].tolist(), strict=True)),
                "status": status.value,
                "message": message,
            }

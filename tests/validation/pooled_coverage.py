"""How often the 95 % intervals of partially pooled fits hold the true stiffness, over phantoms.

Fits of one specimen have regions by profile likelihood: `coverage`.
"""

import os
from collections.abc import Iterable, Sequence
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from scipy.stats import t

from spinepipe import cohort as cohorts
from spinepipe.calibration import pool
from spinepipe.statics import with_parameters
from spinepipe.studies.cohort_stiffness.problem import calibration_problem, specimen_tests
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.units import COORDINATES
from tests.generators.phantom import phantom, write
from tests.validation.made_by import made_by

ROOT = Path(__file__).resolve().parents[2]
CENTRE_ERRORS_MM = (0.0, 3.0)
PHANTOMS = 25
Z = 1.959963984540054
STUDY = CohortStiffness(study="pooled_coverage", kind="cohort_stiffness", cohort="phantom")


def table(seeds: Sequence[int] = range(PHANTOMS)) -> pd.DataFrame:
    """Coverage by joint-centre error and coordinate.

    Ends of its 95 % interval by Student's t over phantoms: parameters of one are not independent.
    """
    rows = _every_row(seeds)
    groups = [rows, rows.assign(coordinate="all")]
    keys = ["centre_error_mm", "coordinate"]
    found = []
    for key, part in pd.concat(groups).groupby(keys, sort=False):
        known = part[part["identifiable"]]
        inside = known.groupby("seed")["inside"].mean()
        ends = t.interval(0.95, len(inside) - 1, inside.mean(), inside.sem())
        found.append(
            {
                **dict(zip(keys, key, strict=True)),
                "parameters": len(part),
                "identifiable": len(known),
                "coverage_percent": 100.0 * known["inside"].mean(),
                "low_percent": 100.0 * ends[0],
                "high_percent": 100.0 * ends[1],
                "worst_phantom_percent": 100.0 * inside.min(),
                "median_error_percent": 100.0 * float(known["log_error"].abs().median()),
            }
        )
    return pd.DataFrame(found)


def _every_row(seeds: Sequence[int]) -> pd.DataFrame:
    """Rows of all phantoms; those computed by this very code before are read again."""
    folder = ROOT / "results" / "validation" / "pooled_coverage" / made_by("pool")
    folder.mkdir(parents=True, exist_ok=True)
    wanted = [(seed, error, folder) for error in CENTRE_ERRORS_MM for seed in seeds]
    with get_context("spawn").Pool(min(2, os.cpu_count() or 1)) as workers:
        files = _told(workers.imap(_one, wanted), len(wanted))
    return pd.concat([pd.read_parquet(file) for file in files], ignore_index=True)


def _told(files: Iterable[Path], n: int) -> list[Path]:
    done = []
    for file in files:
        done.append(file)
        if len(done) % 10 == 0:
            print(f"pooled coverage: {len(done)} of {n} phantoms", flush=True)
    return done


def _one(task: tuple[int, float, Path]) -> Path:
    """The rows of one phantom, as a file that appears whole."""
    seed, error, folder = task
    path = folder / f"seed={seed:04d}-centre_error_mm={error:g}.parquet"
    if not path.exists():
        with TemporaryDirectory() as place:
            rows = _rows(seed, error, Path(place) / "phantom")
        partial = path.with_suffix(".part")
        rows.to_parquet(partial)
        partial.rename(path)
    return path


def _rows(seed: int, error: float, folder: Path) -> pd.DataFrame:
    made = phantom(seed, frame_error_mm=error)
    write(made, folder)
    cohort = cohorts.read(folder)
    truth = np.log(made.stiffness[:, :, 3:])
    frames = []
    problems = []
    for name in cohort.specimen_names:
        tests = specimen_tests(STUDY, cohort, name)
        problems.append(
            calibration_problem(STUDY, cohort, name, "per_joint", tests.frames, tests.tested)
        )
    pooled = pool(problems)
    for number, (problem, own) in enumerate(zip(problems, pooled.specimens, strict=True)):
        k = with_parameters(problem.model, problem.free, own.x).effects[0].values
        at = [(p.rows[0], p.column) for p in problem.free]
        off = [np.log(k[j, c]) - truth[number, j, c - 3] for j, c in at]
        frames.append(_frame(at, off, np.sqrt(np.diag(own.covariance))))
    return pd.concat(frames, ignore_index=True).assign(seed=seed, centre_error_mm=error)


def _frame(at: Sequence[tuple[int, int]], off: Sequence[float], error: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "coordinate": [COORDINATES[column] for _, column in at],
            "log_error": off,
            "inside": np.abs(off) <= Z * error,
            "identifiable": error < STUDY.identifiable_below,
        }
    )

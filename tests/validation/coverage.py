"""How often 95 % regions hold the true stiffness, where it can be told and where it cannot.

One specimen of each phantom, in a design: what was loaded, how stiff the joints are, how much was
read. Beside the regions by profile likelihood stand the local error bars, which take the cost for a
parabola in the logarithm.
"""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import t

from spinepipe import cohort as cohorts
from spinepipe.calibration import Fit, Problem, fit
from spinepipe.cohort import Cohort
from spinepipe.statics import with_parameters
from spinepipe.studies.cohort_stiffness.problem import calibration_problem, specimen_tests
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.units import COORDINATES
from tests.generators.phantom import phantom, write
from tests.validation.made_by import made_by

ROOT = Path(__file__).resolve().parents[2]

PHANTOMS = 42
"""Of each design."""

EVERY = 1000
"""Seeds of a design begin at its number times this: no two designs share a phantom."""

TAIL = 0.975

ALL = "all"

PROFILE, IDENTIFIABLE, LOCAL = "profile", "profile, identifiable", "local error bar"


class Design(NamedTuple):
    """What was loaded, how stiff the joints are, how much was read.

    Attributes
    ----------
    made : choices of the phantom. asked : settings of the study. test : the only one that is
        fitted; None for all.
    """

    name: str
    made: dict[str, Any]
    asked: dict[str, Any]
    test: str | None


DESIGNS = (
    Design("all tests", {}, {}, None),
    Design("centres 3 mm off", {"frame_error_mm": 3.0}, {}, None),
    Design("one reading a test", {}, {"steps": "peak", "cycles": "quietest"}, None),
    Design("flexion alone", {}, {}, "flexion"),
    Design("bridged joints", {"bridged": True}, {}, None),
)
"""In flexion alone bending and rotation are loaded by what couples: at most 0.7 of 7.5 N m."""


def table(seeds: Sequence[int] = range(PHANTOMS)) -> pd.DataFrame:
    """Coverage by design and kind of region; ends of its 95 % interval by Student's t over phantoms
    (the stiffnesses of one are not independent)."""
    rows = _every_row(seeds)
    found = []
    for design, part in pd.concat([rows, rows.assign(design=ALL)]).groupby("design", sort=False):
        fitted = part[part["fitted"]]
        for kind, told, inside in (
            (PROFILE, fitted, "in_region"),
            (IDENTIFIABLE, fitted[fitted["identifiable"]], "in_region"),
            (LOCAL, fitted[fitted["local"]], "in_bar"),
        ):
            ends = _ends(told.groupby("seed")[inside].mean())
            found.append(
                {
                    "design": design,
                    "region": kind,
                    "phantoms": part["seed"].nunique(),
                    "stiffnesses": len(part),
                    "told": len(told),
                    "open_above": int(told["open_above"].sum()),
                    "open_below": int(told["open_below"].sum()),
                    "holds_percent": 100.0 * told[inside].mean(),
                    "low_percent": 100.0 * ends[0],
                    "high_percent": 100.0 * ends[1],
                }
            )
    return pd.DataFrame(found)


def _ends(shares: "pd.Series[float]") -> tuple[float, float]:
    """Of the 95 % interval of a mean of shares; where all are one, for so many without a miss."""
    if shares.min() == 1.0:
        return (1.0 - TAIL) ** (1.0 / len(shares)), 1.0
    low, high = t.interval(2.0 * TAIL - 1.0, len(shares) - 1, shares.mean(), shares.sem())
    return max(float(low), 0.0), min(float(high), 1.0)


def _every_row(seeds: Sequence[int]) -> pd.DataFrame:
    """Rows of all phantoms; those computed by this very code before are read again."""
    folder = ROOT / "results" / "validation" / "coverage" / made_by("fit")
    folder.mkdir(parents=True, exist_ok=True)
    frames = []
    for number, design in enumerate(DESIGNS):
        for seed in seeds:
            frames.append(_kept(design, number * EVERY + seed, folder))
        print(f"coverage: {design.name}, {len(seeds)} phantoms", flush=True)
    return pd.concat(frames, ignore_index=True)


def _kept(design: Design, seed: int, folder: Path) -> pd.DataFrame:
    """The rows of one phantom, in a file that appears whole."""
    path = folder / f"seed={seed:05d}.parquet"
    if not path.exists():
        with TemporaryDirectory() as place:
            rows = _rows(design, seed, Path(place) / "phantom")
        partial = path.with_suffix(".part")
        rows.to_parquet(partial)
        partial.rename(path)
    return pd.read_parquet(path)


def _rows(design: Design, seed: int, folder: Path) -> pd.DataFrame:
    made = phantom(seed, **design.made)
    write(made, folder)
    cohort = cohorts.read(folder)
    number = seed % len(cohort.specimen_names)
    study = CohortStiffness.model_validate(
        {"study": "coverage", "kind": "cohort_stiffness", "cohort": "phantom", **design.asked}
    )
    problem = _problem(design, study, cohort, cohort.specimen_names[number])
    found = fit(problem, study.starts, seed, study.identifiable_below, profiled=True)
    rows = pd.DataFrame(_told(problem, found, made.stiffness[number]))
    return rows.assign(design=design.name, seed=seed)


def _problem(design: Design, study: CohortStiffness, cohort: Cohort, specimen: str) -> Problem:
    tests = specimen_tests(study, cohort, specimen)
    chosen = [one for one in tests.tested if design.test in (None, one.case.test)]
    return calibration_problem(study, cohort, specimen, "per_joint", tests.frames, chosen)


def _told(problem: Problem, found: Fit, truth: np.ndarray) -> list[dict[str, Any]]:
    """What is said of each stiffness beside the true one, (J, 6) N/m and N m/rad."""
    values = with_parameters(problem.model, problem.free, found.x).effects[0].values
    limit = float(t.ppf(TAIL, max(found.uncertainty.degrees_of_freedom, 1)))
    rows = []
    for index, unknown in enumerate(problem.free):
        at = unknown.rows[0], unknown.column
        true, value = float(truth[at]), float(values[at])
        error, reach = float(found.uncertainty.standard_error[index]), found.reach(index, value)
        off = float(np.log(value / true))
        rows.append(
            {
                "coordinate": COORDINATES[unknown.column],
                "fitted": reach is not None,
                "open_above": reach is not None and reach.open_above,
                "open_below": reach is not None and reach.open_below,
                "in_region": reach is not None
                and (reach.low is None or reach.low <= true)
                and (reach.high is None or true <= reach.high),
                "identifiable": found.identifiable(index),
                "local": bool(found.uncertainty.identifiable[index]),
                "in_bar": abs(off) <= limit * error,
                "value": value,
                "true": true,
                "log_error": error,
                "low": None if reach is None else reach.low,
                "high": None if reach is None else reach.high,
                "status": found.status.value,
                "message": found.message,
            }
        )
    return rows

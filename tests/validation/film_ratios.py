"""How many true ratios of stiffness lie inside the 95 % intervals of fits to bending films."""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.progress import Progress
from spinepipe.studies.scoliosis.film_fit import FilmFit
from spinepipe.studies.scoliosis.films import FILMS, PATIENTS, weights
from spinepipe.studies.scoliosis.fit_population import fit_population
from spinepipe.studies.scoliosis.personal import geometric_mean, patient_of
from spinepipe.studies.scoliosis.settings import Scoliosis
from tests.generators import ais_films

PHANTOMS = 54

ALL = "all"


def table() -> pd.DataFrame:
    """Coverage by how films were read, of every segment and of all."""
    with tempfile.TemporaryDirectory() as folder:
        return pd.concat([_of_reading(Path(folder), name) for name in ais_films.READINGS])


def _of_reading(folder: Path, name: str) -> pd.DataFrame:
    ais_films.write(folder / name, ais_films.READINGS[name], PHANTOMS)
    cohort = cohorts.read(folder / name, (FILMS, PATIENTS))
    truth = json.loads((folder / name / "truth.json").read_text(encoding="utf-8"))
    print(f"film ratios: {name}, {PHANTOMS} phantoms filmed", flush=True)
    rows = pd.DataFrame(_rows(cohort, truth))
    every = rows.assign(joint=ALL)
    found = pd.concat([rows, every]).groupby("joint", sort=False)
    return pd.DataFrame(
        {
            "cohort": name,
            "joint": list(found.groups),
            "ratios": found.size().to_numpy(),
            "coverage_percent": 100.0 * found["held"].mean().to_numpy(),
            "mean_log_error": found["error"].mean().to_numpy(),
            "rms_log_error": found["error"].apply(_root_mean_square).to_numpy(),
            "rms_half_width": found["half_width"].apply(_root_mean_square).to_numpy(),
        }
    )


def _rows(cohort: Cohort, truth: dict[str, dict[str, list[list[float]]]]) -> Iterator[dict]:
    """A row for each patient and segment."""
    stated = {"place_sd_mm": 0.03, "tilt_sd_deg": 0.03}  # of the exact films' steps
    study = Scoliosis.model_validate(
        {"study": "ratios", "kind": "scoliosis", "cohort": cohort.name, **stated}
    )
    sd = weights(study, cohort)
    learned = fit_population(study, cohort, sd, Progress(lambda line: print(line, flush=True)))
    for name in cohort.specimen_names:
        fit = FilmFit(patient_of(study, cohort, name), sd)
        found = fit.personal(fit.fit(learned.population))
        assert found.ratio_range is not None
        low, high = found.ratio_range
        own = _true_ratio(np.array(truth[name]["stiffness"]))
        for joint, ratio, ends, true in zip(
            cohort.joint_names, found.ratio, zip(low, high, strict=True), own, strict=True
        ):
            yield {
                "joint": joint,
                "held": ends[0] <= true <= ends[1],
                "error": float(np.log(ratio / true)),
                "half_width": 0.5 * float(np.log(ends[1] / ends[0])),
            }


def _true_ratio(stiffness: Array) -> Array:
    """(S,) of stiffness (S, 2) to the left and right at rest, over the geometric mean."""
    both = stiffness.mean(axis=1)
    found: Array = both / geometric_mean(both)
    return found


def _root_mean_square(values: "pd.Series[float]") -> float:
    return float(np.sqrt(np.mean(values**2)))

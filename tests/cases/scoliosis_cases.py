"""Made-up results of studies of scoliotic spines: errors of models are chosen, nothing solved."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.schema import Table
from spinepipe.studies.scoliosis.accuracy import accuracy_rows
from spinepipe.studies.scoliosis.films import FILMS, LEFT, PATIENTS, RIGHT, Film, read_films
from spinepipe.studies.scoliosis.settings import MODELS, Scoliosis
from spinepipe.studies.scoliosis.tables import (
    ACCURACY,
    CURVES,
    DISPLACEMENTS,
    LAWS,
    POSITIONS,
    VARIATION,
)
from spinepipe.tables import from_rows

STUDY = Scoliosis.model_validate({"study": "s", "kind": "scoliosis", "cohort": "ais"})

FREE = dict(zip(MODELS, (43, 43, 2, 15, 0), strict=True))
FITTED = ("tangent_fitted", "linear_regions")
"""Models that are fitted through the simulator."""

ERRORS = dict(zip(MODELS, (0.4, 0.3, 0.6, 0.5, 0.8), strict=True))
"""Error of every rotation, deg, by model."""


@dataclass(frozen=True)
class Size:
    """What a made-up study has.

    Attributes
    ----------
    errors : of rotations on held-out films, deg, by model; fitted films have half of them.
    noise_deg : SD of a vertebra's tilt as it is read; none where nobody knows.
    lost : patients for whom the first model has no pose on their last film.
    """

    patients: int = 3
    positions: tuple[str, ...] = (RIGHT, LEFT, "neutral", "traction")
    errors: Mapping[str, float] = field(default_factory=lambda: ERRORS)
    noise_deg: float | None = 0.7
    lost: int = 0

    @property
    def models(self) -> tuple[str, ...]:
        """Models that it compares."""
        return tuple(self.errors)


SHIPPED = Path(__file__).parents[2] / "config" / "cohorts"


def write_shipped(folder: Path, count: int, name: str = "ais18_phantom") -> None:
    """The first patients of a cohort that comes along, as its generator would write them again.

    To settle a patient's spine takes the generator seconds; that it still writes what comes along
    is asked in `test_accuracy.py`.
    """
    folder.mkdir(parents=True)
    header = (SHIPPED / name / "cohort.yaml").read_text(encoding="utf-8")
    header = header.replace(f"cohort: {name}", f"cohort: {folder.name}")
    (folder / "cohort.yaml").write_text(header, encoding="utf-8")
    kept = {f"p{number:02d}" for number in range(1, count + 1)}
    for file in ("films.csv", "specimens.csv", "patients.csv"):
        first, *rows = (SHIPPED / name / file).read_text(encoding="utf-8").splitlines(keepends=True)
        chosen = [row for row in rows if row.strip().split(",")[0] in kept]
        (folder / file).write_text("".join([first, *chosen]), encoding="utf-8")


@cache
def shipped(patients: int, name: str = "ais18_phantom") -> Cohort:
    """The first patients of a cohort that comes along."""
    with TemporaryDirectory() as folder:
        write_shipped(Path(folder) / "ais", patients, name)
        return cohorts.read(Path(folder) / "ais", (FILMS, PATIENTS))


def mirrored(film: Film) -> Film:
    """Left and right exchanged."""
    return Film(-film.right, film.up, -film.tilt)


def scaled(film: Film, factor: float) -> Film:
    """The same film, so many times as large."""
    return Film(factor * film.right, factor * film.up, film.tilt)


def study_of(size: Size) -> Scoliosis:
    """The study."""
    asked = {"study": "s", "kind": "scoliosis", "cohort": "ais", "models": list(size.models)}
    return Scoliosis.model_validate(asked)


def cohort_of(size: Size) -> Cohort:
    """Its patients, filmed erect and in the positions."""
    whole = shipped(size.patients)
    films = whole.further["films"]
    kept = films[films["position"].isin(["erect", *size.positions])]
    parts = {name: getattr(whole, name) for name in whole.__dataclass_fields__}
    return Cohort(**parts | {"further": {**whole.further, "films": kept}})


def frame(table: Table, rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as the file of a table has them."""
    return from_rows(table, [dict(row) for row in rows]).to_pandas()


def tables_of(size: Size, **changed: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """All tables that a report reads, but statistics; accuracy follows what is changed."""
    if repr(size) not in _MADE:
        _MADE[repr(size)] = _from_jobs(size)
    made = {name: rows.copy() for name, rows in _MADE[repr(size)].items()} | changed
    if "accuracy" in made and not set(changed) & {"positions", "displacements", "curves"}:
        return made
    sd = np.array([np.nan, np.nan if size.noise_deg is None else size.noise_deg])
    parts = (made[name] for name in ("positions", "displacements", "curves"))
    made["accuracy"] = frame(ACCURACY, list(accuracy_rows(*parts, sd)))
    if not changed:
        _MADE[repr(size)]["accuracy"] = made["accuracy"].copy()
    return made


_MADE: dict[str, dict[str, pd.DataFrame]] = {}
"""Tables made before, by what they are of."""


def _from_jobs(size: Size) -> dict[str, pd.DataFrame]:
    cohort = cohort_of(size)
    rows: dict[str, list[dict[str, Any]]] = {t.name: [] for t in _OF_JOBS}
    for number, patient in enumerate(cohort.specimen_names):
        for model in size.models:
            lost = model == size.models[0] and number < size.lost
            for name, found in _rows(size, cohort, patient, number, model, lost).items():
                rows[name] += found
    made = {table.name: frame(table, rows[table.name]) for table in _OF_JOBS}
    return made | {VARIATION.name: frame(VARIATION, variation(size))}


_OF_JOBS = (LAWS, POSITIONS, DISPLACEMENTS, CURVES)


def _by_films(model: str, at: int) -> dict[str, Any]:
    """What films say of a ratio: of the lower ten segments both ends, of two one, of two none."""
    cells = ("films_low", "films_high", "open_below", "open_above", "identifiable")
    if model != "tangent_fitted":
        return dict.fromkeys(cells)
    low, high = at < 12, at < 10
    told = (0.5 if low else None, 2.0 if high else None, not low, not high, low and high)
    return dict(zip(cells, told, strict=True))


def _rows(
    size: Size, cohort: Cohort, patient: str, number: int, model: str, lost: bool
) -> dict[str, list[dict[str, Any]]]:
    """Rows of one patient and model; the k-th patient's errors are 1 + 0.1 k times as large."""
    read = read_films(cohort, patient)
    taken = {"free_parameters": FREE[model], "decided_parameters": float(FREE[model])}
    known = {"specimen": patient, "model": model}
    found: dict[str, list[dict[str, Any]]] = {t.name: [] for t in _OF_JOBS}
    ends = model.startswith("tangent")
    for at, joint in enumerate(cohort.joint_names):
        law = {"at_rest_nm_per_rad": 50.0 + at, "ratio": 1.0, "ratio_low": None}
        law |= {"lower_end_deg": -5.0 if ends else None, "upper_end_deg": 6.0 if ends else None}
        law |= _by_films(model, at)
        law |= {"fit_status": "converged" if model in FITTED else None}
        law |= {"n_optima": 1 if model in FITTED else None}
        law |= {"ratio_high": None, "opposite": at == 13, "constrained": ends and at == 13}
        found["laws"].append(
            known | {"joint": joint} | law | taken | {"scale_from": "apical_moment"}
        )
    for position in size.positions:
        fitted = position in (RIGHT, LEFT)
        error = size.errors[model] * (1.0 + 0.1 * number) * (0.5 if fitted else 1.0)
        gone = lost and position == size.positions[-1]
        status = "unstable" if gone else "converged"
        where = known | {"position": position, "fitted": fitted, "status": status}
        found["positions"].append(where | _position(error, gone) | taken)
        for at, joint in enumerate(cohort.joint_names):
            measured = float(np.rad2deg(read.turned(position)[at]))
            found["displacements"].append(
                where
                | {
                    "joint": joint,
                    "measured_deg": measured,
                    "simulated_deg": None if gone else measured + error * (-1) ** at,
                    "off_right_mm": None if gone else error * (at % 7),
                    "off_up_mm": None if gone else 0.0,
                    "share_of_range": 1.0 / 1.2 if fitted else 0.1 + 0.08 * at,
                    "opposite": at == 13,
                }
            )
        angles = {f"{name}_measured_deg": 30.0 for name in ("cobb", "ferguson")}
        angles |= {
            f"{name}_simulated_deg": None if gone else 30.0 + error for name in ("cobb", "ferguson")
        }
        ends_of = {"lower_vertebra": "L4", "apex_vertebra": "L1", "upper_vertebra": "T11"}
        found["curves"].append(
            where | {"curve": 0, "region": "TL/L", "side": "left"} | ends_of | angles
        )
    return found


def _position(error: float, gone: bool) -> dict[str, Any]:
    names = ("rotation_rmse_deg", "place_rmse_mm", "tilt_rmse_deg")
    pushes = ("push_right_n", "push_up_n", "push_right_bending_nm", "push_extension_nm")
    return {
        **dict.fromkeys(names, None if gone else error),
        **dict.fromkeys(pushes, None if gone else 1.0),
        "missed_mm": 0.0,
        "missed_deg": 0.0,
        "chord_ratio": 1.0,
        "film_scale": 1.0,
        "scale_from": "apical_moment",
        "message": "it <buckles>" if gone else "",
    }


def variation(size: Size) -> list[dict[str, Any]]:
    """One choice changed; the error is least at 30 % on fitted and at 10 % on held-out films."""
    held_out = any(position not in (RIGHT, LEFT) for position in size.positions)
    least = {"fitted": 30.0} | ({"held_out": 10.0} if held_out else {})
    rows = []
    for films, best in least.items():
        known = {"films": films, "n_patients": size.patients, "place_rmse_mm": 1.0}
        for percent in (0.0, 10.0, 20.0, 30.0, 40.0):
            error = None if percent == 0.0 else 0.5 + 0.01 * abs(percent - best)
            moved = None if percent == 0.0 else 0.01 * percent
            kind = {"varied": "enlargement", "value": percent}
            rows.append(known | kind | {"rotation_rmse_deg": error, "moved_deg": moved})
        for factor in (0.1, 1.0, 10.0):
            kind = {"varied": "scale", "value": factor}
            moved = 0.25 * abs(float(np.log10(factor)))
            rows.append(known | kind | {"rotation_rmse_deg": 0.5, "moved_deg": moved})
    return rows

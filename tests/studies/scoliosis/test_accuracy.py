"""Rows of patients and models keep their tables, and errors are pooled as they are told.

Would catch rows of other films or models than asked for, cells that no table takes, ends that are
not where the study has them, and errors pooled over other rows.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scoliosis_cases
from scoliosis_cases import shipped, write_shipped

from spinepipe.studies.scoliosis.accuracy import accuracy_rows
from spinepipe.studies.scoliosis.films import CORNERS, film_sd, read_films, reading_noise
from spinepipe.studies.scoliosis.personalise import rows_of
from spinepipe.studies.scoliosis.population import (
    PopulationEstimate,
    population_rows,
    usual_population,
)
from spinepipe.studies.scoliosis.settings import MODELS
from spinepipe.studies.scoliosis.tables import (
    ACCURACY,
    CURVES,
    DISPLACEMENTS,
    LAWS,
    MEASURES,
    POPULATION,
    POSITIONS,
)
from spinepipe.tables import from_rows
from tests.generators import ais_films

STUDY = scoliosis_cases.STUDY.model_copy(update={"film_regions": False})
"""Regions take longer than all else, and a run of the kind has them (`tests/workflow`)."""

COHORT = shipped(2, "ais18_phantom_sd07")
TABLES = (LAWS, POSITIONS, DISPLACEMENTS, CURVES)


@pytest.fixture(scope="module")
def tables() -> dict[str, pd.DataFrame]:
    usual = PopulationEstimate(usual_population(len(COHORT.joint_names)), 1, 0.0, 0, (), True)
    population = from_rows(
        POPULATION,
        list(population_rows(usual, COHORT.joint_names, film_sd(0.5, 0.5, 0.5, 0.5))),
    )
    read = {"tangent_fitted": (population.to_pandas(),)}
    rows = [
        rows_of(STUDY, COHORT, n, m, *read.get(m, ()))
        for n in COHORT.specimen_names
        for m in MODELS
    ]
    return {
        table.name: from_rows(table, [row for one in rows for row in one[table.name]]).to_pandas()
        for table in TABLES
    }


def test_every_film_but_the_erect_one_is_held_in_every_model(
    tables: dict[str, pd.DataFrame],
) -> None:
    positions = tables["positions"]
    assert len(positions) == 2 * len(MODELS) * 4
    assert set(positions["status"]) <= {"converged", "unreachable", "unstable"}
    fitted = positions[positions["fitted"]]
    assert set(fitted["position"]) == {"right_bending", "left_bending"}
    held = positions[positions["status"] == "converged"]
    assert (held["missed_mm"] < 1e-9).all()


def test_errors_are_pooled_over_films_segments_and_patients(
    tables: dict[str, pd.DataFrame],
) -> None:
    parts = (tables["positions"], tables["displacements"], tables["curves"])
    sd = reading_noise(STUDY, COHORT)
    found = from_rows(ACCURACY, list(accuracy_rows(*parts, sd))).to_pandas()
    assert len(found) == 2 * len(MEASURES) * len(MODELS)
    chosen = found.set_index(["films", "measure", "model"]).loc[("fitted", "rotation", "uniform")]
    rows = tables["displacements"]
    rows = rows[rows["fitted"] & (rows["model"] == "uniform")]
    error = rows["simulated_deg"] - rows["measured_deg"]
    assert chosen["n"] == len(rows) == 2 * 2 * 14
    assert chosen["rmse"] == pytest.approx(float(np.sqrt(np.mean(error**2))))
    own = error.groupby(rows["specimen"]).apply(lambda one: float(np.sqrt(np.mean(one**2))))
    assert chosen["sd_of_patients"] == pytest.approx(own.std(ddof=1))
    # a reading of tilt has an SD of 0.7 deg, two are averaged, and a rotation has four of the means
    assert chosen["reading_noise"] == pytest.approx(2.0 * 0.7 / np.sqrt(2.0), rel=0.15)
    reference = found[found["model"] == "linear_regions"]
    np.testing.assert_allclose(reference["reduction_percent"], 0.0, atol=1e-12)


@dataclass(frozen=True, eq=False)
class Filmed:
    """Films alone, in the form of a cohort."""

    further: dict[str, pd.DataFrame]
    vertebrae: tuple[str, ...]
    specimen_names: tuple[str, ...]


def test_the_floor_is_the_error_that_reading_makes_whoever_tells_its_sd(
    tables: dict[str, pd.DataFrame],
) -> None:
    """40 patients with 15 vertebrae, three readings a film with an SD of 0.7 deg, told and stated.

    Rotations less those without error have four means of readings: 2 x 0.7 / sqrt(3) = 0.81 deg.
    """
    rng, names = np.random.default_rng(8), COHORT.vertebrae
    rows = [
        {"specimen": f"p{patient}", "position": position, "vertebra": name, "repeat": repeat}
        | {"y_mm": 0.0, "z_mm": 30.0 * at, "orientation_deg": float(rng.normal(0.0, 0.7))}
        for patient in range(40)
        for position in ("erect", "right_bending", "left_bending")
        for repeat in (1, 2, 3)
        for at, name in enumerate(names)
    ]
    film = pd.DataFrame(rows).assign(observer=None, **dict.fromkeys(CORNERS))
    patients = tuple(film["specimen"].unique())
    read: Any = Filmed({"films": film}, names, patients)
    errors = [
        np.rad2deg(read_films(read, name).turned(position))
        for name in read.specimen_names
        for position in ("right_bending", "left_bending")
    ]
    true = float(np.sqrt(np.mean(np.square(errors))))
    assert true == pytest.approx(2.0 * 0.7 / np.sqrt(3.0), rel=0.05)
    once: Any = Filmed({"films": film[film["repeat"] == 1]}, names, patients)
    stated = STUDY.model_copy(update={"tilt_sd_deg": 0.7 / np.sqrt(3.0)})
    parts = (tables["positions"], tables["displacements"], tables["curves"])
    for told in (reading_noise(STUDY, read), reading_noise(stated, once)):
        floors = {row["measure"]: row["reading_noise"] for row in accuracy_rows(*parts, told)}
        assert floors["rotation"] == pytest.approx(true, rel=0.05)
        # of two: a tilt less that of the lowest vertebra, an angle between two of them
        assert floors["tilt"] == floors["cobb"] == pytest.approx(true / np.sqrt(2.0), rel=0.05)


def test_a_pose_that_is_not_there_takes_the_patient_out(
    tables: dict[str, pd.DataFrame],
) -> None:
    parts = {name: tables[name].copy() for name in ("positions", "displacements", "curves")}
    rows = parts["displacements"]
    lost = (rows["specimen"] == "p01") & (rows["model"] == "uniform") & rows["fitted"]
    rows.loc[lost & (rows["position"] == "right_bending"), "simulated_deg"] = np.nan
    found = list(accuracy_rows(*parts.values(), np.array([np.nan, np.nan])))
    chosen = next(
        row
        for row in found
        if (row["films"], row["measure"], row["model"]) == ("fitted", "rotation", "uniform")
    )
    assert (chosen["n_patients"], chosen["n"]) == (1, 28)
    assert chosen["sd_of_patients"] is None
    assert chosen["reading_noise"] is None


def test_the_cohort_that_comes_along_is_the_generators(tmp_path: Path) -> None:
    ais_films.write(tmp_path / "made", ais_films.READINGS["ais18_phantom_sd19"], count=1)
    write_shipped(tmp_path / "ais", 1, "ais18_phantom_sd19")
    for file in ("films.csv", "specimens.csv", "patients.csv"):
        made, shipped = ((tmp_path / name / file).read_bytes() for name in ("made", "ais"))
        assert made == shipped, file

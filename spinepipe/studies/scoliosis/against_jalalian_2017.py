"""Job: the numbers of Jalalian et al. 2017 beside those of a phantom made after its Table 1.

doi 10.1007/s11517-016-1576-8.
"""

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.jobs.against import write_against
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.curve_angles import main_curve
from spinepipe.studies.scoliosis.films import ERECT, read_films
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import AGAINST_JALALIAN_2017
from spinepipe.tables import read_frames
from spinepipe.units import DEG_PER_RAD


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_jalalian_2017.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    frames = {**read_frames(tables), **facts(cohort)}
    write_against(AGAINST_JALALIAN_2017, frames, asked_of(settings), settings, cohort, output)


def asked_of(settings: Scoliosis) -> dict[str, float | None]:
    """Settings that the paper has numbers for."""
    sized = settings.scale.of == "apical_moment"
    return {
        "enlargement": settings.enlargement,
        "apical_moment_nm": settings.scale.apical_moment_nm if sized else None,
    }


def facts(cohort: Cohort) -> dict[str, pd.DataFrame]:
    """Patients and films of the cohort's folder, and Cobb angles on the erect films."""
    erect = {name: read_films(cohort, name).films[ERECT] for name in cohort.specimen_names}
    angles = [DEG_PER_RAD * main_curve(film).cobb(film) for film in erect.values()]
    measured = pd.DataFrame({"specimen": list(erect), "cobb_deg": angles})
    return {**cohort.further, "erect": measured}

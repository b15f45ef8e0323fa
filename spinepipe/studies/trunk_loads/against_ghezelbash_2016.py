"""Job: the numbers of Ghezelbash et al. 2016 beside those of a run on its volunteers.

doi 10.1007/s10237-016-0792-3.
"""

from spinepipe.jobs.against import write_against
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.muscles.scaling import DIAPHRAGM_AHEAD_M
from spinepipe.muscles.subject import CM_PER_M, REFERENCE
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import AGAINST_GHEZELBASH_2016
from spinepipe.tables import read_frames


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_ghezelbash_2016.parquet``."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    # persons and tasks of the cohort's folder, under names that no table of results has
    files = {"subjects": "subjects", "asked": "tasks"}
    further = cohort.further
    facts = {name: further[file] for name, file in files.items() if file in further}
    frames = {**read_frames(tables), **facts}
    write_against(AGAINST_GHEZELBASH_2016, frames, asked_of(settings), settings, cohort, output)


def asked_of(settings: TrunkLoads) -> dict[str, float]:
    """Settings and numbers of this study that the paper has numbers for, in the paper's units."""
    return {
        "t11t12_bending_percent": 100.0 * (settings.passive.t11t12_bending_factor - 1.0),
        "joints_behind_mm": settings.passive.joints_behind_mm,
        "change_percent": 100.0 * settings.solving.change,
        "pressure_ahead_cm": CM_PER_M * DIAPHRAGM_AHEAD_M,
        "reference_male": float(REFERENCE.sex == "male"),
        "reference_age_years": REFERENCE.age_years,
        "reference_height_cm": CM_PER_M * REFERENCE.height_m,
        "reference_mass_kg": REFERENCE.mass_kg,
    }

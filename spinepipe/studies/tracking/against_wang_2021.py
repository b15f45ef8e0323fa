"""Job: the numbers of Wang et al. 2021 beside those of a run (doi 10.1007/s10439-021-02774-3)."""

from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.jobs.against import write_against
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.joint_tables import SIDES
from spinepipe.motion.passive import passive_elements
from spinepipe.motion.skeleton import JOINTS
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import AGAINST_WANG_2021
from spinepipe.studies.tracking.trials import PASSIVE
from spinepipe.tables import read_frames
from spinepipe.units import COORDINATES


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_wang_2021.parquet``."""
    settings, cohort = study_of_kind(Tracking, root, study)
    frames = {**read_frames(tables), **facts(cohort)}
    write_against(AGAINST_WANG_2021, frames, paper_settings(settings), settings, cohort, output)


def facts(cohort: Cohort) -> dict[str, pd.DataFrame]:
    """Rows of the cohort's folder, and as `generic` the elements that calibrations begin with."""
    elements = passive_elements(cohort.further.get(PASSIVE.stem), f"{cohort.name}/{PASSIVE.file}")
    rows = [
        (
            *(JOINTS[place[0]], COORDINATES[place[1]], SIDES[place[2]]),
            *(float(values[place]) for values in (elements.a, elements.b, elements.lower)),
        )
        for place in np.ndindex(*elements.a.shape)
    ]
    generic = pd.DataFrame(rows, columns=["joint", "coordinate", "side", "a", "b", "lower"])
    names = (name for name in ("subjects", "trials", "marker_set") if name in cohort.further)
    return {**{name: cohort.further[name] for name in names}, "generic": generic}


def paper_settings(settings: Tracking) -> dict[str, Any]:
    """Settings that the paper has numbers for."""
    return {
        "rom_bound_increase": settings.bounds.increased_by_percent,
        "times_the_range": settings.bounds.times,
        "max_marker_deviation": settings.largest_deviation_mm,
        "intervals": settings.intervals,
    }

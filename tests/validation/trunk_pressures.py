"""Computed beside measured disc pressures, for two geometries and two places of the hands.

The geometry of the package that the product reads, and that of the generic male of Bruno 2015 in
the shared data, where it is there; hands of the lift with a round back where the arms of a
published model put them, and hanging below the shoulders.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import read
from spinepipe.muscles.folder import SpecimenTables, source_of_folder
from spinepipe.muscles.muscle_equilibrium import solve_task
from spinepipe.muscles.trunk import Trunk
from spinepipe.progress import Progress
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.forms import TASKS
from spinepipe.studies.trunk_loads.persons import solver_options, source_of
from spinepipe.studies.trunk_loads.settings import TrunkLoads, VolunteerSettings
from spinepipe.studies.trunk_loads.tune import rows_of, volunteer_of

ROOT = Path(__file__).resolve().parents[2]
MALE = ROOT.parent / "shared" / "data" / "thoracolumbar_male"
MALE_STRESS_PA = 1.0e6
LIFT = "flexion_70_with_load"

SETTINGS = TrunkLoads(
    study="trunk_volunteers",
    kind="trunk_loads",
    cohort="trunk_volunteers",
    volunteer=VolunteerSettings(specimen="volunteer"),
)


def table() -> pd.DataFrame:
    """One row per geometry, place of the hands and tier."""
    return pd.DataFrame(list(_rows()))


def male() -> Trunk | None:
    """The generic male's trunk, None where the shared data are not there."""
    if not MALE.is_dir():
        return None
    frames = (pd.read_csv(MALE / f"{name}.csv") for name in _FILES)
    return source_of_folder("thoracolumbar_male", SpecimenTables(*frames), MALE_STRESS_PA).trunk


_FILES = ("muscles", "muscle_parameters", "joints", "body_frames")


def _rows() -> Iterator[dict[str, Any]]:
    cohort = read(ROOT / "config" / "cohorts" / "trunk_volunteers", (SUBJECTS, TASKS))
    sources = {"myo_sim": source_of(SETTINGS, cohort).trunk, "thoracolumbar_male": male()}
    for geometry, source in sources.items():
        if source is None:
            continue
        for hands in ("as the arms of a model", "hanging"):
            who = volunteer_of(SETTINGS, cohort, source)
            if hands == "hanging":
                lift = who.tasks[LIFT]
                hung = replace(lift, hands=replace(lift.hands, at=None))
                who = replace(who, tasks={**who.tasks, LIFT: hung})
            person, options = who.stands.person, solver_options(SETTINGS)
            slack = {
                name: float(np.abs(solve_task(person, task, options).found.slack).max())
                for name, task in who.tasks.items()
                if task.number in range(1, 10)
            }
            most = max(slack, key=lambda name: slack[name])
            for row in rows_of(who, Progress())["agreement"]:
                yield {
                    "geometry": geometry,
                    "hands_of_the_lift": hands,
                    "tier": row["tier"],
                    "r": row["r"],
                    "r_low": row["r_low"],
                    "rmse_mpa": row["rmse_mpa"],
                    "goal_mpa": row["goal_rmse_mpa"],
                    "counted_not_held": row["n_not_held"],
                    "largest_slack_nm": slack[most],
                    "at": most,
                }

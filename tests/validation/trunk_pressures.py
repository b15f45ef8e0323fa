"""Computed beside measured disc pressures, for two geometries and two places of the hands.

The geometry of the package that the product reads, and that of the generic male of Bruno 2015 in
the shared data, where it is there; hands of the lift with a round back hanging below the shoulders,
as far ahead of L5S1 as in a lift that was measured, and where the arms of a published model put
them. Tasks may use 1.0 MPa; the least stress that holds them all is told.
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
from spinepipe.muscles.person import Person
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import Trunk
from spinepipe.progress import Progress
from spinepipe.status import Balanced
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.forms import TASKS
from spinepipe.studies.trunk_loads.persons import solver_options, source_of
from spinepipe.studies.trunk_loads.settings import NOMINAL, TrunkLoads, VolunteerSettings
from spinepipe.studies.trunk_loads.tune import Volunteer, rows_of, volunteer_of

ROOT = Path(__file__).resolve().parents[2]
MALE = ROOT.parent / "shared" / "data" / "thoracolumbar_male"
MALE_STRESS_PA = 1.0e6
LIFT = "flexion_70_with_load"

ALLOWED_MPA = 1.0
HANDS_MM: dict[str, tuple[float, float, float] | None] = {
    "hanging": None,
    "as in a measured lift": (460.0, -250.0, 0.0),
    "as the arms of a model": (109.0, -353.0, 0.0),
}
SAMPLES, SEED = 64, 1
"""Of persons, postures and discs, for the intervals of the untuned tier."""

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
        for hands, place in HANDS_MM.items():
            who = _with_hands(volunteer_of(SETTINGS, cohort, source), place)
            nine = [one.task for one in who.beside]
            stress = {name: least_stress_mpa(who.stands.person, who.tasks[name]) for name in nine}
            most = max(stress, key=lambda name: stress[name])
            inside = {"untuned": inside_95(who)}
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
                    "most_stress_mpa": stress[most],
                    "at": most,
                    "inside_95": inside.get(row["tier"], ""),
                }


def _with_hands(who: Volunteer, mm: tuple[float, float, float] | None) -> Volunteer:
    """All tasks at the stress that is allowed, and the hands of the lift there."""
    tasks = {name: replace(one, stress_pa=1e6 * ALLOWED_MPA) for name, one in who.tasks.items()}
    at = None if mm is None else 1e-3 * np.array(mm)
    tasks[LIFT] = replace(tasks[LIFT], hands=replace(tasks[LIFT].hands, at=at))
    return replace(who, tasks=tasks)


def least_stress_mpa(person: Person, task: Task) -> float:
    """Largest stress that has to be allowed for a task to be held, to 0.05 MPa; infinite beyond
    2."""
    options = solver_options(SETTINGS)
    for mpa in np.arange(0.05, 2.01, 0.05):
        found = solve_task(person, replace(task, stress_pa=1e6 * mpa), options)
        if found.status is Balanced.CONVERGED:
            return float(mpa)
    return float("inf")


def inside_95(who: Volunteer) -> str:
    """How many measured pressures lie in the middle 95 % of samples; what is not held lies above
    all others."""
    drawn = np.random.default_rng(SEED)
    found: dict[str, list[float]] = {one.task: [] for one in who.beside}
    for _ in range(SAMPLES):
        values = {
            name: float(NOMINAL[name] + spread.sd * drawn.standard_normal())
            for name, spread in SETTINGS.uncertain.factors.items()
        }
        for task, (mpa, status) in who.computed(values).items():
            held = mpa is not None and status == Balanced.CONVERGED
            found[task].append(mpa if held and mpa is not None else np.inf)
    inside = 0
    for one in who.beside:
        low, high = np.quantile(found[one.task], [0.025, 0.975], method="nearest")
        inside += bool(low <= one.mpa <= high)
    return f"{inside} of {len(who.beside)}"

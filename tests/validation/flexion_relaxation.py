"""How much of the moment in flexion is passive, and how far the extensors fall silent.

Passive: joints, what lies behind them, and stretched muscles, over the moment of all that is above.
Active: moment of erector spinae and multifidus beyond what stretching makes.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import read
from spinepipe.effects.contract import Array
from spinepipe.muscles.muscle_equilibrium import solve_task
from spinepipe.muscles.person import Person
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import LEVELS
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.forms import TASKS
from spinepipe.studies.trunk_loads.persons import solver_options, source_of
from spinepipe.studies.trunk_loads.tune import volunteer_of
from tests.validation.trunk_pressures import ROOT, SETTINGS

EXTENSORS = ("longissimus", "iliocostalis", "multifidus")
HALFWAY, END = ("forward_50", "forward_60"), "full_flexion"
HEAD = (
    "The volunteer bends forwards to 107.3 deg. share: passive moment over that of all above the "
    "joint (goal: at least 0.8 at the end, little at 50 deg). active: moment of extensors that is "
    "no stretch, N m. relaxation: active at the end over the mean of 50 and 60 deg."
)


def table() -> pd.DataFrame:
    """One row per level."""
    return pd.DataFrame(list(_rows()))


def _rows() -> Iterator[dict[str, Any]]:
    cohort = read(ROOT / "config" / "cohorts" / "trunk_volunteers", (SUBJECTS, TASKS))
    who = volunteer_of(SETTINGS, cohort, source_of(SETTINGS, cohort).trunk)
    shares, active = {}, {}
    for name in (*HALFWAY, END):
        shares[name], active[name] = moments(who.stands.person, who.tasks[name])
    for level, joint in enumerate(LEVELS):
        halfway = float(np.mean([active[name][level] for name in HALFWAY]))
        yield {
            "at": joint,
            "share_50": shares["forward_50"][level],
            "share_60": shares["forward_60"][level],
            "share_end": shares[END][level],
            "active_50_60_nm": halfway,
            "active_end_nm": active[END][level],
            "relaxation": active[END][level] / halfway,
        }


def moments(person: Person, task: Task) -> tuple[Array, Array]:
    """(7,) passive share, and (7,) N m of active extensors, disc axes."""
    found = solve_task(person, replace(task, stress_pa=1e6), solver_options(SETTINGS))
    arms = found.demand.arms.reshape(len(LEVELS), 3, -1)
    along = np.einsum("ki,kim->km", found.poses.discs[:, :, 2], arms)
    whole = found.joint_moments[:, 2] + along @ found.found.forces
    passive = found.joint_moments[:, 2] + along @ found.stretched
    groups = person.lines.trunk.muscles.groups
    extends = np.array([any(part in group for part in EXTENSORS) for group in groups])
    active = along[:, extends] @ (found.found.forces - found.stretched)[extends]
    return passive / whole, active

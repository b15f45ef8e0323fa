"""Job: what four wrong simplifications cost one person."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.muscles.muscle_equilibrium import SolvedTask, SolverOptions, acted_on, held
from spinepipe.muscles.person import Person
from spinepipe.muscles.task import Task
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.trunk_loads.extra_inputs import marks_of
from spinepipe.studies.trunk_loads.persons import how_of, regressions_of, source_of, standing
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.rows import Row, TaskOutcome, task_row
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import SIMPLIFICATIONS, SIMPLIFIED
from spinepipe.tables import from_rows, write

SHOWN = ("l4l5_pressure_mpa", "l4l5_compression_n", "l5s1_compression_n", "status", "message")


def run(root: str, study: str, specimen: str, output: str) -> None:
    """Write the rows of a person."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    rows = list(rows_of(settings, cohort, specimen))
    write(
        from_rows(SIMPLIFIED, rows),
        output,
        provenance("simplify", settings, cohort, [specimen], marks_of(settings, cohort)),
    )


def rows_of(settings: TrunkLoads, cohort: Cohort, specimen: str) -> Iterator[Row]:
    """Each task in the whole model and in each wrong one."""
    source, who = source_of(settings, cohort).trunk, subject_of(cohort, specimen)
    regressions = regressions_of(settings, cohort.folder)
    stood = standing(settings, source, who, regressions)
    whole, at = stood.person, stood.upright  # no muscle has a say in how somebody stands
    straight = standing(settings, source, who, regressions, wrapping=False, stood=at).person
    tasks = read_tasks(cohort, settings.trunk_angle)
    for name in settings.simplified_tasks or tuple(tasks):
        for simplification in SIMPLIFICATIONS:
            person = straight if simplification == "no_wrapping" else whole
            how = _how(how_of(settings), simplification)
            outcome = _outcome(person, tasks[name], how)
            told = task_row(outcome)
            yield {
                "specimen": specimen,
                "task": name,
                "simplification": simplification,
                "imbalance_nm": imbalance(whole, tasks[name], outcome.held),
                **{column: told.get(column) for column in SHOWN},
            }


def _how(how: SolverOptions, simplification: str) -> SolverOptions:
    changed = {
        "no_feedback": {"feedback": False},
        "rigid_translations": {"translates": False},
        "only_l5s1": {"lowest_alone": True},
    }
    return replace(how, **changed.get(simplification, {}))


def _outcome(person: Person, task: Task, how: SolverOptions) -> TaskOutcome:
    try:
        found = held(person, task, how)
    except ValueError as why:
        return TaskOutcome(person, task, None, str(why))
    return TaskOutcome(person, task, found, found.message)


def imbalance(person: Person, task: Task, found: SolvedTask | None) -> float | None:
    """N m, largest moment out of balance when forces act on the whole model, where it comes to."""
    if found is None:
        return None
    return float(np.abs(acted_on(person, task, found.found.forces).found.slack).max())

"""Job: what four wrong simplifications cost one person."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.muscles.muscle_equilibrium import solve_with_forces
from spinepipe.studies.trunk_loads.persons import UprightPerson, extra_inputs, solver_options
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.rows import Row, outcome_of, task_row
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import SIMPLIFICATIONS, SIMPLIFIED
from spinepipe.tables import from_rows, write

SHOWN = ("l4l5_pressure_mpa", "l4l5_compression_n", "l5s1_compression_n", "status", "message")

_OPTIONS = {
    "no_feedback": {"feedback": False},
    "rigid_translations": {"translates": False},
    "only_l5s1": {"lowest_alone": True},
}
"""How the solver simplifies; that muscles run straight is another person."""


def run(root: str, study: str, specimen: str, output: str) -> None:
    """Write the rows of a person."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    rows = list(rows_of(settings, cohort, specimen))
    made_by = provenance("simplify", settings, cohort, [specimen], extra_inputs(settings, cohort))
    write(from_rows(SIMPLIFIED, rows), output, made_by)


def rows_of(settings: TrunkLoads, cohort: Cohort, specimen: str) -> Iterator[Row]:
    """Each task in the whole model and in each wrong one."""
    stands = UprightPerson.of_cohort(settings, cohort, specimen)
    whole, straight = stands.person, stands.varied({}, wrapping=False)
    tasks = read_tasks(cohort, settings.trunk_angle)
    for name in settings.simplified_tasks or tuple(tasks):
        for simplification in SIMPLIFICATIONS:
            person = straight if simplification == "no_wrapping" else whole
            options = replace(solver_options(settings), **_OPTIONS.get(simplification, {}))
            outcome = outcome_of(person, tasks[name], options)
            # moment out of balance when these forces act on the whole model, where that comes to
            imbalance = None
            if outcome.solved is not None:
                there = solve_with_forces(whole, tasks[name], outcome.solved.found.forces)
                imbalance = float(np.abs(there.found.slack).max())
            found = task_row(outcome)
            yield {
                "specimen": specimen,
                "task": name,
                "simplification": simplification,
                "imbalance_nm": imbalance,
                **{column: found.get(column) for column in SHOWN},
            }

"""Job: one person in all tasks."""

import sys
from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.muscles.masses import ARM, shares
from spinepipe.muscles.person import Person
from spinepipe.muscles.scaling import applied_ratios
from spinepipe.muscles.stability import least_stable, smallest_eigenvalue
from spinepipe.muscles.strength import above_asked, capacity_left, hold_task, load_factor
from spinepipe.muscles.subject import REFERENCE
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import BODIES
from spinepipe.muscles.upright import Upright
from spinepipe.progress import Progress
from spinepipe.studies.trunk_loads.persons import (
    UprightPerson,
    extra_inputs,
    solver_options,
    source_of,
)
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.rows import (
    Row,
    TaskOutcome,
    iteration_rows,
    level_rows,
    muscle_rows,
    path_rows,
    task_row,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import (
    ITERATIONS,
    LEVELS_TABLE,
    MASSES,
    MUSCLES,
    PATHS,
    REMARKS,
    SCALING,
    TASKS,
    UPRIGHT,
)
from spinepipe.tables import from_rows, write
from spinepipe.units import DEG_PER_RAD, MM_PER_M

PER_PERSON = (TASKS, LEVELS_TABLE, MUSCLES, PATHS, ITERATIONS, UPRIGHT, MASSES, SCALING, REMARKS)
"""Tables that this job makes."""

NO_TONE = "no tone that can be held makes it stable; shown without"


def run(root: str, study: str, specimen: str, **paths: str) -> None:
    """Write the rows of a person, a file for each table."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    progress = Progress(lambda line: print(f"{study}: {line}", file=sys.stderr, flush=True))
    rows = rows_of(settings, cohort, specimen, progress)
    made_by = provenance("hold", settings, cohort, [specimen], extra_inputs(settings, cohort))
    for table in PER_PERSON:
        whole = [{c.name: row.get(c.name) for c in table.columns} for row in rows[table.name]]
        write(from_rows(table, whole), paths[table.name], made_by)


def rows_of(
    settings: TrunkLoads, cohort: Cohort, specimen: str, progress: Progress
) -> dict[str, list[Row]]:
    """Rows of each table, by its name."""
    stands = UprightPerson.of_cohort(settings, cohort, specimen)
    person, known = stands.person, {"specimen": specimen}
    ratios = applied_ratios(stands.source, stands.subject, REFERENCE, stands.regressions)
    remarks = source_of(settings, cohort).remarks
    found: dict[str, list[Row]] = {table.name: [] for table in PER_PERSON}
    found["upright"] = [known | row for row in _upright_rows(stands.upright)]
    found["masses"] = [known | row for row in _mass_rows(person)]
    found["scaling"] = [known | dict(vars(ratio)) for ratio in ratios]
    found["remarks"] = [known | {"remark": remark} for remark in remarks]
    tasks = read_tasks(cohort, settings.trunk_angle)
    drawn = settings.drawn_tasks or tuple(tasks)[:1]
    for name in progress.through(list(tasks), f"{specimen}: tasks"):
        try:
            outcome = _outcome(settings, person, tasks[name])
        except ValueError as why:
            outcome = TaskOutcome(person, tasks[name], None, str(why))
        place = known | {"task": name}
        found["tasks"].append(place | task_row(outcome))
        found["levels"] += [place | row for row in level_rows(outcome)]
        found["muscles"] += [place | row for row in muscle_rows(outcome)]
        found["iterations"] += [place | row for row in iteration_rows(outcome)]
        if name in drawn:
            found["paths"] += [place | row for row in path_rows(outcome)]
    return found


def _outcome(settings: TrunkLoads, person: Person, task: Task) -> TaskOutcome:
    """A task with its stability and strength; raises where it cannot be posed."""
    options, gain = solver_options(settings, twice=True), settings.solving.stiffness_gain
    message, tone = "", task.tone_share if task.tone == "stated" else 0.0
    held = hold_task(
        person, task, options, least="sought" if settings.solving.strength else "untold"
    )
    found = held.solved
    if task.tone == "stable":
        least = least_stable(held.person, held.task, options, gain)
        message = "" if least else NO_TONE
        if least:
            found, tone = above_asked(least.solved, task, held.task), least.tone
    stable = smallest_eigenvalue(held.person, found, gain) >= 0.0
    asked, at_asked = settings.solving.strength, found if held.task is task else held.asked
    return TaskOutcome(
        person,
        task,
        found,
        "; ".join(part for part in (found.message, message) if part),
        tone,
        stable,
        load_factor(at_asked) if asked else None,
        capacity_left(at_asked) if asked else None,
        held,
    )


def _upright_rows(found: Upright) -> Iterator[Row]:
    for number, body in enumerate(BODIES):
        below = number - 1
        yield {
            "body": body,
            "start_deg": DEG_PER_RAD * float(found.start[number]),
            "upright_deg": DEG_PER_RAD * float(found.angles[number]),
            "bound": bool(found.at_bound[number]),
            "moment_before_nm": float(found.before[below]) if number else None,
            "moment_after_nm": float(found.after[below]) if number else None,
        }


def _mass_rows(person: Person) -> Iterator[Row]:
    """Slices and head with their places, arms and what is left without."""
    subject, origin = person.subject, person.chain.centres[0]
    for mass in person.masses:
        x, y, z = (MM_PER_M * (mass.at - origin)).tolist()
        yield {
            "part": mass.name,
            "carried_by": BODIES[mass.body],
            "mass_kg": float(mass.kg),
            "share": float(mass.kg / subject.mass_kg),
            **{"x_mm": x, "y_mm": y, "z_mm": z},
        }
    arms = {f"both {segment.replace('_', ' ')}s" for segment in ARM}
    for share in shares(subject):
        if share.part in arms or not share.carried:
            yield {
                "part": share.part,
                "carried_by": BODIES[-1] if share.carried else None,
                "mass_kg": float(share.percent / 100.0 * subject.mass_kg),
                "share": share.percent / 100.0,
            }

"""Job: batches of samples of one person: all sampled tasks, inputs as drawn."""

import sys
from collections.abc import Iterator, Mapping

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.muscles.muscle_equilibrium import held
from spinepipe.progress import Progress
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.trunk_loads.extra_inputs import marks_of
from spinepipe.studies.trunk_loads.persons import (
    changed_task,
    how_of,
    regressions_of,
    source_of,
    standing,
)
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.rows import Row, TaskOutcome, task_row
from spinepipe.studies.trunk_loads.sampling import drawn, of_batch
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import QUANTITIES, RESPONSES
from spinepipe.tables import from_rows, read_frame, write


def run(
    root: str, study: str, specimen: str, design: str, parts: Mapping[str, Mapping[str, str]]
) -> None:
    """Write the rows of batches, a file each."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    read = [*marks_of(settings, cohort), mark_of(design)]
    made_by = provenance("respond", settings, cohort, [specimen], read)
    progress = Progress(lambda line: print(f"{study}: {line}", file=sys.stderr, flush=True))
    for path, place in parts.items():
        samples = of_batch(settings, int(place["batch"]))
        numbered = dict(zip(samples, drawn(read_frame(design), samples), strict=True))
        rows = list(rows_of(settings, cohort, specimen, numbered, progress))
        write(from_rows(RESPONSES, rows), path, made_by)


def rows_of(
    settings: TrunkLoads,
    cohort: Cohort,
    specimen: str,
    samples: Mapping[int, Mapping[str, float]],
    progress: Progress,
) -> Iterator[Row]:
    """Rows of table responses."""
    source, who = source_of(settings, cohort).trunk, subject_of(cohort, specimen)
    regressions, how = regressions_of(settings, cohort.folder), how_of(settings)
    tasks = read_tasks(cohort, settings.trunk_angle)
    stood = standing(settings, source, who, regressions).upright
    for sample in progress.through(list(samples), f"{specimen}: samples"):
        values = samples[sample]
        person = standing(settings, source, who, regressions, values, stood=stood).person
        for name in settings.uncertain.tasks:
            task = changed_task(tasks[name], values)
            try:
                found = held(person, task, how)
                outcome = TaskOutcome(person, task, found, found.message)
            except ValueError as why:
                outcome = TaskOutcome(person, task, None, str(why))
            told = task_row(outcome)
            yield {
                "specimen": specimen,
                "task": name,
                "sample": sample,
                **{column: told.get(column) for column in QUANTITIES},
                "status": told["status"],
                "message": told["message"],
            }

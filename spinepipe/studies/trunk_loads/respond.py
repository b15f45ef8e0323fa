"""Job: batches of samples of one person: all sampled tasks, inputs as drawn."""

import sys
from collections.abc import Iterator, Mapping

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.progress import Progress
from spinepipe.studies.trunk_loads.persons import (
    UprightPerson,
    extra_inputs,
    solver_options,
    vary_task,
)
from spinepipe.studies.trunk_loads.postures import read_tasks
from spinepipe.studies.trunk_loads.rows import Row, outcome_of, task_row
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import QUANTITIES, RESPONSES
from spinepipe.tables import from_rows, read_frame, write


def run(
    root: str, study: str, specimen: str, design: str, parts: Mapping[str, Mapping[str, str]]
) -> None:
    """Write the rows of batches, a file each."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    read = [*extra_inputs(settings, cohort), mark_of(design)]
    made_by = provenance("respond", settings, cohort, [specimen], read)
    progress = Progress(lambda line: print(f"{study}: {line}", file=sys.stderr, flush=True))
    drawn, size = read_frame(design), settings.uncertain.samples_per_target
    for path, place in parts.items():
        batch = int(place["batch"])
        samples = range(batch * size, min((batch + 1) * size, settings.uncertain.runs))
        own = drawn[drawn["sample"].isin(list(samples))]
        # a row for each sample, a column for each factor
        wide = own.pivot(index="sample", columns="factor", values="value").sort_index()
        values = [{str(k): float(v) for k, v in row.items()} for row in wide.to_dict("records")]
        numbered = dict(zip(samples, values, strict=True))
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
    stands = UprightPerson.of_cohort(settings, cohort, specimen)
    options, tasks = solver_options(settings), read_tasks(cohort, settings.trunk_angle)
    for sample in progress.through(list(samples), f"{specimen}: samples"):
        values = samples[sample]
        person = stands.varied(values)
        for name in settings.uncertain.tasks:
            found = task_row(outcome_of(person, vary_task(tasks[name], values), options))
            yield {
                "specimen": specimen,
                "task": name,
                "sample": sample,
                **{column: found.get(column) for column in QUANTITIES},
                "status": found["status"],
                "message": found["message"],
            }

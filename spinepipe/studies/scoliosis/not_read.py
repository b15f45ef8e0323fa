"""Job: which vertebrae lack on which films, and what was made of it."""

from collections.abc import Iterator
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.films import can_be_held, read_on, span_of
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import NOT_READ
from spinepipe.tables import from_rows, write

INTERPOLATED, SHORTENED, LEFT_OUT = NOT_READ.column("made_of_it").allowed


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``not_read.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    rows = list(not_read_rows(cohort))
    write(from_rows(NOT_READ, rows), output, provenance("not_read", settings, cohort))


def not_read_rows(cohort: Cohort) -> Iterator[dict[str, Any]]:
    """A row for each vertebra of a film that was not read, or not used."""
    films = cohort.further["films"]
    for patient in cohort.specimen_names:
        seen = read_on(films[films["specimen"] == patient], cohort.vertebrae)
        lowest, top = span_of(seen)
        for position, read in seen.items():
            used = can_be_held(read[lowest : top + 1])
            for number, vertebra in enumerate(cohort.vertebrae):
                within = lowest <= number <= top
                if not (used and within and read[number]):
                    made = INTERPOLATED if within else SHORTENED
                    yield {
                        "specimen": patient,
                        "position": position,
                        "vertebra": vertebra,
                        "was_read": bool(read[number]),
                        "made_of_it": made if used else LEFT_OUT,
                    }

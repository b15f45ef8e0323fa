"""Search what the base model of a study lacks, prove it on held-out data, and write it down."""

import json
from pathlib import Path

from spinepipe.cohort import Cohort
from spinepipe.discrepancy.grounds import NoBase
from spinepipe.discrepancy.investigation import investigate
from spinepipe.discrepancy.tasks import Run
from spinepipe.files import appearing
from spinepipe.jobs.discrepancy.no_base import without_base
from spinepipe.jobs.discrepancy.results import Results
from spinepipe.jobs.discrepancy.store import Store
from spinepipe.jobs.discrepancy.with_base import with_base
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.model.file import read_model, write_model
from spinepipe.studies import Discrepancy
from spinepipe.tables import CANDIDATES, CONFUSIONS, GAP, HELD_OUT, WHERE, from_rows, write

JOB = "discrepancy.search"
STORE = "store"


def run(
    root: str,
    study: str,
    verdict: str,
    gap: str,
    candidates: str,
    where: str,
    confusions: str,
    held_out: str,
    model_base: str,
    model_with_effects: str,
) -> None:
    """Write the verdict, its tables and the two model files of a study.

    A base that cannot be fitted is a verdict too: UNKNOWN, and why.
    """
    settings, cohort = study_of_kind(Discrepancy, root, study)
    store = Store(Path(verdict).parent / STORE, f"spinepipe.jobs.{JOB}")
    results = searched(settings, cohort, root, store)
    metadata = provenance(JOB, settings, cohort)
    files = {gap: GAP, candidates: CANDIDATES, where: WHERE, confusions: CONFUSIONS,
             held_out: HELD_OUT}  # fmt: skip
    for path, table in files.items():
        write(from_rows(table, results.rows.get(table.name, ())), path, metadata)
    write_model(results.model_base, model_base)
    write_model(results.model_with_effects, model_with_effects)
    with appearing(verdict) as temporary:
        temporary.write_text(
            json.dumps(results.verdict, indent=1, allow_nan=False) + "\n", encoding="utf-8"
        )
    store.forget_the_rest()


def searched(study: Discrepancy, cohort: Cohort, root: str, run: Run) -> Results:
    """All that the files of a study hold, whether or not its base has a fit."""
    file = None if study.base.model is None else read_model(Path(root) / study.base.model)
    try:
        ended = investigate(study, cohort, file, run)
    except NoBase as trouble:
        return without_base(study, cohort, file, trouble)
    return with_base(study, cohort, file, ended, run)

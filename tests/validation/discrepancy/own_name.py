"""From which gap an effect has its own name in a scored cohort, and not only a place in a set.

Asked of the base fit and the tests alone, to first order (`design/distinguishability.py`), for
cohorts with one effect; entered into their rows.
"""

from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from spinepipe import cohort as cohorts
from spinepipe.studies.discrepancy.design.distinguishability import confusions
from spinepipe.studies.discrepancy.design.fisher_information import (
    CohortSignatures,
    candidates,
    specimen_signatures,
)
from spinepipe.studies.discrepancy.design.testable import judgements
from spinepipe.studies.discrepancy.search.hypothesis import trials
from spinepipe.studies.discrepancy.search.investigation import fit_base, prepare
from spinepipe.studies.discrepancy.store import at_once
from tests.generators.hidden import make, recipe_from
from tests.validation.discrepancy.further import repeats_of
from tests.validation.discrepancy.judged import judged
from tests.validation.discrepancy.row import STUDY, Row
from tests.validation.discrepancy.store import keep

KEY = "own_name"
TOLD_EVERY = 20


def tell_own_names(rows: list[tuple[Path, Row]], jobs: int) -> None:
    """Enter the gap into the rows that lack it, in their files too."""
    lacking = [(path, row) for path, row in rows if KEY not in row and _asks(row)]
    if not lacking:
        return
    print(f"discrepancy: own names of {len(lacking)} cohorts", flush=True)
    with get_context("spawn").Pool(min(jobs, len(lacking))) as workers:
        answers = workers.imap(gap_of_own_name, [row for _, row in lacking])
        for number, ((path, row), told) in enumerate(zip(lacking, answers, strict=True), 1):
            row[KEY] = told
            keep(row, path)
            if number % TOLD_EVERY == 0:
                print(f"discrepancy: own names, {number} of {len(lacking)}", flush=True)


def _asks(row: Row) -> bool:
    """One effect, above the gap from which it is found at all."""
    single = row["status"] == "scored" and row["target"]["kind"] in ("one", "small")
    return single and judged(row).above


def gap_of_own_name(row: Row) -> dict[str, Any]:
    """SD of one reading, like the truth's; None where another effect is always as good."""
    (name,) = row["truth"]["names"]
    with TemporaryDirectory() as place:
        make(recipe_from(row["recipe"]), Path(place) / "hidden")
        ready = prepare(STUDY, cohorts.read(Path(place) / "hidden"), None)
        grounds = fit_base(ready, at_once)
        joints, specimens = len(ready.cohort.joint_names), sorted(ready.cohort.specimen_names)
    every = trials(STUDY.effects, ready.coordinates, specimens, joints)
    of = {specimen: specimen_signatures(grounds, specimen, every) for specimen in grounds.readings}
    needed = row["threshold"] + STUDY.margin
    found = judgements(every, of, joints, grounds.tests, needed, STUDY.seed)
    design = CohortSignatures(candidates(every, joints, grounds.tests), of)
    pairs = [one for one in confusions(design, found, STUDY.margin) if one.effect == name]
    gaps = [one.gap for one in pairs if one.gap is not None]
    if not pairs or len(gaps) < len(pairs):
        return {"gap": None, "nearest": [one.other for one in pairs if one.gap is None]}
    nearest = max(pairs, key=lambda one: one.gap or 0.0)
    return {"gap": max(gaps) / np.sqrt(repeats_of(grounds)), "nearest": [nearest.other]}

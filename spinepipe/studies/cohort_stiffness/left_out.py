"""Job: predict a specimen with the median stiffness of the others, in one representation."""

from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array, Indices
from spinepipe.jobs.digest import mark_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import ScopedEffect
from spinepipe.status import Status, joined
from spinepipe.studies.cohort_stiffness.fit_rows import stiffness_rows
from spinepipe.studies.cohort_stiffness.predict import error_rows
from spinepipe.studies.cohort_stiffness.problem import (
    base_effects,
    base_of,
    origin,
    own_values_note,
    specimen_tests,
    start_stiffness,
    with_stiffness,
)
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stiffening import Growth, laws, median_growth
from spinepipe.studies.cohort_stiffness.tables import ERRORS, STIFFNESS
from spinepipe.tables import from_rows, read_frame, write
from spinepipe.units import COORDINATES

SOURCE = "others_median"


def run(
    root: str,
    study: str,
    others: list[str],
    specimen: str,
    representation: str,
    fitted_to: str,
    stiffness: str,
    errors: str,
) -> None:
    """Write the median of the other specimens' stiffness and the errors it leaves."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    base = base_of(root, settings)
    rows = predicted_by_others(
        *(settings, cohort, specimen, representation, fitted_to),
        [read_frame(path) for path in others],
        base_effects(base, cohort, specimen, left_out=True),
        own_values_note(base, cohort, specimen),
    )
    read = [mark_of(path) for path in others]
    made = origin("left_out", root, settings, cohort, [specimen], read)
    of = {"specimen": specimen, "representation": representation, "fitted_to": fitted_to}
    for table, path in ((STIFFNESS, stiffness), (ERRORS, errors)):
        write(from_rows(table, rows[table.name], **of), path, made)


def predicted_by_others(
    settings: CohortStiffness,
    cohort: Cohort,
    specimen: str,
    representation: str,
    fitted_to: str,
    others: list[pd.DataFrame],
    beside: tuple[ScopedEffect, ...] = (),
    note: str = "",
) -> dict[str, list[dict[str, Any]]]:
    """Rows of the tables ``stiffness`` and ``errors`` of a specimen that no fit has seen.

    Parameters
    ----------
    others : rows of ``stiffness`` of each other specimen's own fit. beside : effects besides the
        bushings. note : to be told of the stiffness.
    """
    tests = specimen_tests(settings, cohort, specimen)
    k, growth, used = _median(settings, cohort, representation, others)
    rows = _stiffness(settings, cohort, k, growth, used, len(others), note)
    known = used.max(initial=0) > 0
    within = {one.case.test for one in tests.fitted_to(fitted_to)}
    effects = (*laws(settings, growth), *beside)
    seen = [] if not known else error_rows(cohort, specimen, tests, k, effects)
    labelled = [
        {**row, "source": SOURCE, "stage": "left_out_specimen"}
        for row in seen
        if row["test"] in within
    ]
    return {STIFFNESS.name: rows, ERRORS.name: labelled}


def _median(
    settings: CohortStiffness, cohort: Cohort, representation: str, others: list[pd.DataFrame]
) -> tuple[Array, Array | None, Indices]:
    """(J, 6) median over the others that have a stiffness, that of growth, and (J, 6) how many.

    Growth is None where the representation is linear, or nobody has any.
    """
    k = start_stiffness(settings, cohort, representation)
    used = np.zeros(k.shape, dtype=np.int64)
    fitted = [frame[frame["stiffness"].notna()] for frame in others]
    if not any(map(len, fitted)):
        return k, None, used
    # Coordinates that are not fitted keep the published value.
    keys, values = ["joint", "coordinate"], ["stiffness", "growth"]
    rows = pd.concat(fitted).astype(dict.fromkeys(values, float))
    median = rows.groupby(keys, as_index=False)[values].median()
    k = with_stiffness(k, cohort.joint_names, median)
    growth = median_growth(settings, cohort.joint_names, representation, median)
    places = [cohort.joint_names.index(joint) for joint in rows["joint"]]
    np.add.at(used, (places, [COORDINATES.index(name) for name in rows["coordinate"]]), 1)
    return k, growth, used


def _stiffness(
    settings: CohortStiffness,
    cohort: Cohort,
    k: Array,
    growth: Array | None,
    used: Indices,
    others: int,
    note: str,
) -> list[dict[str, Any]]:
    known = used.max(initial=0) > 0
    values = k if known else np.full(k.shape, np.nan)
    none = np.zeros(k.shape, dtype=int)
    rows = stiffness_rows(
        *(cohort.joint_names, settings.free, values, np.full(k.shape, np.inf), 0.0, None, none),
        growth=None if growth is None else Growth.of(growth),
        silent=(used == 0) & known,
    )
    told = []
    for row in rows:
        n = used[cohort.joint_names.index(row["joint"]), COORDINATES.index(row["coordinate"])]
        status, message = Status.REFUSED, "no other specimen has a stiffness"
        if n:
            part = f"{others - n} of {others} have no stiffness" if n < others else ""
            whole = f"median of {n} specimen{'s' if n != 1 else ''}"
            status, message = Status.CONVERGED, joined(whole, part, note)
        told.append({"status": status.value, "message": message, **row, "source": SOURCE})
    return told

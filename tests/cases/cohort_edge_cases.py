"""Three chains of joints, and tables joined of the jobs of a study of chains."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import pandas as pd
from chain_cases import MOMENT_OF, STUDY, Tables, Written

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.kind import CohortLayout
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

A = np.array([[50.0, 60.0, 200.0], [55.0, 66.0, 220.0], [60.0, 70.0, 240.0]])
TRUTH = {"a": A, "b": 0.8 * A, "c": 1.5 * A}
TESTS = tuple(MOMENT_OF)


def layout_of(project: Written) -> CohortLayout:
    return CohortLayout.of(*study_of_kind(CohortStiffness, str(project.root), STUDY))


def joined_jobs(
    project: Written,
    specimens: Sequence[str],
    representations: Sequence[str],
    labels: Sequence[str],
    left_out: bool = True,
    pooled: Sequence[tuple[str, str]] = (),
) -> Tables:
    """Tables of literature, fits and left-out specimens, with the columns that folders carry.

    Parameters
    ----------
    pooled : of pooled fits, what they are fitted to and who is left out.
    """
    parts: dict[str, list[pd.DataFrame]] = {}

    def keep(tables: Tables, **carried: str) -> None:
        for name, rows in tables.items():
            parts.setdefault(name, []).append(rows.assign(**carried))

    for specimen in specimens:
        keep(project.literature(specimen), specimen=specimen)
    for name, label in product(representations, labels):
        carried = {"representation": name, "fitted_to": label}
        if not left_out:
            for specimen in specimens:
                keep(project.fit(specimen, name, label), specimen=specimen, **carried)
            continue
        for specimen, found in project.fit_all(specimens, name, label).items():
            for tables in found:
                keep(tables, specimen=specimen, **carried)
    for label, without in pooled:
        carried = {"representation": "partially_pooled", "fitted_to": label}
        found = project.pool(label, without)
        keep({"pooling": found.pop("pooling")}, without=without, **carried)
        keep(found, **carried)
    return {name: pd.concat(found, ignore_index=True) for name, found in parts.items()}

"""Three chains of joints, and what is asked of all tables that are made of them."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from chain_cases import MOMENT_OF, STUDY, Tables, Written

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.kind import CohortLayout
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.tables import read

A = np.array([[50.0, 60.0, 200.0], [55.0, 66.0, 220.0], [60.0, 70.0, 240.0]])
TRUTH = {"a": A, "b": 0.8 * A, "c": 1.5 * A}
TESTS = tuple(MOMENT_OF)


def no_nan(root: Path) -> None:
    """Empty cells of the files are nulls; no number is NaN or infinite.

    (Frames cannot tell: reading turns nulls into NaN.)
    """
    files = list(root.glob("*.parquet"))
    assert files
    for path in files:
        for column in read(path).columns:
            if pa.types.is_floating(column.type):
                known = column.drop_null().to_numpy()
                assert np.isfinite(known).all(), path.stem


def layout_of(project: Written) -> CohortLayout:
    return CohortLayout.of(*study_of_kind(CohortStiffness, str(project.root), STUDY))


def made_of_jobs(
    project: Written, representations: Sequence[str], labels: Sequence[str]
) -> dict[str, list[pd.DataFrame]]:
    """Tables of literature and own fits, with the columns that folders carry."""
    parts: dict[str, list[pd.DataFrame]] = {"stiffness": [], "errors": [], "fits": []}

    def keep(tables: Tables, **carried: str) -> None:
        for name, frame in tables.items():
            if name in parts and len(frame):
                parts[name].append(frame.assign(**carried))

    for specimen in TRUTH:
        keep(project.literature(specimen), specimen=specimen)
        for name, label in product(representations, labels):
            carried = {"specimen": specimen, "representation": name, "fitted_to": label}
            keep(project.fit(specimen, name, label), **carried)
    return parts

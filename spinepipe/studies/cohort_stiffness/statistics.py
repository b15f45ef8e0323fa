"""Job: the tests of Gould et al. 2024b, and beside them those that fit the data."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.jobs.cohort_stiffness.between_tests import between_groups
from spinepipe.jobs.cohort_stiffness.load_case_tests import load_case_specific
from spinepipe.jobs.cohort_stiffness.paired_tests import against_level_ratio, signed_ranks
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.jobs.tested_rows import Tested, corrected_rows
from spinepipe.studies import CohortStiffness
from spinepipe.tables import STATISTICS, from_rows, read_frames, write
from spinepipe.tables.specimen_errors import rotations


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``statistics.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    frames = read_frames(tables)
    rows = list(corrected_rows(all_tests(frames["errors"], frames["fits"])))
    origin = provenance("cohort_stiffness.statistics", settings, cohort)
    write(from_rows(STATISTICS, rows), output, origin)


def all_tests(errors: pd.DataFrame, fits: pd.DataFrame) -> Iterator[Tested]:
    """Every test of the tables ``errors`` and ``fits``, family by family."""
    seen = rotations(errors)
    yield from between_groups(seen)
    yield from signed_ranks(seen)
    yield from against_level_ratio(seen)
    yield from load_case_specific(fits)

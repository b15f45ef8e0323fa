"""Job: the numbers of Gould et al. 2024 beside those of a run on the cohort rebuilt from it."""

import pandas as pd

from spinepipe.comparison import GOULD_2024A, Run, judged
from spinepipe.jobs.inputs import study_and_cohort
from spinepipe.jobs.provenance import provenance
from spinepipe.tables import AGAINST_GOULD_2024A, from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_gould_2024a.parquet``; what needs an absent table is told as not computed."""
    settings, cohort = study_and_cohort(root, study)
    specimen = cohort.specimen_names[0]  # the paper has one
    frames = {name: _of(frame, specimen) for name, frame in read_frames(tables).items()}
    rows = judged(GOULD_2024A, Run(frames, settings.success.failed_when))
    write(
        from_rows(AGAINST_GOULD_2024A, rows),
        output,
        provenance("against_gould_2024a", settings, cohort),
    )


def _of(frame: pd.DataFrame, specimen: str) -> pd.DataFrame:
    """The rows of one specimen."""
    return frame[frame["specimen"] == specimen]

"""Job: the numbers of Gould et al. 2024b beside those of a run on the phantom made after it."""

from spinepipe.comparison import GOULD_2024B, Run, judged
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.provenance import provenance
from spinepipe.studies import CohortStiffness
from spinepipe.tables import AGAINST_GOULD_2024B, from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_gould_2024b.parquet``; what needs an absent table is told as not computed."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    rows = judged(GOULD_2024B, Run(read_frames(tables)))
    origin = provenance("cohort_stiffness.against_gould_2024b", settings, cohort)
    write(from_rows(AGAINST_GOULD_2024B, rows), output, origin)

"""Job: the numbers of Gould et al. 2024b beside those of a run on the phantom made after it.

doi 10.3389/fbioe.2024.1372088.
"""

from spinepipe.jobs.against import write_against
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import AGAINST_GOULD_2024B
from spinepipe.tables import read_frames


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_gould_2024b.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    write_against(AGAINST_GOULD_2024B, read_frames(tables), {}, settings, cohort, output)

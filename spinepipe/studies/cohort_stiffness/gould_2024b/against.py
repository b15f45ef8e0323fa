"""Job: the numbers of Gould et al. 2024b beside those of a run on the phantom made after it.

doi 10.3389/fbioe.2024.1372088.
"""

from spinepipe.comparison.claim import Run, judged
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.gould_2024b.error_patterns import (
    claims_of_error_orders,
    claims_of_error_patterns,
)
from spinepipe.studies.cohort_stiffness.gould_2024b.errors import claims_of_mean_errors
from spinepipe.studies.cohort_stiffness.gould_2024b.motion import (
    claims_of_implied_motion,
    claims_of_rotations,
)
from spinepipe.studies.cohort_stiffness.gould_2024b.numbers import (
    claims_of_own_numbers,
    claims_of_set_up,
)
from spinepipe.studies.cohort_stiffness.gould_2024b.stiffness import (
    claims_of_level_patterns,
    claims_of_stiffness_table,
)
from spinepipe.studies.cohort_stiffness.gould_2024b.tests import (
    claims_of_group_tests,
    claims_of_model_tests,
    claims_of_signed_rank,
)
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import AGAINST_GOULD_2024B
from spinepipe.tables import from_rows, read_frames, write

CLAIMS = (
    *claims_of_set_up(),
    *claims_of_own_numbers(),
    *claims_of_rotations(),
    *claims_of_implied_motion(),
    *claims_of_stiffness_table(),
    *claims_of_mean_errors(),
    *claims_of_group_tests(),
    *claims_of_signed_rank(),
    *claims_of_model_tests(),
    *claims_of_error_patterns(),
    *claims_of_error_orders(),
    *claims_of_level_patterns(),
)


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_gould_2024b.parquet``; what needs an absent table is told as not computed."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    rows = judged(CLAIMS, Run(read_frames(tables)))
    origin = provenance("against_gould_2024b", settings, cohort)
    write(from_rows(AGAINST_GOULD_2024B, rows), output, origin)

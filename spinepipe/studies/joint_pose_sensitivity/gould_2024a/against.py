"""Job: the numbers of Gould et al. 2024 beside those of a run on the cohort rebuilt from it."""

import pandas as pd

from spinepipe.comparison.claim import Run, judged
from spinepipe.jobs.digest import provenance
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.assumed import claims_of_load_point
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.best_models import (
    claims_of_best_model,
    claims_of_ten_best,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.counts import (
    claims_of_counts,
    claims_of_experiment,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.factors import (
    claims_of_factors,
    claims_of_two_factor,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.fits import (
    claims_of_bootstraps,
    claims_of_nominal,
    claims_of_stiffness_ranges,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.frames import (
    claims_of_datasets,
    claims_of_joint_frames,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.poses import (
    claims_of_correlations,
    claims_of_normality,
    claims_of_pose_sampling,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.precision import (
    claims_of_closed_forms,
    claims_of_precision,
)
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.tables_of_fits import AGAINST_GOULD_2024A
from spinepipe.tables import from_rows, read_frames, write

CLAIMS = (
    *claims_of_experiment(),
    *claims_of_counts(),
    *claims_of_nominal(),
    *claims_of_bootstraps(),
    *claims_of_stiffness_ranges(),
    *claims_of_ten_best(),
    *claims_of_best_model(),
    *claims_of_pose_sampling(),
    *claims_of_normality(),
    *claims_of_correlations(),
    *claims_of_two_factor(),
    *claims_of_factors(),
    *claims_of_joint_frames(),
    *claims_of_datasets(),
    *claims_of_precision(),
    *claims_of_closed_forms(),
    *claims_of_load_point(),
)
"""All claims of the paper (doi 10.3389/fbioe.2024.1304334), in its order."""


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_gould_2024a.parquet``; what needs an absent table is told as not computed."""
    settings, cohort = study_and_cohort(root, study)
    specimen = cohort.specimen_names[0]  # the paper has one
    frames = {name: _of(frame, specimen) for name, frame in read_frames(tables).items()}
    rows = judged(CLAIMS, Run(frames, {"failed_when": settings.success.failed_when}))
    write(
        from_rows(AGAINST_GOULD_2024A, rows),
        output,
        provenance("against_gould_2024a", settings, cohort),
    )


def _of(frame: pd.DataFrame, specimen: str) -> pd.DataFrame:
    """The rows of one specimen."""
    return frame[frame["specimen"] == specimen]

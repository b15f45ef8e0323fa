"""Job: the numbers of Gould et al. 2024 beside those of a run on the cohort rebuilt from it.

doi 10.3389/fbioe.2024.1304334.
"""

from spinepipe.jobs.against import write_against
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.tables import AGAINST_GOULD_2024A
from spinepipe.tables import read_frames


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_gould_2024a.parquet``."""
    settings, cohort = study_and_cohort(root, study)
    specimen = cohort.specimen_names[0]  # the paper has one
    frames = {
        name: frame[frame["specimen"] == specimen] for name, frame in read_frames(tables).items()
    }
    asked = {"failed_when": settings.success.failed_when}
    write_against(AGAINST_GOULD_2024A, frames, asked, settings, cohort, output)

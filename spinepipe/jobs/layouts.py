"""Which files a study of any kind consists of."""

from collections.abc import Callable
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.studies.cohort_stiffness import kind as cohort_stiffness
from spinepipe.studies.discrepancy import kind as discrepancy
from spinepipe.studies.global_sensitivity import kind as global_sensitivity
from spinepipe.studies.joint_pose_sensitivity import kind as layout
from spinepipe.studies.range_of_motion import kind as range_of_motion
from spinepipe.studies.study import Study
from spinepipe.studies.study_files import StudyFiles

LAYOUTS: dict[str, Callable[[Any, Cohort], StudyFiles]] = {
    "joint_pose_sensitivity": layout.Layout.of,
    "range_of_motion": range_of_motion.RangeOfMotionFiles.of,
    "cohort_stiffness": cohort_stiffness.CohortLayout.of,
    "discrepancy": discrepancy.DiscrepancyFiles.of,
    "global_sensitivity": global_sensitivity.SensitivityFiles.of,
}
"""What lists the files of each kind of study."""

JOINED = (
    *layout.OF_JOBS,
    *cohort_stiffness.OF_JOBS,
    *range_of_motion.OF_JOBS,
    *global_sensitivity.OF_JOBS,
)
"""Tables of all kinds that are joined from job files."""


def files_of(study: Study, cohort: Cohort) -> StudyFiles:
    """The result files of a study of a cohort."""
    return LAYOUTS[study.kind](study, cohort)

"""Which files a study of any kind consists of."""

from collections.abc import Callable
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.jobs.cohort_stiffness.layout import CohortLayout
from spinepipe.jobs.layout import Layout
from spinepipe.jobs.range_of_motion.layout import RangeOfMotionFiles
from spinepipe.jobs.study_files import StudyFiles
from spinepipe.studies import Study

LAYOUTS: dict[str, Callable[[Any, Cohort], StudyFiles]] = {
    "joint_pose_sensitivity": Layout.of,
    "range_of_motion": RangeOfMotionFiles.of,
    "cohort_stiffness": CohortLayout.of,
}
"""What lists the files of each kind of study."""


JOINED = (
    *("calibrations", "simulations", "bootstrap", "method_fits", "precision_errors"),
    *("stiffness", "fits", "errors", "sign_checks", "pooling"),
    "range_of_motion",
)
"""Tables of all kinds that are joined from job files."""


def files_of(study: Study, cohort: Cohort) -> StudyFiles:
    """The result files of a study of a cohort."""
    return LAYOUTS[study.kind](study, cohort)

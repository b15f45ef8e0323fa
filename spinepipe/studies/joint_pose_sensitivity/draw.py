"""Job: one figure of a study, as SVG and as PNG."""

from collections.abc import Callable, Mapping

import pandas as pd
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.inputs import study_and_cohort
from spinepipe.report.style import save, style
from spinepipe.studies.joint_pose_sensitivity.figures.agreement import agreement_figure
from spinepipe.studies.joint_pose_sensitivity.figures.bootstrap import bootstrap_figure
from spinepipe.studies.joint_pose_sensitivity.figures.errors import errors_figure
from spinepipe.studies.joint_pose_sensitivity.figures.joint_pose import joint_pose_figure
from spinepipe.studies.joint_pose_sensitivity.figures.landmark_precision import (
    landmark_precision_figure,
)
from spinepipe.studies.joint_pose_sensitivity.figures.pose_against_stiffness import (
    pose_against_stiffness_figure,
)
from spinepipe.studies.joint_pose_sensitivity.figures.stiffness import stiffness_figure
from spinepipe.studies.joint_pose_sensitivity.figures.success import success_figure
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import read_frames

Tables = Mapping[str, pd.DataFrame]
Draw = Callable[[JointPoseSensitivity, Cohort, Tables], Figure]

DRAW: dict[str, Draw] = {
    "stiffness": lambda study, cohort, rows: stiffness_figure(study, cohort, rows["calibrations"]),
    "errors": lambda study, cohort, rows: errors_figure(cohort, rows["simulations"], study),
    "joint_pose": lambda _, cohort, rows: joint_pose_figure(cohort, rows["poses"]),
    "bootstrap": bootstrap_figure,
    "success_by_method": success_figure,
    "agreement": agreement_figure,
    "pose_against_stiffness": pose_against_stiffness_figure,
    "landmark_precision": landmark_precision_figure,
}
"""What draws each figure; the tables it is drawn from: `spinepipe.jobs.layout.FIGURES`."""


def run(root: str, study: str, figure: str, tables: list[str], svg: str, png: str) -> None:
    """Draw a figure, one of `DRAW`, from the files of its tables."""
    settings, cohort = study_and_cohort(root, study)
    rows = read_frames(tables)
    with style():
        drawn = DRAW[figure](settings, cohort, rows)
        for path in (svg, png):
            save(drawn, path, digest_of("figures", settings, cohort))

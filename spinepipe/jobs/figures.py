"""Job: the figures of a study, each as SVG and as PNG beside it."""

from spinepipe.jobs.inputs import study_and_cohort
from spinepipe.report.errors import errors_figure
from spinepipe.report.joint_pose import joint_pose_figure
from spinepipe.report.stiffness import stiffness_figure
from spinepipe.report.style import save_with_png, style
from spinepipe.tables import read_frame


def run(
    root: str,
    study: str,
    poses: str,
    calibrations: str,
    simulations: str,
    stiffness: str,
    errors: str,
    joint_pose: str,
) -> None:
    """Write three figures to the named SVG files."""
    settings, cohort = study_and_cohort(root, study)
    with style():
        fitted = read_frame(calibrations)
        save_with_png(stiffness_figure(settings, cohort, fitted), stiffness)
        save_with_png(errors_figure(cohort, read_frame(simulations)), errors)
        save_with_png(joint_pose_figure(cohort, read_frame(poses)), joint_pose)

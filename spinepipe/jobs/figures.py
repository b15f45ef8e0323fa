"""Job: one figure of a study, as SVG and as PNG."""

from spinepipe.jobs.inputs import study_and_cohort
from spinepipe.report.errors import errors_figure
from spinepipe.report.joint_pose import joint_pose_figure
from spinepipe.report.stiffness import stiffness_figure
from spinepipe.report.style import save, style
from spinepipe.tables import read_frame


def run(root: str, study: str, figure: str, table: str, svg: str, png: str) -> None:
    """Draw a figure (``stiffness``, ``errors`` or ``joint_pose``) from its table."""
    settings, cohort = study_and_cohort(root, study)
    rows = read_frame(table)
    with style():
        if figure == "stiffness":
            drawn = stiffness_figure(settings, cohort, rows)
        elif figure == "errors":
            drawn = errors_figure(cohort, rows)
        elif figure == "joint_pose":
            drawn = joint_pose_figure(cohort, rows)
        else:
            raise ValueError(f"no figure is called {figure!r}")
        for path in (svg, png):
            save(drawn, path)

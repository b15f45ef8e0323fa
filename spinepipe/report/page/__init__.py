"""The report of a study: one HTML file with findings, figures, tables and a 3-D view."""

from spinepipe.report.page.document import Results
from spinepipe.studies.joint_pose_sensitivity.page import READ, study_page

__all__ = ["READ", "Results", "study_page"]

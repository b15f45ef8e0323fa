"""The report of a study: one HTML file with findings, figures, tables and a 3-D view."""

from spinepipe.report.page.page import READ, study_page
from spinepipe.report.page.results import Results

__all__ = ["READ", "Results", "study_page"]

"""The page of one specimen: measured curves, then the geometry in 3-D, then all numbers."""

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Drawing
from spinepipe.report.page.study_page import rendered, tag
from spinepipe.report.specimen import SpecimenView
from spinepipe.report.specimen_curves import curve_charts, measured_curves
from spinepipe.report.specimen_text import describe
from spinepipe.report.viewer.figure import viewer_html
from spinepipe.report.viewer.specimens import specimen_scene


def specimen_page(cohort: Cohort, view: SpecimenView) -> str:
    """One HTML file; it loads nothing, and the same files make the same bytes.

    Parameters
    ----------
    cohort : one that tells where joints are.
    """
    charts = curve_charts(cohort, list(measured_curves(view)))
    return rendered(
        "specimen_page.html",
        ("spinepipe.report",),
        title=f"{cohort.name}, {view.specimen}",
        tag=tag(cohort.made_up, cohort.rebuilt),
        cohort=cohort,
        specimen=view.specimen,
        curves=[Drawing.read(f"curves-{n}", chart.svg()) for n, chart in enumerate(charts)],
        viewer=viewer_html([specimen_scene(cohort, view)]),
        text=describe(cohort, view),
    )

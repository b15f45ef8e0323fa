"""The page of one specimen: measured curves, then the geometry in 3-D, then all numbers."""

import base64
from importlib.resources import files

from jinja2 import Environment, StrictUndefined

from spinepipe.cohort import Cohort
from spinepipe.report.specimen import SpecimenView
from spinepipe.report.specimen_curves import curve_figures, measured_curves
from spinepipe.report.specimen_text import describe
from spinepipe.report.style import picture, style
from spinepipe.report.viewer.figure import viewer_html, viewer_script, viewer_style
from spinepipe.report.viewer.specimens import specimen_scene


def specimen_page(cohort: Cohort, view: SpecimenView) -> str:
    """One HTML file; it loads nothing, and the same files make the same bytes.

    Parameters
    ----------
    cohort : one that tells where joints are.
    """
    with style():
        drawn = [
            (name, base64.b64encode(picture(figure, "svg")).decode())
            for name, figure in curve_figures(cohort, list(measured_curves(view)))
        ]
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    page = files("spinepipe.report").joinpath("specimen_page.html").read_text(encoding="utf-8")
    return environment.from_string(page).render(
        cohort=cohort,
        specimen=view.specimen,
        curves=drawn,
        viewer=viewer_html([specimen_scene(cohort, view)]),
        viewer_style=viewer_style(),
        viewer_script=viewer_script(),
        text=describe(cohort, view),
    )

"""Pages of made-up results of every kind of study, their figures left empty."""

from importlib import import_module

from made_results import Made

from spinepipe.report.forms.chart import Drawing
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.studies.registry import PACKAGE, kind_of

SVG = '<svg xmlns="http://www.w3.org/2000/svg" class="panel"></svg>'
"""An empty panel."""


def results_of(found: Made) -> ResultTables:
    """What the kind's page is made of."""
    metadata = {name: {"seed": "7", "study": found.study.study} for name in found.tables}
    drawings = {
        one.name: Drawing(one.name, one.title, "Words.", (SVG,))
        for one in kind_of(found.study.kind).figures
    }
    return ResultTables(found.tables, metadata, drawings)


def made_page(found: Made) -> Page:
    """What the kind puts on its page."""
    write = import_module(f"{PACKAGE}.{found.study.kind}.page").page
    shown: Page = write(found.study, found.cohort, results_of(found))
    return shown


def page_of(found: Made) -> str:
    """The whole page of a study."""
    return made_page(found).html(found.study, found.cohort, results_of(found))

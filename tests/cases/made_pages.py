"""Pages of made-up results of every kind of study, their figures left empty."""

from importlib import import_module

from made_results import Made

from spinepipe.report.page.document import Document, Picture, ResultTables
from spinepipe.report.page.study_page import Page, Results
from spinepipe.studies.registry import PACKAGE, kind_of

SVG = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'
"""An empty figure."""


def document_of(found: Made) -> Document:
    """What the kind puts on its page."""
    metadata = {name: {"seed": "7", "study": found.study.study} for name in found.tables}
    titles = {one.name: one.title for one in kind_of(found.study.kind).figures}
    pictures = {name: Picture.of(name, title, SVG, "Words.") for name, title in titles.items()}
    write = import_module(f"{PACKAGE}.{found.study.kind}.page").document
    shown: Document = write(
        found.study, found.cohort, ResultTables(found.tables, metadata, pictures)
    )
    return shown


def page_of(found: Made) -> str:
    """The whole page of a study, drawing library included."""
    kind_page = import_module(f"{PACKAGE}.{found.study.kind}.page")
    if hasattr(kind_page, "page"):  # kinds whose pages are made of records
        results = Results(found.tables, {name: {"seed": "7"} for name in found.tables})
        shown: Page = kind_page.page(found.study, found.cohort, results)
        return shown.html(found.study, found.cohort, results)
    return document_of(found).html(found.study, found.cohort)

"""The report of a range-of-motion study: one HTML file that fetches nothing."""

import base64
from collections.abc import Iterator
from importlib.resources import files

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from spinepipe.cohort import Cohort
from spinepipe.report.page.origin import origin
from spinepipe.report.page.results import Results
from spinepipe.report.page.sortable import Sortable, sortable
from spinepipe.report.range_of_motion.findings import findings
from spinepipe.report.range_of_motion.panels import EVERY
from spinepipe.report.words import count
from spinepipe.studies import RangeOfMotion
from spinepipe.tables import ROM_SUMMARY, ROM_VARIANCE, STIFFNESS_SETS, Table

QUESTION = (
    "How far do the joints of these spines move in tests, and does that hang on the spine, on "
    "where its joint frames are, or on the stiffness?"
)
TITLES = {"range_of_motion": "Range of motion", "rom_variance": "What motion hangs on"}
READ = ("rom_summary", "rom_variance", "stiffness_sets")
"""Tables whose rows the page needs; of the others it tells where they come from."""


def range_of_motion_page(study: RangeOfMotion, cohort: Cohort, results: Results) -> str:
    """The report as one HTML document; the same results, the same bytes."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(_part("spinepipe.report.range_of_motion", "page.html"))
    return template.render(
        study=study,
        cohort=cohort,
        question=QUESTION,
        specimens=count(len(cohort.specimen_names), "specimen"),
        findings=findings(study, cohort, results),
        pictures=[_picture(name, results) for name in results.pictures],
        tables=[table for table in _tables(cohort, results) if table.rows],
        origin=origin(study, results.metadata),
        style=Markup(_part("spinepipe.report.page", "page.css")),
        script=Markup(_part("spinepipe.report.page", "page.js.html")),
    )


def _part(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text(encoding="utf-8")


def _picture(name: str, results: Results) -> dict[str, str]:
    """A figure inside the page: as an image of its own it shares no ids with the others."""
    content = base64.b64encode(results.pictures[name].encode()).decode()
    return {
        "name": name,
        "title": TITLES[name],
        "address": f"data:image/svg+xml;base64,{content}",
        "caption": " ".join(results.captions[name].split()),
    }


def _tables(cohort: Cohort, results: Results) -> Iterator[Sortable]:
    """Rows of the whole cohort, or of its only specimen; those of each specimen are in the file."""
    chosen = EVERY if len(cohort.specimen_names) > 1 else cohort.specimen_names[0]
    summary, variance = results.table("rom_summary"), results.table("rom_variance")
    shown: tuple[tuple[Table, str, bool], ...] = (
        (ROM_SUMMARY, "Range of motion", True),
        (ROM_VARIANCE, "Shares of variance", True),
        (STIFFNESS_SETS, "Stiffness sets", False),
    )
    rows = {ROM_SUMMARY.name: summary, ROM_VARIANCE.name: variance}
    for table, title, by_specimen in shown:
        frame = rows.get(table.name, results.table(table.name))
        if by_specimen:
            frame = frame[frame["specimen"] == chosen]
        yield sortable(table.name, title, table.about, frame, table.columns)

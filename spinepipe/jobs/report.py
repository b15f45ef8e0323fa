"""Job: the report of a study of any kind, one HTML file."""

from collections.abc import Collection
from importlib import import_module
from pathlib import Path

from spinepipe.jobs.digest import report_digest
from spinepipe.jobs.inputs import study_of
from spinepipe.marks import write_marked
from spinepipe.report.page.document import Picture, Results
from spinepipe.studies.registry import PACKAGE, kind_of
from spinepipe.tables import Tables, read_metadata


def run(
    root: str,
    study: str,
    tables: list[str],
    figures: list[str],
    captions: list[str],
    output: str,
    **others: str,
) -> None:
    """Write the page from the files of all tables, pictures (SVG), captions and ``others``."""
    settings, cohort = study_of(root, study)
    page = import_module(f"{PACKAGE}.{settings.kind}.page")
    titles = {figure.name: figure.title for figure in kind_of(settings.kind).figures}
    results = results_of(page.READ, titles, tables, figures, captions, others)
    document = page.document(settings, cohort, results)
    write_marked(document.html(settings, cohort), output, report_digest(settings, cohort))


def results_of(
    read: Collection[str],
    titles: dict[str, str],
    tables: list[str],
    figures: list[str],
    captions: list[str],
    others: dict[str, str],
) -> Results:
    """Rows of the tables named in ``read``, where all tables come from, and pictures."""
    words = {Path(path).stem: _text(path) for path in captions}
    drawn = {Path(path).stem: _text(path) for path in figures}
    return Results(
        tables=Tables.read([path for path in tables if Path(path).stem in read], others),
        metadata={Path(path).stem: read_metadata(path) for path in tables},
        pictures={
            name: Picture.of(name, titles[name], svg, " ".join(words[name].split()))
            for name, svg in drawn.items()
        },
    )


def _text(path: str) -> str:
    return Path(path).read_text(encoding="utf-8")

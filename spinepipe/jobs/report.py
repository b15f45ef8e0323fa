"""Job: a page of a study of any kind, one HTML file: its report, or what `full` makes of it.

Beside it is written what the tables are that the study has by then, for other programs to read. It
says nothing that the tables and their code do not, so no digest holds it and nothing reads it here.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.files import appearing
from spinepipe.jobs.digest import mark_of, report_digest
from spinepipe.jobs.inputs import study_of
from spinepipe.marks import KEY, write_marked
from spinepipe.report.conclusions import rows_of
from spinepipe.report.forms.chart import Drawing
from spinepipe.report.page.comparison import AGAINST, comparison, paper_of
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import listed
from spinepipe.schema import Table
from spinepipe.schema.datapackage import FILE, descriptor
from spinepipe.studies.registry import PACKAGE, files_of, kind_of
from spinepipe.studies.study import Study
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import StudyTables, from_rows, read_metadata, write

_LEADING = """\
<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>This page has moved</title>
<meta http-equiv="refresh" content="0; url={address}">
<p>This page has moved to <a href="{address}">{address}</a>.</p></html>
"""
"""What stands where a page once was; its address is made of names of ours."""


def run(
    root: str,
    study: str,
    page: str,
    tables: list[str],
    figures: list[str],
    output: str,
    former: str = "",
    **others: str,
) -> None:
    """Write a page from the files of all tables, figures (SVG) and ``others``.

    Parameters
    ----------
    former : where the page once was, if elsewhere: what is written there leads to it. A copy could
        be the older of two; so could a page that an earlier version left there.
    """
    settings, cohort = study_of(root, study)
    kind_page = import_module(f"{PACKAGE}.{settings.kind}.page")
    read = [mark_of(path) for path in [*tables, *figures, *others.values()]]
    digest = report_digest(page, settings, cohort, read)
    _write_page(kind_page, settings, cohort, page, tables, figures, output, others, digest)
    if former:
        address = Path(os.path.relpath(output, Path(former).parent)).as_posix()
        write_marked(_LEADING.format(address=address), former, digest)
    folder = Path(output).parent / kind_of(settings.kind).files.subfolder
    with appearing(folder / FILE) as temporary:
        temporary.write_text(descriptor_of(settings, cohort, folder), "utf-8")


def _write_page(
    kind_page: Any,
    study: Study,
    cohort: Cohort,
    page: str,
    tables: list[str],
    figures: list[str],
    output: str,
    others: dict[str, str],
    digest: str,
) -> None:
    """Write the page, beside it its conclusions as a table, and pages of comparisons."""
    results = ResultTables(
        StudyTables.read([path for path in tables if Path(path).stem in kind_page.READ], others),
        {Path(path).stem: read_metadata(path) for path in tables},
        {Path(path).stem: Drawing.read(Path(path).stem, _text(path)) for path in figures},
    )
    made = kind_page.page(study, cohort, results)
    added = files_of(study, cohort).adds
    if page == "report" and added:
        more = f"{listed(added)} (`make full` makes them and the page full.html)"
        made = replace(made, left_out=(*made.left_out, more))
    folder = Path(output).parent
    papers = {}
    for shape in kind_of(study.kind).tables:
        rows = results.table(shape.name)
        if shape.name.startswith(AGAINST) and len(rows):
            papers[f"{shape.name}.html"] = title = f"Beside {paper_of(shape.name)}"
            beside = comparison(shape, title, rows, study, cohort)
            write_marked(beside, folder / f"{shape.name}.html", digest)
    subfolder = kind_of(study.kind).files.subfolder
    html = made.html(study, cohort, results, papers=papers, folder=subfolder)
    write_marked(html, output, digest)
    if page == "report":
        metadata = {"study": study.study, "kind": study.kind, KEY: digest}
        told = from_rows(CONCLUSIONS, rows_of(made.told))
        write(told, folder / f"{CONCLUSIONS.name}.parquet", metadata)


def descriptor_of(
    study: Study,
    cohort: Cohort,
    folder: Path,
    ending: str = ".parquet",
    also: Sequence[Table] = (),
) -> str:
    """What the tables are that a study has in a folder by now, as a Data Package."""
    has = files_of(study, cohort).tables
    shapes = [
        (shape, f"{shape.name}{ending}")
        for shape in (*(one for one in kind_of(study.kind).tables if one.name in has), *also)
        if (folder / f"{shape.name}{ending}").is_file()
    ]
    title = f"Results of the study {study.study} ({study.kind}) of the cohort {cohort.name}"
    return descriptor(study.study, title, shapes)


def _text(path: str) -> str:
    return Path(path).read_text(encoding="utf-8")

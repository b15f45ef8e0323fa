"""The report of scoliosis: the answer first, true to its tables, fetching nothing.

Would catch a page that loads something, hides doubt behind the answer or shows a table without
rows. That its figures and page are made of files is seen by the run of the kind
(`tests/workflow/test_every_kind.py`) and, alone, by `make test-full`.
"""

import re
from functools import cache
from pathlib import Path

import pandas as pd
import pytest
from drawn import caption
from scoliosis_cases import ERRORS, Size, cohort_of, study_of, tables_of, write_shipped
from study_cases import Size as OtherSize
from study_cases import project
from sweeps import sweep

from spinepipe.jobs import draw, report
from spinepipe.report.page.document import Picture, ResultTables
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.kind import KIND
from spinepipe.studies.scoliosis.page import READ, document, left_out, shown_tables
from spinepipe.tables import to_arrow, write

PICTURE = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'
SIZES = {
    "a pose lost": Size(lost=1),
    "nothing held out, reading unknown": Size(1, positions=(RIGHT, LEFT), noise_deg=None),
    "one model, nobody has all poses": Size(errors={"uniform": 0.3}, lost=3),
}
"""Each page is made once, and looked at by all tests."""


def results(size: Size, **changed: pd.DataFrame) -> ResultTables:
    """Made-up results with a picture."""
    tables = tables_of(size) | changed
    title = KIND.figure("film_overlay").title
    picture = Picture.of("film_overlay", title, PICTURE, "What it shows.")
    metadata = {name: {"seed": "7", "code_digest": name} for name in tables}
    return ResultTables(tables, metadata, {"film_overlay": picture})


@cache
def page(size: str) -> str:
    """The page of made-up results of that size."""
    return page_of(SIZES[size])


def page_of(size: Size, **changed: pd.DataFrame) -> str:
    study, cohort = study_of(size), cohort_of(size)
    return document(study, cohort, results(size, **changed)).html(study, cohort)


@sweep("size", SIZES)
def test_page_of_any_films_fetches_nothing_and_has_no_view_in_space(size: str) -> None:
    text = page(size)
    before_scripts = text.split("<script")[0]
    for address in re.findall(r' (?:src|href)="([^"]*)"', before_scripts):
        assert address.startswith(("#", "data:image/svg+xml;base64,")), address
    assert '<h2 id="findings-title">Verdict</h2>' in text
    assert "Figure 1. Films, and the models held in them." in text
    for absent in ("3-D view", 'id="scene"', 'class="still"'):
        assert absent not in before_scripts + text[text.rindex("</script>") :]
    assert "drawScene();" not in text
    assert len(text) < 600_000, "no library for a view that is not there"
    assert "nan" not in re.sub("<[^>]*>", " ", before_scripts).lower().split()


def test_the_answer_stands_before_all_else() -> None:
    text = page("a pose lost")
    order = ["Look at this first", "Verdict", 'class="headline"', "Figure 1.", "Table 1."]
    places = [text.index(words) for words in order[1:]]
    assert places == sorted(places)
    assert text.index("Verdict") < text.index(order[0]) < text.index('class="headline"')


def test_every_table_that_is_read_has_a_shape_and_rows_are_shown_or_left_out() -> None:
    assert set(READ) <= {table.name for table in KIND.tables}
    shown = [table.name for table in shown_tables(results(Size()))]
    assert shown == ["accuracy", "variation", "laws", "positions", "curves"]
    empty = {name: rows.iloc[:0] for name, rows in tables_of(Size()).items()}
    assert not shown_tables(results(Size(), **empty))
    assert "There are no findings" in page_of(Size(), **empty)


def test_what_is_left_out_is_told_with_its_reason() -> None:
    told = left_out(study_of(Size()), cohort_of(Size()))
    assert told == ()
    bare = Size(errors={"uniform": 0.3, "tangent": 0.2}, positions=(RIGHT, LEFT, "neutral"))
    told = left_out(study_of(bare), cohort_of(bare))
    assert told[-1] == "position traction (nobody has a film of it)"
    assert {f"{name} (models)" for name in ERRORS if name not in bare.errors} < set(told)


@pytest.mark.full
def test_figures_and_report_are_drawn_from_files(tmp_path: Path) -> None:
    project(tmp_path, OtherSize())
    root = tmp_path
    write_shipped(root / "config/cohorts/ais", 2)
    text = "study: s\nkind: scoliosis\ncohort: ais\nmodels: [tangent, uniform]\n"
    (root / "config/studies/s.yaml").write_text(text)
    tables = tables_of(Size(2, errors={"tangent": 0.4, "uniform": 0.8}))
    files = {}
    for name, rows in tables.items():
        files[name] = root / f"{name}.parquet"
        empty = rows.astype(object).where(rows.notna(), None)  # texts too
        write(to_arrow(KIND.table(name), empty), files[name], {"study": "s"})
    pictures = []
    for figure in KIND.figures:
        places = [str(root / f"{figure.name}.{kind}") for kind in ("svg", "png")]
        read = [str(files[name]) for name in figure.reads]
        draw.run(str(root), "s", figure.name, read, *places)
        pictures.append(places[0])
    page = root / "report.html"
    captions = [str(caption("scoliosis", figure.name)) for figure in KIND.figures]
    report.run(
        str(root), "s", "full", [str(f) for f in files.values()], pictures, captions, str(page)
    )
    text = page.read_text(encoding="utf-8")
    for figure in KIND.figures:
        assert f"{figure.title}." in text

"""The report of scoliosis: the answer first, true to its tables, fetching nothing."""

import re
from pathlib import Path

import pandas as pd
import pytest
from drawn import caption
from scoliosis_cases import ERRORS, Size, cohort_of, study_of, tables_of
from study_cases import Size as OtherSize
from study_cases import project

from spinepipe.jobs import draw, report
from spinepipe.report.page.document import Picture, Results
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.kind import KIND
from spinepipe.studies.scoliosis.page import READ, document, left_out, shown_tables
from spinepipe.tables import to_arrow, write
from tests.generators import ais_films

PICTURE = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'
SIZES = {
    "three patients": Size(),
    "one patient": Size(1),
    "nothing held out": Size(positions=(RIGHT, LEFT)),
    "one model": Size(errors={"uniform": 0.3}),
    "reading unknown": Size(noise_deg=None),
    "nobody has all poses": Size(lost=3),
}


def results(size: Size, **changed: pd.DataFrame) -> Results:
    """Made-up results with a picture."""
    tables = tables_of(size) | changed
    title = KIND.figure("film_overlay").title
    picture = Picture.of("film_overlay", title, PICTURE, "What it shows.")
    metadata = {name: {"seed": "7", "code_digest": name} for name in tables}
    return Results(tables, metadata, {"film_overlay": picture})


def page_of(size: Size, **changed: pd.DataFrame) -> str:
    """The page of made-up results."""
    study, cohort = study_of(size), cohort_of(size)
    return document(study, cohort, results(size, **changed)).html(study, cohort)


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES.keys())
def test_page_of_any_films_fetches_nothing_and_has_no_view_in_space(size: Size) -> None:
    page = page_of(size)
    before_scripts = page.split("<script")[0]
    for address in re.findall(r' (?:src|href)="([^"]*)"', before_scripts):
        assert address.startswith(("#", "data:image/svg+xml;base64,")), address
    assert '<h2 id="findings-title">Verdict</h2>' in page
    assert "Figure 1. Films, and the models held in them." in page
    for absent in ("3-D view", 'id="scene"', 'class="still"'):
        assert absent not in before_scripts + page[page.rindex("</script>") :]
    assert "drawScene();" not in page
    assert len(page) < 600_000, "no library for a view that is not there"
    assert "nan" not in re.sub("<[^>]*>", " ", before_scripts).lower().split()


def test_page_has_the_same_bytes_twice() -> None:
    assert page_of(Size()) == page_of(Size())


def test_the_answer_stands_before_all_else() -> None:
    page = page_of(Size(lost=1))
    order = ["Look at this first", "Verdict", 'class="headline"', "Figure 1.", "Table 1."]
    places = [page.index(words) for words in order[1:]]
    assert places == sorted(places)
    assert page.index("Verdict") < page.index(order[0]) < page.index('class="headline"')


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


def test_figures_and_report_are_drawn_from_files(tmp_path: Path) -> None:
    project(tmp_path, OtherSize())
    root = tmp_path
    ais_films.write(root / "config/cohorts/ais", ais_films.READINGS["ais18_phantom"], count=2)
    text = "study: s\nkind: scoliosis\ncohort: ais\nmodels: [tangent, uniform]\n"
    (root / "config/studies/s.yaml").write_text(text)
    tables = tables_of(Size(2, errors={"tangent": 0.4, "uniform": 0.8}))
    files = {}
    for name, rows in tables.items():
        files[name] = root / f"{name}.parquet"
        write(to_arrow(KIND.table(name), rows), files[name], {"study": "s"})
    pictures = []
    for figure in KIND.figures:
        places = [str(root / f"{figure.name}.{kind}") for kind in ("svg", "png")]
        read = [str(files[name]) for name in figure.reads]
        draw.run(str(root), "s", figure.name, read, *places)
        pictures.append(places[0])
    page = root / "report.html"
    captions = [str(caption("scoliosis", figure.name)) for figure in KIND.figures]
    report.run(str(root), "s", [str(f) for f in files.values()], pictures, captions, str(page))
    text = page.read_text(encoding="utf-8")
    for figure in KIND.figures:
        assert f"{figure.title}." in text

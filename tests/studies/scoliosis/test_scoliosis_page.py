"""The report of scoliosis: the answer first, true to its tables, fetching nothing.

Would catch a page that loads something, hides doubt behind the answer or shows a table without
rows. That its figures and page are made of files is seen by the run of the kind
(`tests/workflow/test_every_kind.py`).
"""

import re
from functools import cache

import pandas as pd
from scoliosis_cases import ERRORS, Size, cohort_of, study_of, tables_of
from spinepipe.report.page.document import Picture, ResultTables
from sweeps import sweep

from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.kind import KIND
from spinepipe.studies.scoliosis.page import READ, document, left_out, shown_tables

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

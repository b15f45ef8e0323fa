"""The report of trunk loads: the answer first, the trunk in space, fetching nothing."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from drawn import caption
from study_cases import Size as OtherSize
from study_cases import project
from trunk_table_cases import DRAWN, FOLDER, Size, cohort_of, study_of, tables_of

from spinepipe.jobs import draw, report
from spinepipe.report.page.document import Picture, ResultTables
from spinepipe.studies.trunk_loads.in_space import MOST_SCENES, trunk_in_space
from spinepipe.studies.trunk_loads.kind import KIND
from spinepipe.studies.trunk_loads.page import READ, document, left_out, shown_tables
from spinepipe.tables import to_arrow, write

PICTURE = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'
SIZES = {
    "five persons": Size(),
    "one person, nothing more": Size(1, volunteer=False, samples=False, simplified=False),
    "nothing drawn": Size(1, drawn=()),
    "one task": Size(1, ("standing",)),
    "nothing settled": Size(1, ("standing",), (("standing", "out_of_reach", "<no>"),)),
}


def results(size: Size, **changed: pd.DataFrame) -> ResultTables:
    """Made-up results with a picture."""
    made = tables_of(size, **changed)
    picture = Picture.of("load_by_level", "Loads by level", PICTURE, "What it shows.")
    metadata = {name: {"seed": "7", "code_digest": name} for name in made}
    return ResultTables(made, metadata, {"load_by_level": picture})


def page_of(size: Size, **changed: pd.DataFrame) -> str:
    """The page of made-up results."""
    study, cohort = study_of(size), cohort_of(size)
    return document(study, cohort, results(size, **changed)).html(study, cohort)


def scenes_of(page: str) -> dict[str, Any]:
    """What the script of the page is given."""
    found = re.search(r'<script type="application/json" id="scenes">(.*?)</script>', page)
    assert found is not None
    scenes: dict[str, Any] = json.loads(found[1])
    return scenes


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES.keys())
def test_page_of_any_study_fetches_nothing(size: Size) -> None:
    page = page_of(size)
    before_scripts = page.split("<script")[0]
    for address in re.findall(r' (?:src|href)="([^"]*)"', before_scripts):
        assert address.startswith(("#", "data:image/svg+xml;base64,")), address
    assert '<h2 id="findings-title">Verdict</h2>' in page
    assert "nan" not in re.sub("<[^>]*>", " ", before_scripts).lower().split()
    drawn = bool(len(tables_of(size)["paths"]))
    assert ("drawScene();" in page) == drawn
    assert ("The trunk in 3-D" in page) == drawn


def test_page_has_the_same_bytes_twice() -> None:
    assert page_of(Size(1)) == page_of(Size(1))


def test_the_answer_stands_before_all_else() -> None:
    page = page_of(Size(1))
    order = ["Verdict", "Look at this first", 'class="headline"', "Figure 1.", "The trunk in 3-D"]
    places = [page.index(words) for words in [*order, "Table 1."]]
    assert places == sorted(places)


def test_tables_are_those_of_the_kind_and_empty_ones_are_left_out() -> None:
    assert set(READ) <= {table.name for table in KIND.tables}
    shown = [table.name for table in shown_tables(results(Size(1)))]
    assert shown[:3] == ["tasks", "agreement", "pressures"]
    assert not {"masses", "scaling"} & set(shown)
    empty = {name: rows.iloc[:0] for name, rows in tables_of(Size(1)).items()}
    assert not shown_tables(results(Size(1), **empty))
    assert "No load can be told" in page_of(Size(1), **empty)


def test_what_the_study_leaves_out_is_told_with_its_reason() -> None:
    assert left_out(study_of(Size(1))) == ()
    told = left_out(study_of(Size(1, volunteer=False, samples=False)))
    assert len(told) == 2
    assert "(no task is to be sampled)" in told[0]
    assert "(nobody stands for the volunteer)" in told[1]


def test_every_drawn_task_has_a_scene_and_every_group_a_switch() -> None:
    page = page_of(Size(1))
    scenes = scenes_of(page)
    assert set(scenes) == {name.replace("_", " ") for name in DRAWN}
    assert re.findall(r"<option>(.*?)</option>", page) == [n.replace("_", " ") for n in DRAWN]
    groups = set(re.findall(r'data-group="(.*?)"', page))
    shown = {trace["meta"] for scene in scenes.values() for trace in scene["data"]}
    assert groups == shown
    assert {"spine", "load", "multifidus"} < groups


def test_lines_are_the_paths_and_their_colour_is_the_stress() -> None:
    rows = tables_of(Size(1))["paths"]
    scene = scenes_of(page_of(Size(1)))["load away"]
    trace = next(trace for trace in scene["data"] if trace["meta"] == "psoas")
    own = rows[(rows["task"] == "load_away") & (rows["group"] == "psoas")]
    first = own[own["muscle"] == own["muscle"].iloc[0]]
    n = len(first)
    drawn = np.array([trace[axis][:n] for axis in "xyz"], dtype=float).T
    # places are written to 0.1 mm
    np.testing.assert_allclose(drawn, first[["x_mm", "y_mm", "z_mm"]], rtol=0, atol=0.0501)
    assert trace["x"][n] is None, "a gap before the next fascicle"
    assert trace["line"]["color"][0] == pytest.approx(first["stress_mpa"].iloc[0], abs=1e-4)
    assert len(trace["line"]["color"]) == len(trace["x"]) == len(trace["text"])
    box = scene["layout"]["coloraxis"]
    assert box["cmin"] == 0.0
    assert box["cmax"] == pytest.approx(float(rows["stress_mpa"].max()), abs=1e-4)
    assert box["colorbar"]["title"]["text"] == "stress (MPa)"


def test_millimetres_are_equally_long_along_all_axes() -> None:
    scene = scenes_of(page_of(Size(1)))["load away"]
    shape = scene["layout"]["scene"]["aspectratio"]
    for letter, other in ("xy", "yz"):
        sizes = []
        for axis in (letter, other):
            values = [v for trace in scene["data"] for v in trace[axis] if v is not None]
            sizes.append(max(values) - min(values))
        assert shape[letter] / shape[other] == pytest.approx(sizes[0] / sizes[1], rel=1e-3)


def test_the_load_stands_where_the_task_says() -> None:
    scenes = scenes_of(page_of(Size(1)))
    load = next(trace for trace in scenes["one handed"]["data"] if trace["meta"] == "load")
    assert (load["x"], load["y"], load["z"]) == ([0.0], [-150.0], [340.0])
    assert "19.8 kg" in load["text"][0]
    assert all(trace["meta"] != "load" for trace in scenes["standing"]["data"])


def test_no_more_than_some_scenes_and_that_is_said() -> None:
    made = tables_of(Size())
    space = trunk_in_space(cohort_of(Size()), made["paths"], made["levels"])
    assert len(space.scenes) == MOST_SCENES < 15
    assert f"The first {MOST_SCENES} of 15 postures." in space.caption
    assert next(iter(space.scenes)) == "standing, volunteer"


def test_names_cannot_end_the_script() -> None:
    rows = tables_of(Size(1))["paths"]
    rows["muscle"] = rows["muscle"] + "</script><b>"
    page = page_of(Size(1), paths=rows)
    assert "</script><b>" not in page
    assert "&lt;/script&gt;&lt;b&gt;" in json.dumps(scenes_of(page)), "as plotly reads it"


def test_a_figure_is_there_without_the_tables_that_it_shows_besides() -> None:
    without = Size(1, samples=False)
    files = KIND.files.of(study_of(without), cohort_of(without))
    assert "pressure_against_measured" in files.figures()
    assert "drivers" not in files.figures()
    sampled = KIND.files.of(study_of(Size(1)), cohort_of(Size(1)))
    assert set(sampled.figures()) == {figure.name for figure in KIND.figures}


def test_figures_and_report_are_drawn_from_files(tmp_path: Path) -> None:
    project(tmp_path, OtherSize())
    shutil.copytree(FOLDER, tmp_path / "config/cohorts/trunk_volunteers")
    size = Size()
    text = "study: s\nkind: trunk_loads\ncohort: trunk_volunteers\ndrawn_tasks: [standing]\n"
    (tmp_path / "config/studies/s.yaml").write_text(text)
    files = {}
    for name, rows in tables_of(size).items():
        files[name] = str(tmp_path / f"{name}.parquet")
        cells = rows.convert_dtypes().astype(object)
        told = to_arrow(KIND.table(name), cells.where(cells.notna(), None))
        write(told, files[name], {"study": "s"})
    pictures = []
    for figure in KIND.figures:
        places = [str(tmp_path / f"{figure.name}.{kind}") for kind in ("svg", "png")]
        read = [files[name] for name in (*figure.reads, *figure.also)]
        draw.run(str(tmp_path), "s", figure.name, read, *places)
        pictures.append(places[0])
    page = tmp_path / "report.html"
    captions = [str(caption("trunk_loads", figure.name)) for figure in KIND.figures]
    report.run(str(tmp_path), "s", "full", list(files.values()), pictures, captions, str(page))
    text = page.read_text(encoding="utf-8")
    for figure in KIND.figures:
        assert f"{figure.title}." in text

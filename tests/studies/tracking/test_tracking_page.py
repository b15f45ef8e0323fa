"""The report of tracked motions: the answer first, the spine in motion, fetching nothing."""

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
from tracking_table_cases import ERROR, FOLDER, Size, cohort_of, study_of, tables_of

from spinepipe.jobs import draw, report
from spinepipe.report.page.document import Picture, ResultTables
from spinepipe.report.page.space import Space
from spinepipe.studies.tracking.in_space import (
    MOST_FRAMES,
    MOST_SCENES,
    boxes,
    motions_of,
    spine_in_space,
)
from spinepipe.studies.tracking.kind import KIND
from spinepipe.studies.tracking.page import READ, document, left_out, shown_tables
from spinepipe.tables import to_arrow, write

PICTURE = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'
SIZES = {
    "three persons": Size(),
    "one person, no truth": Size(1, truth=False),
    "stance alone": Size(1, ("stance",)),
    "nothing found": Size(1, failing=tuple(ERROR)),
}
LARGEST_PAGE = 12e6
"""Bytes that a browser opens without a wait."""


def results(size: Size, **changed: pd.DataFrame) -> ResultTables:
    """Made-up results with a picture."""
    made = tables_of(size, **changed)
    picture = Picture.of("kinematics", "How joints turn", PICTURE, "What it shows.")
    metadata = {name: {"seed": "7", "code_digest": name} for name in made}
    return ResultTables(made, metadata, {"kinematics": picture})


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
    assert not re.findall(r"<(?:script|link|iframe)[^>]+(?:src|href)=", page)
    assert "default-src 'none'" in page
    assert '<h2 id="findings-title">Verdict</h2>' in page
    assert "nan" not in re.sub("<[^>]*>", " ", before_scripts).lower().split()
    drawn = bool(len(tables_of(size)["drawn"]))
    assert ("drawScene();" in page) == drawn
    assert ("The spine in 3-D" in page) == drawn


def test_the_answer_stands_before_all_else() -> None:
    page = page_of(Size())
    order = ["Verdict", 'class="warning"', 'class="headline"', "Figure 1.", "The spine in 3-D"]
    places = [page.index(words) for words in [*order, "Table 1."]]
    assert places == sorted(places)


def test_tables_are_those_of_the_kind_and_empty_ones_are_left_out() -> None:
    assert set(READ) <= {table.name for table in KIND.tables}
    own = {table.name for table in KIND.tables} - {"tracked", "drawn"}
    shown = [table.name for table in shown_tables(results(Size()))]
    assert set(shown) == own, "all but the rows of each frame"
    assert shown[:4] == ["accuracy", "fits", "profiles", "against_wang_2021"]
    empty = {name: rows.iloc[:0] for name, rows in tables_of(Size(1)).items()}
    assert not shown_tables(results(Size(1), **empty))
    assert "No motion can be told" in page_of(Size(1), **empty)


def test_what_went_wrong_stands_at_the_top_of_its_table() -> None:
    made = tables_of(Size())
    made["fits"].loc[30, "status"] = "not_converged"
    made["clusters"].loc[1, ["variability_mm", "status"]] = [9.0, "not_rigid"]
    shown = {table.name: table for table in shown_tables(ResultTables(made, {}, {}))}
    assert "not_converged" in [cell.text for cell in shown["fits"].rows[0]]
    assert "not_rigid" in [cell.text for cell in shown["clusters"].rows[0]]
    # errors from the least
    place = [head.name for head in shown["accuracy"].heads].index("mean")
    first = [row[place].value for row in shown["accuracy"].rows[: len(ERROR)]]
    assert first == sorted(first, key=lambda value: value or 0.0)


def test_what_there_is_nothing_of_is_told_with_its_reason() -> None:
    assert left_out(results(Size())) == ()
    size = Size(1, truth=False, approaches=("ik", "optk_generic"))
    told = left_out(results(size))
    assert len(told) == 2
    assert "(where vertebrae truly were is not known)" in told[0]
    assert "(no approach asks for it)" in told[1]


def test_every_motion_has_a_scene_and_every_group_a_switch() -> None:
    page = page_of(Size(1))
    scenes = scenes_of(page)
    # three trials by two approaches that the study draws, what moves first, dynamics before others
    names = re.findall(r"<option>(.*?)</option>", page)
    assert names == [
        "flexion–extension, dynamics, generic",
        "flexion–extension, inverse kinematics",
        "lateral bending, dynamics, generic",
        "lateral bending, inverse kinematics",
        "stance, dynamics, generic",
        "stance, inverse kinematics",
    ]
    assert set(scenes) == set(names)
    groups = set(re.findall(r'data-group="(.*?)"', page))
    shown = {trace["meta"] for scene in scenes.values() for trace in scene["data"]}
    assert groups == shown == {"bones", "measured", "modelled"}


def test_frames_are_those_of_the_table() -> None:
    rows = tables_of(Size(1))["drawn"]
    scene = scenes_of(page_of(Size(1)))["flexion–extension, dynamics, generic"]
    own = rows[(rows["trial"] == "flexion_extension") & (rows["approach"] == "optk_generic")]
    assert [frame["name"] for frame in scene["frames"]] == ["0.00 s", "1.00 s", "2.00 s"]
    kinds = {"joint centres": "body", "markers of the model": "modelled"}
    for number, trace in enumerate(scene["data"]):
        for axis in "xyz":
            first = scene["frames"][0][axis][number]
            assert trace[axis] == first, "the scene opens with its first frame"
            assert all(len(f[axis][number]) == len(first) for f in scene["frames"])
        if trace["name"] not in kinds:
            continue
        for k, frame in enumerate(scene["frames"]):
            now = own[(own["frame"] == 10 * k) & (own["kind"] == kinds[trace["name"]])]
            told = np.array([frame[axis][number] for axis in "xyz"]).T
            # places are written to 0.1 mm
            np.testing.assert_allclose(told, now[["x_mm", "y_mm", "z_mm"]], rtol=0, atol=0.0501)


def test_a_marker_that_is_not_seen_has_no_place() -> None:
    scene = scenes_of(page_of(Size(1)))["flexion–extension, dynamics, generic"]
    number = [trace["meta"] for trace in scene["data"]].index("measured")
    assert [frame["x"][number][1] is None for frame in scene["frames"]] == [False, True, False]


def test_axes_hold_all_frames_and_millimetres_are_equally_long() -> None:
    scene = scenes_of(page_of(Size(1)))["flexion–extension, dynamics, generic"]
    shape, axes = scene["layout"]["scene"]["aspectratio"], scene["layout"]["scene"]
    spans = {}
    for letter in "xyz":
        low, high = axes[f"{letter}axis"]["range"]
        spans[letter] = high - low
        values = [v for f in scene["frames"] for trace in f[letter] for v in trace if v is not None]
        assert low < min(values) <= max(values) < high
    for one, other in ("xy", "yz"):
        assert shape[one] / shape[other] == pytest.approx(spans[one] / spans[other], rel=1e-3)


def test_a_stance_alone_has_no_player() -> None:
    page = page_of(Size(1, ("stance",)))
    assert 'id="player"' not in page
    assert all("frames" not in scene for scene in scenes_of(page).values())
    assert 'id="player"' in page_of(Size(1))
    assert not Space(scenes={"a": {"data": [], "layout": {}}}).moves


def test_boxes_turn_with_their_bodies() -> None:
    rows = tables_of(Size(1))["drawn"]
    rows["left_rotation_deg"] = rows["left_rotation_deg"].where(rows["name"] != "L3", 90.0)
    shown = next(iter(motions_of(rows)))
    corners = boxes(shown, shown.frames[0]).reshape(-1, 8, 3)
    sizes = np.ptp(corners, axis=1)
    still, turned = shown.bodies.index("L4"), shown.bodies.index("L3")
    assert sizes[still, 0] < sizes[still, 2], "a vertebra is wider than deep"
    np.testing.assert_allclose(sizes[turned], sizes[still][[2, 1, 0]])


def test_no_more_than_some_scenes_and_that_is_said() -> None:
    rows = tables_of(Size(1))["drawn"]
    many = pd.concat([rows.assign(specimen=f"p{k:02d}") for k in range(6)], ignore_index=True)
    space = spine_in_space(many)
    assert len(space.scenes) == MOST_SCENES
    assert f"{MOST_SCENES} of 36 motions are here." in space.caption
    assert next(iter(space.scenes)) == "p00, flexion–extension, dynamics, generic"


def test_the_largest_animation_leaves_the_page_small_enough() -> None:
    """Each frame of 18 bodies and 27 markers; what scripts and figures take beside them."""
    rows = tables_of(Size(1, ("flexion_extension",), approaches=("optk_generic",)))["drawn"]
    markers = rows[rows["kind"] != "body"]
    more = [markers.assign(name=markers["name"] + str(k)) for k in range(13)]
    whole = pd.concat([rows, *more], ignore_index=True)
    whole[["x_mm", "y_mm", "z_mm"]] += 123.4
    frames = next(iter(spine_in_space(whole).scenes.values()))["frames"]
    per_frame = len(json.dumps(frames, separators=(",", ":"))) / len(frames)
    figures_and_tables, plotly = 3.0e6, 5.0e6
    assert MOST_FRAMES * per_frame + figures_and_tables + plotly < LARGEST_PAGE


def test_figures_of_calibrations_are_there_where_there_are_any() -> None:
    size = Size(1)
    files = KIND.files.of(study_of(size), cohort_of(size))
    assert set(files.figures()) == {figure.name for figure in KIND.figures}
    without = Size(1, approaches=("ik", "optk_generic"))
    files = KIND.files.of(study_of(without), cohort_of(without))
    assert "stiffness_by_level" not in files.figures()


def test_figures_and_report_are_drawn_from_files(tmp_path: Path) -> None:
    project(tmp_path, OtherSize())
    shutil.copytree(FOLDER, tmp_path / "config/cohorts/tracking_phantom")
    text = "study: s\nkind: tracking\ncohort: tracking_phantom\n"
    (tmp_path / "config/studies/s.yaml").write_text(text)
    files = {}
    for name, rows in tables_of(Size()).items():
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
    captions = [str(caption("tracking", figure.name)) for figure in KIND.figures]
    report.run(str(tmp_path), "s", "full", list(files.values()), pictures, captions, str(page))
    text = page.read_text(encoding="utf-8")
    for figure in KIND.figures:
        assert f"{figure.title}." in text
    assert page.stat().st_size < LARGEST_PAGE

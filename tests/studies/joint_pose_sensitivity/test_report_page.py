"""The report of a study: one file that fetches nothing, true to its tables, usable by keyboard."""

import json
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pandas as pd
from identification_cases import METADATA, identification, write_table
from spinepipe.report.page.document import Picture, ResultTables
from spinepipe.report.page.scene import CORNERS, LONE_DISC_MM, MOST_POSES, as_script, scenes, solids
from study_cases import STUDY, Size, project, results
from sweeps import sweep

from spinepipe.cohort import Cohort
from spinepipe.frames import Pose
from spinepipe.jobs import report
from spinepipe.report.page.tables import sortable
from spinepipe.report.specimen import view_of
from spinepipe.schema import Column
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.page import document, folded, in_full
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import StudyTables, read_frame

PICTURE = '<svg xmlns="http://www.w3.org/2000/svg"><!-- &amp; --></svg>'
VOID = {"meta", "link", "img", "input", "br", "hr"}
ODD = "<b>&\"'</script>"


class Page(HTMLParser):
    """Elements of a page with their attributes, and the text of some of them."""

    def __init__(self, text: str) -> None:
        """Read a whole page."""
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.texts: list[tuple[str, str]] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Elements end in the order in which they were opened."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Note text by the element it stands in."""
        if data.strip():
            self.texts.append((self.open[-1] if self.open else "", data))

    def all(self, tag: str) -> list[dict[str, str]]:
        """Attributes of all elements of a kind."""
        return [attributes for name, attributes in self.elements if name == tag]

    def text(self, tag: str) -> list[str]:
        """Texts that stand directly in elements of a kind."""
        return [" ".join(data.split()) for name, data in self.texts if name == tag]


def made(root: Path, size: Size) -> tuple[str, list[Path]]:
    """A report of made-up results by the job; returns its text and the table files."""
    folder = results(project(root, size), size)
    identification(folder, size)
    files = sorted(folder.glob("*.parquet"))
    pictures = {"stiffness": PICTURE, "errors": PICTURE}
    for name, content in pictures.items():
        (folder / f"{name}.svg").write_text(content)
        (folder / f"{name}.rst").write_text(f"What {name}\nshows & means.\n")
    svgs, captions = (
        [str(folder / f"{name}.{kind}") for name in pictures] for kind in ("svg", "rst")
    )
    report.run(
        *(str(root), STUDY, "report", [str(file) for file in files]),
        *(svgs, captions, str(folder / "report.html")),
    )
    return (folder / "report.html").read_text(encoding="utf-8"), files


def html(study: JointPoseSensitivity, cohort: Cohort, results: ResultTables) -> str:
    """The page of a study."""
    return document(study, cohort, results).html(study, cohort)


@cache
def page(size: Size) -> tuple[Page, str]:
    """A report, read, and its text."""
    text, _ = made(Path(mkdtemp()), size)
    return Page(text), text


SIZES = {
    "one specimen": Size(("a",), 2, 12),
    "many specimens": Size(tuple(f"s{n}" for n in range(9)), 3, 3),
    "nothing solved": Size(solved=False),
}


@sweep("size", SIZES.values())
def test_nothing_is_fetched(size: Size) -> None:
    found, text = page(size)
    for tag, attributes in found.elements:
        for name in ("src", "href", "data", "action", "srcset", "poster"):
            address = attributes.get(name, "#")
            assert address.startswith(("#", "data:image/svg+xml;base64,")), (tag, address)
    assert not found.all("link")
    assert not re.search(r"@import|url\(", "".join(found.text("style")))
    (policy,) = [m["content"] for m in found.all("meta") if "http-equiv" in m]
    assert policy.startswith("default-src 'none'"), "the browser itself refuses to fetch"
    assert "http:" not in policy + "".join(found.text("noscript"))
    assert "Plotly.react" in text


def test_same_bytes_twice(tmp_path: Path) -> None:
    size = SIZES["many specimens"]
    assert made(tmp_path / "1", size)[0] == made(tmp_path / "2", size)[0]


@sweep("size", SIZES.values())
def test_ids_are_unique_and_what_points_at_them_finds_them(size: Size) -> None:
    found, _ = page(size)
    ids = [attributes["id"] for _, attributes in found.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = [a["href"][1:] for a in found.all("a")]
    targets += [a["aria-labelledby"] for _, a in found.elements if "aria-labelledby" in a]
    assert targets
    assert set(targets) <= set(ids)


def test_every_figure_is_there_with_number_title_and_caption() -> None:
    found, text = page(SIZES["one specimen"])
    images = found.all("img")
    assert len(images) == 3, "and the segment, for paper and for readers without scripts"
    assert all(image["alt"] for image in images)
    assert found.text("b") == [
        "Figure 1. Calibrated stiffness.",
        "Figure 2. Errors of predicted motion.",
    ]
    assert found.text("figcaption") == [
        "What stiffness shows & means.",
        "What errors shows & means.",
    ]
    assert "shows &amp; means" in text


def test_headings_are_buttons_that_tell_what_the_column_means() -> None:
    found, text = page(SIZES["one specimen"])
    heads = [h for h in found.all("th") if "aria-sort" in h]
    buttons = found.all("button")
    assert len(heads) == len(buttons) > 50
    assert {h["aria-sort"] for h in heads} == {"none"}
    assert {h["scope"] for h in heads} == {"col"}
    assert all(b["type"] == "button" and b["title"] for b in buttons)
    scrolled = [a for a in found.all("div") if "wide" in a.get("class", "").split()]
    assert all(a.get("tabindex") == "0" and a.get("role") == "group" for a in scrolled)
    assert 'document.querySelectorAll("table.sortable th button")' in text
    assert 'head.setAttribute("aria-sort", falling ? "descending" : "ascending")' in text


def test_tables_read_without_script() -> None:
    found, text = page(SIZES["one specimen"])
    cells = [a["data-v"] for a in found.all("td") if "data-v" in a]
    assert np.isfinite([float(value) for value in cells]).all()
    assert "too many poses are above the limit even at 0.5 mm" in text
    assert len(found.all("tr")) > 30
    assert any("JavaScript" in words for words in found.text("p"))


def test_findings_are_the_numbers_of_the_tables() -> None:
    told = page(SIZES["one specimen"])[0].text("li")
    assert told[0].startswith("12 fits of 12 (100 %) are in the reduced dataset: 12 ended")
    assert "0 had not moved (all free stiffnesses within 1 % of the start)" in told[0]
    assert "flexion–extension 37.0 N m/rad (IQR 18.5 to 74.0)" in told[1]
    assert told[2].startswith("Over 6 load points, ")
    assert "more of the variance than stiffness in 4 and stiffness more in 0." in told[3]
    assert "stiffness fitted to each pose 1.25 mm (1.00–1.50)" in told[4]
    assert "forward run default step 1 of 6 (least cost reached: 1)" in told[5]
    many = page(SIZES["many specimens"])[0].text("li")
    assert many[0].startswith("27 fits of 27")
    assert "37.0 N m/rad in all 9 specimens" in many[1]
    assert "1.25 mm (smallest of 9 specimens, s0)" in many[4]
    assert "forward run default step 9 of 54" in many[5]


def test_comparison_with_the_paper_is_counted_and_shown(tmp_path: Path) -> None:
    verdicts = ["inside"] * 3 + ["outside"] * 2 + ["contradicted", "not_computed"]
    same = {"where": "Table 1", "unit": "mm", "paper": 1.0, "limit": "two_sided"}
    same |= {"reason": "as <it> is", "evidence": "independent"}
    rows = [
        {**same, "id": f"q{n}", "quantity": f"quantity {n}", "ours": float(n), "verdict": verdict}
        for n, verdict in enumerate(verdicts)
    ]
    rows[5]["evidence"] = "contradicted"
    size = SIZES["one specimen"]
    folder = results(project(tmp_path, size), size)
    against = read_frame(write_table(folder, "against_gould_2024a", rows))
    study, cohort = study_and_cohort(str(tmp_path), STUDY)
    poses = read_frame(folder / "poses.parquet")
    tables = StudyTables({"poses": poses, "against_gould_2024a": against})
    found = Page(html(study, cohort, ResultTables(tables, {}, {})))
    (told,) = found.text("li")
    assert "Of 6 published quantities that are evidence ours are inside the paper's range" in told
    assert "for 3 and outside for 2; 1 are not computed. Of the 3 inside, 3 lie in a" in told
    assert "Not counted: 1 that other numbers of the paper exclude." in told
    heads = found.text("button")
    first = ["quantity", "unit", "paper", "ours", "limit", "verdict", "reason", "where"]
    assert heads == [*first, *first, "evidence"]
    assert found.text("summary")[0] == "1 rows"
    assert found.text("td").count("as <it> is") == 7


def test_without_results_the_page_says_so() -> None:
    found, _ = page(SIZES["nothing solved"])
    told = found.text("li")
    assert told[0].startswith("0 fits of 24 (0 %) are in the reduced dataset: 0 ended")
    assert "too many poses are above the limit even at 0.5 mm" not in told[0]
    assert not any("Median stiffness" in words for words in told)


def test_a_study_of_few_tables_has_a_page(tmp_path: Path) -> None:
    size = SIZES["one specimen"]
    folder = results(project(tmp_path, size), size)
    study, cohort = study_and_cohort(str(tmp_path), STUDY)
    few = ResultTables(StudyTables.read([folder / "poses.parquet"]), {}, {})
    found = Page(html(study, cohort, few))
    assert "There are no findings: no table has a result." in found.text("p")


def test_what_was_run_is_what_the_files_say() -> None:
    found, text = page(SIZES["one specimen"])
    facts = dict(zip(found.text("dt"), found.text("dd"), strict=True))
    assert facts["seed"] == METADATA["seed"]
    assert facts["python"] == METADATA["version_python"]
    assert facts["cohort digest"] == METADATA["cohort_digest"]
    assert "counts".ljust(64, "0") in text
    (settings,) = found.text("pre")
    assert "study: probe" in settings


def odd(cohort: Cohort) -> Cohort:
    """The same cohort, whose specimen is called something that HTML would take for itself."""
    named = {
        name: None if table is None else table.assign(specimen=table["specimen"].replace("a", ODD))
        for name in ("specimens", "landmarks", "joints", "bodies", "loads", "motion")
        for table in (getattr(cohort, name),)
    }
    return replace(cohort, title=ODD, source=ODD, **named)


def test_odd_names_are_text_and_nothing_else(tmp_path: Path) -> None:
    size = SIZES["one specimen"]
    folder = results(project(tmp_path, size), size)
    files = identification(folder, size)
    study, cohort = study_and_cohort(str(tmp_path), STUDY)
    read = StudyTables.read([*files, folder / "poses.parquet"])
    tables = StudyTables({n: frame.replace({"specimen": {"a": ODD}}) for n, frame in read.items()})
    metadata = {"counts": {"seed": ODD}}
    pictures = {ODD: Picture.of(ODD, ODD, PICTURE, ODD)}
    text = html(study, odd(cohort), ResultTables(tables, metadata, pictures))
    found = Page(text)
    assert f"({1} specimen: {ODD};" in " ".join(" ".join(found.text("p")).split())
    assert len(found.all("b")) == 1, "only the title of the one figure"
    assert "<b>&" not in text
    assert len(found.all("script")) == 4, "none was ended early or begun"
    (data,) = [d for tag, d in found.texts if tag == "script" and d.startswith("{")]
    assert list(json.loads(data)) == [ODD]


def test_script_data_survives_what_html_would_read() -> None:
    scene = {"</script><b>&": [1.5, None]}
    text = as_script(scene)
    assert json.loads(text) == scene
    assert not set("<>&") & set(text)


def test_scene_shows_frames_of_both_kinds(tmp_path: Path) -> None:
    size = Size(("a", "b"), 2, 250)
    folder = results(project(tmp_path, size), size)
    study, cohort = study_and_cohort(str(tmp_path), STUDY)
    views = [view_of(cohort, name, study.tests) for name in cohort.specimen_names]
    drawn = scenes(views, cohort, read_frame(folder / "poses.parquet"))
    assert list(drawn) == ["a", "b"]
    traces = {trace["name"]: trace for trace in drawn["a"]["data"]}
    own = traces["superior axis, own"]
    assert own["x"] == [0.0, 0.0, None] * 2
    assert own["y"][:2] == [5.0, 16.0], "from the joint's origin 11 mm upwards"
    lines = len(traces["superior axis, sampled"]["x"]) // 3
    assert lines == 2 * 84, "of 250 poses every third, two joints each"
    assert lines <= 2 * MOST_POSES
    assert traces["flexion: 20 N"]["y"][0] == 36.0 * 2 + 13.0, "ends where the load acts"
    titles = [drawn["a"]["layout"]["scene"][f"{x}axis"]["title"]["text"] for x in "xyz"]
    assert titles == ["anterior (mm)", "superior (mm)", "right (mm)"]


def test_only_some_specimens_are_drawn_and_the_page_says_so() -> None:
    found, text = page(SIZES["many specimens"])
    assert found.text("option") == [f"s{n}" for n in range(6)]
    assert "The first 6 of 9 specimens." in " ".join(text.split())
    assert not page(SIZES["one specimen"])[0].all("select")


def test_solids_of_vertebrae_with_two_endplates_one_or_none() -> None:
    centre = {"inferior_endplate_centre": np.zeros(3)}
    both = {**centre, "superior_endplate_centre": np.array([0.0, 0.03, 0.0])}
    both |= {
        f"{side}_pedicle_base": np.array([0.0, 0.02, z])
        for side, z in (("left", -0.01), ("right", 0.01))
    }
    frames = dict.fromkeys(("A", "B", "C"), Pose(np.eye(3), np.zeros(3)))
    found = solids({"A": both, "B": centre, "C": {}}, frames, 1000.0)
    assert set(found) == {"A", "B"}
    points = found["A"].points
    assert points.shape == (2 * CORNERS + 2, 3)
    np.testing.assert_allclose(np.hypot(points[:-2, 0], points[:-2, 2]), 10.0)
    np.testing.assert_allclose(points[CORNERS : 2 * CORNERS, 1], 30.0)
    np.testing.assert_allclose(found["B"].points[-1], [0.0, LONE_DISC_MM, 0.0])
    assert found["A"].triangles.shape == (4 * CORNERS, 3)
    assert found["A"].triangles.max() == 2 * CORNERS + 1


def test_repeated_tests_are_folded_and_counted() -> None:
    one = {"specimen": "a", "family": "F", "test": "T", "joint": "*", "response": "r"}
    one |= {"factor": "f", "effect_name": "rho", "family_size": 4}
    numbers = [(0.9, 0.001, 0.004, 0.004), (-0.5, 0.02, 0.08, 0.04), (0.8, 0.002, 0.008, 0.006)]
    rows = [
        {**one, "stratum": str(k), "effect": e, "p": p, "p_bonferroni": b, "p_holm": h}
        for k, (e, p, b, h) in enumerate(numbers)
    ]
    rows.append({**one, "stratum": "3", **dict.fromkeys(("effect", "p", "p_bonferroni", "p_holm"))})
    rows.append({**one, "family": "G", "stratum": "", "p": 0.5})
    frame = pd.DataFrame(rows)
    assert list(in_full(frame)["family"]) == ["G"]
    (row,) = folded(frame, 0.05).to_dict("records")
    assert (row["tests"], row["with_result"], row["significant"]) == (4, 3, 3)
    assert (row["bonferroni"], row["holm"]) == (2, 3)
    assert (row["effect_lowest"], row["effect_highest"]) == (0.8, 0.9)


def test_columns_that_say_nothing_are_left_out_and_units_stand_in_the_heading() -> None:
    columns = [
        Column("specimen", "text", "name"),
        Column("sd_mm", "number", "spread", "mm", nullable=True, empty="none"),
        Column("message", "text", "words"),
        Column("kept", "flag", "whether"),
    ]
    frame = pd.DataFrame(
        {"specimen": "a", "sd_mm": [0.1234, np.nan], "message": "", "kept": [True, False]}
    )
    found = sortable("t", "T", "about", frame, columns)
    assert [(head.name, head.unit) for head in found.heads] == [("sd", "mm"), ("kept", "")]
    assert found.heads[0].meaning == "spread; empty: none"
    assert [[cell.text for cell in row] for row in found.rows] == [["0.123", "yes"], ["", "no"]]
    assert found.rows[0][0].value == 0.1234
    assert found.rows[1][0].value is None
    long = sortable("t", "T", "about", pd.DataFrame({"specimen": list("ab") * 400}), columns)
    assert len(long.rows) == 400
    assert long.note == "The first 400 of 800 rows; all of them are in t.parquet."

"""No name and no text of anybody becomes markup, in page or figures of any kind of study.

Catches a name that becomes markup in a page or a figure.
"""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from drawn import drawings
from hostile import HARMLESS, PAYLOAD, Structure, mapped, renamed
from made_pages import made_page, page_of, results_of
from made_results import MAKERS, Made, made
from sweeps import sweep

from spinepipe.documents.names import folder_fault, name_fault
from spinepipe.marks import marked
from spinepipe.report.page.origin import origin
from spinepipe.report.specimen import view_of
from spinepipe.report.specimen_page import specimen_page
from spinepipe.studies.registry import kind_names, kind_of

ROOT = Path(__file__).resolve().parents[2]
SHORT = "<script>&\"'-->]]></svg>"


def assert_alike(hostile: str, harmless: str) -> None:
    """Both pages have the same elements and attributes, and run the same scripts."""
    found, expected = Structure(hostile), Structure(harmless)
    assert found.elements == expected.elements
    assert not [one for one in found.elements if re.search(r" on\w+( |$)", one)]
    for address in found.addresses:
        assert address.startswith(("#", "data:image/svg+xml;base64,")), address
    own = [script for script in found.scripts if not script.startswith("{")]
    assert own == [script for script in expected.scripts if not script.startswith("{")]
    assert all("<" not in script for script in found.scripts if script.startswith("{"))


@pytest.fixture(params=sorted(MAKERS), scope="module")
def results(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Made-up results of each kind in turn."""
    return made(request.param, tmp_path_factory.mktemp(request.param))


def test_every_kind_is_tried() -> None:
    assert set(MAKERS) == set(kind_names())


@pytest.mark.filterwarnings("ignore:constrained_layout not applied:UserWarning")
def test_names_of_people_never_become_markup(results: Made, tmp_path: Path) -> None:
    """Specimens, vertebrae, tests, tasks, persons, trials, messages: all end with the payload."""
    pages = []
    for payload in (PAYLOAD, HARMLESS):
        found = renamed(results, payload, tmp_path)
        pages.append(page_of(found))
    # films are of persons, whom that page does not name row by row
    least = 3 if results.study.kind == "scoliosis" else 10
    assert pages[0].count("&lt;script&gt;alert(1)") > least, "they do stand in the page"
    assert_alike(*pages)


@sweep("kind", ["joint_pose_sensitivity", "discrepancy"])
def test_no_text_of_a_page_becomes_markup(kind: str, tmp_path: Path) -> None:
    """Each text of page, settings and cohort ends with the payload; names of ours stay.

    All kinds have one template.
    """
    results = made(kind, tmp_path)
    whole = replace(made_page(results), scenes=[])
    pages = []
    for payload in (PAYLOAD, HARMLESS):

        def change(text: str, payload: str = payload) -> str:
            return text if re.fullmatch(r"[a-z_0-9]*", text) else text + payload

        study, told = mapped(results.study, change), mapped(whole, change)
        words = {"title": change("t"), "source": change("s")}
        cohort = type(results.cohort)(**{**vars(results.cohort), **words})
        pages.append(told.html(_as_settings(study), cohort, results_of(results)))
    assert_alike(*pages)


def _as_settings(study: Any) -> Any:
    """Settings that may hold any text when they are written out."""
    plain = json.loads(json.dumps(mapped(dict(study), lambda text: text), default=str))

    class Written:
        study, kind = plain["study"], plain["kind"]

        def model_dump(self, mode: str) -> Any:
            return plain

    return Written()


@pytest.mark.filterwarnings("ignore:constrained_layout not applied:UserWarning")
def test_the_page_of_a_specimen_holds_no_markup_of_names(tmp_path: Path) -> None:
    """`spinepipe show`: name, title, tests, vertebrae and all numbers as text."""
    found = made("joint_pose_sensitivity", tmp_path)
    pages = []
    for payload in (PAYLOAD, HARMLESS):
        cohort = renamed(found, payload, tmp_path).cohort
        pages.append(specimen_page(cohort, view_of(cohort, cohort.specimen_names[0])))
    # films are of persons, whom that page does not name row by row
    least = 3 if results.study.kind == "scoliosis" else 10
    assert pages[0].count("&lt;script&gt;alert(1)") > least, "they do stand in the page"
    assert_alike(*pages)


def test_settings_are_shown_as_text(results: Made) -> None:
    """YAML of settings is written by the safe writer, which names no types to build."""
    assert "!!" not in origin(results.study, {}).settings


@pytest.mark.filterwarnings("ignore:constrained_layout not applied:UserWarning")
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[pytest.mark.full] * (kind not in ("range_of_motion", "tracking")))
        for kind in sorted(MAKERS)
    ],
)
def test_no_name_becomes_an_element_of_a_figure(kind: str, tmp_path: Path) -> None:
    """Names are text of the drawing."""
    found = renamed(made(kind, tmp_path / "made"), SHORT, tmp_path)
    figures = [f for f in kind_of(kind).figures if set(f.tables) <= set(found.tables)]
    figure = next((f for f in figures if set(f.reads) <= {*found.tables, "verdict.json"}), None)
    assert figure is not None
    chart = drawings(kind)[figure.name](found.study, found.cohort, found.tables)
    assert_is_a_drawing(marked(chart.svg(), ".svg", "0" * 64))


DRAWN = {"svg", "g", "path", "defs", "use", "clipPath", "rect", "style", "image", "text", "pattern"}
DRAWN |= {"title", "desc"}


def assert_is_a_drawing(svg: bytes) -> None:
    """Shapes and nothing that runs, is fetched or ends the drawing early."""
    for element in ElementTree.fromstring(svg).iter():
        assert element.tag.split("}")[-1] in DRAWN
        for name, value in element.attrib.items():
            assert not name.split("}")[-1].startswith("on")
            if name.endswith("href"):
                assert value.startswith(("#", "data:image/png;base64,"))
    assert b"<script" not in svg


@sweep("text", [PAYLOAD, SHORT, "<b>", "a&lt;b", "javascript:alert(1)//<"])
def test_such_names_are_refused_already(text: str) -> None:
    assert name_fault(text)
    assert folder_fault(text)


def test_only_the_page_vouches_for_markup() -> None:
    """`Markup` is said of its own parts alone; no template switches the escaping off."""
    vouching = re.compile(r"Markup|from_string|get_template|markupsafe|jinja2")
    users = {
        path.relative_to(ROOT / "spinepipe").as_posix()
        for path in (ROOT / "spinepipe").rglob("*.py")
        if vouching.search(path.read_text(encoding="utf-8"))
    }
    assert users == {
        "report/forms/chart.py",
        "report/page/study_page.py",
        "report/viewer/figure.py",
    }
    for template in (ROOT / "spinepipe/report").rglob("*.html"):
        assert not re.search(r"\|\s*safe|autoescape", template.read_text("utf-8")), template.name
    for script in (ROOT / "spinepipe/report").rglob("*.js"):
        unsafe = r"innerHTML|outerHTML|document\.write|insertAdjacentHTML|eval\("
        assert not re.search(unsafe, script.read_text("utf-8")), script.name

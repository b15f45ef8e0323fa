"""The page of all studies: what each says, its state, and no name that becomes markup.

Catches a study that is missing or stands below another question, a state that is told too well, a
failed job that nobody is told of, an address that leads nowhere, a name that becomes markup.
"""

import json
import os
import re
from html import unescape
from pathlib import Path

import pytest
import stored_studies as cases
from hostile import HARMLESS, PAYLOAD, Structure
from stored_studies import FIRST, SECOND
from sweeps import sweep

from spinepipe.cli import main
from spinepipe.jobs.expected import Expected
from spinepipe.marks import write_marked
from spinepipe.report.overview.index import Entry, entry, write_index
from spinepipe.report.overview.stored import StoredFiles, stored_files
from spinepipe.studies.read import check
from spinepipe.studies.registry import every_kind
from spinepipe.tables import read

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A project of two studies, both with results."""
    root = cases.project(tmp_path / "project")
    (root / "spinepipe").symlink_to(ROOT / "spinepipe")  # captions of figures
    for name in (FIRST, SECOND):
        cases.store(root, name, cases.conclusions())
    return root


def page(root: Path, **up_to_date: bool | None) -> str:
    return write_index(root, up_to_date).read_text("utf-8")


def fail(root: Path, name: str, words: str, at: float | None = None) -> Path:
    """The log of a job that failed, and an empty one of a job that went well."""
    log = root / "results" / name / "logs" / "simulate" / "specimen-a.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_text(f"job simulate study={name}: {words}\nTraceback\n")
    (log.parent / "specimen-b.log").write_text("")
    made = (root / "results" / name / "report.html").stat().st_mtime
    os.utime(log, (made + (at or 1.0),) * 2)
    return log


def test_both_studies_stand_below_their_question_in_the_order_of_config(root: Path) -> None:
    told = page(root, first=True, second=True)
    headings = re.findall(r'<h2 id="[^"]+">([^<]+)</h2>', told)
    assert headings == [every_kind()["range_of_motion"].question]
    assert re.findall(r'<b><a href="([^"]+)">', told) == [
        "second/report.html",
        "first/report.html",
    ]
    key_number = f"9.0 (8.0 to 10.0)°: {cases.KEY_NUMBER}"
    assert told.count(cases.ANSWER) == told.count(key_number) == 2
    assert told.count("Simulated data</span>") == 2
    assert told.count("3 specimens, L1–L4") == 2
    assert "2 studies, all up to date" in told
    assert "No answer is stored" not in told


@sweep(
    "header, tag",
    [
        ("made_up: true", "Simulated data"),
        ("rebuilt: true", "Rebuilt from print"),
        ("made_up: false", "Measured data"),
        ("vertebrae: [unclosed", ""),
    ],
)
def test_a_tag_tells_whether_anybody_was_measured(header: str, tag: str, tmp_path: Path) -> None:
    root = cases.project(tmp_path)
    (root / "config/cohorts/stack/cohort.yaml").write_text(f"cohort: stack\n{header}\n")
    assert entry(root, FIRST, {}).tag == tag


def test_every_kind_has_a_question() -> None:
    assert all("Other" not in kind.question for kind in every_kind().values())


def test_lights_are_counted_by_sentence_and_shown_the_most_urgent_first(root: Path) -> None:
    number = ("n", 3.0, "", None, None)
    lights = [
        cases.conclusion("light", "data", "stop", "Data: wrong.", number, ("m", 1.0, "", 0.0, 2.0)),
        cases.conclusion("light", "more", "check", "More: few."),
    ]
    cases.store(root, FIRST, [*cases.conclusions(), *lights])
    found = entry(root, FIRST, {})
    assert found.lights == [("stop", "■", 1), ("check", "▲", 2), ("ok", "●", 1)]


def test_the_same_results_give_the_same_page(root: Path) -> None:
    assert page(root, first=True) == page(root, first=True)


def test_day_and_size_are_of_the_files(root: Path) -> None:
    folder = root / "results" / FIRST
    for path in folder.glob("*.parquet"):
        os.utime(path, (0, 86400.0 * 59))  # 1 March 1970
    os.utime(folder / "conclusions.parquet", (0, 86400.0 * 90))  # made with the page
    (folder / "large.csv").write_bytes(bytes(2_000_000))
    found = entry(root, FIRST, {})
    assert found.day == "1 Mar 1970"
    assert found.size == "2.0 MB"
    assert found.files.bytes == sum(path.stat().st_size for path in folder.iterdir())


STATES = {
    "up to date": (True, ()),
    "changed since": (False, ()),
    "not checked": (..., ()),
    "unsound": (None, ()),
    "failed": (False, ("log",)),
    "not finished": (False, ("no page",)),
    "not run": (..., ("nothing",)),
}


@sweep("state", STATES)
def test_a_state_is_told(state: str, tmp_path: Path) -> None:
    asked, changes = STATES[state]
    root = cases.project(tmp_path / "project")
    folder = cases.store(root, FIRST, cases.conclusions())
    if "log" in changes:
        fail(root, FIRST, "it broke")
    if "no page" in changes:
        (folder / "report.html").unlink()
    if "nothing" in changes:
        for path in folder.iterdir():
            path.unlink()
    found = entry(root, FIRST, {} if asked is ... else {FIRST: asked})
    assert found.state == state
    assert bool(found.address) == ("no page" not in changes and "nothing" not in changes)


def test_a_failed_job_is_told_with_its_reason_and_its_log(root: Path) -> None:
    log = fail(root, FIRST, "the disk is <full>")
    told = page(root, first=False, second=True)
    assert "2 studies: 1 up to date, 1 failed" in told
    assert f"job simulate study={FIRST}: the disk is &lt;full&gt;" in told
    assert "Traceback" not in told
    (address,) = re.findall(r'href="([^"]+)">Log', told)
    assert (root / "results" / address.replace("%3D", "=")) == log


def test_a_failure_that_a_page_has_outlived_is_none(root: Path) -> None:
    fail(root, FIRST, "it broke", at=-10.0)
    assert stored_files(root / "results" / FIRST).failure is None
    fail(root, FIRST, "it broke")
    assert entry(root, FIRST, {FIRST: True}).state == "up to date"  # settings of before


def test_results_whose_study_is_gone_and_other_folders(root: Path) -> None:
    (root / "config/studies/first.yaml").unlink()
    (root / "results/show").mkdir()
    (root / "results/show/first.png").write_bytes(b"")
    told = page(root)
    assert "Its study file is gone" in told
    assert "show" not in re.findall(r"<b><\w+[^>]*>([^<]+)<", told)


def test_damaged_conclusions_are_told_and_stop_nothing(root: Path) -> None:
    path = root / "results/first/conclusions.parquet"
    path.write_bytes(path.read_bytes()[:-20])
    told = page(root)
    assert "results/first/conclusions.parquet is damaged" in told
    assert str(root) not in told
    assert "No answer is stored." in told
    assert told.count(cases.ANSWER) == 1


def test_an_empty_project_has_a_page(tmp_path: Path) -> None:
    root = cases.project(tmp_path)
    told = page(root)
    assert "No study has run yet." in told
    assert {"first", "second"} <= set(re.findall(r"<b><span>(\w+)</span></b>", told))


def made(root: Path, name: str) -> Expected:
    """All results of a study with the marks that they must have."""
    expected = Expected(str(root), *check(root, name, starting=False))
    for path in map(root.joinpath, expected.files.results()):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"" if path.suffix != ".html" else path.read_bytes())
    write_marked("a page", root / expected.files.page(), expected.of_report("report"))
    return expected


def test_the_command_tells_by_digests_what_is_up_to_date(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    expected = made(root, FIRST)
    assert main(["--root", str(root), "index"]) == 0
    path = root / "results/index.html"
    assert capsys.readouterr().out.splitlines() == [
        "up to date    first",
        "changed since second",
        f"Page: {path}",
        "Next: spinepipe why second, or  spinepipe run second",
    ]
    assert "2 studies: 1 up to date, 1 changed since" in path.read_text()
    lost = root / expected.files.results()[0]
    lost.unlink()
    assert not expected.is_up_to_date
    study = root / "config/studies/second.yaml"
    study.write_text(study.read_text().replace("seed: 2", "seed: many"))
    assert main(["--root", str(root), "index"]) == 0
    told = path.read_text()
    assert "spinepipe check second says why" in told
    assert "2 studies: 1 changed since, 1 unsound" in told


def test_texts_of_people_never_become_markup(tmp_path: Path) -> None:
    """Of conclusions, messages and cohorts; the same page with harmless texts has its elements."""
    pages = []
    for payload in (PAYLOAD, HARMLESS):
        root = cases.project(tmp_path / str(len(pages)))
        told = [
            cases.conclusion(place, f"r{payload}", f"ok_{payload}", f"{place} {payload}")
            for place in ("answer", "key", "light")
        ]
        cases.store(root, FIRST, told)
        fail(root, FIRST, payload)
        header = root / "config/cohorts/stack/cohort.yaml"
        text = header.read_text().replace("[L4, ", f"[{json.dumps(payload)}, ")
        header.write_text(text)
        pages.append(page(root, first=False))
    hostile, harmless = map(Structure, pages)
    assert unescape(pages[0]).count(PAYLOAD) >= 4
    assert hostile.elements == harmless.elements
    assert hostile.scripts == harmless.scripts
    assert hostile.addresses == harmless.addresses
    assert "default-src 'none'" in pages[0]


def test_a_folder_with_a_hostile_name_leads_nowhere_else(root: Path) -> None:
    name = "javascript:alert(1)"
    cases.store(root, name, cases.conclusions())
    addresses = Structure(page(root)).addresses
    assert "javascript%3Aalert%281%29/report.html" in addresses


def test_an_entry_without_numbers_is_complete() -> None:
    files = StoredFiles(0, None, False, None)
    bare = Entry("s", "", "?", "", "", "not run", "", "", (), files)
    assert (bare.answer, bare.key, bare.lights, bare.day, bare.size) == ("", "", [], "", "0.1 MB")


def test_stored_tables_read_as_written(root: Path) -> None:
    """Of the made-up cases themselves: order is kept where rows of sentences are apart."""
    folder = root / "results" / FIRST
    rows = read(folder / "conclusions.parquet").to_pylist()
    assert [row["order"] for row in rows] == [0, 1, 2, 3]
    assert entry(root, FIRST, {}).told[0].values["motion"].low == 8.0

"""No name and no link leads out of the folder it belongs to.

Catches a name or link by which a job reads or writes outside of its folder.
"""

import os
from collections.abc import Iterator
from pathlib import Path

import cohort_study_cases
import pytest
import tracked_cohort
import trunk_table_cases
from cohort_cases import swap, write
from hostile import mapped
from hypothesis import given, settings
from hypothesis import strategies as st
from made_results import MAKERS, Made, made
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.documents.inside import leads_out
from spinepipe.documents.names import folder_fault, name_fault
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.registry import kind_of
from spinepipe.studies.study_files import StudyFiles
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.tracking.checks import check_tracking
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.trials import FORMS
from spinepipe.studies.trunk_loads.checks import check_trunk

DOCUMENT = YamlDocument("s.yaml", {}, {})
SPECIMEN, TEST = "Specimen0", "Test0"
LONGEST_PART = 255
"""Bytes that systems allow in the name of a folder or file."""

WRONG = (
    *("..", ".", "../x", "a/b", "/etc/passwd", "~", "~root", "a/../../b", "C:\\x", "a\\b", "a..b"),
    *("\\\\host\\share", "//host/share", "con", "NUL", "aux.txt", "lpt1", "a\0b", "a\nb", "a.", ""),
    *(" a", "-rf", ".hidden", "a=b", "{a}", "$(a)", "`a`", "a;b", "a|b", "*", "x" * 61, "a\u202eb"),
    *("\uff0e\uff0e", "\u2024\u2024", "a\u2215b", "\U00010428" * 60),
)
"""Names that mean a folder, a device, an option or a command somewhere."""


@sweep("name", WRONG)
def test_names_that_mean_something_to_a_system_are_refused(name: str) -> None:
    assert name_fault(name)
    assert folder_fault(name)


def files_of(found: Made) -> StudyFiles:
    """The files of a study whose first specimen and first test have names that can be found."""
    names = {found.cohort.specimen_names[0]: SPECIMEN}
    trials = found.cohort.further.get("trials")
    names |= {} if trials is None else {trials["trial"].iloc[0]: TEST}
    cohort = mapped(found.cohort, lambda text: names.get(text, text))
    study = found.study
    if study.kind == "cohort_stiffness":
        study = cohort_study_cases.study_of(cohort_study_cases.Size(), tests=(TEST, "b", "c"))
    return kind_of(study.kind).files.of(study, cohort)


def paths_of(files: StudyFiles) -> Iterator[str]:
    """Every file that a study may have."""
    yield from files.results()
    for table in (*files.made_of_jobs, *files.by_specimen):
        yield from files.block_files(table)
    for table in files.made_of_jobs:
        for specimen, block in files.blocks(table):
            yield from files.job_files(table, specimen, block)


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, str]]:
    """Files of small studies of every kind that hang on names, each with its study's folder."""
    found = set()
    for kind in MAKERS:
        files = files_of(made(kind, tmp_path_factory.mktemp(kind)))
        named = {path for path in paths_of(files) if SPECIMEN in path or TEST in path}
        assert any(SPECIMEN in path for path in named) == bool(files.made_of_jobs), kind
        assert any(TEST in path for path in named) == (kind in ("cohort_stiffness", "tracking"))
        found |= {(files.folder, path) for path in named}
    return sorted(found)


NAMES = st.one_of(
    st.text("ab./\\~:-_ é·%€", min_size=1, max_size=8),
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12),
    st.sampled_from(WRONG),
    st.text("\U00010428\u4e00aä", min_size=50, max_size=60),
)


@settings(max_examples=100)
@given(NAMES)
def test_any_accepted_name_stays_below_the_folder_of_its_study(
    paths: list[tuple[str, str]], name: str
) -> None:
    accepted = {SPECIMEN: folder_fault(name), TEST: name_fault(name)}
    for token in (token for token, fault in accepted.items() if fault is None):
        for folder, pattern in paths:
            path = pattern.replace(token, name)
            assert os.path.normpath(path) == path
            assert path.startswith(f"{folder}/")
            assert path.count("/") == pattern.count("/")
            assert max(len(part.encode()) for part in path.split("/")) <= LONGEST_PART


def told(folder: Path) -> list[InputProblem]:
    """What is said of a cohort."""
    try:
        cohorts.read(folder)
    except InputError as error:
        return list(error.problems)
    return []


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A sound cohort."""
    return write(tmp_path / "cohorts" / "small")


@sweep("name", ["cohort.yaml", "specimens.csv", "loads.csv"])
@sweep("dead", [False, True])
def test_links_out_of_a_cohort_are_refused(tmp_path: Path, name: str, dead: bool) -> None:
    folder, elsewhere = write(tmp_path / "cohorts" / "small"), tmp_path / "elsewhere"
    (folder / name).rename(elsewhere)
    (folder / name).symlink_to(elsewhere)
    if dead:
        elsewhere.unlink()
    (one,) = [p for p in told(folder) if p.file == f"small/{name}"]
    assert one.found == f"'{name}', which leads out of the folder to {os.path.realpath(elsewhere)}"
    assert one.allowed == "a file in this folder, or a link to one in it"
    assert "copy the file" in one.remedy


def test_links_in_circles_and_through_other_links_are_refused_too(folder: Path) -> None:
    (folder / "loads.csv").unlink()
    (folder / "loads.csv").symlink_to(folder / "loads.csv")
    assert next(p.file for p in told(folder)) == "small/loads.csv"
    (folder / "out").symlink_to(folder.parent)
    (folder.parent / "secret.csv").write_text("specimen\n")
    (folder / "loads.csv").unlink()
    (folder / "loads.csv").symlink_to("out/secret.csv")
    assert "leads out of the folder" in next(p.found for p in told(folder))


def test_links_within_a_cohort_and_to_a_whole_cohort_are_followed(folder: Path) -> None:
    plain = cohorts.read(folder)
    (folder / "raw").mkdir()
    (folder / "motion.csv").rename(folder / "raw" / "motion.csv")
    (folder / "motion.csv").symlink_to("raw/motion.csv")
    other = folder.parents[1] / "config" / "small"
    other.parent.mkdir()
    other.symlink_to(folder)
    assert cohorts.read(folder).digest == plain.digest == cohorts.read(other).digest


@sweep("name", ["../loads.csv", "/etc/loads.csv", "raw/../../loads.csv"])
def test_a_name_can_lead_out_without_any_link(folder: Path, name: str) -> None:
    assert leads_out(folder / name, folder)
    assert not leads_out(folder / "raw" / "~" / "loads.csv", folder)


@sweep("name", ["../flexion.trc", "/etc/flexion.trc", "out/flexion.trc"])
def test_motions_outside_of_the_cohort_are_refused(tmp_path: Path, name: str) -> None:
    change = swap("trials.csv", "flexion_extension.trc", name)
    folder = tracked_cohort.write(tmp_path, change)
    (folder / "out").symlink_to(tmp_path)
    (folder / "flexion_extension.trc").rename(tmp_path / "flexion.trc")
    cohort = cohorts.read(folder, (SUBJECTS, *FORMS))
    study = Tracking.model_validate({"study": "s", "kind": "tracking", "cohort": "tracked"})
    (one,) = [p for p in check_tracking(DOCUMENT, study, cohort) if p.column == "file"]
    assert f"'{name}', which leads out of the folder" in one.found
    assert one.row == 3


def test_a_table_of_regressions_outside_of_the_cohort_is_refused() -> None:
    size = trunk_table_cases.Size(1, ("standing",))
    study = trunk_table_cases.study_of(size).model_copy(update={"regressions": "../x.csv"})
    cohort = trunk_table_cases.cohort_of(size)
    problems = [p for p in check_trunk(DOCUMENT, study, cohort) if p.column == "regressions"]
    assert ["leads out of the folder" in one.found for one in problems] == [True]

"""Valid cohorts of every allowed form are read as they stand.

Catches a valid cohort that is refused, or read as another one, and tables of an old cohort that a
worker goes on using.
"""

import gc
import weakref
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from cohort_cases import NAME, Change, add, cell, joints, line, motion, swap, text, without, write
from straight_chains import TESTS, write_cohort

from spinepipe import cohort
from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import memoize_per_cohort
from spinepipe.cohort.columns import TABLES
from spinepipe.cohort.specimen import bodies, load_cases
from spinepipe.documents.form import InputColumn, TableForm
from spinepipe.studies.cohort_stiffness.problem import specimen_tests
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

LOADS_BY_CYCLE = """\
specimen,test,cycle,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm
a,bending,1,0,L2,0,0,0,0,0,0
a,bending,1,1,L2,0,0,0,1,0,0
a,bending,2,0,L2,0,0,0,0,0,0
a,bending,2,1,L2,0,0,0,1.1,0,0
b,bending,,0,L2,0,0,0,0,0,0
b,bending,,1,L2,0,0,0,1,0,0
"""

MOTION_BY_CYCLE = """\
specimen,test,cycle,step,joint,right_bending_deg
a,bending,1,0,L3L4,0
a,bending,1,1,L3L4,1
a,bending,2,0,L3L4,0
a,bending,2,1,L3L4,1.2
b,bending,1,0,L3L4,
b,bending,1,1,L3L4,0.9
b,bending,3,0,L3L4,
b,bending,3,1,L3L4,0.8
"""

CHAIN = ["S1", "L5", "L4", "L3", "L2", "L1", *(f"T{i}" for i in range(12, 0, -1)), "C7", "C6", "C5"]


def test_cohort_holds_what_the_files_say(tmp_path: Path) -> None:
    read = cohort.read(write(tmp_path / NAME))
    assert (read.name, read.gravity, read.zeroed_at_step_0) == (NAME, True, False)
    assert read.vertebrae == ("L4", "L3", "L2")
    assert read.joint_names == ("L3L4", "L2L3")
    assert read.specimen_names == ("a", "b")
    assert read.tests == ("flexion",)
    assert read.measurement_sd == cohort.MeasurementSd(rotation_deg=0.1, translation_mm=0.05)
    assert read.folder == tmp_path / NAME


def test_tables_have_every_declared_column_and_their_own_types(tmp_path: Path) -> None:
    read = cohort.read(write(tmp_path / NAME))
    for stem in ("landmarks", "bodies", "loads", "motion"):
        table = getattr(read, stem)
        assert tuple(table.columns) == TABLES[stem].names
        assert list(table.index) == list(range(len(table)))
    assert read.motion is not None
    assert read.loads is not None
    assert read.motion["step"].dtype == "int64"
    assert read.motion["cycle"].tolist() == [1] * 12
    assert read.motion["right_mm"].isna().all()
    assert read.loads["cycle"].isna().all()
    assert read.loads["px_mm"].isna().tolist() == [True, False, False]


def test_further_specimen_columns_are_carried_as_text(tmp_path: Path) -> None:
    specimens = cohort.read(write(tmp_path / NAME)).specimens
    assert specimens["scanner"].tolist() == ["CT 1", "CT 2"]
    assert np.isnan(specimens["age_years"][1])


def test_joint_poses_can_stand_for_landmarks(tmp_path: Path) -> None:
    folder = write(tmp_path / NAME, without("landmarks.csv"), text("joints.csv", joints()))
    read = cohort.read(folder)
    assert read.landmarks is None
    assert read.joints is not None
    assert read.joints["y_mm"].tolist() == [5.0, 41.0, 5.0, 41.0]


def test_joint_poses_count_where_landmarks_do_not_suffice(tmp_path: Path) -> None:
    poses = joints().replace("a,L2L3,0,41,0,4,0,0\n", "").replace("a,L3L4,0,5,0,-3,0,0\n", "")
    change = line("landmarks.csv", 14, None)  # b has no upper endplate of L4
    read = cohort.read(write(tmp_path / NAME, change, text("joints.csv", poses)))
    assert read.joints is not None
    assert set(read.joints["specimen"]) == {"b"}


def test_frame_of_one_complete_vertebra_suffices(tmp_path: Path) -> None:
    changes = [line("landmarks.csv", number, None) for number in (5, 4, 3)]
    assert cohort.read(write(tmp_path / NAME, *changes)).landmarks is not None


def test_weightless_cohort_needs_no_bodies(tmp_path: Path) -> None:
    weightless = swap("cohort.yaml", "gravity: true", "gravity: false")
    assert cohort.read(write(tmp_path / NAME, weightless, without("bodies.csv"))).bodies is None


def test_geometry_alone_is_a_cohort(tmp_path: Path) -> None:
    read = cohort.read(write(tmp_path / NAME, without("loads.csv"), without("motion.csv")))
    assert read.loads is None
    assert read.motion is None
    assert read.tests == ()


def test_cycles_and_loads_for_all_of_them(tmp_path: Path) -> None:
    folder = write(
        tmp_path / NAME, text("loads.csv", LOADS_BY_CYCLE), text("motion.csv", MOTION_BY_CYCLE)
    )
    read = cohort.read(folder)
    assert read.motion is not None
    assert read.motion["cycle"].tolist() == [1, 1, 2, 2, 1, 1, 3, 3]


def test_a_test_has_its_own_cycles_only(tmp_path: Path) -> None:
    loads = LOADS_BY_CYCLE + "b,twist,,0,L2,0,0,0,0,0,0\nb,twist,,1,L2,0,0,0,0,1,0\n"
    moved = MOTION_BY_CYCLE + "b,twist,2,0,L3L4,0\nb,twist,2,1,L3L4,0.1\n"
    folder = write(tmp_path / NAME, text("loads.csv", loads), text("motion.csv", moved))
    cases = load_cases(cohort.read(folder), "b", ("bending", "twist"), np.zeros(3))
    assert [(one.test, one.cycle) for one in cases] == [
        ("bending", 1),
        ("bending", 3),
        ("twist", 2),
    ]


def test_twenty_joints_are_not_too_many(tmp_path: Path) -> None:
    names = CHAIN[:21]
    pairs = enumerate(pairwise(names))
    rows = [f"s,{upper}{lower},0,{30 * i},0,0,0,0" for i, (lower, upper) in pairs]
    header = joints().splitlines()[0]
    header_yaml = f"cohort: {NAME}\ntitle: t\nsource: s\nvertebrae: {names}\ngravity: false\n"
    folder = write(
        tmp_path / NAME,
        text("cohort.yaml", header_yaml),
        text("specimens.csv", "specimen\ns\n"),
        text("joints.csv", "\n".join([header, *rows]) + "\n"),
        *map(without, ("landmarks.csv", "bodies.csv", "loads.csv", "motion.csv")),
    )
    read = cohort.read(folder)
    assert len(read.joint_names) == 20
    assert read.measurement_sd is None


@pytest.mark.parametrize(
    "change",
    [
        text("notes.csv", "anything;goes\n"),
        text("specimens.csv", b"\xef\xbb\xbfspecimen\na\nb\n"),
        text("motion.csv", motion().replace("\n", "\r\n")),
        text("specimens.csv", 'specimen,note\na,"two\nlines, one cell"\n\nb,\n'),
        cell("landmarks.csv", 2, "x_mm", " 0.0 "),
        cell("loads.csv", 3, "fy_n", "-5.0e1"),
        swap("cohort.yaml", "rotation_deg: 0.1", "rotation_deg: 1e-1"),
        add("landmarks.csv", "a,L4,body_centre,0,-13,0,"),
    ],
    ids=["other-file", "BOM", "CRLF", "quoted", "blanks", "exponent", "yaml-exponent", "landmark"],
)
def test_harmless_variants_are_read(change: Change, tmp_path: Path) -> None:
    assert cohort.read(write(tmp_path / NAME, change)).specimen_names == ("a", "b")


def test_digest_follows_the_bytes_that_count(tmp_path: Path) -> None:
    plain = cohort.read(write(tmp_path / "1" / NAME))
    noted = cohort.read(write(tmp_path / "2" / NAME, text("README.md", "hello")))
    other = cohort.read(write(tmp_path / "3" / NAME, cell("motion.csv", 6, "superior_mm", "0.1")))
    assert plain.digest == noted.digest
    assert plain.digest != other.digest


TASK = InputColumn("task", "text", "task", key=True)
FOR_ALL = TableForm("tasks", "task", (TASK,))
OF_EACH = TableForm(
    "films",
    "specimen",
    (InputColumn("specimen", "text", "specimen", key=True), InputColumn("film", "text", "film")),
)


def test_a_table_without_specimens_is_part_of_what_each_hangs_on(tmp_path: Path) -> None:
    def digest(name: str, tasks: str, film_of_b: str) -> str:
        files = text("tasks.csv", tasks), text("films.csv", f"specimen,film\na,1\nb,{film_of_b}\n")
        folder = write(tmp_path / name / NAME, *files)
        return cohort.read(folder, (FOR_ALL, OF_EACH)).digest_of(["a"])

    first = digest("one", "task\nlift\n", "1")
    assert digest("two", "task\nlift\n", "2") == first
    assert digest("three", "task\nbend\n", "1") != first


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_cohort(tmp_path / "chains")
    return tmp_path / "chains"


def test_an_answer_is_worked_out_once_for_each_cohort_and_question(folder: Path) -> None:
    asked: list[tuple[int, str]] = []

    @memoize_per_cohort
    def answer(given: Cohort, question: str) -> str:
        asked.append((id(given), question))
        return question.upper()

    one, other = cohort.read(folder), cohort.read(folder)
    for each in (one, other, one):
        assert [answer(each, word) for word in ("a", "b", "a")] == ["A", "B", "A"]
    assert asked == [(id(each), word) for each in (one, other) for word in ("a", "b")]


def test_nothing_that_is_kept_holds_a_cohort(folder: Path) -> None:
    study = CohortStiffness(study="small", kind="cohort_stiffness", cohort="chains")
    chains = cohort.read(folder)
    assert bodies(chains, "a") is bodies(chains, "a")
    assert {one.case.test for one in specimen_tests(study, chains, "a").tested} == set(TESTS)
    seen = weakref.ref(chains)
    del chains
    gc.collect()
    assert seen() is None

"""Files that people write are read within bounds: each is refused with its place, none holds up.

Catches a reader that hangs, swells or runs what a file holds, and a fault told without its place.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest
from cohort_cases import NAME, Change, add, cell, line, swap, text, valid_files, without, write
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sweeps import sweep

from spinepipe import cohort, problems
from spinepipe.documents import csv_table
from spinepipe.documents.names import folder_fault, name_fault
from spinepipe.documents.text import (
    LONGEST_CELL,
    MOST_CSV_BYTES,
    MOST_YAML_BYTES,
    has_long_word,
    longest_word,
)
from spinepipe.model.file import read_model
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies import read as studies
from spinepipe.studies.registry import every_form

read_module = import_module("spinepipe.cohort.read")

YAML, SPECIMENS, LOADS, MOTION = "cohort.yaml", "specimens.csv", "loads.csv", "motion.csv"
MOTION_HEADER = "specimen,test,cycle,step,joint,extension_deg\n"
DIGITS = "1" * 100_000


def told(folder: Path, *changes: Change) -> tuple[InputProblem, ...]:
    """What reading the changed cohort complains about."""
    with pytest.raises(InputError) as caught:
        cohort.read(write(folder / NAME, *changes))
    return caught.value.problems


def rows_of_motion(number: int, row: Callable[[int], str]) -> Change:
    return text(MOTION, MOTION_HEADER + "".join(row(n) for n in range(number)))


@sweep(
    "about, change, place, says",
    [
        ("alias", add(YAML, "a: &a [1, 1]\nb: [*a, *a]"), (YAML, 10), "anchor '&a'"),
        ("lone alias", add(YAML, "b: *a"), (YAML, 10), "alias '*a'"),
        ("tag", add(YAML, "b: !!timestamp x"), (YAML, 10), "tag"),
        ("deep brackets", add(YAML, "a: " + "[" * 5000), (YAML, 10), "at most 20"),
        ("deep dashes", add(YAML, "a:\n  " + "- " * 5000 + "1"), (YAML, 11), "at most 20"),
        ("many values", add(YAML, "a: [" + "1," * 100_001 + "]"), (YAML, 10), "at most 100000"),
        ("control character", add(YAML, "a: \x07"), (YAML, 10), "U+0007"),
        ("turned text", add(YAML, "a: \u202eabc"), (YAML, 10), "U+202E"),
        ("digits", line(YAML, 5, f"gravity: {DIGITS}"), (YAML, 5), "100000 characters"),
        ("digits e", line(YAML, 5, f"gravity: {DIGITS[:300]}e1"), (YAML, 5), "302 characters"),
        ("long key", add(YAML, f"{'a b ' * 60}: 1"), (YAML, 10), "a key of 239 characters"),
        ("number as key", add(YAML, "1: 1"), (YAML, 10), "the key '1'"),
        ("list as key", add(YAML, "[a, b]: 1"), (YAML, 10), "a list or mapping"),
        ("large YAML", add(YAML, "#" * MOST_YAML_BYTES), (YAML, None), "at most 1 MB"),
        ("long title", line(YAML, 2, "title: " + "very " * 90), (YAML, 2), "at most 300"),
        ("many vertebrae", line(YAML, 4, f"vertebrae: [{'V,' * 9999}L1]"), (YAML, 4), "at most 20"),
        ("digits in a cell", cell(MOTION, 2, "extension_deg", DIGITS), (MOTION, 2), "at most 200"),
        ("digits x", cell(MOTION, 2, "extension_deg", "1" * 199 + "x"), (MOTION, 2), "finite"),
        ("bell in a cell", cell(MOTION, 2, "test", "a\x07"), (MOTION, 2), "U+0007"),
        ("Arabic digits", cell(MOTION, 3, "extension_deg", "٣"), (MOTION, 3), "finite number"),
        ("dollars", cell(MOTION, 2, "test", "a $\\frac$"), (MOTION, 2), "dollar sign"),
        ("path", cell(MOTION, 2, "test", "a/../b"), (MOTION, 2), "solidus"),
        ("long name", cell(MOTION, 2, "test", "t" * 61), (MOTION, 2), "a name of 61 characters"),
        ("mixed", cell(MOTION, 2, "test", "flеxion"), (MOTION, 2), "cyrillic small letter ie"),
        ("look-alike", cell(MOTION, 2, "joint", "LЗL4"), (MOTION, 2), "cyrillic capital letter ze"),
        ("dots", add(SPECIMENS, "b..c,,,,,"), (SPECIMENS, 4), "two dots in a row"),
        ("device", add(SPECIMENS, "CON,,,,,"), (SPECIMENS, 4), "Windows"),
        ("hyphen first", add(SPECIMENS, "-rf,,,,,"), (SPECIMENS, 4), "letter or digit first"),
        ("260", add(SPECIMENS, "s" * 190 + ",,,,,"), (SPECIMENS, 4), "a name of 190"),
        ("many columns", text(SPECIMENS, "specimen" + ",a" * 1001), (SPECIMENS, 1), "at most 1000"),
    ],
    lambda value: value if isinstance(value, str) and " " not in value[9:] else None,
)
def test_what_is_beyond_bounds_is_told_at_its_place(about, change, place, says, tmp_path) -> None:
    found = told(tmp_path, change)
    here = [p for p in found if (p.file, p.row) == (f"{NAME}/{place[0]}", place[1])]
    assert any(says in str(problem) for problem in here), f"{about}: {found}"
    assert len("\n".join(map(str, found))) < 20_000


def test_a_file_too_large_is_not_read(tmp_path, monkeypatch) -> None:
    folder = write(tmp_path / NAME)
    with (folder / MOTION).open("ab") as file:
        file.truncate(MOST_CSV_BYTES + 1)  # a hole on the disk
    read_bytes = Path.read_bytes

    def refuse(path: Path) -> bytes:
        assert path.name != MOTION
        return read_bytes(path)

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(InputError, match="at most 100 MB"):
        cohort.read(folder)


@pytest.mark.parametrize("sign", ["\n", "\r", ","])
def test_rows_and_cells_are_counted_before_they_are_parsed(sign, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(csv_table, "_records", None)  # calling it would fail
    number = csv_table.MOST_CELLS if sign == "," else csv_table.MOST_ROWS
    (problem,) = csv_table.read_rows(_written(tmp_path, "a" + sign * (number + 1)), "f")[1]
    assert problem.allowed.startswith(f"at most {number}")


def _written(folder: Path, content: str) -> Path:
    path = folder / "file.csv"
    path.write_text(content, encoding="utf-8", newline="")
    return path


def test_rows_with_the_same_fault_are_one_line(tmp_path) -> None:
    found = told(tmp_path, rows_of_motion(499, lambda n: f"a,flexion,1,{n % 3},L3L4,x\n"))
    (same,) = [p for p in found if p.column == "extension_deg"]
    assert (same.row, same.others) == (2, 498)
    assert str(same).endswith("and 498 rows more: 3-500")


def test_three_rows_with_the_same_fault_are_three_lines(tmp_path) -> None:
    found = told(tmp_path, *(cell(MOTION, n, "extension_deg", "x") for n in (2, 3, 5)))
    assert [problem.row for problem in found] == [2, 3, 5]


def test_faults_that_differ_in_names_alone_are_told_ten_times_and_counted(tmp_path) -> None:
    found = told(tmp_path, rows_of_motion(500, lambda n: f"q{n},flexion,1,0,L3L4,1\n"))
    assert [problem.row for problem in found] == [*range(2, 12)]
    assert found[-1].others == 490
    assert str(found[-1]).endswith("and 490 rows more: 12-501")


def test_only_the_first_unknown_names_are_compared_with_known_ones(tmp_path, monkeypatch) -> None:
    calls = []
    monkeypatch.setattr(
        problems, "get_close_matches", lambda name, *_, **__: calls.append(name) or []
    )
    told(tmp_path, rows_of_motion(2000, lambda n: f"q{n},t{n},1,0,Q{n},1\n"))
    assert 0 < len(calls) <= 100


def test_unknown_cycles_are_counted_before_they_are_written_out(tmp_path, monkeypatch) -> None:
    reading = import_module("spinepipe.cohort.read")  # the package has a function of this name
    monkeypatch.setattr(reading, "MOST_APPLIED", 1199)
    found = told(tmp_path, rows_of_motion(200, lambda n: f"a,flexion,{n + 1},0,L3L4,1\n"))
    (loads,) = [p for p in found if p.file == f"{NAME}/{LOADS}"]
    assert loads.found.startswith("1200 loads")  # 3 rows x 2 specimens x 200 cycles


def test_names_of_other_languages_are_allowed_and_look_alikes_named() -> None:
    for good in ("flexion", "Seitneigung (links)", "屈曲 1", "сгибание", "κάμψη", "7.5 N m", "a+b"):
        assert name_fault(good) is None, good
    assert "look like 'T12' but are Cyrillic" in str(name_fault("Т12"))
    assert "looks like another letter" in str(name_fault("flexiοn"))
    assert "looks like 'L4'" in str(name_fault("Ｌ４"))
    for bad in ("", ".a", "-a", "a..b", "a.", "a/b", "a\\b", "C:\\a", "a{b}", "a=b", "nul.txt"):
        assert name_fault(bad) is not None, bad
    assert folder_fault("Müller-1") == "'Müller-1' with 'ü' (latin small letter u with diaeresis)"
    for bad in ("a b", "ä", "com1", "a" * 61, "..", "a:b"):
        assert folder_fault(bad) is not None, bad


def test_each_sign_that_a_name_may_have_can_be_drawn() -> None:
    from spinepipe.documents.names import SIGNS
    from spinepipe.report.forms.chart import saying

    assert saying("Signs", f"a{SIGNS}b {SIGNS}").picture("png")
    assert name_fault("a $\\frac$") is not None  # which matplotlib would set as a formula


MODEL = "model: m\ncohort: c\neffects:\n- effect: linear_bushing\n"


@sweep(
    "content, row, says",
    [
        (MODEL + "cohort: d\n", 5, "same key twice"),
        (MODEL + "  values:\n  - {joint: '*', joint: L1L2}\n", 6, "same key twice"),
        (MODEL + "  options: &a {}\n", 5, "anchor"),
        (MODEL + f"  options: {'[' * 3000}\n", 5, "at most 20"),
        (MODEL + f"  values: [{{extension_nm_per_rad: {'9' * 5000}}}]\n", 5, "5000 characters"),
        (MODEL + f"  values: [{{extension_nm_per_rad: {'9' * 199}}}]\n", 5, "allowed: 0.0001 to"),
        (MODEL + "a: \x01\n", 5, "U+0001"),
    ],
)
def test_model_files_are_read_within_the_same_bounds(content, row, says, tmp_path) -> None:
    path = tmp_path / "model.yaml"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_model(path)
    assert any(p.row == row and says in str(p) for p in caught.value.problems), caught.value


STUDY = "study: one\nkind: range_of_motion\ncohort: small\n"


def project(root: Path) -> Path:
    """A root with a study file, its list and everything that editors and systems leave behind."""
    folder = root / "config" / "studies"
    folder.mkdir(parents=True)
    (folder / "one.yaml").write_text(STUDY, encoding="utf-8")
    (folder / ".#one.yaml").symlink_to("somebody@somewhere.123:456")
    (folder / "._one.yaml").write_bytes(b"\x00\x05\x16\x07")
    (folder / "one.yaml~").write_bytes(b"\xff")
    (folder / "lost.yaml").symlink_to("nowhere.yaml")
    (folder / "folder.yaml").mkdir()
    (folder / "two.yml").write_text(STUDY, encoding="utf-8")
    (folder / "broken.yaml").write_text("a: \x07", encoding="utf-8")
    (root / "config" / "cohorts" / ".hidden").mkdir(parents=True)
    (root / "config" / "cohorts" / "._small").write_bytes(b"\x00")
    write(root / "config" / "cohorts" / NAME)
    (root / "config" / "config.yaml").write_text("studies: [one]\n", encoding="utf-8")
    return root


def test_strays_among_studies_and_cohorts_stop_nothing(tmp_path) -> None:
    from spinepipe.cli.find import cohort_names, study_names

    root = project(tmp_path)
    assert studies.names_by_kind(root) == {"range_of_motion": ["one"]}
    assert studies.read_selection(root).studies == ("one",)
    assert study_names(root) == ["broken", "one"]
    assert cohort_names(root) == [NAME]
    words = {problem.file.rpartition("/")[2]: problem.found for problem in studies.strays(root)}
    assert words == {
        "folder.yaml": "a folder",
        "lost.yaml": "a link to nothing",
        "two.yml": "a file that ends with .yml",
    }


def renamed(old: str, new: str) -> Change:
    def change(files):
        files[new] = files.pop(old)

    return change


@sweep(
    "old, new",
    [
        (LOADS, "Loads.csv"),
        (LOADS, "loads.CSV"),
        (LOADS, "load.csv"),
        (LOADS, "loads.csv.txt"),
        (MOTION, "motoin.csv"),
        ("bodies.csv", "body.csv"),
        (YAML, "cohort.yml"),
    ],
)
def test_a_table_of_a_wrong_name_does_not_count_as_absent(old, new, tmp_path) -> None:
    found = told(tmp_path, renamed(old, new))
    assert any(p.file == f"{NAME}/{new}" and f"did you mean '{old}'" in p.remedy for p in found)


def test_misspelt_joints_beside_landmarks_are_told(tmp_path) -> None:
    (problem,) = told(tmp_path, text("joint.csv", "specimen\n"))
    assert "did you mean 'joints.csv'" in problem.remedy


def test_notes_and_raw_data_beside_the_tables_are_ignored(tmp_path) -> None:
    strays = ("notes.csv", "._loads.csv", ".#motion.csv", "motion2.csv", "raw.txt", "loads.csv~")
    folder = write(tmp_path / NAME, *(text(name, b"\xff") for name in strays))
    assert cohort.read(folder).name == NAME


def test_a_folder_or_dead_link_in_the_place_of_a_table_is_told(tmp_path) -> None:
    folder = write(tmp_path / NAME)
    (folder / "joints.csv").mkdir()
    (folder / "supports.csv").symlink_to("nowhere.csv")
    with pytest.raises(InputError) as caught:
        cohort.read(folder)
    assert {p.file for p in caught.value.problems} == {
        f"{NAME}/joints.csv",
        f"{NAME}/supports.csv",
    }


TOKENS = st.sampled_from(
    [
        *("[", "{", "'", '"', "|", "#", "%", "---", "٣", "é", "а", "$", ".nan", "1e999"),
        *("-", "0x1f", "1:30", "2001-13-45", "=", "~", "*"),
        *("&a ", "*a", "!!int ", "<<: ", "? ", "- ", ": ", "9" * 500, "a" * 300, "[" * 60),
        *("\n", "\r", ",", "\t", "\x00", "\x85", "\u2028", "\ufeff"),
    ]
)
SPOILS = st.lists(
    st.tuples(
        st.sampled_from(sorted(valid_files())),
        st.sampled_from(["put", "replace", "byte", "twice", "cut"]),
        st.floats(0.0, 1.0),
        TOKENS,
        st.integers(0, 255),
    ),
    min_size=1,
    max_size=4,
)


def spoilt(data: bytes, how: str, where: float, token: str, byte: int) -> bytes:
    """One change of a file."""
    at = int(where * len(data))
    if how == "byte":
        return data[:at] + bytes([byte]) + data[at + 1 :]
    if how == "cut":
        return data[:at]
    if how == "twice":
        rows = data.split(b"\n")
        place = int(where * (len(rows) - 1))
        return b"\n".join([*rows[: place + 1], *rows[place:]])
    return data[:at] + token.encode() + data[at + (len(token) if how == "replace" else 0) :]


@given(spoils=SPOILS)
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_put_into_the_files_is_accepted_or_told(spoils, tmp_path_factory) -> None:
    folder = write(tmp_path_factory.mktemp("spoilt") / NAME)
    for file, *change in spoils:
        path = folder / file
        path.write_bytes(spoilt(path.read_bytes(), *change))
    found = problems_in(folder)
    assert all(p.file and p.found and p.remedy for p in found)
    assert len("\n".join(map(str, found))) < 100_000


def problems_in(folder: Path) -> tuple[InputProblem, ...]:
    """What is wrong with a cohort, if anything; any other exception fails the test."""
    try:
        cohort.read(folder)
    except InputError as error:
        return error.problems
    return ()


def test_the_cohort_that_is_spoilt_is_sound(tmp_path) -> None:
    assert cohort.read(write(tmp_path / NAME)).name == NAME
    assert told(tmp_path / "b", without(SPECIMENS))
    assert told(tmp_path / "c", swap(YAML, "small", "smal"))


def test_a_reader_reads_each_folder_once_whoever_asks(tmp_path, monkeypatch) -> None:
    read = []
    whole = read_module.read_table

    def counted(path, form, file):
        read.append(file)
        return whole(path, form, file)

    monkeypatch.setattr(read_module, "read_table", counted)
    folder = write(tmp_path / NAME)
    reader = cohort.Reader()
    first = reader.read(folder)
    assert reader.read(folder, every_form()) is first  # no file of another kind is there
    assert len(read) == len(set(read)) == len(list(folder.glob("*.csv")))
    assert cohort.read(folder) is not first
    cell(MOTION, 2, "extension_deg", "words")(files := valid_files())
    (folder / MOTION).write_text(str(files[MOTION]))
    with pytest.raises(InputError):
        cohort.Reader().read(folder)


def test_a_reader_tells_misspelt_files_of_those_forms_alone_that_are_asked_for(tmp_path) -> None:
    folder = write(tmp_path / NAME)
    (folder / "film.csv").write_text("a\n1\n")
    reader = cohort.Reader()
    reader.read(folder)
    with pytest.raises(InputError, match=r"film\.csv"):
        reader.read(folder, every_form())


def test_a_reader_keeps_the_last_cohorts_alone(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(read_module, "MOST_KEPT", 2)
    folders = [write(tmp_path / part / NAME) for part in "abc"]
    reader = cohort.Reader()
    first, second, _ = map(reader.read, folders)
    assert reader.read(folders[1]) is second
    assert reader.read(folders[0]) is not first


@given(st.lists(st.tuples(st.sampled_from("ab \t\n"), st.integers(1, 250)), max_size=8))
def test_long_words_are_seen_wherever_they_stand(runs) -> None:
    text_of = "".join(letter * number for letter, number in runs)
    assert has_long_word(text_of) is (longest_word(text_of) > LONGEST_CELL)

"""Files of testing machines in the forms in which laboratories have them.

A signal that is known goes into a file by code of this test, in every notation; what is read of it
must be that signal. A file that cannot be read must say where, and what to do.

Catches a number, a column or a specimen that is taken for another one without a word.
"""

import datetime
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import openpyxl
import opensim
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from sweeps import sweep

from spinepipe.cohort import read as read_cohort
from spinepipe.imports.imported import write
from spinepipe.imports.registry import read as imported
from spinepipe.imports.registry import read_settings
from spinepipe.problems import InputError
from spinepipe.testing_machine import folder as folders
from spinepipe.testing_machine import raw_table
from spinepipe.testing_machine.notation import Notation
from spinepipe.testing_machine.recording import Recording

ROWS = 81
TIME = np.arange(ROWS) / 4.0
MOMENT = np.round(7.5 * np.sin(2 * np.pi * TIME / 10.0), 4)
ANGLE = np.round(MOMENT / 1.5 + 0.2 * MOMENT**2 / 7.5, 4)

DOCUMENT = {
    "cohort": "rig",
    "title": "made up",
    "source": "no measurement",
    "vertebrae": ["L5", "L4"],
    "time": {"column": "t", "unit": "s"},
    "loads": [{"column": "Moment", "unit": "N m", "positive": "extension"}],
    "motion": [{"column": "Angle", "unit": "deg", "joint": "L4L5", "positive": "extension"}],
    "files": [{"file": "a.txt", "specimen": "s01", "test": "flexion"}],
}
LOAD, MOTION, FILE = (DOCUMENT[key][0] for key in ("loads", "motion", "files"))


def text(names: str = "t,Moment,Angle", factor: float = 1.0) -> str:
    rows = zip(TIME, factor * MOMENT, ANGLE, strict=True)
    return "\n".join([names, *(f"{t:.2f},{m:.4f},{a:.4f}" for t, m, a in rows)]) + "\n"


def read(folder: Path, content: str | bytes | None = None, **changes: object) -> list[Recording]:
    """Recordings of all files; ``content`` is that of ``a.txt``."""
    if content is not None:
        data = content.encode() if isinstance(content, str) else content
        (folder / "a.txt").write_bytes(data)
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(json.loads(json.dumps({**DOCUMENT, **changes}))))
    tests = folders.read(folder, read_settings(path)).tests
    return [one for test in tests for one in test.recordings]


def refused(folder: Path, content: str | bytes | None = None, **changes: object) -> str:
    with pytest.raises(InputError) as caught:
        read(folder, content, **changes)
    return str(caught.value)


def same(recording: Recording) -> bool:
    assert recording.time is not None
    (moment,), (angle,) = recording.loads.values(), recording.motion.values()
    np.testing.assert_allclose(recording.time, TIME[: len(moment)], atol=2e-7)
    np.testing.assert_allclose(moment, MOMENT, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(angle, ANGLE, rtol=1e-12, atol=1e-12)
    return True


def workbook(names: tuple[str, ...] = ("t", "Moment", "Angle"), clock: bool = False) -> bytes:
    """Two sheets, of which the second has the recording below a title."""
    book = openpyxl.Workbook()
    book.active.append(["nothing here"])
    sheet = book.create_sheet("s01")
    sheet.append(["a title"])
    sheet.append(list(names))
    start = datetime.datetime(2024, 1, 31, 23, 59, 55)
    for t, m, a in zip(TIME, MOMENT, ANGLE, strict=True):
        at = start + datetime.timedelta(seconds=float(t)) if clock else float(t)
        sheet.append([at, float(m), float(a)])
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def labview(decimal: str = ",", mark: str = "\t", segments: int = 1) -> str:
    head = [
        "LabVIEW Measurement",
        "Writer_Version{}2",
        "Separator{}" + {"\t": "Tab", ",": "Comma"}[mark],
    ]
    head += [f"Decimal_Separator{{}}{decimal}", "X_Columns{}One", "***End_of_Header***{}", ""]
    segment = ["Channels{}2{}", "Samples{}81{}81", "Delta_X{}0.25{}0.25", "***End_of_Header***{}{}"]
    body = [
        line.replace(".", decimal)
        for line in "\n".join(text().splitlines()[1:]).replace(",", "|").split("\n")
    ]
    body[0] += "|it begins"
    segment += ["X_Value|Moment|Angle|Comment", *body, ""]
    return "\n".join([*head, *segment * segments]).replace("{}", "|").replace("|", mark)


MARKS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": "  "}
GROUPS = {None: "", "point": ".", "comma": ",", "space": "\u202f", "apostrophe": "'"}
UNITS = {"N m": 1.0, "N mm": 1000.0, "N cm": 100.0}
TIMES = {"s": 1.0, "ms": 1000.0, "min": 1 / 60.0}


def number(value: float, decimal: str, group: str) -> str:
    whole, _, rest = f"{value:.9f}".partition(".")
    sign, whole = whole[: whole.startswith("-")], whole.lstrip("-")
    parts = [whole[max(end - 3, 0) : end] for end in range(len(whole), 0, -3)][::-1]
    return sign + (group.join(parts) if group else whole) + decimal + rest


@settings(max_examples=60, deadline=None)
@given(
    st.data(),
    st.sampled_from(list(MARKS)),
    st.sampled_from(["point", "comma"]),
    st.sampled_from(list(UNITS)),
    st.sampled_from([*TIMES, "clock"]),
    st.sampled_from(["utf-8", "latin-1", "utf-16"]),
    st.integers(0, 4),
    st.floats(0.5, 500.0),
)
def test_a_known_signal_is_read_from_every_notation(
    tmp_path_factory, data, delimiter, decimal, unit, time_unit, encoding, above, rate
) -> None:
    taken = {decimal, delimiter}
    thousands = data.draw(st.sampled_from([one for one in GROUPS if one not in taken]))
    if encoding == "latin-1" and thousands == "space":
        thousands = None  # latin-1 has no narrow blank
    sign, mark, group = {"point": ".", "comma": ","}[decimal], MARKS[delimiter], GROUPS[thousands]
    quote = '"' if mark == sign or (data.draw(st.booleans()) and delimiter != "space") else ""
    named = data.draw(st.booleans())
    time = np.arange(ROWS) / rate

    def clock(seconds: float) -> str:
        at = datetime.datetime(2024, 1, 31, 23, 59, 58) + datetime.timedelta(seconds=seconds)
        return at.strftime("%H:%M:%S") + f"{sign}{at.microsecond:06d}"

    lines = [f"remark {n}" for n in range(above)]
    if named:
        lines.append(mark.join(f"{quote}{one}{quote}" for one in ("Größe", "t", "Moment", "Angle")))
    for t, m, a in zip(time, MOMENT, ANGLE, strict=True):
        when = clock(t) if time_unit == "clock" else number(t * TIMES[time_unit], sign, group)
        cells = ["x", when, number(m * UNITS[unit], sign, group), number(a, sign, group)]
        lines.append(mark.join(f"{quote}{cell}{quote}" for cell in cells))
    columns = ("t", "Moment", "Angle") if named else (2, 3, 4)
    form = {"delimiter": delimiter, "decimal": decimal, "thousands": thousands}
    form |= {"encoding": encoding, "names_line": above + 1 if named else 0}
    if not named:
        form["first_line"] = above + 1
    (found,) = read(
        tmp_path_factory.mktemp("rig"),
        "\r\n".join(lines).encode(encoding),
        form=form,
        time={"column": columns[0], "unit": time_unit},
        loads=[{**LOAD, "column": columns[1], "unit": unit}],
        motion=[{**MOTION, "column": columns[2]}],
    )
    (moment,), (angle,) = found.loads.values(), found.motion.values()
    np.testing.assert_allclose(moment, MOMENT, atol=1e-9)
    np.testing.assert_allclose(angle, ANGLE, atol=1e-9)
    np.testing.assert_allclose(found.time, time, atol=2e-6)


CELLS = st.one_of(
    st.floats(-1e4, 1e4).map(repr),
    st.floats(-1e4, 1e4).map(lambda one: f"{one:.3f}"),
    st.text("0123456789.,+-eE_ nainfx", max_size=7),
    st.sampled_from(["True", "FALSE", "", "1_000", "0x1F", "١", "1.", ".5", "nan", "inf", '"1"']),
)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.lists(CELLS, min_size=1, max_size=4), min_size=1, max_size=4))
def test_the_bulk_reader_takes_no_cell_that_the_exact_one_refuses(rows) -> None:
    content = "\n".join(["a;b", *(";".join(row) for row in rows)])
    form = raw_table.FileForm(delimiter="semicolon")
    table = raw_table.open_table(content.encode(), "a", form)
    value = Notation("point").value
    lines, rows, exact = table.columns([0, 1], [value, value], plain=False)
    bulk_lines, bulk_rows, bulk = table.columns([0, 1], [value, value], plain=True)
    np.testing.assert_array_equal(lines, bulk_lines)
    np.testing.assert_array_equal(rows, bulk_rows)
    np.testing.assert_array_equal(exact, bulk)


def test_plain_text_goes_the_fast_way() -> None:
    table = raw_table.open_table(text().encode(), "a", raw_table.FileForm())
    lines, rows, numbers = table.columns([1, 0], [lambda _: np.nan] * 2, plain=True)
    np.testing.assert_array_equal(numbers, [MOMENT, TIME])
    assert (lines[0], lines[-1], rows[0], rows[-1]) == (2, ROWS + 1, 0, ROWS - 1)


def test_a_table_that_opensim_writes(tmp_path: Path) -> None:
    table = opensim.TimeSeriesTable()
    table.setColumnLabels(["Moment", "Angle"])
    for time, *row in zip(TIME.tolist(), MOMENT.tolist(), ANGLE.tolist(), strict=True):
        table.appendRow(time, opensim.RowVector(row))
    table.addTableMetaDataString("inDegrees", "yes")
    opensim.STOFileAdapter().write(table, str(tmp_path / "a.txt"))
    head = (tmp_path / "a.txt").read_text().partition("endheader")[0]
    form = {"delimiter": "tab", "names_line": head.count("\n") + 2}
    (one,) = read(tmp_path, form=form, time={"column": "time", "unit": "s"})
    assert same(one)


def test_workbooks(tmp_path: Path) -> None:
    """By any name; a decimal comma of the settings does not matter; dates are cells."""
    form = {"sheet": "s01", "names_line": 2, "decimal": "comma"}
    assert same(*read(tmp_path, workbook(), form=form))
    assert same(*read(tmp_path, workbook(), form={**form, "sheet": 2}))
    clock = {"column": "t", "unit": "clock"}
    assert same(*read(tmp_path, workbook(clock=True), form=form, time=clock))
    own = [{**FILE, "form": form}]
    assert same(*read(tmp_path, workbook(), files=own))


def bomb() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/workbook.xml", b"0" * (raw_table.MOST_BYTES + 1))
    return file.getvalue()


@sweep(
    "content, form, says",
    [
        (workbook(), {}, "no sheet named; allowed: one of Sheet, s01; set `form: {sheet"),
        (workbook(), {"sheet": "s02"}, "no sheet 's02'; allowed: one of Sheet, s01"),
        (workbook(), {"sheet": 3}, "no sheet 3"),
        (workbook(clock=True), {"sheet": 2, "names_line": 2}, "`time: {unit: clock}`"),
        (workbook()[:3000], {}, "a workbook that is damaged (BadZipFile)"),
        (bomb(), {}, "300 MB when unpacked; allowed: at most 300 MB"),
        (text(), {"sheet": 1}, "a text without sheets"),
        (b"TDSm\x0e\0\0\0", {}, "a .tdms file of LabVIEW; allowed: text"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1", {}, "an old workbook (.xls)"),
        (b"\x02P\0\0", {}, "a binary file"),
        (b"t,M\0\0,A\n1,2,3", {}, "a binary file"),
        (text().encode("utf-16"), {}, "set `form: {encoding: utf-16}`"),
        ("t,Größe\n".encode("latin-1") * 20, {}, "latin-1"),
    ],
)
def test_other_files_are_told_by_what_they_are(
    tmp_path: Path, content: bytes | str, form: dict[str, object], says: str
) -> None:
    told = refused(tmp_path, content, form=form)
    assert says in told
    assert "latin-1" not in told or "latin-1" in says


@sweep("decimal, mark", [(",", "\t"), (".", "\t"), (".", ",")])
def test_labview_files(tmp_path: Path, decimal: str, mark: str) -> None:
    """The header is above the names; several segments are refused where the second begins."""
    form = {"names_line": 12, "delimiter": {"\t": "tab", ",": "comma"}[mark]}
    form["decimal"] = {",": "comma", ".": "point"}[decimal]
    changes = {"time": {"column": "X_Value", "unit": "s"}, "form": form}
    assert same(*read(tmp_path, labview(decimal, mark), **changes))
    lines = labview(decimal, mark, segments=2).split("\n")
    second = [n for n, line in enumerate(lines, start=1) if line.startswith("Channels")][1]
    told = refused(tmp_path, "\n".join(lines), **changes)
    assert f"line {second}, X_Value: found 'Channels' and " in told


def test_a_name_that_stands_twice_is_refused_unless_by_number(tmp_path: Path) -> None:
    twice = text().replace("t,Moment,Angle", "t,Moment,Moment")
    motion = [{**MOTION, "column": 3}]
    told = refused(tmp_path, twice, motion=motion)
    assert "the name 'Moment' in columns 2 and 3" in told
    assert "`column: 2` or 3" in told
    assert same(*read(tmp_path, twice, motion=motion, loads=[{**LOAD, "column": 2}]))


def test_a_column_by_name_and_by_number_is_one_column(tmp_path: Path) -> None:
    told = refused(tmp_path, text(), motion=[{**MOTION, "column": 2}])
    assert "a.txt, 2: found column 2, which is told twice" in told


@sweep(
    "there, asked, offered",
    [
        ("Torque FE", "Torque LB", False),
        ("Mx", "Mz", False),
        ("Moment_x", "Moment_z", False),
        ("MomentX", "MomentZ", False),
        ("Force 1", "Force 2", False),
        ("Left rotation", "Right rotation", False),
        ("Anterior", "Posterior", False),
        ("Torque LB", "Torqe LB", True),
        ("Torque LB", "torque lb", True),
    ],
)
def test_no_column_of_another_direction_is_offered(
    tmp_path: Path, there: str, asked: str, offered: bool
) -> None:
    told = refused(tmp_path, text(f"t,{there},Angle"), loads=[{**LOAD, "column": asked}])
    assert ("did you mean" in told) == offered
    assert f"one of t, {there}, Angle" in told


def test_a_column_that_another_quantity_has_is_not_offered(tmp_path: Path) -> None:
    told = refused(tmp_path, text("t,Moment,Winkel"), motion=[{**MOTION, "column": "Momennt"}])
    assert "did you mean" not in told


@sweep(
    "cell, form, says",
    [
        ("1,5", {}, "set `form: {decimal: comma}`, which"),
        ("1.234,5", {}, "set `form: {decimal: comma, thousands: point}`, which"),
        ("1 234,5", {}, "set `form: {decimal: comma, thousands: space}`, which"),
        ("1,234", {}, "`form: {decimal: point, thousands: comma}` for 1234"),
        ("1,234", {}, "`form: {decimal: comma}` for 1.234"),
        ("1.5", {"decimal": "comma"}, "set `form: {decimal: point}`, which"),
        ("NaN", {}, "'NaN' and 80 more such lines"),
        ("#N/A", {}, "no reading, and none is made up"),
        ("-", {}, "no reading, and none is made up"),
        ("1e999", {}, "no measured number is that large"),
        ("1.5 N", {}, "take units out of the cells"),
        ("12,34", {"thousands": "comma"}, "set `form: {decimal: comma}`"),
    ],
)
def test_remedies_for_numbers_lead_on(
    tmp_path: Path, cell: str, form: dict[str, object], says: str
) -> None:
    lines = [f"{n};{cell};{n}" for n in range(ROWS)]
    form = {"delimiter": "semicolon", **form}
    assert says in refused(tmp_path, "\n".join(["t;Moment;Angle", *lines]), form=form)


def test_both_decimal_signs_in_one_file_end_no_circle(tmp_path: Path) -> None:
    lines = [f"{n};{n},5;{n}.5" for n in range(ROWS)]
    for decimal in ("point", "comma"):
        form = {"delimiter": "semicolon", "decimal": decimal}
        told = refused(tmp_path, "\n".join(["t;Moment;Angle", *lines]), form=form)
        assert "no `form` reads all" in told
        assert "set `form" not in told


@sweep(
    "cell, unit, says",
    [
        ("12:00:{:05.2f}", "s", "set `time: {unit: clock}`"),
        ("{:.2f}", "clock", "set its `unit` to s, ms or min"),
        ("01/31/2024 12:00:{:05.2f}", "clock", "2024-01-31 12:34:56.7"),
        ("12:00:{:05.2f} PM", "s", "2024-01-31 12:34:56.7"),
        ("31.02.2024 12:00:{:05.2f}", "clock", "2024-01-31 12:34:56.7"),
    ],
)
def test_clock_times(tmp_path: Path, cell: str, unit: str, says: str) -> None:
    lines = [f"{cell.format(t)},{m},{a}" for t, m, a in zip(TIME, MOMENT, ANGLE, strict=True)]
    content = "\n".join(["t,Moment,Angle", *lines])
    assert says in refused(tmp_path, content, time={"column": "t", "unit": unit})


TURNED = {
    "time": {"column": "t", "unit": "s"},
    "files": [
        {
            **FILE,
            "file": f"{test}.txt",
            "test": test,
            "loads": [{"column": "Torque", "unit": "N m", "positive": way}],
            "motion": [{"column": "Angle", "unit": "deg", "joint": "L4L5", "positive": way}],
        }
        for test, way in (("flexion", "extension"), ("bending", "right_bending"))
    ],
}


def test_one_torque_and_one_angle_with_the_specimen_turned_between_files(tmp_path: Path) -> None:
    for name in ("flexion", "bending"):
        (tmp_path / f"{name}.txt").write_text(text("t,Torque,Angle"))
    changes = {**TURNED, "loads": [], "motion": []}
    first, second = read(tmp_path, **changes)
    assert (list(first.loads), list(second.loads)) == (["mz_nm"], ["mx_nm"])
    assert same(first)
    assert same(second)
    changes["files"] = [{**one, "test": "flexion"} for one in TURNED["files"]]
    told = refused(tmp_path, **changes)
    assert "bending.txt: found driven by mx_nm" in told
    assert "as in flexion.txt" in told


def test_faults_of_a_files_own_columns_have_their_place(tmp_path: Path) -> None:
    own = [{**LOAD, "positive": "anterior"}]
    told = refused(tmp_path, text(), files=[{**FILE, "loads": own, "motion": []}])
    assert "files.0.loads.0.positive: found 'anterior' in N m" in told
    assert "files.0.motion: found 0 of them" in told


def patterned(folder: Path, *names: str) -> None:
    (folder / "raw").mkdir(exist_ok=True)
    for name in names:
        (folder / "raw" / name).write_text(text())


def test_patterns_name_specimens_and_tests(tmp_path: Path) -> None:
    patterned(tmp_path, "001_flexion_10.csv", "001_flexion_2.csv", "002_flexion_1.csv")
    files = [{"glob": "raw/{specimen}_{test}_*.csv", "preconditioning_cycles": 0}]
    found = read(tmp_path, files=files)
    names = [(one.of.specimen, one.of.test, one.file) for one in found]
    assert names == [
        ("001", "flexion", "raw/001_flexion_2.csv"),
        ("001", "flexion", "raw/001_flexion_10.csv"),
        ("002", "flexion", "raw/002_flexion_1.csv"),
    ]
    write(imported(tmp_path / "rig.yaml"), tmp_path / "rig", replace=False)
    assert read_cohort(tmp_path / "rig").specimen_names == ("001", "002")


@sweep(
    "files, says",
    [
        ([{"glob": "row/{specimen}_{test}.csv"}], "no file of this pattern"),
        ([None, {"glob": 1}, 2, {"glob": "../{specimen}_{test}"}], "files.1.glob: found 1"),
        ([{"glob": "raw/{specimen}_{test}.csv"}], "specimen 's01', test 'flexion_1' or specimen"),
        ([{"glob": "raw/{specimen}_*.csv"}], "files.0.test: found nothing: the key is missing"),
        ([{"glob": "raw/{name}_*.csv"}], "'{name}'; allowed: one of {specimen}, {test}"),
        ([{"glob": "raw/{specimen}_*", "specimen": "s01", "test": "a"}], "`specimen` beside"),
        (
            [
                {"glob": "raw/{specimen}_flexion_*", "test": "a"},
                {**FILE, "file": "raw/s01_flexion_1.csv"},
            ],
            "files.1: found raw/s01_flexion_1.csv, which files.0 names too",
        ),
        (
            [FILE, {"glob": "raw/{specimen}_flexion_*", "test": "a", "driving": "F"}],
            "files.1.driving",
        ),
        (
            [{**FILE, "specimen": 10}],
            "files.0.specimen: found 10; allowed: a valid string; put it in quotes",
        ),
    ],
)
def test_faults_of_patterns(tmp_path: Path, files: list[dict[str, object]], says: str) -> None:
    patterned(tmp_path, "s01_flexion_1.csv", "s02_flexion_1.csv")
    told = refused(tmp_path, text(), files=files)
    assert says in told
    assert "files.4" not in told

"""Names and cells of a machine's file that do not fit each other.

Catches a column that is read under the name of another one, a row that is counted wrongly, and a
message that sends to a key that is right.
"""

import io
import unicodedata
from pathlib import Path

import numpy as np
import openpyxl
from sweeps import sweep
from test_machine_files import FILE, LOAD, MOMENT, MOTION, TIME, read, refused, same, text

SPACE = {"delimiter": "space"}
HEAD = "t,Moment,Angle"


@sweep(
    "content, changes, says",
    [
        (text("Zeit,Kraft,Weg").replace(",", ";"), {}, "is `form.delimiter` right? With comma"),
        (
            text().replace(",", ";"),
            {},
            "are found with `form: {delimiter: semicolon, names_line: 1}`",
        ),
        (f"# rig 3\n\n{text()}", {}, "line 1, Moment: found no such column; allowed: one of # rig"),
        (f"# rig 3\n\n{text()}", {}, "All names are found with `form: {names_line: 3}`"),
        (text("Zeit,Kraft,Weg"), {}, "line 1, t: found no such column; allowed: one of Zeit"),
        (text("t (s),M (Nm),A").replace(",", " "), {"form": SPACE}, "line 1, Moment"),
    ],
)
def test_no_column_found_is_no_lack_of_lines(
    tmp_path: Path, content: str, changes: dict[str, object], says: str
) -> None:
    told = refused(tmp_path, content, **changes)
    assert says in told
    assert "first_line" not in told


def test_a_camera_has_a_form_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "b.txt").write_text(text())
    files = [{**FILE, "motion_file": "b.txt"}]
    camera = {"rate_hz": 4, "form": {"delimiter": "tab"}}
    told = refused(tmp_path, text(), files=files, motion_files=camera)
    assert "is `motion_files.form.delimiter` right?" in told
    assert "set" not in told


def test_few_lines_and_a_wrong_name_are_told_together(tmp_path: Path) -> None:
    told = refused(tmp_path, "t,Moment,Winkel\n0,1,2\n")
    assert "Angle: found no such column" in told
    assert "found 1 line of numbers; allowed: at least 10" in told


def rows(*cells: str) -> str:
    return "\n".join([HEAD, *(",".join(cells).format(n, n + 1) for n in range(20))])


@sweep(
    "content, form, says",
    [
        (text("t (s),Moment,Angle").replace(",", " "), SPACE, "4 names, 3 cells"),
        (text("Moment,Angle,t").replace("t\n", "t,u\n").replace(",", " "), SPACE, "4 names, 3"),
        (rows("0.5", "{}", "{}", "3"), {}, "3 names, 4 cells; allowed: a name for each cell; give"),
        (rows("{}", "-1050", "-0", "945"), {}, "line 2: found 3 names, 4 cells"),
        (rows("{}", "-1050", "-0", "945"), {}, "are decimals set off by commas?"),
        (rows("{}", "1", '"0,5"') + "\n30,1,0,5", {"decimal": "comma"}, "line 22: found 3 names"),
    ],
)
def test_cells_without_a_name_are_refused(
    tmp_path: Path, content: str, form: dict[str, object], says: str
) -> None:
    assert says in refused(tmp_path, content, form=form)


NUMBERS = {
    "time": {"column": 1, "unit": "s"},
    "loads": [{**LOAD, "column": 2}],
    "motion": [{**MOTION, "column": 3}],
}


def with_notes() -> bytes:
    book = openpyxl.Workbook()
    for line in text().splitlines():
        book.active.append([float(c) if c[-1].isdigit() else c for c in line.split(",")])
    book.active["G3"] = "remark"
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


@sweep(
    "content, changes",
    [
        (text().replace("\n", ",,\n"), {}),
        (text("t,Moment,Angle,Comment"), {}),
        (text("t (s),Moment,Angle").replace(",", " "), {"form": SPACE, **NUMBERS}),
        (text("t,Moment").replace("\n0", ",0\n0", 1), NUMBERS),
        (with_notes(), {}),
    ],
)
def test_what_tells_columns_without_doubt_is_read(
    tmp_path: Path, content: str | bytes, changes: dict[str, object]
) -> None:
    assert same(*read(tmp_path, content, **changes))


@sweep(
    "there, asked",
    [
        ("Moment\u00a0µ", "Moment \u03bc"),
        ("Moment  M", "Moment M"),
        (unicodedata.normalize("NFD", "Größe"), "Größe"),
    ],
)
def test_names_that_look_the_same_are_the_same(tmp_path: Path, there: str, asked: str) -> None:
    loads = [{**LOAD, "column": asked}]
    assert same(*read(tmp_path, text(f"t,{there},Angle"), loads=loads))
    told = refused(
        tmp_path, text(f"t,{there},{there} "), loads=loads, motion=[{**MOTION, "column": 1}]
    )
    assert "in columns 2 and 3" in told


def test_a_reading_that_is_turned_round_has_no_zero_below_zero(tmp_path: Path) -> None:
    (found,) = read(tmp_path, text(), loads=[{**LOAD, "positive": "flexion"}])
    (moment,) = found.loads.values()
    assert not np.signbit(moment[moment == 0.0]).any()


def test_quotes_may_stand_after_a_blank(tmp_path: Path) -> None:
    lines = (", ".join(f'"{cell}"' for cell in line.split(",")) for line in text().splitlines())
    assert same(*read(tmp_path, "\n".join(lines)))


def test_a_camera_tells_a_lost_marker_in_several_ways(tmp_path: Path) -> None:
    lines = text().splitlines()
    for number, cell in zip((9, 19, 29, 39), ("NaN", "nan", "#N/A", ""), strict=True):
        lines[number] = lines[number].rpartition(",")[0] + f",{cell}"
    (found,) = read(tmp_path, "\n".join(lines), form={"empty_cells": "left_out"})
    assert len(found.lines) == len(TIME) - 4
    assert found.notes == ("4 rows with an empty cell left out",)
    lines[9] = lines[9].replace("NaN", "lost?")
    assert "'lost?'" in refused(tmp_path, "\n".join(lines), form={"empty_cells": "left_out"})


@sweep("empty_line, rows", [("", 0), (",,", 1)])
def test_frames_are_rows_and_not_lines(tmp_path: Path, empty_line: str, rows: int) -> None:
    """A blank line is no frame; one of empty cells is."""
    lines = text().splitlines()
    lines[9:9] = [empty_line]
    (found,) = read(tmp_path, "\n".join(lines))
    assert (found.lines[8], found.rows[8]) == (11, 8 + rows)


@sweep(
    "units, form, says",
    [
        ("s,N m,deg", {}, "line 2, Moment: found 'N m'"),
        ("s,N m,deg", {}, "set `form: {first_line: 3}`"),
        ("s N m deg", SPACE, "set `form: {first_line: 3}`"),
    ],
)
def test_a_row_of_units_is_below_the_names(
    tmp_path: Path, units: str, form: dict[str, object], says: str
) -> None:
    content = text(f"{HEAD}\n{units}")
    told = refused(tmp_path, content.replace(",", " ") if form else content, form=form)
    assert says in told
    assert "names, " not in told


def formulas() -> bytes:
    book = openpyxl.Workbook()
    for number, line in enumerate(zip(("t", *TIME), ("Moment", *MOMENT), strict=True), start=1):
        book.active.append([*line, f"=B{number}*2" if number > 1 else "Angle"])
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


@sweep(
    "content, says",
    [
        (formulas(), "open and save it in a spreadsheet program"),
        ("\n".join([HEAD, *(f",{m},{m}" for m in MOMENT)]), "leave `time` out"),
    ],
)
def test_a_column_without_any_reading(tmp_path: Path, content: str | bytes, says: str) -> None:
    for form in ({}, {"empty_cells": "left_out"}):
        assert says in refused(tmp_path, content, form=form)


@sweep("cell", ["{}.0D+00", "#{}.0"])
def test_other_numbers_are_no_clock_times(tmp_path: Path, cell: str) -> None:
    told = refused(tmp_path, rows(cell, "{}", "1"))
    assert "line 2, t: found" in told
    assert "clock" not in told


@sweep("time", [{"column": "t", "unit": "s"}, {"column": "t", "unit": "clock"}])
def test_days_of_a_spreadsheet_are_told(tmp_path: Path, time: dict[str, str]) -> None:
    days = "\n".join(
        f"{45322.9 + t / 86400:.9f},{m},{m}" for t, m in zip(TIME, MOMENT, strict=True)
    )
    told = refused(tmp_path, f"{HEAD}\n{days}", time=time)
    assert "days since 1900" in told

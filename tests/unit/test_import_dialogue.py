"""`spinepipe import FILES`: what is suggested of files that nobody described, and what is asked.

The files are made up: one segment, straight lines of known slope. Catches a form, unit, direction
or column that is taken for another one, and an answer that is not written.
"""

import io
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pandas as pd
import pytest
import yaml
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cli import main
from spinepipe.testing_machine.sniff import seen
from spinepipe.testing_machine.suggest import direction_of

DEG_PER_NM = {"FE": 0.6, "LB": 0.5, "AR": 0.2}
HEAD = "Time;Axial Force;Torque;Angle"


def cycles(count: int = 4) -> np.ndarray:
    """(N,) N m, there and back to both sides, from zero."""
    turns = np.array([0.0, *[7.5, -7.5] * count, 0.0])
    ends = np.concatenate([np.linspace(a, b, 40)[:-1] for a, b in pairwise(turns)])
    return np.append(ends, 0.0)


def machine(
    folder: Path, *, head: str = HEAD, units: str = "ms;N;N m;deg", **factors: float
) -> list[str]:
    """Six files of a machine with one torque and one angle, `torque` and `angle` times as large."""
    rng = np.random.default_rng(3)
    folder.mkdir(parents=True, exist_ok=True)
    for specimen in ("donor12", "donor15"):
        for test, slope in DEG_PER_NM.items():
            moment = cycles()
            angle = slope * moment + 3.0 * (factors.get("angle", 1.0) == 1.0)
            angle += rng.normal(0.0, 0.01, len(moment))
            preload = rng.normal(-15.0, 1.0, len(moment))
            columns = [np.arange(len(moment)) * 50.0, preload]
            columns += [moment * factors.get("torque", 1), angle * factors.get("angle", 1)]
            rows = [";".join(f"{c:.5f}" for c in row) for row in zip(*columns, strict=True)]
            text = "\n".join([f"rig of {specimen}", "", head.replace("{test}", test), units, *rows])
            (folder / f"{specimen}_{test}.csv").write_text(text + "\n")
    return [str(one) for one in sorted(folder.glob("*.csv"))]


def answered(monkeypatch: pytest.MonkeyPatch, *lines: str) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("".join(f"{line}\n" for line in lines)))


def settings(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((folder / "import.yaml").read_text())
    return found


def test_one_torque_and_one_angle_by_entering_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every suggestion is right: direction by the test's name, sign by how the angle follows."""
    files = machine(tmp_path / "raw")
    answered(monkeypatch, *[""] * 10)
    assert main(["-C", str(tmp_path), "import", *files, "--cohort", "lab"]) == 0
    told = capsys.readouterr().out
    assert "6 files, 2 specimens (donor12 and donor15), 3 tests (AR, FE and LB)" in told
    assert "separated by semicolons, decimal point, names in line 3, numbers from line 5" in told
    assert "moment, N m  AR left_rotation, FE flexion, LB right_bending" in told
    assert "a preload?" in told
    assert "which is no accuracy" in told
    assert "Next: spinepipe show lab" in told
    written = settings(tmp_path / "raw")
    assert written["accuracy"] == {"rotation_deg": 0.1}
    assert [one["glob"] for one in written["files"]] == [
        f"{{specimen}}_{test}.csv" for test in ("AR", "FE", "LB")
    ]
    assert written["files"][1]["loads"][0]["positive"] == "flexion"
    folder = tmp_path / "config/cohorts/lab"
    cohort = cohorts.read(folder)
    assert cohort.reading_sd()[3] == 0.1
    motion = pd.read_csv(folder / "motion.csv")
    peak = motion[(motion.test == "FE") & (motion.step == 5)]
    np.testing.assert_allclose(peak.extension_deg, -0.6 * 7.5, atol=0.03)
    assert len(motion[motion.step == 0]) == 2 * 3 * 3  # the first of four cycles is left out
    before = (folder / "motion.csv").read_bytes()
    again = ["-C", str(tmp_path), "import", str(tmp_path / "raw/import.yaml"), "--replace"]
    assert main(again) == 0
    assert (folder / "motion.csv").read_bytes() == before


def test_answers_are_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Column 3 is told anew, a direction is turned round, and nothing is preconditioning."""
    files = machine(tmp_path / "raw", units=";;;", torque=1e3)
    lines = ["9", "3", "moment", "Nmm", "", "left_rotation", "up", "extension", "", "L4 L3"]
    answered(monkeypatch, *lines, "lab", "me, 2026", "n", "0.25")
    assert main(["-C", str(tmp_path), "import", *files]) == 0
    said = capsys.readouterr().out
    assert "A number from 1 to 4." in said
    assert "Allowed: extension, flexion" in said
    written = settings(tmp_path / "raw")
    assert written["vertebrae"] == ["L4", "L3"]
    assert written["source"] == "me, 2026"
    assert written["accuracy"] == {"rotation_deg": 0.25}
    loads = [one["loads"][0] for one in written["files"]]
    assert [one["unit"] for one in loads] == ["N mm"] * 3
    assert loads[1]["positive"] == written["files"][1]["motion"][0]["positive"] == "extension"
    assert "preconditioning_cycles" not in written["files"][0]


def test_an_answer_that_cannot_be_meant_is_asked_for_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Column 2 is told in N, so no unit of a moment is suggested by it; then it is a force."""
    files = machine(tmp_path / "raw")
    lines = ["2", "moments", "moment", "lbf in", "", "2", "force", "", "down", "superior"]
    answered(monkeypatch, *lines, "a b", "0 10", "0 10 5", *[""] * 10)
    asked = ["-C", str(tmp_path), "import", *files, "--cohort", "lab", "--dry-run"]
    assert main([*asked, "--vertebrae", "L5"]) == 2
    assert 'the vertebrae "L5"' in capsys.readouterr().err
    answered(monkeypatch, *lines, "a b", "0 10", "0 10 5", *[""] * 10)
    main(asked)
    said = capsys.readouterr().out
    assert "Allowed: time, moment, angle, force, no." in said
    assert "Unit (N m, N mm, N cm) [N m]" in said
    assert "Allowed: N m, N mm, N cm." in said
    assert "Allowed: anterior, posterior, superior, inferior, right, left." in said
    assert "load_point_mm: [0.0, 10.0, 5.0]" in said
    assert "{column: Axial Force, unit: N, positive: superior}" in said


def test_a_dry_run_and_a_stop_write_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    files = machine(tmp_path / "raw")
    assert main(["-C", str(tmp_path), "import", *files, "--yes", "--dry-run"]) == 0
    told = capsys.readouterr().out
    assert "loads: [{column: Torque, unit: N m, positive: flexion}]" in told
    assert "378 load steps in all" in told
    answered(monkeypatch, "")
    assert main(["-C", str(tmp_path), "import", *files]) == 130
    assert {one.name for one in tmp_path.iterdir()} == {"raw"}
    assert len(list((tmp_path / "raw").iterdir())) == 6


def test_settings_that_are_there_are_not_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = machine(tmp_path / "raw")
    arguments = ["-C", str(tmp_path), "import", *files, "--yes", "--cohort", "lab"]
    assert main(arguments) == 0
    assert main(arguments) == 1
    assert f"spinepipe import {tmp_path / 'raw/import.yaml'}" in capsys.readouterr().err
    assert main([*arguments, "--replace", "--accuracy-deg", "0.5"]) == 0
    assert settings(tmp_path / "raw")["accuracy"] == {"rotation_deg": 0.5}


@sweep(
    "units, factors, key, suspected",
    [
        ("ms;N;N m;deg", {"angle": np.pi / 180}, "motion.0.unit: found 'deg'", "suspected: rad"),
        ("ms;N;N m;deg", {"torque": 1e3}, "loads.0.unit: found 'N m'", "N mm"),
        ("ms;N;N mm;deg", {}, "loads.0.unit: found 'N mm'", "suspected: N m"),
        ("ms;N;deg;N m", {}, "loads.0.column: found 'Angle' in loads", "exchange the columns"),
    ],
)
def test_what_the_files_say_wrongly_is_told_at_its_line_and_no_cohort_is_written(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    units: str,
    factors: dict[str, float],
    key: str,
    suspected: str,
) -> None:
    files = machine(tmp_path / "raw", units=units, **factors)
    assert main(["-C", str(tmp_path), "import", *files, "--yes", "--cohort", "lab"]) == 1
    said = capsys.readouterr()
    line = next(one for one in said.err.splitlines() if f"files.1.{key}" in one)
    number = int(line.split("line ")[1].split(",")[0])
    lines = (tmp_path / "raw/import.yaml").read_text().splitlines()
    assert key.split(".")[0] + ": " in lines[number - 1]
    assert suspected in said.err
    assert "import.yaml goes on" in said.out
    assert not list((tmp_path / "config/cohorts").iterdir())


@sweep(
    "unit, torque, angle, units",
    [("", 1e3, 1.0, ("N mm", "deg")), ("", 1.0, 0.0175, ("N m", "rad"))],
)
def test_units_that_no_header_tells_are_suggested_by_size(
    tmp_path: Path, unit: str, torque: float, angle: float, units: tuple[str, str]
) -> None:
    files = machine(tmp_path / "raw", units="ms;;;", torque=torque, angle=angle)
    assert main(["-C", str(tmp_path), "import", *files, "--yes", "--cohort", "lab"]) == 0
    (item, *_) = settings(tmp_path / "raw")["files"]
    assert (item["loads"][0]["unit"], item["motion"][0]["unit"]) == units


def test_columns_named_by_direction_are_of_the_files_that_have_them(tmp_path: Path) -> None:
    files = machine(tmp_path / "raw", head="Time;Axial Force;Torque {test};Angle {test}")
    assert main(["-C", str(tmp_path), "import", *files, "--yes", "--cohort", "lab"]) == 0
    items = settings(tmp_path / "raw")["files"]
    assert [one["loads"][0]["column"] for one in items] == [
        f"Torque {t}" for t in ("AR", "FE", "LB")
    ]


def test_a_fault_of_the_settings_that_all_files_show_is_told_once_at_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = machine(tmp_path / "raw", head="Time;Axial Force;Torque {test};Angle {test}")
    assert main(["-C", str(tmp_path), "import", *files, "--yes", "--cohort", "lab"]) == 0
    path = tmp_path / "raw/import.yaml"
    told = path.read_text()
    capsys.readouterr()
    path.write_text(told.replace("delimiter: semicolon", "delimiter: comma"))
    assert main(["-C", str(tmp_path), "import", str(path), "--replace"]) == 1
    (line,) = [
        one for one in capsys.readouterr().err.splitlines() if "found" in one and "error" in one
    ]
    assert "import.yaml, line 7, form.delimiter: found comma" in line
    assert "in 6 files (" in line
    document = yaml.safe_load(told)
    document["loads"] = [one.pop("loads")[0] for one in document["files"]]
    document["motion"] = [one.pop("motion")[0] for one in document["files"]]
    for one, load in zip(document["files"], document["loads"], strict=True):
        one["driving"] = load["column"]
    path.write_text(yaml.safe_dump(document, sort_keys=False))
    assert main(["-C", str(tmp_path), "import", str(path), "--replace"]) == 1
    said = capsys.readouterr().err
    assert "'Torque LB', and no such column in 4 files (" in said
    assert "if each file holds one direction" in said


def test_what_cannot_be_told_is_asked_for_and_refused_without_questions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    machine(tmp_path / "raw")
    name = tmp_path / "raw/donor12.run.csv"
    name.write_bytes((tmp_path / "raw/donor12_FE.csv").read_bytes())
    asked = ["-C", str(tmp_path), "import", str(name)]
    assert main([*asked, "--yes"]) == 1
    assert '--pattern "{specimen}_{test}.csv"' in capsys.readouterr().err
    assert main([*asked, "--yes", "--pattern", "{specimen}.{test}.csv"]) == 1
    assert "a test whose name does not tell its direction" in capsys.readouterr().err
    answered(monkeypatch, "{specimen}.{test}.csv", "", "flexion", "", "lab", "", "", "")
    assert main(asked) == 0
    assert settings(tmp_path / "raw")["files"][0]["test"] == "run"
    assert not name.with_suffix(".yaml").exists()
    (tmp_path / "raw/s_FE.csv").write_text("a: 1\n" * 30)
    assert main(["-C", str(tmp_path), "import", str(tmp_path / "raw/s_FE.csv")]) == 1
    assert "no 5 lines of numbers" in capsys.readouterr().err
    assert main([*asked[:3], str(tmp_path / "raw/import.yaml"), "--yes"]) == 2


def table(mark: str, decimal: str, head: list[list[str]]) -> str:
    rows = [[f"{n / 4:.2f}", f"{n % 7 - 3.25:.3f}", f"{n * 0.1:.2f}"] for n in range(30)]
    body = [mark.join(row).replace(".", decimal) for row in rows]
    return "\n".join([*(mark.join(one) for one in head), *body]) + "\n"


@sweep(
    "text, form, keys",
    [
        (table(",", ".", [["t", "M", "A"]]), {}, ["t", "M", "A"]),
        (table("\t", ",", [["x"], ["t", "M", "A"], ["s", "Nm", "°"]]),
         {"delimiter": "tab", "decimal": "comma", "names_line": 2, "first_line": 4},
         ["t", "M", "A"]),
        (table("  ", ".", [["time", "moment", "angle"]]), {"delimiter": "space"},
         ["time", "moment", "angle"]),
        (table(" ", ".", [["Axial force", "moment", "angle"]]),
         {"delimiter": "space", "names_line": 0, "first_line": 2}, [1, 2, 3]),
        (table(";", ".", []), {"delimiter": "semicolon", "names_line": 0}, [1, 2, 3]),
        (table(",", ".", [["t", "M", "M"]]), {}, ["t", 2, 3]),
    ],
)  # fmt: skip
@sweep("encoding", ["utf-8", "latin-1", "utf-16"])
def test_forms(
    tmp_path: Path, text: str, form: dict[str, Any], keys: list[Any], encoding: str
) -> None:
    path = tmp_path / "s_FE.txt"
    path.write_bytes(text.encode(encoding))
    found = seen(path, path.name)
    other = encoding == "utf-16" or (encoding == "latin-1" and "°" in text)
    assert dict(found.form) == form | ({"encoding": encoding} if other else {})
    assert [one.key for one in found.columns] == keys
    assert found.columns[1].values[:2].tolist() == [-3.25, -2.25]
    assert "°" not in text or [one.unit for one in found.columns] == ["s", "N m", "deg"]


def test_a_workbook_is_read_on_the_sheet_with_numbers(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.append(["by hand"])
    sheet = book.create_sheet("Data")
    for row in (
        ["Time [s]", "Torque [Nm]", "Angle [deg]"],
        *([n, n % 5, n / 2] for n in range(20)),
    ):
        sheet.append(row)
    book.save(tmp_path / "s_FE.xlsx")
    found = seen(tmp_path / "s_FE.xlsx", "s_FE.xlsx")
    assert dict(found.form) == {"sheet": 2}
    assert [one.unit for one in found.columns] == ["s", "N m", "deg"]


@sweep(
    "test, direction",
    [
        ("FE", "flexion"), ("flexion_extension", "flexion"), ("extension", "extension"),
        ("LB", "right_bending"), ("left_bending", "left_bending"), ("AR2", "left_rotation"),
        ("axialRotation", "left_rotation"), ("right_rotation", "right_rotation"), ("run", ""),
    ],
)  # fmt: skip
def test_directions_of_names(test: str, direction: str) -> None:
    assert direction_of(test) == direction

"""Files that only some kind of study reads: films, persons, markers, times, rigs and preloads.

Each mistake is named with its file, its column and how to mend it; good files never are.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from cohort_cases import swap, text
from cohort_cases import write as write_small
from mistaken_cohorts import SHIPPED, good, told

from spinepipe import cohort as cohorts
from spinepipe.studies.plausibility import refusals
from spinepipe.studies.registry import every_form

Table = Callable[[pd.DataFrame], None]

CENTRE = ["y_mm", "z_mm", "orientation_deg"]
FILMS, PEOPLE, TASKS, MARKERS = "films.csv", "subjects.csv", "tasks.csv", "marker_set.csv"
HANDS_MM = ["hands_anterior_mm", "hands_superior_mm", "hands_right_mm"]
PUSHES_N = ["push_anterior_n", "push_superior_n", "push_right_n"]
PUSHES_NM = ["push_extension_nm", "push_right_bending_nm", "push_left_rotation_nm"]
AIS, TRUNKS, TRACKED = "ais18_phantom_sd07", "trunk_volunteers", "tracking_phantom"


def times(columns: list[str], factor: float) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[columns] *= factor

    return spoil


def swapped(first: str, second: str) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[[first, second]] = table[[second, first]].to_numpy()

    return spoil


def put(column: str, value: float, row: int = 0) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[column] = table[column].astype(float)
        table.loc[row, column] = value

    return spoil


def copied(table: pd.DataFrame) -> None:
    first = table["specimen"].iloc[0]
    rows = table["specimen"] != first
    table.loc[rows, CENTRE] = table.loc[table["specimen"] == first, CENTRE].to_numpy()


def upside_down(table: pd.DataFrame) -> None:
    names = list(dict.fromkeys(table["vertebra"]))
    table["vertebra"] = table["vertebra"].replace(dict(zip(names, names[::-1], strict=True)))
    lowest = table.groupby(["specimen", "position", "observer"])[CENTRE].transform("last")
    table[CENTRE] -= lowest


def filled_down(table: pd.DataFrame) -> None:
    table["orientation_deg"] = 2.0


def small(columns: list[str], largest: float) -> Table:
    """Numbers of all tasks, of the one unit that makes them small."""

    def spoil(table: pd.DataFrame) -> None:
        table[columns] = 0.0
        table.loc[0, columns[0]] = largest

    return spoil


def radians(table: pd.DataFrame) -> None:
    turns = [name for name in table if name.endswith("_deg")]
    table[turns] *= np.pi / 180.0


def in_bone(table: pd.DataFrame) -> None:
    """Two of many markers, as a camera's program puts them on the vertebra."""
    table.loc[table["marker"].isin(["T5", "L3"]), "x_mm"] = -10.0


MISTAKES = [
    (AIS, FILMS, times(CENTRE[:2], 0.1), "y_mm", "in cm and not mm (0.1); multiply y_mm, z_mm"),
    (AIS, FILMS, times(CENTRE[:2], 1e-3), "y_mm", "in m and not mm"),
    (AIS, FILMS, times(CENTRE[:2], 1 / 25.4), "y_mm", "inches"),
    (AIS, FILMS, swapped("y_mm", "z_mm"), "y_mm", "y_mm and z_mm exchanged"),
    (AIS, FILMS, times(["z_mm"], -1.0), "z_mm", "sign of z_mm: counted downwards"),
    (AIS, FILMS, upside_down, "z_mm", "names of vertebrae in reverse"),
    (AIS, FILMS, times(["y_mm"], -1.0), "orientation_deg", "the sign of orientation_deg, or of y"),
    (AIS, FILMS, times(["orientation_deg"], np.pi / 180), "orientation_deg", "radians"),
    (AIS, FILMS, filled_down, "orientation_deg", "filled down"),
    (AIS, FILMS, copied, "specimen", "copied"),
    (AIS, "patients.csv", times(["cobb_deg"], np.pi / 180), "cobb_deg", "radians"),
    (TRUNKS, PEOPLE, times(["mass_kg"], 1 / 0.45359237), "mass_kg", "mass in lb and not kg; 72.0?"),
    (TRUNKS, PEOPLE, put("age_years", 125.0), "age_years", "age in months and not years; 10?"),
    (TRUNKS, TASKS, put("intra_abdominal_pressure_kpa", 45.0), "", "mmHg and not kPa; 6?"),
    (TRUNKS, TASKS, put("intra_abdominal_pressure_kpa", 0.01), "", "MPa, or bar"),
    (TRUNKS, TASKS, put("largest_stress_mpa", 60.0), "", "N/cm2 or kPa"),
    (TRUNKS, TASKS, small(HANDS_MM, 5.0), "", "cm, inches or m"),
    (TRUNKS, TASKS, small(PUSHES_N, 0.2), "", "kN and not N"),
    (TRUNKS, TASKS, small(PUSHES_NM, 0.2), "", "kN m and not N m"),
    (TRUNKS, TASKS, radians, "", "multiply the columns that end in _deg"),
    (TRACKED, PEOPLE, times(["mass_kg"], 1 / 0.45359237), "mass_kg", "mass in lb and not kg"),
    (TRACKED, MARKERS, times(["x_mm", "y_mm", "z_mm"], 0.1), "x_mm", "cm and not mm"),
    (TRACKED, MARKERS, times(["x_mm", "y_mm", "z_mm"], 1e-3), "x_mm", "m and not mm"),
    (TRACKED, MARKERS, times(["x_mm"], -1.0), "x_mm", "sign of x_mm"),
    (TRACKED, MARKERS, in_bone, "x_mm", "points of the bone"),
]


def few(name: str, into: Path) -> Path:
    """A cohort with few of its specimens."""
    folder = good(name, into)
    if name in SHIPPED or name == TRUNKS:
        return folder
    for file in folder.glob("*.csv"):
        table = pd.read_csv(file)
        table[table["specimen"].isin(["p01", "p02"])].to_csv(file, index=False)
    return folder


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folders = {name: few(name, tmp_path_factory.mktemp(name)) for name in (AIS, TRUNKS, TRACKED)}
    assert all(told(folder) == () for folder in folders.values())
    return folders


@pytest.mark.parametrize(("name", "file", "spoil", "column", "remedy"), MISTAKES)
def test_each_is_told_with_its_column_and_remedy(
    name: str,
    file: str,
    spoil: Table,
    column: str,
    remedy: str,
    sound: dict[str, Path],
    tmp_path: Path,
) -> None:
    folder = tmp_path / name
    folder.mkdir()
    for one in sound[name].iterdir():
        if one.name != file:
            (folder / one.name).write_bytes(one.read_bytes())
    table = pd.read_csv(sound[name] / file)
    spoil(table)
    table.to_csv(folder / file, index=False)
    found = told(folder)
    assert found
    assert {problem.file for problem in found} == {f"{name}/{file}"}
    assert all(not column or problem.column == column for problem in found)
    assert all(problem.row is not None for problem in found)
    assert any(remedy in problem.remedy for problem in found)


def test_lengths_of_films_are_refused_unless_meant(sound: dict[str, Path], tmp_path: Path) -> None:
    for meant in (False, True):
        folder = tmp_path / str(meant) / AIS
        folder.mkdir(parents=True)
        for one in sound[AIS].iterdir():
            (folder / one.name).write_bytes(one.read_bytes())
        table = pd.read_csv(folder / FILMS)
        table[CENTRE[:2]] *= 0.1
        table.to_csv(folder / FILMS, index=False)
        header = yaml.safe_load((folder / "cohort.yaml").read_text())
        header |= {"acknowledged_warnings": ["lengths"]} if meant else {}
        (folder / "cohort.yaml").write_text(yaml.safe_dump(header))
        refused = refusals(cohorts.read(folder, every_form()))
        assert len(refused) == (0 if meant else 1)


def test_corners_of_films(tmp_path: Path) -> None:
    """Rectangles of 40 by 25 mm in a straight spine; then sides, ends and axes exchanged."""
    names = [
        f"{end}_{side}_{axis}_mm"
        for end in ("upper", "lower")
        for side in ("left", "right")
        for axis in "yz"
    ]
    levels = ["L4", "L3", "L2", "L1"]
    rows = []
    for position, bend in (("erect", 0.0), ("right_bending", -1.0), ("left_bending", 1.0)):
        for k, vertebra in enumerate(levels):
            corner = [(20, 12.5), (-20, 12.5), (20, -12.5), (-20, -12.5)]
            points = [(y + 4 * bend * k**2, z + 35.0 * k) for y, z in corner]
            rows.append(["a", position, vertebra, *np.ravel(points)])
    table = pd.DataFrame(rows, columns=["specimen", "position", "vertebra", *names])
    swaps = {
        "": {},
        "left and right": {n: n.replace("left", "right") for n in names if "left" in n},
        "upper and lower": {n: n.replace("upper", "lower") for n in names if "upper" in n},
        "y and z": {n: n.replace("_y_", "_z_") for n in names if "_y_" in n},
    }
    for words, pairs in swaps.items():
        folder = tmp_path / (words or "good") / "films"
        folder.mkdir(parents=True)
        header = f"cohort: films\ntitle: t\nsource: s\nvertebrae: {levels}\ngravity: false\n"
        (folder / "cohort.yaml").write_text(header.replace("'", ""))
        (folder / "specimens.csv").write_text("specimen\na\n")
        both = pairs | {new: old for old, new in pairs.items()}
        table.rename(columns=both)[table.columns].to_csv(folder / FILMS, index=False)
        found = told(folder)
        assert len(found) == (1 if words else 0)
        assert all(f"{words}" in problem.remedy for problem in found)


@pytest.mark.parametrize(
    ("rate", "words"), [(10_000.0, "another unit"), (0.5, "DataRate too small")]
)
def test_times_of_recordings(
    rate: float, words: str, sound: dict[str, Path], tmp_path: Path
) -> None:
    """The same frames, at another rate: a bend in hundredths of a second, or in minutes."""
    folder = tmp_path / TRACKED
    folder.mkdir()
    for one in sound[TRACKED].iterdir():
        (folder / one.name).write_bytes(one.read_bytes())
    (path,) = folder.glob("s01_flexion_extension.trc")
    lines = path.read_text().splitlines()
    old = float(lines[2].split("\t")[0])
    heads = lines[2].split("\t")
    lines[2] = "\t".join([f"{rate:g}", f"{rate:g}", *heads[2:]])
    for k in range(5, len(lines)):
        cells = lines[k].split("\t")
        if len(cells) > 2 and cells[0].strip():
            cells[1] = f"{float(cells[1]) * old / rate:.6f}"
            lines[k] = "\t".join(cells)
    path.write_text("\n".join(lines) + "\n")
    (problem,) = told(folder)
    assert problem.file == f"{TRACKED}/{path.name}"
    assert words in problem.remedy


PRELOAD = "specimen,test,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm\n"
SUPPORTS = "specimen,test,joint,coordinate,state,reaction\n"


@pytest.mark.parametrize(
    ("row", "column", "words"),
    [
        ("*,*,L2,0,-400,0,0,0,0,0,59,0", None, ""),
        ("*,*,L2,0,-0.4,0,0,0,0,0,59,0", "fy_n", "kN and not N"),
        ("*,*,L2,0,-8000,0,0,0,0,0,59,0", "fy_n", "multiplied by 1000"),
        ("*,*,L2,0,400,0,0,0,0,0,59,0", "fy_n", "sign of fy_n"),
        ("*,*,L2,0,0,0,0,0,-300,0,59,0", "mz_nm", "N mm and not N m"),
    ],
)
def test_preloads(row: str, column: str | None, words: str, tmp_path: Path) -> None:
    found = told(write_small(tmp_path / "small", text("preload.csv", f"{PRELOAD}{row}\n")))
    own = [one for one in found if one.file == "small/preload.csv"]
    assert [one.column for one in own] == ([column] if column else [])
    assert all(words in one.remedy for one in own)


@pytest.mark.parametrize(
    ("coordinate", "old", "new", "words"),
    [
        ("extension", "", "", ""),
        ("extension", "-1,", "-0.02,", "radians and not degrees"),
        ("anterior", "0.2,0", "0.0002,0", "in m and not mm"),
    ],
)
def test_prescribed_motion(coordinate: str, old: str, new: str, words: str, tmp_path: Path) -> None:
    """What a rig moves is an input: nothing but its size can be judged."""
    rig = text("supports.csv", f"{SUPPORTS}*,*,*,{coordinate},prescribed,\n")
    folder = write_small(tmp_path / "small", rig)
    table = pd.read_csv(folder / "motion.csv")
    if words:
        table["extension_deg"] *= 0.0175 if coordinate == "extension" else 1.0
        table["anterior_mm"] *= 1e-3 if coordinate == "anterior" else 1.0
        table.to_csv(folder / "motion.csv", index=False)
    found = [one for one in told(folder) if "prescribed" in one.found]
    assert len(found) == bool(words)
    assert all(words in one.remedy and one.file == "small/motion.csv" for one in found)


@pytest.mark.parametrize(
    ("row", "column", "words"),
    [
        ("a,female,61,1.62,155,CT 1", "mass_kg", "mass in lb and not kg; 70.3?"),
        ("a,female,61,162,70.5,CT 1", "height_m", "cm and not m"),
        ("a,female,129,1.62,70.5,CT 1", "age_years", "months"),
    ],
)
def test_persons_of_specimens(row: str, column: str, words: str, tmp_path: Path) -> None:
    change = swap("specimens.csv", "a,female,61,1.62,70.5,CT 1", row)
    (problem,) = told(write_small(tmp_path / "small", change))
    assert (problem.file, problem.row, problem.column) == ("small/specimens.csv", 2, column)
    assert words in problem.remedy

"""Sound cells, wrong quantities: another unit, sign, order or column, in tables of every kind."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tests.generators.spoilt.case import Case, Expected
from tests.generators.spoilt.projects import Project, as_csv
from tests.generators.spoilt.recordings import TRACKED

TOLD, OPEN = Expected.TOLD, Expected.OPEN

XYZ, COM, POINT = (
    ("x_mm", "y_mm", "z_mm"),
    ("com_x_mm", "com_y_mm", "com_z_mm"),
    ("px_mm", "py_mm", "pz_mm"),
)
ANGLES = ("extension_deg", "right_bending_deg", "left_rotation_deg")
SHIFTS = ("anterior_mm", "superior_mm", "right_mm")
MOMENTS, FORCES = ("mx_nm", "my_nm", "mz_nm"), ("fx_n", "fy_n", "fz_n")
FILM = ("y_mm", "z_mm")
HANDS = ("hands_anterior_mm", "hands_superior_mm", "hands_right_mm")

UNITS = {"cm": 0.1, "inch": 1.0 / 25.4, "m": 1e-3, "times 10": 10.0}

RADIANS = math.pi / 180.0


@dataclass(frozen=True)
class _Scaled:
    """Columns of a table multiplied."""

    stem: str
    columns: Sequence[str]
    what: str
    factor: float
    expected: Expected = TOLD
    told_in: tuple[str, ...] = ()


def _scaled() -> Iterator[_Scaled]:
    for stem, columns in (
        ("landmarks", XYZ),
        ("joints", XYZ),
        ("bodies", COM),
        ("loads", POINT),
        ("films", FILM),
        ("marker_set", XYZ),
        ("tasks", HANDS),
    ):
        for unit, factor in UNITS.items():
            yield _Scaled(stem, columns, unit, factor)
        if stem not in ("loads", "tasks"):
            yield _Scaled(stem, columns[1:2], "upside down", -1.0)
    yield _Scaled("joints", ANGLES, "radians", RADIANS)
    yield _Scaled("films", ("orientation_deg",), "radians", RADIANS)
    yield _Scaled("films", ("orientation_deg",), "sign", -1.0)
    yield _Scaled("films", ("orientation_deg",), "zero", 0.0)
    yield _Scaled("motion", ANGLES, "radians", RADIANS, told_in=("loads.csv",))
    yield _Scaled("motion", SHIFTS, "m", 1e-3, told_in=("loads.csv",))
    yield _Scaled("motion", ANGLES, "zero", 0.0)
    yield _Scaled("loads", MOMENTS, "N mm", 1e3, told_in=("motion.csv",))
    yield _Scaled("loads", FORCES, "kN", 1e-3, told_in=("motion.csv",))
    yield _Scaled("loads", (*MOMENTS, *FORCES), "zero", 0.0, told_in=("motion.csv",))
    yield _Scaled("bodies", ("mass_kg",), "g", 1e3)
    yield _Scaled("bodies", ("mass_kg",), "t", 1e-3)
    yield _Scaled("subjects", ("height_cm",), "m", 0.01)
    yield _Scaled("subjects", ("height_cm",), "mm", 10.0)
    yield _Scaled("subjects", ("height_cm",), "inch", 1.0 / 2.54)
    yield _Scaled("subjects", ("mass_kg",), "g", 1e3)
    yield _Scaled("subjects", ("mass_kg",), "N", 9.81)
    yield _Scaled("subjects", ("mass_kg",), "lb", 2.2, OPEN)
    yield _Scaled("specimens", ("height_m",), "cm", 100.0)
    yield _Scaled("specimens", ("mass_kg",), "g", 1e3)
    yield _Scaled("tasks", ("hand_load_kg",), "g", 1e3)
    yield _Scaled("tasks", ("hand_load_kg",), "N", 9.81)
    yield _Scaled("tasks", ("trunk_extension_deg",), "radians", RADIANS)
    yield _Scaled("tasks", ("push_extension_nm",), "N mm", 1e3)
    yield _Scaled("tasks", ("push_extension_nm",), "kN m", 1e-3)
    yield _Scaled("tasks", ("intra_abdominal_pressure_kpa",), "Pa", 1e3)
    yield _Scaled("tasks", ("largest_stress_mpa",), "kPa", 1e3)
    yield _Scaled("tasks", ("largest_stress_mpa",), "Pa", 1e6)
    yield _Scaled("patients", ("cobb_deg",), "radians", RADIANS)


EXCHANGED = (
    ("landmarks", "x_mm", "y_mm"),
    ("landmarks", "x_mm", "z_mm"),
    ("joints", "x_mm", "y_mm"),
    ("bodies", "com_x_mm", "com_y_mm"),
    ("bodies", "mass_kg", "com_x_mm"),
    ("films", "y_mm", "z_mm"),
    ("marker_set", "x_mm", "y_mm"),
    ("subjects", "height_cm", "mass_kg"),
    ("subjects", "age_years", "mass_kg"),
    ("trials", "specimen", "trial"),
)


UNDECIDED = {
    ("l4l5_disc", "joints", "exchanged with y_mm"): "nobody tells where the joint of a disc lies",
    (
        "tracking_phantom",
        "subjects",
        "age_years",
    ): "67 years and 65.6 kg are as good as the reverse",
    ("small_rig", "loads", "zero"): "the preload alone may have moved the joints",
}
"""Mistakes that cannot be decided from the files, and why."""


def quantity_cases(project: Project) -> Iterator[Case]:
    """All cases of one project."""
    for one in _scaled():
        if one.stem in project.tables:
            yield from _multiplied(project, one)
    for stem, first, second in EXCHANGED:
        if stem in project.tables:
            yield from _exchanged(project, stem, first, second)


def _multiplied(project: Project, one: _Scaled) -> Iterator[Case]:
    header, *rows = project.table(one.stem)
    there = [header.index(name) for name in one.columns if name in header]
    forces = [header.index(name) for name in FORCES if name in header]
    of_force = one.columns == POINT
    new = [
        [_times(c, one.factor) if n in there and c else c for n, c in enumerate(row)]
        if not of_force or any(float(row[at]) for at in forces)
        else row
        for row in rows
    ]
    if [_numbers(row, there) for row in new] != [_numbers(row, there) for row in rows]:
        yield _case(project, one.columns[0], one.what, [header, *new], one)


def _numbers(row: list[str], there: list[int]) -> list[float]:
    return [float(row[at]) for at in there if row[at]]


def _times(cell: str, factor: float) -> str:
    return f"{float(cell) * factor:.9g}"


def _exchanged(project: Project, stem: str, first: str, second: str) -> Iterator[Case]:
    header, *rows = project.table(stem)
    if first in header and second in header:
        one, other = header.index(first), header.index(second)
        new = [list(row) for row in rows]
        for row in new:
            row[one], row[other] = row[other], row[one]
        about = _Scaled(stem, (first,), "", 1.0)
        yield _case(project, first, f"exchanged with {second}", [header, *new], about)


def _case(project: Project, place: str, what: str, rows: list[list[str]], of: _Scaled) -> Case:
    file = f"{project.folder}/{of.stem}.csv"
    undecided = {(project.name, of.stem, what), (project.name, of.stem, place)} & set(UNDECIDED)
    expected = OPEN if undecided else of.expected
    told_in = (*of.told_in, *(TRACKED if project.kind == "tracking" else ()))
    return Case(
        project, "quantity", what, file, place, expected, lambda: {file: as_csv(rows)}, told_in
    )

"""A small valid cohort as text, and one-line ways to spoil it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

Files = dict[str, str | bytes]
"""Content of the files of a cohort folder, by file name."""

Change = Callable[[Files], None]

NAME = "small"

COHORT_YAML = """\
cohort: small
title: two specimens, three vertebrae
source: written for the tests
vertebrae: [L4, L3, L2]
gravity: true
zeroed_at_step_0: false
measurement_sd:
  rotation_deg: 0.1
  translation_mm: 0.05
"""

SPECIMENS = """\
specimen,sex,age_years,height_m,mass_kg,scanner
a,female,61,1.62,70.5,CT 1
b,,,,,CT 2
"""

BODIES = """\
specimen,vertebra,mass_kg,com_x_mm,com_y_mm,com_z_mm,ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2,ixz_kg_m2,iyz_kg_m2
a,L3,0.06,0,23,0,2e-5,3e-5,2e-5,0,0,0
a,L2,0.06,0,59,0,2e-5,3e-5,2e-5,0,0,0
b,L3,0.06,0,23,0,,,,,,
b,L2,0.06,0,59,0,,,,,,
"""

LOADS = """\
specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm,time_s
*,flexion,0,L2,0,0,0,0,0,0,,,,0
*,flexion,1,L2,0,-50,0,0,0,-1,15,72,0,1
*,flexion,2,L2,0,-100,0,0,0,-2,15,72,0,2
"""

MOTION_HEADER = "specimen,test,step,joint,extension_deg,anterior_mm,superior_mm"


def landmarks() -> str:
    """Three upright vertebrae of two specimens; a's L4, L3, L2 begin in lines 2, 6, 10."""
    rows = ["specimen,vertebra,landmark,x_mm,y_mm,z_mm,sd_mm"]
    for specimen in "ab":
        for vertebra, base in (("L4", -26), ("L3", 10), ("L2", 46)):
            start = f"{specimen},{vertebra}"
            rows += [
                f"{start},superior_endplate_centre,0,{base + 26},0,1",
                f"{start},inferior_endplate_centre,0,{base},0,1",
                f"{start},left_pedicle_base,-20,{base + 18},-15,1",
                f"{start},right_pedicle_base,-20,{base + 18},15,1",
            ]
    return "\n".join(rows) + "\n"


def motion() -> str:
    """Three steps of two joints of two specimens; steps 0, 1, 2 of a begin in lines 2, 4, 6."""
    rows = [MOTION_HEADER]
    for specimen in "ab":
        for step in range(3):
            for joint in ("L3L4", "L2L3"):
                rows.append(f"{specimen},flexion,{step},{joint},{-step},{0.1 * step:.1f},0")
    return "\n".join(rows) + "\n"


def joints() -> str:
    """Poses of both joints of both specimens."""
    rows = ["specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"]
    for specimen in "ab":
        rows += [f"{specimen},L3L4,0,5,0,-3,0,0", f"{specimen},L2L3,0,41,0,4,0,0"]
    return "\n".join(rows) + "\n"


def valid_files() -> Files:
    """A cohort without a fault."""
    return {
        "cohort.yaml": COHORT_YAML,
        "specimens.csv": SPECIMENS,
        "landmarks.csv": landmarks(),
        "bodies.csv": BODIES,
        "loads.csv": LOADS,
        "motion.csv": motion(),
    }


def write(folder: Path, *changes: Change) -> Path:
    """Write the cohort, changed, and return its folder."""
    files = valid_files()
    for change in changes:
        change(files)
    folder.mkdir(parents=True)
    for name, content in files.items():
        data = content if isinstance(content, bytes) else content.encode()
        (folder / name).write_bytes(data)
    return folder


def text(file: str, content: str | bytes) -> Change:
    """Give a file this content."""

    def change(files: Files) -> None:
        files[file] = content

    return change


def without(file: str) -> Change:
    """Leave a file out."""

    def change(files: Files) -> None:
        del files[file]

    return change


def swap(file: str, old: str, new: str) -> Change:
    """Replace the first occurrence of a text, which must be there."""

    def change(files: Files) -> None:
        content = files[file]
        assert isinstance(content, str)
        assert old in content, f"{old!r} is not in {file}"
        files[file] = content.replace(old, new, 1)

    return change


def line(file: str, number: int, new: str | None) -> Change:
    """Replace a line, numbered as in an editor; None deletes it."""

    def change(files: Files) -> None:
        content = files[file]
        assert isinstance(content, str)
        lines = content.splitlines()
        lines[number - 1 : number] = [] if new is None else [new]
        files[file] = "\n".join(lines) + "\n"

    return change


def cell(file: str, number: int, column: str, new: str) -> Change:
    """Replace one cell, by line and column name."""

    def change(files: Files) -> None:
        content = files[file]
        assert isinstance(content, str)
        lines = content.splitlines()
        cells = lines[number - 1].split(",")
        cells[lines[0].split(",").index(column)] = new
        lines[number - 1] = ",".join(cells)
        files[file] = "\n".join(lines) + "\n"

    return change


def add(file: str, new: str) -> Change:
    """Add lines at the end of a file."""

    def change(files: Files) -> None:
        content = files[file]
        assert isinstance(content, str)
        files[file] = content + new + "\n"

    return change


def both(*changes: Change) -> Change:
    """Several changes as one."""

    def change(files: Files) -> None:
        for each in changes:
            each(files)

    return change


@dataclass(frozen=True)
class Case:
    """One fault and what must be said about it.

    Attributes
    ----------
    about : name of the test.
    change : how the valid cohort is spoilt.
    file, row, column : the place that must be named.
    says : a piece of the message.
    count : number of problems in all; a fault that shows in several places has several.
    """

    about: str
    change: Change
    file: str
    row: int | None
    column: str | None
    says: str
    count: int = 1

"""Files that machines write, spoilt: motion of markers as `.trc` and `.c3d`, testing machines."""

import gzip
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import inf, nan

from tests.generators.spoilt.c3d import SOUND, Form, Markers, written
from tests.generators.spoilt.case import FOLDER, GONE, Case, Content, Expected, Link
from tests.generators.spoilt.projects import Project

REFUSED, TOLD, FINE, OPEN = Expected.REFUSED, Expected.TOLD, Expected.FINE, Expected.OPEN

TRACKED = ("s01_stance.trc", "s01_stance.c3d", "trials.csv", "joints.csv", "marker_set.csv")
"""Files of which two contradict each other where one is in another unit."""

IMPORTED = ("loads.csv", "motion.csv", "cohort.yaml", "joints.csv", "specimens.csv")
"""Files of the cohort that is made of a machine's."""

Make = Callable[[], Content]

FLIPPED = 60
"""Cases of a `.c3d` with bytes changed by chance."""

STRANGE: dict[str, Content] = {
    "empty": b"",
    "blanks alone": b" \n \n",
    "noise": random.Random(3).randbytes(10_000),
    "HTML": b"<html><body>404</body></html>",
    "pointer of a large file": b"version https://git-lfs.github.com/spec/v1\n",
    "spreadsheet": b"PK\x03\x04\x14\x00\x06\x00" + bytes(range(256)),
    "noughts, 3 MB": bytes(3_000_000),
    "one line of 3 MB": b"a" * 3_000_000,
    "line ends, 1 MB": b"\n" * 1_000_000,
    "a folder": FOLDER,
    "a dead link": Link("nowhere"),
    "a pipe": "pipe",
    "missing": GONE,
}
"""In the place of any file."""


def recording_cases(project: Project) -> Iterator[Case]:
    """All cases of one project."""
    for ending, cases in ((".trc", _trc), (".c3d", _c3d)):
        for file in [name for name in project.files if name.endswith(f"stance{ending}")][:1]:
            yield from cases(project, file)
    if project.mapping:
        yield from _machine(project)


def _case(
    project: Project, file: str, what: str, expected: Expected, make: Make, told_in: tuple[str, ...]
) -> Case:
    def changes() -> dict[str, Content]:
        return {file: make()}

    return Case(project, "recording", what, file, "", expected, changes, told_in)


def _strange(project: Project, file: str, told_in: tuple[str, ...]) -> Iterator[Case]:
    for what, content in STRANGE.items():
        yield _case(project, file, what, REFUSED, partial(_same, content), told_in)
    data = project.files[file]
    yield _case(project, file, "packed", REFUSED, lambda: gzip.compress(data, mtime=0), told_in)


def _same(content: Content) -> Content:
    return content


def _trc(project: Project, file: str) -> Iterator[Case]:
    """A wrong unit in the header, wrong cells."""
    text = project.files[file].decode()
    cell = text.splitlines()[-1].split("\t")[4]
    spoilt = {
        "mm called m": text.replace("\tmm\t", "\tm\t"),
        "mm called cm": text.replace("\tmm\t", "\tcm\t"),
        "unknown unit": text.replace("\tmm\t", "\tfurlong\t"),
        "one cell of words": text.replace(cell, "abc"),
        "one cell inf": text.replace(cell, "inf"),
        "cut": text[: len(text) // 2],
        "decimal commas": text.replace(".", ","),
        "100 000 digits": text.replace(cell, "4" * 100_000),
    }
    for what, new in spoilt.items():
        yield _case(project, file, what, TOLD, partial(new.encode), TRACKED)
    yield from _strange(project, file, TRACKED)


NOT_TOLD = ("L3", "T1_a")
"""Markers of the set that are spoilt: one by itself, one of a cluster."""


def _c3d(project: Project, file: str) -> Iterator[Case]:
    plain = _markers(project, file)
    for what, (expected, form) in _forms().items():
        yield _case(project, file, what, expected, partial(written, plain, form), TRACKED)
    for what, (expected, markers) in _contents(plain).items():
        yield _case(project, file, what, expected, partial(written, markers), TRACKED)
    data = written(plain)
    for share in (0.02, 0.09, 0.2, 0.3, 0.5, 0.9):
        cut = data[: int(share * len(data))]
        yield _case(project, file, f"cut at {share:g}", REFUSED, partial(bytes, cut), TRACKED)
    behind = data + bytes(5_000_000)
    yield _case(project, file, "noughts behind it", OPEN, partial(bytes, behind), TRACKED)
    for number in range(FLIPPED):
        yield _case(
            project,
            file,
            f"bytes changed, {number}",
            OPEN,
            partial(_flipped, data, number),
            TRACKED,
        )
    yield from _strange(project, file, TRACKED)


def _markers(project: Project, file: str) -> Markers:
    """What the `.trc` of the same name tells, which the project was made of."""
    return project.markers[file]


def _flipped(data: bytes, number: int) -> bytes:
    """A few bytes of header and parameters changed."""
    rng = random.Random(20_000 + number)
    new = bytearray(data)
    for _ in range(rng.choice((1, 2, 8))):
        new[rng.randrange(1600)] = rng.randrange(256)
    return bytes(new)


def _forms() -> dict[str, tuple[Expected, Form]]:
    """Header and parameters that claim what is not so."""
    wrong: dict[str, tuple[object, ...]] = {
        "magic": (0,),
        "parameter_block": (0, 1, 3, 255),
        "points": (0, 1, 65535),
        "analog": (1, 65535),
        "first": (11, 12, 65535),
        "last": (0, 1, 5, 4000),
        "data_block": (0, 1, 2, 5, 65535),
        "processor": (0, 85, 86, 255),
        "used": (0, 1, 28, 65535),
        "told_frames": (1, 4000),
        "scale": (nan, inf),
        "rate": (-1.0, nan, inf, 1e-30, 1e30),
        "dimensions": ((255, 255), (255,) * 4, (255,) * 7, (255, 255, 3), (4, 0), (0, 27), (4,)),
        "link": (0, 1, 2, 3, -5, 32767, -32768),
        "name_length": (0, -5, 127, -128),
    }
    # of a count that is one off and of two signs, the file's size tells which is right: a remark
    doubtful: dict[str, tuple[object, ...]] = {
        "first": (0,),
        "header_scale": (0.0, nan, 1.0, 1e30),
        "header_rate": (0.0, -1.0, nan, 1e30),
        "parameter_blocks": (0, 1, 255),
        "data_start": (0, 1, 65535),
        "last": (65535,),
        "told_frames": (0, 12, 65535),
        "scale": (0.0, 1.0, -1e30),
        "rate": (0.0,),
    }
    found = {
        f"{name} {value}": (expected, replace(SOUND, **{name: value}))  # type: ignore[arg-type]
        for expected, group in ((TOLD, wrong), (OPEN, doubtful))
        for name, values in group.items()
        for value in values
    }
    for name, expected in (("UNITS", TOLD), ("LABELS", TOLD), ("USED", OPEN), ("SCALE", OPEN)):
        found[f"no {name}"] = (expected, replace(SOUND, left_out=(name,)))
    found["nothing seen"] = (TOLD, replace(SOUND, residual=-1.0))
    return found


def _contents(of: Markers) -> dict[str, tuple[Expected, Markers]]:
    """Names, units and places that are wrong."""
    found = {
        f"mm called {unit or 'nothing'}": (TOLD, replace(of, units=unit))
        for unit in ("m", "cm", "furlong", "", "mm\x07", "M" * 255)
    }
    found["sound"] = (FINE, of)
    for what, name in {
        "renamed": "q7x",
        "tag": "<script>alert(1)</script>",
        "path": "../../etc/passwd",
        "control": "T1\x07",
        "formula": "=cmd|x",
        "noughts": "\0\0",
        "255 letters": "n" * 255,
        "twice": of.names[0],
    }.items():
        names = [name if one == NOT_TOLD[0] else one for one in of.names]
        found[f"a marker {what}"] = (TOLD, replace(of, names=names))
        further = [[*frame, frame[0]] for frame in of.frames]
        if what not in ("renamed", "twice"):
            more = replace(of, names=[*of.names, name], frames=further)
            found[f"a further marker {what}"] = (OPEN, more)
    for what, number in {"inf": inf, "nan": nan, "1e30": 1e30, "far": 1e5}.items():
        expected = OPEN if what == "nan" else TOLD
        for all_of_it in (False, True):
            new = [[list(place) for place in frame] for frame in of.frames]
            for frame in new if all_of_it else new[5:6]:
                frame[of.names.index(NOT_TOLD[1])][1] = number
            when = "always" if all_of_it else "once"
            found[f"{what} {when}"] = (
                TOLD if all_of_it else expected,
                replace(of, frames=new),
            )
    return found


def _machine(project: Project) -> Iterator[Case]:
    file = next(name for name in project.files if name.endswith("s01_flexion_extension.csv"))
    text = project.files[file].decode()
    for what, (expected, new) in _of_a_machine(text).items():
        yield _case(project, file, what, expected, partial(new.encode), IMPORTED)
    for what, encoding in (("UTF-16", "utf-16"), ("UTF-32", "utf-32")):
        yield _case(project, file, what, REFUSED, partial(text.encode, encoding), IMPORTED)
    latin = text.replace("Winkel Z", "Wínkel Z", 1).encode("latin-1")
    yield _case(project, file, "Latin 1", REFUSED, partial(bytes, latin), IMPORTED)
    marked = b"\xef\xbb\xbf" + text.encode()
    yield _case(project, file, "byte-order mark", FINE, partial(bytes, marked), IMPORTED)
    yield from _strange(project, file, IMPORTED)
    yield from _mapped_wrongly(project)


HEAD = 4
"""Lines above the numbers: a title, a blank or remark, names, units."""


def _of_a_machine(text: str) -> dict[str, tuple[Expected, str]]:
    """A machine's file as it should not be."""
    lines = text.splitlines()
    head, rows = lines[:HEAD], [line.split(";") for line in lines[HEAD:]]
    names = lines[2].split(";")
    angle, moment = names.index("Winkel Z"), names.index("Moment Z")

    def put(row: int, column: int, cell: str) -> str:
        new = [list(cells) for cells in rows]
        new[row][column] = cell
        return _joined(head, new)

    def column(at: int, change: Callable[[str], str]) -> str:
        return _joined(head, [[*r[:at], change(r[at]), *r[at + 1 :]] for r in rows])

    def named(new: list[str]) -> str:
        return _joined([*head[:2], ";".join(new), *head[3:]], rows)

    half = len(rows) // 2
    found = {
        f"one cell {what}": (REFUSED, put(half, angle, cell))
        for what, cell in {
            "of words": "abc",
            "nan": "nan",
            "inf": "inf",
            "1e999": "1e999",
            "empty": "",
            "hex": "0x1F",
            "thousands": "1.234,5",
            "formula": "=A1+1",
            "of 100 000 digits": "4" * 100_000,
            "Arabic": "٣",
            "control": "5\x07",
            "a quote": '"5',
        }.items()
    }
    found |= {
        "one cell 1e300": (OPEN, put(half, angle, "1e300")),
        "one time back": (REFUSED, put(half, 0, rows[0][0])),
        "times in reverse": (REFUSED, _joined(head, rows[::-1])),
        "time stands still": (REFUSED, column(0, lambda _: "0")),
        "the recording twice": (REFUSED, _joined(head, [*rows, *rows])),
        "all angles zero": (TOLD, column(angle, lambda _: "0,0")),
        "all moments zero": (REFUSED, column(moment, lambda _: "0,0")),
        "angles in rad": (TOLD, column(angle, lambda c: _scaled(c, 0.0174533))),
        "angles 60 times": (TOLD, column(angle, lambda c: _scaled(c, 60.0))),
        "angles 1e300": (REFUSED, column(angle, lambda c: f"{c}e300")),
        "angles turned round": (TOLD, column(angle, lambda c: _scaled(c, -1.0))),
        "moments in N m": (TOLD, column(moment, lambda c: _scaled(c, 1e-3))),
        "moments 1e300": (REFUSED, column(moment, lambda c: f"{c}e300")),
        "decimal points": (REFUSED, text.replace(",", ".")),
        "commas between cells": (REFUSED, text.replace(";", ",")),
        "tabs between cells": (REFUSED, text.replace(";", "\t")),
        "numbers alone": (REFUSED, _joined([], rows)),
        "head alone": (REFUSED, "\n".join(head)),
        "nine rows": (REFUSED, _joined(head, rows[:9])),
        "a cell more in each row": (REFUSED, _joined(head, [[*r, "7"] for r in rows])),
        "a cell more in one row": (REFUSED, put(half, angle, f"{rows[half][angle]};7")),
        "a cell less in each row": (REFUSED, _joined(head, [r[:-1] for r in rows])),
        "a name twice": (REFUSED, named([*names[:-1], "Winkel Z"])),
        "a name misspelt": (REFUSED, named([n.replace("Winkel", "Winkle") for n in names])),
        "a name look-alike": (REFUSED, named([n.replace("Winkel", "Winkеl") for n in names])),
        "NUL at the end": (REFUSED, text + "\0" * 100),
        "a million columns": (REFUSED, _joined([*head[:2], lines[2] + ";" * 10**6, head[3]], rows)),
        "CR LF": (FINE, "\r\n".join(lines) + "\r\n"),
        "blank lines between": (FINE, "\n".join([*lines[:200], "", "", *lines[200:]]) + "\n"),
        "no last line end": (FINE, "\n".join(lines)),
        "cut in mid-row": (OPEN, text[: int(0.7 * len(text))]),
        "a million rows": (REFUSED, _joined(head, rows * (1_000_000 // len(rows)))),
    }
    return found


def _joined(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join([*head, *map(";".join, rows)]) + "\n"


def _scaled(cell: str, factor: float) -> str:
    return f"{float(cell.replace(',', '.')) * factor:.9g}".replace(".", ",")


def _mapped_wrongly(project: Project) -> Iterator[Case]:
    """The YAML says another unit or direction than the file has: lawful, and wrong."""
    text = project.files[project.mapping].decode()
    wrong = {
        "moments called N m": (TOLD, text.replace("unit: N mm", "unit: N m")),
        "moments called N cm": (TOLD, text.replace("unit: N mm", "unit: N cm")),
        "angles called rad": (TOLD, text.replace("unit: deg", "unit: rad")),
        "angles turned round": (TOLD, _turned_motion(text)),
        "time called min": (OPEN, text.replace("unit: s\n", "unit: min\n")),
        "first line too late": (OPEN, text.replace("first_line: 5", "first_line: 200")),
        "first line in the head": (REFUSED, text.replace("first_line: 5", "first_line: 4")),
        "names in another line": (REFUSED, text.replace("names_line: 3", "names_line: 4")),
        "one file twice": (
            TOLD,
            text.replace("s01_lateral_bending.csv", "s01_flexion_extension.csv"),
        ),
        "a file that leads out": (REFUSED, text.replace("file: s01_lat", "file: ../../s01_lat")),
        "vertebrae upside down": (REFUSED, text.replace("- L5\n- L4", "- L4\n- L5")),
    }
    for what, (expected, new) in wrong.items():
        assert new != text, what
        told_in = (*IMPORTED, "s01_flexion_extension.csv", "s01_lateral_bending.csv")
        yield _case(project, project.mapping, what, expected, partial(new.encode), told_in)


def _turned_motion(text: str) -> str:
    """Motion that is positive to the other side, loads as they were."""
    loads, motion = text.split("motion:\n", 1)
    for one, other in (("flexion", "extension"), ("right_bending", "left_bending")):
        motion = motion.replace(f"positive: {one}", f"positive: {other}")
    return f"{loads}motion:\n{motion}"

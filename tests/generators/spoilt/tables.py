"""Whole tables spoilt: columns, rows, separators, encodings, sizes."""

import gzip
import random
from collections.abc import Callable, Iterator
from functools import partial

from tests.generators.spoilt.case import FOLDER, GONE, Case, Content, Expected, Link
from tests.generators.spoilt.cells import entries
from tests.generators.spoilt.projects import Project, as_csv

REFUSED, TOLD, FINE, OPEN = Expected.REFUSED, Expected.TOLD, Expected.FINE, Expected.OPEN

CARRY = ("specimens", "muscles", "muscle_parameters", "body_frames")
"""Tables with columns of anybody's own."""

ORDER_COUNTS = ("supports",)

Table = list[list[str]]

Make = Callable[..., Case]
"""Makes a case of a mutation's name, what is expected and what makes the file."""


def table_cases(project: Project, stem: str, rng: random.Random) -> Iterator[Case]:
    """All cases of one table as a whole."""
    file = f"{project.folder}/{stem}.csv"

    def case(what: str, expected: Expected, make: Callable[[], Content], **further: object) -> Case:
        place = str(further.get("place", ""))
        elsewhere = ("*",) if further.get("anywhere") else ()
        return Case(
            project, "table", what, file, place, expected, lambda: {file: make()}, elsewhere
        )

    yield from _rows(project, stem, case, rng)
    yield from _columns(project, stem, case, rng)
    yield from _as_text(project, file, case)
    yield from _as_bytes(project, file, case)
    yield from _as_a_file(project, stem, case)


def _rows(project: Project, stem: str, case: Make, rng: random.Random) -> Iterator[Case]:
    header, *rows = project.table(stem)
    at = rng.randrange(len(rows))
    again = rows[at]
    numbers = [n for n, e in entries(project, stem).items() if e.is_number and n in header]

    def put(*new: list[str]) -> Callable[[], Content]:
        return lambda: as_csv([header, *rows, *new])

    yield case("row twice", REFUSED, put(again))
    values = [n for n in numbers if n not in ("cycle", "step", "point", "repeat")]
    if values:
        other = list(again)
        cell = other[header.index(values[0])]
        other[header.index(values[0])] = str(float(cell or 0) + 1)
        yield case("row twice, another number", REFUSED, put(other))
    yield case("one cell more", REFUSED, put([*again, "1"]))
    if len(header) > 1:
        yield case("one cell less", REFUSED, put(again[:-1]))
    yield case("commas alone", REFUSED, put([""] * len(header)))
    yield case("header again", REFUSED, put(header))
    yield case("comment", REFUSED, put(["# measured on Monday"]))
    yield case("conflict of versions", REFUSED, put(["<<<<<<< HEAD"]))
    yield case("a row less", OPEN, lambda: as_csv([header, *rows[:at], *rows[at + 1 :]]))
    mixed = random.Random(rng.random()).sample(rows, len(rows))
    order = OPEN if stem in ORDER_COUNTS else FINE
    yield case("rows in another order", order, lambda: as_csv([header, *mixed]))
    yield case("header alone", REFUSED, lambda: as_csv([header]))
    yield case("no header", REFUSED, lambda: as_csv(rows))
    names = [at for at, n in enumerate(header) if n in ("specimen", "test", "task", "trial")]
    if names:
        wide = stem == "specimens"
        few, many = _numbered(again, names[0], 500, "q"), _numbered(again, names[-1], 10_000, "q")
        yield case("500 unknown names", REFUSED, lambda: put(*few())(), anywhere=wide)
        free = OPEN if stem == "trials" else REFUSED  # trials may be called anything
        yield case("10 000 unknown names", free, lambda: put(*many())(), anywhere=wide)
    if "cycle" in header:
        cycles = _numbered(again, header.index("cycle"), 100_000, "9")
        yield case("100 000 cycles", REFUSED, lambda: put(*cycles())())
        yield case("200 000 cycles", REFUSED, lambda: put(*cycles(), *cycles())())


def _numbered(row: list[str], at: int, number: int, start: str) -> Callable[[], Table]:
    """So many copies of a row whose cell is a number behind ``start``."""
    return lambda: [[*row[:at], f"{start}{k}", *row[at + 1 :]] for k in range(number)]


def _columns(project: Project, stem: str, case: Make, rng: random.Random) -> Iterator[Case]:
    rows = project.table(stem)
    header = rows[0]
    known = entries(project, stem)

    def named(at: int, name: str) -> Callable[[], Content]:
        return lambda: as_csv([[*header[:at], name, *header[at + 1 :]], *rows[1:]])

    def without(at: int) -> Callable[[], Content]:
        return lambda: as_csv([[*row[:at], *row[at + 1 :]] for row in rows])

    def beside(name: str, cell: str) -> Callable[[], Content]:
        return lambda: as_csv([[*header, name], *([*row, cell] for row in rows[1:])])

    for at, name in enumerate(header):
        entry = known.get(name)
        if entry is None:
            continue
        if len(header) > 1:
            yield case(f"no {name}", REFUSED if entry.required else OPEN, without(at), place=name)
        for what, new in (
            ("misspelt", name[:-2] + name[-1] + name[-2] if name[-1] != name[-2] else name + "s"),
            ("in capitals", name.upper()),
            ("look-alike", name.replace("e", "е").replace("a", "а").replace("y", "у", 1)),
        ):
            if new != name:
                yield case(f"{name} {what}", REFUSED, named(at, new), place=new)
        yield case(f"{name} twice", REFUSED, beside(name, "1"), place=name)
    carried = FINE if stem in CARRY else REFUSED
    yield case(
        "another column", carried, beside("scanner_of_ours", "CT 1"), place="scanner_of_ours"
    )
    yield case("a column without name", REFUSED, beside("", "1"))
    yield case("a column <script>", REFUSED, beside("<script>alert(1)</script>", "1"))
    yield case("a column of 100 000 characters", REFUSED, beside("n" * 100_000, "1"))
    yield case("1001 columns", REFUSED, lambda: as_csv([[*row, *["x"] * 1001] for row in rows]))
    yield case("columns in another order", FINE, lambda: as_csv([row[::-1] for row in rows]))
    numbers = [n for n, name in enumerate(header) if name in known and known[name].is_number]
    if numbers:
        at = rng.choice(numbers)
        yield case("decimal commas", REFUSED, partial(_with_commas, rows, at), place=header[at])


def _with_commas(rows: Table, at: int) -> bytes:
    """The numbers of a column with decimal commas, in quotes."""
    cells = [row[at] if "." in row[at] else f"{row[at]}.0" for row in rows[1:]]
    new = [cell.replace(".", ",") for cell in cells]
    return as_csv(
        [rows[0], *([*r[:at], c, *r[at + 1 :]] for r, c in zip(rows[1:], new, strict=True))]
    )


LETTERS, COMMAS, QUOTES, LINES = "a" * 3_000_000, "," * 3_000_000, '"' * 3_000_000, "\n" * 1_000_000


def _as_text(project: Project, file: str, case: Make) -> Iterator[Case]:
    text = project.files[file].decode()
    for what, (expected, _) in _texts(text).items():
        yield case(what, expected, partial(lambda what: _texts(text)[what][1].encode(), what))


def _texts(text: str) -> dict[str, tuple[Expected, str]]:
    """A table as other programs write it, and other things in its place."""
    lines = text.splitlines()
    return {
        "semicolons": (REFUSED if "," in text else FINE, text.replace(",", ";")),
        "tabs": (REFUSED if "," in text else FINE, text.replace(",", "\t")),
        "bars": (REFUSED if "," in text else FINE, text.replace(",", "|")),
        "CR LF": (FINE, text.replace("\n", "\r\n")),
        "CR": (FINE, text.replace("\n", "\r")),
        "line ends of both kinds": (FINE, "\r\n".join(lines[:2]) + "\n" + "\n".join(lines[2:])),
        "no last line end": (FINE, text.rstrip("\n")),
        "blank lines at the end": (FINE, text + "\n\n\n"),
        "a blank line between": (FINE, "\n".join([*lines[:2], "", *lines[2:]]) + "\n"),
        "quote not closed": (REFUSED, "\n".join([lines[0], '"' + lines[1], *lines[2:]]) + "\n"),
        "quote in a cell": (REFUSED, "\n".join([lines[0], 'x"y' + lines[1], *lines[2:]]) + "\n"),
        "quote after a quote": (REFUSED, "\n".join([lines[0], '"x"y' + lines[1], ""])),
        "title above": (REFUSED, "Measurements of Monday\n" + text),
        "cut in mid-row": (REFUSED, text.rstrip().rpartition(",")[0] or '"' + text[:-3]),
        "blanks alone": (REFUSED, " \n \n"),
        "empty": (REFUSED, ""),
        "JSON": (REFUSED, '{"specimen": ["a"]}'),
        "HTML": (REFUSED, "<html><body>404, not found</body></html>\n"),
        "pointer of a large file": (REFUSED, "version https://git-lfs.github.com/spec/v1\n"),
        "one line of 3 MB": (REFUSED, LETTERS),
        "commas, 3 MB": (REFUSED, COMMAS),
        "quotes, 3 MB": (REFUSED, QUOTES),
        "line ends, 1 MB": (REFUSED, LINES),
        "blanks round commas": (OPEN if '"' in text else FINE, text.replace(",", " , ")),
        "form feed": (REFUSED, text[:-1] + "\x0c\n"),
        "line separator": (REFUSED, text.replace("\n", "\u2028")),
    }


def _as_bytes(project: Project, file: str, case: Make) -> Iterator[Case]:
    data = project.files[file]
    text = data.decode()
    spoilt = {
        "byte-order mark": (FINE, b"\xef\xbb\xbf" + data),
        "two byte-order marks": (REFUSED, b"\xef\xbb\xbf" * 2 + data),
        "UTF-16": (REFUSED, text.encode("utf-16")),
        "UTF-16 without mark": (REFUSED, text.encode("utf-16-be")),
        "UTF-32": (REFUSED, text.encode("utf-32")),
        "Latin 1": (REFUSED, (text[:-1] + "é\n").encode("latin-1")),
        "NUL at the end": (REFUSED, data + b"\0" * 100),
        "packed": (REFUSED, gzip.compress(data, mtime=0)),
        "spreadsheet": (REFUSED, b"PK\x03\x04\x14\x00\x06\x00" + bytes(range(256))),
        "noise": (REFUSED, random.Random(1).randbytes(10_000)),
    }
    for what, (expected, new) in spoilt.items():
        yield case(what, expected, partial(bytes, new))


def _as_a_file(project: Project, stem: str, case: Make) -> Iterator[Case]:
    yield case("a folder", REFUSED, lambda: FOLDER)
    yield case("a dead link", REFUSED, lambda: Link("nowhere.csv"))
    yield case("a link to itself", REFUSED, lambda: Link(f"{stem}.csv"))
    yield case("a pipe", REFUSED, lambda: "pipe")
    yield case("missing", REFUSED if stem == "specimens" else OPEN, lambda: GONE)
    file = f"{project.folder}/{stem}.csv"
    data = project.files[file]
    for new in (stem.upper() + ".csv", f"{stem}.CSV", f"{stem}.csv.txt", f"{stem[:-1]}.csv"):
        path = f"{project.folder}/{new}"
        yield Case(
            project,
            "place",
            f"called {new}",
            path,
            "",
            REFUSED,
            partial(dict, {file: GONE, path: data}),
        )

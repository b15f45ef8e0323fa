"""One cell of a table spoilt, in every table and every column of it."""

import random
from collections.abc import Iterator

from tests.generators.spoilt.case import Case, Expected
from tests.generators.spoilt.documented import Entry, columns
from tests.generators.spoilt.projects import Project, as_csv
from tests.generators.spoilt.words import (
    FURTHER_NUMBERS,
    MAIN_NAMES,
    MAIN_NUMBERS,
    TEXTS,
    bad_names,
)

REFUSED, TOLD, FINE, OPEN = Expected.REFUSED, Expected.TOLD, Expected.FINE, Expected.OPEN

FREE = {"specimens": ("sex",), "patients": ("sex", "lenke_class"), "passive": ("source",)}
"""Texts that are neither names nor words of a list."""

DEFINES = {"specimens": "specimen", "tasks": "task", "landmarks": "landmark"}
"""Where a table says which names there are, any sound name is one."""

ANY_NAME = {
    ("landmarks", "landmark"),
    ("films", "position"),
    ("films", "observer"),
    ("marker_set", "cluster"),
    ("muscle_parameters", "group"),
    ("trials", "trial"),
}
"""Names that nothing else must know."""


def entries(project: Project, stem: str) -> dict[str, Entry]:
    """Documented columns of a table, by name."""
    return {entry.name: entry for entry in columns(stem, project.kind)}


def cell_cases(project: Project, stem: str, rng: random.Random) -> Iterator[Case]:
    """All cases of the cells of one table."""
    header, *rows = project.table(stem)
    known = entries(project, stem)
    further = list(FURTHER_NUMBERS)
    names = [name for name in bad_names("a") if name not in MAIN_NAMES]
    rng.shuffle(further)
    rng.shuffle(names)
    numeric = [n for n in header if n in known and known[n].is_number]
    worded = [n for n in header if n in known and known[n].words == "text"]
    for at, name in enumerate(header):
        entry = known.get(name)
        row = _row(rows, at, rng)
        make = _Maker(project, stem, header, rows, at, row)
        if entry is None:
            yield from make.texts()
        elif entry.is_number:
            share = further[numeric.index(name) :: len(numeric)]
            yield from make.numbers(entry, share)
        else:
            share = names[worded.index(name) :: len(worded)]
            yield from make.names(entry, share)


def _row(rows: list[list[str]], at: int, rng: random.Random) -> int:
    """A row whose cell is filled, if there is one."""
    filled = [n for n, row in enumerate(rows) if row[at] not in ("", "*")]
    return rng.choice(filled or list(range(len(rows))))


class _Maker:
    """Cases of one cell."""

    def __init__(
        self,
        project: Project,
        stem: str,
        header: list[str],
        rows: list[list[str]],
        at: int,
        row: int,
    ) -> None:
        self.project, self.stem, self.header, self.rows = project, stem, header, rows
        self.at, self.row = at, row
        self.old = rows[row][at]

    def case(self, what: str, text: str, expected: Expected, anywhere: bool = False) -> Case:
        """The cell replaced by a text."""
        file = f"{self.project.folder}/{self.stem}.csv"

        def changes() -> dict[str, bytes]:
            rows = [list(row) for row in self.rows]
            rows[self.row][self.at] = text
            return {file: _encoded([self.header, *rows])}

        return Case(
            self.project,
            "cell",
            what,
            file,
            self.header[self.at],
            expected,
            changes,
            told_in=("*",) if anywhere else (),
        )

    def numbers(self, entry: Entry, further: list[str]) -> Iterator[Case]:
        """Numbers that are none, out of range, and the same number written otherwise."""
        for what, text in MAIN_NUMBERS.items():
            yield self.case(what, text, TOLD if what == "1e300" else REFUSED)
        for what in further:
            late = what in ("150 digits", "-1e300")
            yield self.case(what, FURTHER_NUMBERS[what], TOLD if late else REFUSED)
        yield self.case("empty", "", REFUSED if entry.required else OPEN)
        yield self.case("blanks", "   ", REFUSED if entry.required else OPEN)
        yield from self._out_of_range(entry)
        if self.old not in ("", "*"):
            yield from self._same_number(entry)

    def _out_of_range(self, entry: Entry) -> Iterator[Case]:
        if entry.high is not None:
            yield self.case("too large", f"{entry.high + 1.0:g}", REFUSED)
        if entry.low is not None:
            yield self.case("too small", f"{entry.low - 1.0:g}", REFUSED)
        if entry.open_low:
            yield self.case("at its open end", f"{entry.low:g}", REFUSED)
        if entry.words.startswith("integer"):
            yield self.case("half a step", f"{float(self.old or 1) + 0.5}", REFUSED)

    def _same_number(self, entry: Entry) -> Iterator[Case]:
        sign = self.old if self.old.startswith("-") else f"+{self.old}"
        point = self.old if "." in self.old or "e" in self.old else f"{self.old}.0"
        yield self.case("with its sign", sign, FINE)
        yield self.case("with a point", point, FINE)
        yield self.case("blanks around", f"  {self.old}\t", FINE)
        if "e" not in self.old:
            yield self.case("with an exponent", f"{self.old}e0", FINE)
            yield self.case("with a large E", f"{self.old}E+00", FINE)

    def names(self, entry: Entry, further: list[str]) -> Iterator[Case]:
        """Names and words that are none."""
        if entry.name in FREE.get(self.stem, ()):
            yield from self.texts()
            return
        defines = DEFINES.get(self.stem) == entry.name
        anything = (self.stem, entry.name) in ANY_NAME
        bad = bad_names(self.old or "x1")
        for what in (*MAIN_NAMES, *further):
            free = what == "unknown" and (defines or anything)
            anywhere = what in ("unknown", "look-alike") and defines
            yield self.case(what, bad[what], OPEN if free else REFUSED, anywhere)
        if entry.required:
            yield self.case("empty", "", REFUSED)
            yield self.case("blanks", "  \t ", REFUSED)
        if self.old:
            yield self.case("blanks around", f"  {self.old} ", FINE)
            other = self.old.swapcase()
            if other != self.old and not (defines or anything):
                yield self.case("other case", other, OPEN if entry.name == "sex" else REFUSED)

    def texts(self) -> Iterator[Case]:
        """Texts that nobody reads but people."""
        for what, (text, expected) in TEXTS.items():
            yield self.case(what, text, expected)


def _encoded(rows: list[list[str]]) -> bytes:
    """CSV, lone surrogates as the bytes they stand for."""
    flat = [[cell.replace("\udc80", "\ue000") for cell in row] for row in rows]
    return as_csv(flat).replace("\ue000".encode(), b"\x80")

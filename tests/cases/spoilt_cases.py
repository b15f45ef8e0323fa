"""What `spinepipe check` says of a spoilt project, and whether that is right."""

import contextlib
import io
import re
import sys
import traceback
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from spinepipe.cli.program import main
from tests.generators.spoilt.case import Case, Expected
from tests.generators.spoilt.projects import MODEL, Project

MOST_TOLD = 100_000
"""Characters that all messages together may have."""

_LINE = re.compile(
    r"^(?P<kind>      |warn  |error: )"
    r"(?P<place>(?:[^:]|:(?! )){1,400}?): found (?P<found>.*)",
    re.S,
)


@dataclass(frozen=True)
class Message:
    """One problem or warning as it is printed."""

    file: str
    row: int
    place: str
    text: str


@dataclass(frozen=True)
class Seen:
    """What one `spinepipe check` did.

    Attributes
    ----------
    code : exit code, -1 where it ended with a stack.
    printed : all that it printed, or the stack.
    """

    code: int
    printed: str

    @property
    def messages(self) -> list[Message]:
        """Problems and warnings."""
        return [m for line in self.printed.splitlines() if (m := _message(line)) is not None]


class Verdict(Enum):
    """How right that was."""

    RIGHT = "right"
    ACCEPTED = "accepted though wrong"
    HANGS = "hangs"
    STACK = "ends in a stack"
    REFUSED = "good one refused"
    DOUBTED = "good one warned of"
    ELSEWHERE = "told of another file"
    OTHER_PLACE = "told of the file, not of its place"
    LONG = "message too long"


def look(root: Path, *names: str) -> Seen:
    """What `spinepipe check` says of these studies, or of everything in a project."""
    return _ran(root, "check", *names)


def _ran(root: Path, *arguments: str) -> Seen:
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        try:
            code = main(["--root", str(root), *arguments])
        except Exception:
            traceback.print_exc(file=sys.stderr)
            code = -1
    return Seen(code, out.getvalue())


def looked(case: Case, root: Path) -> Seen:
    """What is said of a spoilt project that was written below a folder."""
    if case.project.mapping:
        return look_at_import(case.project, root)
    return look(root, *asked(case))


def look_at(project: Project, root: Path) -> Seen:
    """What is said of a sound project."""
    return look_at_import(project, root) if project.mapping else look(root)


def look_at_import(project: Project, root: Path) -> Seen:
    """What `spinepipe import` says and, of the cohort that it makes, `spinepipe check`."""
    made = _ran(root, "import", str(root / project.mapping))
    if made.code != 0:
        return made
    seen = look(root, project.cohort)
    return Seen(seen.code, made.printed + seen.printed)


def asked(case: Case) -> tuple[str, ...]:
    """What check is asked for: the study, or all where other files than its own are spoilt."""
    own = case.file in (case.project.study, MODEL) or case.file.startswith(case.project.folder)
    return (case.project.name,) if own and case.family not in ("file", "stray") else ()


def verdict(case: Case, seen: Seen) -> Verdict:
    """Whether what was said of a case is what it asks for."""
    if seen.code == -1:
        return Verdict.STACK
    if len(seen.printed) > MOST_TOLD:
        return Verdict.LONG
    if case.expected is Expected.OPEN:
        return Verdict.RIGHT
    if case.expected is Expected.FINE:
        if seen.code != 0:
            return Verdict.REFUSED
        return Verdict.DOUBTED if seen.messages else Verdict.RIGHT
    if seen.code == 0 and (case.expected is Expected.REFUSED or not seen.messages):
        return Verdict.ACCEPTED
    return _where(case, seen.messages)


def _where(case: Case, messages: list[Message]) -> Verdict:
    """Whether one of the messages points at what was spoilt."""
    if "*" in case.told_in:
        return Verdict.RIGHT
    names = {case.file.rpartition("/")[2], *case.told_in}
    here = [m for m in messages if m.file.rpartition("/")[2] in names]
    if not here:
        return Verdict.ELSEWHERE
    if not case.place or case.family == "quantity":
        return Verdict.RIGHT
    first, last = case.lines()
    at = any(first <= m.row <= last or _same(m.place, case.place) for m in here)
    return Verdict.RIGHT if at else Verdict.OTHER_PLACE


def _same(told: str, place: str) -> bool:
    """Whether a key or column is meant, or one that holds it or is held by it."""
    of, meant = _plain(told), _plain(place)
    return bool(of) and (of == meant or of.startswith(f"{meant}.") or meant.startswith(f"{of}."))


def _plain(key: str) -> str:
    """A dotted key without numbers of items and names of forms."""
    parts = re.sub(r"\[[^\]]*\]", "", key).casefold().split(".")
    return ".".join(part for part in parts if not part.isdigit())


def _message(line: str) -> Message | None:
    found = _LINE.match(line)
    if found is None:
        return None
    file, *rest = found["place"].split(", ")
    rows = [int(part[5:]) for part in rest if re.fullmatch(r"line [0-9]+", part)]
    places = [part for part in rest if not re.fullmatch(r"line [0-9]+", part)]
    return Message(file, rows[0] if rows else 0, ", ".join(places), line)

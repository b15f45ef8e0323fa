"""Text files of bounded size: read whole, as UTF-8 without characters that nobody sees."""

import re
from pathlib import Path
from stat import S_ISREG

from spinepipe.problems import InputProblem

MOST_YAML_BYTES = 1_000_000

MOST_CSV_BYTES = 100_000_000
"""Of tables and of recordings."""

LONGEST_CELL = 200
"""Characters of a cell of a CSV file, a key of a YAML file, and a word of its texts."""

NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")
"""A decimal number, and nothing else: no nan, no 1_000, no digits of other scripts."""

INVISIBLE = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f\u202a-\u202e\u2066-\u2069\ufeff\ufffe\uffff]"
)
"""Control characters but tabs and line ends, marks that turn the direction of writing.

Also the byte-order mark `U+FEFF`, unless it begins the file, and what is no character at all.
"""


def longest_word(text: str) -> int:
    """Characters of the longest run without blanks; 0 of texts that are short as a whole."""
    return max(map(len, text.split()), default=0) if len(text) > LONGEST_CELL else 0


def has_long_word(text: str) -> bool:
    """Whether a run without blanks is longer than `LONGEST_CELL`.

    Such a run fills a piece of half that length from end to end: where each has a blank is none.
    """
    half = LONGEST_CELL // 2
    starts = range(0, len(text) - half + 1, half)
    if len(text) <= LONGEST_CELL or all(" " in text[at : at + half] for at in starts):
        return False
    return longest_word(text) > LONGEST_CELL


def read_text(path: Path, file: str, most_bytes: int) -> tuple[str, list[InputProblem]]:
    """Text of a UTF-8 file; a byte-order mark is allowed.

    Parameters
    ----------
    path : the file.
    file : its name in messages.
    most_bytes : a larger file is refused before it is read.

    Returns
    -------
    The text (empty when there is a problem) and the problems.
    """
    data, problems = read_bytes(path, file, most_bytes)
    if problems:
        return "", problems
    if not data.strip():
        return "", [
            InputProblem(file, None, None, "an empty file", "a file with content", "fill it")
        ]
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return "", [_not_utf8(file, data[: error.start].count(b"\n") + 1)]
    if "\0" in text:
        return "", [_not_utf8(file, text[: text.index("\0")].count("\n") + 1)]
    hidden = INVISIBLE.search(text)
    if hidden is not None:
        line = text[: hidden.start()].count("\n") + 1
        found = f"the control character U+{ord(hidden[0]):04X}"
        allowed = "characters that can be seen, blanks, tabs and line ends"
        remedy = "delete it; retype the line if it hides"
        return "", [InputProblem(file, line, None, found, allowed, remedy)]
    return text, []


def read_bytes(path: Path, file: str, most_bytes: int) -> tuple[bytes, list[InputProblem]]:
    """What is in a file, empty when there is a problem, and the problems, as `read_text`."""
    place = (file, None, None)
    try:
        status = path.stat()
        if not S_ISREG(status.st_mode):
            remedy = "rename it, or put the file in its place"
            return b"", [InputProblem(*place, "a folder or device", "a file", remedy)]
        if status.st_size > most_bytes:
            found, allowed = f"{status.st_size / 1e6:.1f} MB", f"at most {most_bytes / 1e6:g} MB"
            remedy = "take out what does not belong, or split it"
            return b"", [InputProblem(*place, found, allowed, remedy)]
        return path.read_bytes(), []
    except OSError as error:  # the system does not let us read it
        found = f"what cannot be read ({(error.strerror or type(error).__name__).lower()})"
        remedy = "look at what it is and who may read it"
        return b"", [InputProblem(*place, found, "a readable file", remedy)]


def _not_utf8(file: str, line: int) -> InputProblem:
    found = "bytes that are not UTF-8 text"
    return InputProblem(file, line, None, found, "UTF-8", "save the file again with encoding UTF-8")

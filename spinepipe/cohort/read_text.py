"""A text file as a string, or the reason why it is none."""

from pathlib import Path

from spinepipe.problems import Problem

__all__ = ["read_text"]


def read_text(path: Path, file: str) -> tuple[str, list[Problem]]:
    """Text of a UTF-8 file; a byte-order mark is allowed.

    Parameters
    ----------
    path : the file, which exists.
    file : its name in messages.

    Returns
    -------
    The text (empty when there is a problem) and the problems.
    """
    data = path.read_bytes()
    if not data.strip():
        return "", [Problem(file, None, None, "an empty file", "a file with content", "fill it")]
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return "", [_not_utf8(file, data[: error.start].count(b"\n") + 1)]
    if "\0" in text:
        return "", [_not_utf8(file, text[: text.index("\0")].count("\n") + 1)]
    return text, []


def _not_utf8(file: str, line: int) -> Problem:
    found = "bytes that are not UTF-8 text"
    return Problem(file, line, None, found, "UTF-8", "save the file again with encoding UTF-8")

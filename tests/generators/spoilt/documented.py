"""What the documentation says of columns and keys: the contract that spoilt files are held to."""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

DOCS = Path(__file__).resolve().parents[3] / "docs"

PAGES = ("cohort-format.md", "import.md", "model-file.md", "studies/*.md")


@dataclass(frozen=True)
class Entry:
    """One documented column of a CSV file, or one key of a YAML file.

    Attributes
    ----------
    name : header of the column, or dotted key; ``[]`` stands for any item of a list, ``[form]``
        for one that says it has this form.
    words : its type in the words of the page.
    required : it must be there (and no cell may be empty).
    low, high : documented range, None where there is none.
    open_low, open_high : whether the end itself is out.
    choices : the only values, where they are listed.
    nullable : whether nothing may stand there.
    """

    name: str
    words: str
    required: bool
    low: float | None = None
    high: float | None = None
    open_low: bool = False
    open_high: bool = False
    choices: tuple[str, ...] = ()
    nullable: bool = False

    @property
    def is_number(self) -> bool:
        """Whether numbers stand there, whole ones too."""
        return self.words.split(" or ")[0] in ("number", "integer")

    @property
    def is_list(self) -> bool:
        """Whether a list stands there."""
        return self.words.startswith("list")


_RANGE = re.compile(r"(at least|above|at most|below) (-?[0-9.]+(?:e[+-]?[0-9]+)?)")


def _ends(text: str) -> dict[str, float | bool]:
    found: dict[str, float | bool] = {}
    for word, number in _RANGE.findall(text.replace("at least 1 of them", "")):
        end = "low" if word in ("at least", "above") else "high"
        found[end] = float(number)
        found[f"open_{end}"] = word in ("above", "below")
    return found


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


@cache
def _blocks() -> dict[tuple[str, str], list[list[str]]]:
    """Rows of each generated table, by page and name."""
    found: dict[tuple[str, str], list[list[str]]] = {}
    for pattern in PAGES:
        for page in sorted(DOCS.glob(pattern)):
            text = page.read_text(encoding="utf-8")
            for name, body in re.findall(r"<!-- generated: (.*?) -->(.*?)<!-- end", text, re.S):
                rows = [_cells(line) for line in body.splitlines() if line.startswith("|")]
                found[page.stem, name] = rows[2:]
    return found


def columns(stem: str, kind: str | None = None) -> tuple[Entry, ...]:
    """Columns of a table of a cohort; ``kind`` where a kind of study has its own of that name."""
    blocks = _blocks()
    rows = blocks.get((kind or "", f"cohort {stem}")) or blocks.get(
        ("cohort-format", f"cohort {stem}")
    )
    if rows is None:
        rows = next((rows for (_, name), rows in blocks.items() if name == f"cohort {stem}"), [])
    return tuple(
        Entry(name.strip("*`"), words, name.startswith("**"), **_ends(span))
        for name, words, span, *_ in rows
    )


def keys(name: str) -> tuple[Entry, ...]:
    """Keys of ``cohort.yaml``, ``config.yaml``, ``model`` or of the study files of a kind."""
    (rows,) = [rows for (_, other), rows in _blocks().items() if other == f"keys {name}"]
    return tuple(
        Entry(
            key.strip("`"),
            words,
            default == "**required**",
            **_ends(allowed),
            choices=_choices(allowed),
            nullable="or null" in words or default == "`null`" or "null:" in " ".join(meaning),
        )
        for key, words, default, allowed, *meaning in rows
    )


def _choices(allowed: str) -> tuple[str, ...]:
    words = re.findall(r"`([^`]*)`", allowed)
    return () if any(word.startswith("^") for word in words) or "keys" in allowed else tuple(words)

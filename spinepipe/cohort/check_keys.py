"""Does each row of a table speak of something no other row speaks of?"""

from collections.abc import Iterator
from math import isnan

from spinepipe.cohort.columns import TABLES
from spinepipe.cohort.draft import Draft
from spinepipe.problems import Problem

__all__ = ["check_keys"]


def check_keys(draft: Draft) -> Iterator[Problem]:
    """Repeated keys in every table but ``loads.csv``, whose wildcards ask for more care."""
    for stem, form in TABLES.items():
        if stem != "loads":
            yield from _repeated(draft, stem, form.keys)


def _repeated(draft: Draft, stem: str, keys: tuple[str, ...]) -> Iterator[Problem]:
    seen: dict[tuple[object, ...], int] = {}
    for line, cells in draft.rows(stem, *keys):
        cells = tuple(map(_numbered, keys, cells))
        if any(isinstance(cell, float) and isnan(cell) for cell in cells):
            continue  # a bad or empty cell, reported there
        first = seen.setdefault(cells, line)
        if first != line:
            found = "again " + ", ".join(_shown(cell) for cell in cells)
            allowed = f"one row per {' x '.join(keys)}"
            remedy = f"delete one (the other is line {first})"
            yield Problem(draft.file(stem), line, None, found, allowed, remedy)


def _numbered(key: str, cell: object) -> object:
    """The cell, an empty cycle as the first."""
    return 1.0 if key == "cycle" and isinstance(cell, float) and isnan(cell) else cell


def _shown(cell: object) -> str:
    return f"{cell:g}" if isinstance(cell, float) else str(cell)

"""Do the tables speak of specimens, vertebrae and joints that exist?"""

import re
from collections.abc import Iterator

from spinepipe.cohort.cohort import joint_names
from spinepipe.cohort.columns import TABLES
from spinepipe.cohort.draft import Draft
from spinepipe.problems import Problem, did_you_mean, one_of

__all__ = ["check_names"]

SPECIMEN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
"""Specimens become folder names of results."""


def check_names(draft: Draft) -> Iterator[Problem]:
    """Unknown names in every table, and specimen names no folder can have."""
    for line, (name,) in draft.rows("specimens", "specimen"):
        if isinstance(name, str) and not SPECIMEN_NAME.fullmatch(name):
            allowed = "letters, digits, _ . - and a letter or digit first"
            place = (draft.file("specimens"), line, "specimen")
            yield Problem(*place, f"'{name}'", allowed, "rename the specimen in every file")
    known = {
        "specimen": draft.specimens,
        "vertebra": draft.vertebrae,
        "joint": draft.joint_names,
    }
    for stem, form in TABLES.items():
        for column, names in known.items():
            if names and column in form.names and stem != "specimens":
                wildcard = ("*",) if (stem, column) == ("loads", "specimen") else ()
                yield from _unknown(draft, stem, column, (*names, *wildcard))


def _unknown(draft: Draft, stem: str, column: str, names: tuple[str, ...]) -> Iterator[Problem]:
    allowed = set(names)
    for line, (name,) in draft.rows(stem, column):
        if isinstance(name, str) and name not in allowed:
            place = (draft.file(stem), line, column)
            remedy = _remedy(draft, column, name, names)
            yield Problem(*place, f"unknown {column} '{name}'", one_of(names), remedy)


def _remedy(draft: Draft, column: str, name: str, names: tuple[str, ...]) -> str:
    source = "specimens.csv" if column == "specimen" else "vertebrae in cohort.yaml"
    otherwise = f"correct the name or add it to {source}"
    if column == "joint" and name in joint_names(draft.vertebrae[::-1]):
        swapped = names[::-1][joint_names(draft.vertebrae[::-1]).index(name)]
        return f"a joint is named upper vertebra first: '{swapped}'"
    return did_you_mean(name, names, otherwise)

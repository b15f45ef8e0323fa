"""Is the cohort's name its folder's, and are the vertebrae a chain?"""

import re
from collections.abc import Iterator
from itertools import pairwise

from spinepipe.cohort.read_yaml import Document
from spinepipe.problems import Problem

__all__ = ["check_header", "usable_vertebrae"]

MOST_JOINTS = 20
"""The physics engine is wrong without notice above 120 coordinates, six to a joint."""

REGIONS = "SLTC"
"""Sacral, lumbar, thoracic, cervical: caudal to cranial."""


def check_header(document: Document, folder: str) -> Iterator[Problem]:
    """Problems of ``cohort.yaml`` which its schema cannot see."""
    name = document.data.get("cohort")
    if isinstance(name, str) and name != folder:
        place = (document.file, document.line_of("cohort"), "cohort")
        remedy = "rename the folder or change the key"
        yield Problem(*place, f"'{name}'", f"the folder's name, '{folder}'", remedy)
    vertebrae = document.data.get("vertebrae")
    if isinstance(vertebrae, list):
        names = [name for name in vertebrae if isinstance(name, str)]
        yield from _chain_problems(document, names, len(vertebrae))


def usable_vertebrae(document: Document) -> tuple[str, ...]:
    """The vertebrae when they are a sound chain; none otherwise, so that one fault stays one."""
    names = document.data.get("vertebrae")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return ()
    return () if any(_chain_problems(document, names, len(names))) else tuple(names)


def _chain_problems(document: Document, names: list[str], count: int) -> Iterator[Problem]:
    place = (document.file, document.line_of("vertebrae"), "vertebrae")
    if count < 2:
        found = f"{count} vertebra{'' if count == 1 else 'e'}"
        yield Problem(*place, found, "at least 2", "list every vertebra, caudal to cranial")
    if count - 1 > MOST_JOINTS:
        allowed = f"at most {MOST_JOINTS}"
        yield Problem(*place, f"{count - 1} joints", allowed, "leave vertebrae out at an end")
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            yield Problem(*place, f"'{name}' twice", "each vertebra once", "delete one")
    for lower, upper in pairwise(names):
        low, high = _height(lower), _height(upper)
        if low is not None and high is not None and low > high:
            found = f"'{lower}' before '{upper}'"
            yield Problem(*place, found, "caudal to cranial, as in [L4, L3]", "turn the list round")


def _height(name: str) -> tuple[int, int] | None:
    """Sort key of an anatomical name, growing cranially; None for other names."""
    match = re.fullmatch(r"([SLTC])(\d+)", name)
    return (REGIONS.index(match[1]), -int(match[2])) if match else None

"""The ranking of stiffness sets that `rank` wrote, as other jobs read it."""

import json
import os
from functools import lru_cache
from typing import Any

from spinepipe.files import Stamp, stamp
from spinepipe.marks import DamagedFile, read_json


@lru_cache(maxsize=4)
def _ranking(where: Stamp) -> dict[str, list[dict[str, Any]]] | None:
    """Nothing of a damaged file."""
    try:
        found: dict[str, list[dict[str, Any]]] = read_json(where[0])
    except DamagedFile:
        return None
    return found


def is_whole(path: str) -> bool:
    """Whether there is a ranking, as it was written: one that is damaged counts as lost."""
    return os.path.isfile(path) and _ranking(stamp(path)) is not None


def ranking(path: str) -> dict[str, list[dict[str, Any]]]:
    """Specimen to its best stiffness sets, from ``best.json``.

    Raises
    ------
    DamagedFile
        For a file that is not as it was written.
    """
    found: dict[str, list[dict[str, Any]]] = _ranking(stamp(path)) or read_json(path)
    return found


def ranked_set(path: str, specimen: str, name: str) -> str:
    """Stiffness (J or 1, 6) of a ranked set as JSON; empty where the specimen has none so named."""
    for ranked in ranking(path).get(specimen, []):
        if ranked["name"] == name:
            return json.dumps(ranked["stiffness"])
    return ""

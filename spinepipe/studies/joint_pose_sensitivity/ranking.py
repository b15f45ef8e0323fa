"""The ranking of stiffness sets that `rank` wrote, as other jobs read it."""

import json
from functools import lru_cache
from typing import Any

from spinepipe.files import Stamp, stamp
from spinepipe.marks import read_json


@lru_cache(maxsize=4)
def _ranking(where: Stamp) -> dict[str, list[dict[str, Any]]]:
    found: dict[str, list[dict[str, Any]]] = read_json(where[0])
    return found


def ranking(path: str) -> dict[str, list[dict[str, Any]]]:
    """Specimen to its best stiffness sets, from ``best.json``."""
    return _ranking(stamp(path))


def ranked_set(path: str, specimen: str, name: str) -> str:
    """Stiffness (J or 1, 6) of a ranked set as JSON; empty where the specimen has none so named."""
    for ranked in ranking(path).get(specimen, []):
        if ranked["name"] == name:
            return json.dumps(ranked["stiffness"])
    return ""

"""Published stiffness of a lumbar joint, to tell what a joint can be and what none can."""

from functools import cache

import numpy as np

from spinepipe.anatomy.published import published
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, TRANSLATIONS


def published_range(coordinate: str) -> tuple[float, float]:
    """Smallest and largest published, N/m or N m/rad (Gould 2024a, Table 1)."""
    column = _column(coordinate)
    box = published("gould_2024a")["start_stiffness_box"]
    return float(box["low"][column]), float(box["high"][column])


def middle(coordinate: str) -> float:
    """The middle of the range on a scale of factors."""
    low, high = published_range(coordinate)
    return float(np.sqrt(low * high))


@cache
def range_of_level(joint: str, coordinate: str) -> tuple[float, float]:
    """Smallest and largest that is published for a level, N/m or N m/rad.

    Rotations: Gould 2024b, Table 2, the level's own value and the one of all levels; of joints that
    are not in that table, the range over its levels. Translations, which no source tells by level:
    `published_range`.
    """
    if coordinate in TRANSLATIONS:
        return published_range(coordinate)
    column, paper = _column(coordinate), published("gould_2024b")
    levels = {name: row for name, row in paper["level_stiffness"].items() if name != "where"}
    rows = [levels[joint]] if joint in levels else list(levels.values())
    values = [float(row[column]) for row in (*rows, paper["uniform_stiffness"])]
    return min(values), max(values)


def plausible(joint: str, coordinate: str) -> float:
    """The middle of `range_of_level` on a scale of factors, N/m or N m/rad."""
    low, high = range_of_level(joint, coordinate)
    return float(np.sqrt(low * high))


def _column(coordinate: str) -> str:
    return STIFFNESS_COLUMNS[COORDINATES.index(coordinate)]

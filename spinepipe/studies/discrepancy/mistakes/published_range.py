"""Published stiffness of a lumbar joint, to tell what no joint can be."""

import numpy as np

from spinepipe.anatomy.published import published
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS


def published_range(coordinate: str) -> tuple[float, float]:
    """Smallest and largest published, N/m or N m/rad (Gould 2024a, Table 1)."""
    column = STIFFNESS_COLUMNS[COORDINATES.index(coordinate)]
    box = published("gould_2024a")["start_stiffness_box"]
    return float(box["low"][column]), float(box["high"][column])


def middle(coordinate: str) -> float:
    """The middle of the range on a scale of factors."""
    low, high = published_range(coordinate)
    return float(np.sqrt(low * high))

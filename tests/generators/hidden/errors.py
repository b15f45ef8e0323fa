"""Mistakes in the files that are no physics: swapped, flipped, badly marked, wrongly converted."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .anatomy import COORDINATES

Table = np.ndarray
"""Readings (P, T, C, S, J, 6), mm and deg, in the order of `COORDINATES`."""


def swapped_specimens(table: Table, clean: Table, rng: np.random.Generator, options: Any):
    """The motion of two specimens changed places."""
    first, second = options.get("specimens") or sorted(rng.permutation(len(table))[:2].tolist())
    swapped = table.copy()
    swapped[[first, second]] = table[[second, first]]
    return swapped, {"specimens": [first, second]}


def flipped_sign(table: Table, clean: Table, rng: np.random.Generator, options: Any):
    """One coordinate of one joint has the wrong sign, in all specimens or in one."""
    coordinate = options.get("coordinate") or str(rng.choice(COORDINATES[3:]))
    joint = options.get("joint", int(rng.integers(table.shape[-2])))
    specimen = options.get("specimen")
    chosen = slice(None) if specimen is None else slice(specimen, specimen + 1)
    flipped = table.copy()
    flipped[chosen, ..., joint, COORDINATES.index(coordinate)] *= -1.0
    return flipped, {"coordinate": coordinate, "joint": joint, "specimen": specimen}


def bad_markers(table: Table, clean: Table, rng: np.random.Generator, options: Any):
    """The noise of one joint is ``factor`` times as large, in all specimens or in one."""
    factor = options.get("factor", 10.0)
    joint = options.get("joint", int(rng.integers(table.shape[-2])))
    specimen = options.get("specimen")
    chosen = slice(None) if specimen is None else slice(specimen, specimen + 1)
    place = (chosen, ..., joint, slice(None))
    bad = table.copy()
    bad[place] = clean[place] + factor * (table[place] - clean[place])
    return bad, {"factor": factor, "joint": joint, "specimen": specimen}


Error = Callable[[Table, Table, np.random.Generator, Any], tuple[Table, dict[str, Any]]]
ERRORS: dict[str, Error] = {
    "swapped_specimens": swapped_specimens,
    "flipped_sign": flipped_sign,
    "bad_markers": bad_markers,
}
LOAD_UNIT = "load_unit"
"""A further error: {"factor": 1000 for N mm, 8.85 for lbf in} times every moment in loads.csv."""


def load_factor(errors: dict[str, Any]) -> float:
    """What the moments in loads.csv are multiplied by."""
    return float(errors[LOAD_UNIT].get("factor", 1000.0)) if LOAD_UNIT in errors else 1.0

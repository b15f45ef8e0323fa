"""Loads of a varied specimen: moved, turned about their own points, and scaled."""

from scipy.spatial.transform import Rotation

from spinepipe.cohort.varied.variation import Variation
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase
from spinepipe.statics.many.spines import Cases


def varied_cases(case: LoadCase, change: Variation) -> Cases:
    """One test of M spines: force and moment of each load are turned together and scaled."""
    same = Cases.of(case, len(change.load_sizes))
    turn = Rotation.from_rotvec(change.load_turns).as_matrix()
    by = change.load_sizes[:, None, None] * turn
    points = same.points.copy()
    for row, step in enumerate(case.steps):  # where a step has fewer loads, the rest is nobody's
        points[:, row, : len(step.wrenches)] += change.load_points[:, None]
    return Cases(case, points, _turned(by, same.forces), _turned(by, same.moments))


def _turned(by: Array, vectors: Array) -> Array:
    """(M, T, W, 3) vectors turned by (M, 3, 3)."""
    turned: Array = (by[:, None, None] @ vectors[..., None])[..., 0]
    return turned

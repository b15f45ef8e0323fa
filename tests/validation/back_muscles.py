"""Where muscles of the back lie, and with what lever arms, beside those that were placed by CT.

The package's muscles as published and as the product moves them, beside the generic male of Bruno
2015 and Allaire 2020 in the shared data, whose muscles were placed by CT of living people. What is
moved (`farther_by_ct` in `spinepipe/muscles/facts.csv`) is the difference of the two, each brought
to the reference person's mass.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.muscles.myo_sim import source_of_myo_sim
from spinepipe.muscles.paths import Lines, Standoff
from spinepipe.muscles.person import above
from spinepipe.muscles.pose import JointCentres, place_bodies
from spinepipe.muscles.trunk import BODIES, LEVELS, NO_BODY, SLICES, Trunk
from spinepipe.muscles.trunk_source import backwards
from tests.validation.trunk_pressures import SETTINGS, male

PARTS = ("longissimus", "iliocostalis", "multifidus", "quadratus")
BY_MASS = float(np.exp(0.003 * (75.1 - 79.58)))
"""The reference person beside the generic male, 0.3 % per kg as in `regressions.csv`."""

HEAD = (
    "Muscles of the back, right side, weighted by cross-section. back_mm, aside_mm: distance of "
    "their paths from the centre of a vertebra; farther: how much farther those placed by CT are "
    "than the package has them, at the reference person's mass. Rows of a joint: lever arm of "
    "erector spinae and multifidus in extension, no posture (back_mm)."
)


def table() -> pd.DataFrame:
    """One row per part and vertebra, and per joint; without the shared data the package alone."""
    trunks = {
        "published": source_of_myo_sim(placed_by_ct=False).trunk,
        "here": source_of_myo_sim().trunk,
    }
    if (by_ct := male()) is not None:
        trunks["by_ct"] = by_ct
    return pd.DataFrame(list(_rows(trunks)))


def _rows(trunks: dict[str, Trunk]) -> Iterator[dict[str, Any]]:
    for part in PARTS:
        found = {name: 1e3 * places(trunk, part) for name, trunk in trunks.items()}
        for level, vertebra in enumerate(SLICES[8:], 8):
            row: dict[str, Any] = {"muscle": part, "at": vertebra}
            row |= {f"back_{name}_mm": at[level, 0] for name, at in found.items()}
            row |= {f"aside_{name}_mm": at[level, 1] for name, at in found.items()}
            if "by_ct" in found:
                off = BY_MASS * found["by_ct"][level] - found["published"][level]
                row |= {"farther_back_mm": off[0], "farther_aside_mm": off[1]}
            yield row
    arms = {name: 1e3 * extensor_arms(trunk) for name, trunk in trunks.items()}
    for level, joint in enumerate(LEVELS):
        row = {"muscle": "lever arm of extensors", "at": joint}
        yield row | {f"back_{name}_mm": arm[level] for name, arm in arms.items()}


def places(trunk: Trunk, part: str) -> Array:
    """(17, 2) m behind and beside T1 to L5, where paths cross the plane through a vertebra; NaN
    where none does."""
    muscles, back = trunk.muscles, backwards(trunk.vertebrae)
    up = np.stack([back[:, 1], -back[:, 0], np.zeros(len(back))], axis=1)
    found = np.zeros((len(SLICES), 3))
    for k, group in enumerate(muscles.groups):
        if part not in group or muscles.sides[k] != "right":
            continue
        path = muscles.point[k][muscles.body[k] != NO_BODY]
        for level, centre in enumerate(trunk.vertebrae):
            height = (path - centre) @ up[level]
            legs = np.flatnonzero((height[:-1] < 0.0) != (height[1:] < 0.0))
            if not len(legs):
                continue
            leg = legs[0]
            share = height[leg] / (height[leg] - height[leg + 1])
            at = path[leg] + share * (path[leg + 1] - path[leg]) - centre
            found[level] += muscles.pcsa[k] * np.array([at @ back[level], at[2], 1.0])
    with np.errstate(invalid="ignore"):
        mean: Array = found[:, :2] / found[:, 2:]
    return mean


def extensor_arms(trunk: Trunk) -> Array:
    """(7,) m, as the product runs them: over bars, about joints behind the discs' centres."""
    passive, wrap = SETTINGS.passive, SETTINGS.wrapping
    chain = JointCentres.of(trunk, 1e-3 * passive.joints_behind_mm)
    turns = np.tile(np.eye(3), (len(BODIES), 1, 1))
    poses = place_bodies(chain, turns, np.zeros((len(LEVELS), 3)))
    pulls = Lines.of(trunk, Standoff(wrap.depth, 1e-3 * wrap.least_mm)).pulls(poses)
    _, arms = above(pulls.forces, pulls.moments, poses.centres)
    along = np.einsum("ki,mki->mk", poses.discs[:, :, 2], arms)
    extends = np.array([any(p in g for p in PARTS[:3]) for g in trunk.muscles.groups])
    weight = trunk.muscles.pcsa[:, None] * (extends[:, None] & (along > 1e-3))
    found: Array = (weight * along).sum(axis=0) / weight.sum(axis=0)
    return found

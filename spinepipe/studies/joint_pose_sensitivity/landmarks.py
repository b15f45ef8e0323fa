"""The landmarks of a specimen: as they were palpated, and sampled around that."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.designs import sample_landmarks
from spinepipe.effects.contract import Array
from spinepipe.units import MM_PER_M

LandmarkPoints = dict[str, dict[str, Array]]
"""Vertebra to landmark to position (3,)."""


@dataclass(frozen=True)
class Landmarks:
    """A specimen's landmarks.

    Attributes
    ----------
    names : (vertebra, landmark) of each.
    points_mm : (L, 3) in ground. sd_mm : (L,) per axis.
    """

    names: tuple[tuple[str, str], ...]
    points_mm: Array
    sd_mm: Array

    @property
    def points(self) -> Array:
        """(L, 3) m, ground."""
        found: Array = self.points_mm / MM_PER_M
        return found

    @property
    def sd(self) -> Array:
        """(L,) m, per axis."""
        found: Array = self.sd_mm / MM_PER_M
        return found

    def with_sd(self, sd_mm: float, count: int, seed: int, name: str) -> Iterator[LandmarkPoints]:
        """So many sets in m, sampled with one SD of all.

        Every SD draws the same directions, so that what is made of them differs by SD alone.
        """
        sds = np.full(len(self.names), sd_mm)
        drawn, _ = sample_landmarks(self.points_mm, sds, max(count, 2), seed, name)
        return (by_vertebra(self.names, points) for points in drawn[:count] / MM_PER_M)


def landmarks_of(cohort: Cohort, specimen: str, sd_mm: float | None = None) -> Landmarks:
    """The landmarks as the cohort lists them.

    Parameters
    ----------
    sd_mm : SD that a study gives all of them; None: the cohort's own.
    """
    assert cohort.landmarks is not None  # asked for when the study was checked
    rows = cohort.landmarks[cohort.landmarks["specimen"] == specimen]
    own = rows["sd_mm"].fillna(0.0).to_numpy(float)
    sd = own if sd_mm is None else np.full(len(rows), sd_mm)
    names = tuple(zip(rows["vertebra"], rows["landmark"], strict=True))
    return Landmarks(names, rows[["x_mm", "y_mm", "z_mm"]].to_numpy(float), sd)


def by_vertebra(names: Iterable[tuple[str, str]], points: Iterable[Array]) -> LandmarkPoints:
    """Points by their vertebra and name."""
    placed: LandmarkPoints = {}
    for (vertebra, landmark), point in zip(names, points, strict=True):
        placed.setdefault(vertebra, {})[landmark] = point
    return placed

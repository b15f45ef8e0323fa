"""Where the discrepancy is: gaps by specimen, joint, coordinate, test and load step."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from spinepipe.discrepancy.gaps import Gap, LeftOver, left_over
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.joint_fit import JointFit
from spinepipe.units import COORDINATES

KEYS = ("specimen", "test", "step", "joint", "coordinate")

POOLED = {
    "all": (),
    "specimen": ("specimen",),
    "joint": ("joint",),
    "coordinate": ("coordinate",),
    "test": ("test",),
    "step": ("step",),
    "joint x coordinate x test": ("joint", "coordinate", "test"),
}
"""Name of each way to pool and what it tells apart."""


@dataclass(frozen=True)
class Place:
    """A place and the gap there; ``at`` holds what is told apart, the rest is together."""

    by: str
    at: Mapping[str, object]
    gap: Gap


def residual_frame(grounds: Grounds, fit: JointFit, joints: Sequence[str]) -> pd.DataFrame:
    """One row per reading: where it is, squared residual in noise SD, freedom it keeps."""
    rows = [
        row
        for name, left in left_over(grounds, fit).items()
        for row in _rows(grounds, name, left, joints)
    ]
    return pd.DataFrame(rows, columns=[*KEYS, "chi2", "freedom"])


def _rows(
    grounds: Grounds, name: str, left: LeftOver, joints: Sequence[str]
) -> Iterator[tuple[object, ...]]:
    tests = grounds.readings[name].tests
    for test, residual, freedom in zip(tests, left.residual, left.freedom, strict=True):
        for t, j, c in zip(*test.count.nonzero(), strict=True):
            place = (name, test.case.test, test.case.steps[t].step, joints[j], COORDINATES[c])
            yield (*place, residual[t, j, c] ** 2, freedom[t, j, c])


def places(frame: pd.DataFrame) -> list[Place]:
    """Gaps pooled in every way."""
    found = []
    for by, keys in POOLED.items():
        groups = frame.groupby(list(keys), sort=False) if keys else [((), frame)]
        for key, rows in groups:
            at = dict(zip(keys, key if isinstance(key, tuple) else (key,), strict=True))
            gap = Gap(float(rows["chi2"].sum()), float(rows["freedom"].sum()), len(rows))
            found.append(Place(by, at, gap))
    return found


def worst(found: Sequence[Place], count: int) -> list[Place]:
    """The places of joint, coordinate and test with the largest gap that is above the noise."""
    fine = [p for p in found if p.by == "joint x coordinate x test" and p.gap.interval[0] > 0.0]
    return sorted(fine, key=lambda place: -place.gap.gap)[:count]

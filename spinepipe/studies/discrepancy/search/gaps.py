"""How large a discrepancy is, in noise SD, over all readings or pooled by place."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chndtr

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
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
class Gap:
    """Size of a discrepancy in noise SD.

    Attributes
    ----------
    gap : sqrt(max(0, chi2 / dof - 1)). low, high : its 95 % interval. rms : sqrt(chi2 / dof).
    """

    chi2: float
    dof: float
    readings: int

    @property
    def rms(self) -> float:
        """1 where only noise is left."""
        return float(np.sqrt(self.chi2 / self.dof)) if self.dof > 0.0 else 0.0

    @property
    def gap(self) -> float:
        """0 where only noise is left."""
        return self._of(self.chi2 - self.dof)

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the gap: of the noncentrality that chi2 allows.

        By inversion of the noncentral chi squared distribution; what fits leave is of that kind
        where a model lacks something.
        """
        return self._of(self._noncentrality(0.975)), self._of(self._noncentrality(0.025))

    @property
    def excess(self) -> float:
        """chi2 beyond what noise makes."""
        return self.chi2 - self.dof

    def _of(self, excess: float) -> float:
        return float(np.sqrt(max(0.0, excess / self.dof))) if self.dof > 0.0 else 0.0

    def _noncentrality(self, share: float) -> float:
        """Noncentrality at which chi2 or less has that probability; 0 where none has."""
        if self.dof <= 0.0 or chndtr(self.chi2, self.dof, 1e-12) <= share:
            return 0.0
        most = 2.0 * self.chi2 + 100.0  # the mean is dof + noncentrality: far beyond both limits
        found: float = brentq(
            lambda size: chndtr(self.chi2, self.dof, size) - share, 1e-12, most, xtol=1e-12
        )
        return found


@dataclass(frozen=True)
class LeftOver:
    """What a fit leaves of a specimen's readings, in noise SD, with what each counts.

    Attributes
    ----------
    residual, freedom : per test (T, J, 6), NaN where nothing was read.
    """

    residual: tuple[Array, ...]
    freedom: tuple[Array, ...]


@dataclass(frozen=True)
class GapPlace:
    """A place and the gap there; ``at`` holds what is told apart, the rest is together."""

    by: str
    at: Mapping[str, object]
    gap: Gap


def whole_gap(baseline: BaselineFit, fit: JointFit) -> Gap:
    """The gap over all readings."""
    return _pooled(left_over(baseline, fit).values())


def gaps_at(baseline: BaselineFit, fit: JointFit) -> dict[str, Gap]:
    """The gap over the readings of each coordinate that was read."""
    left = left_over(baseline, fit).values()
    found = {name: _pooled(left, place) for place, name in enumerate(COORDINATES)}
    return {name: gap for name, gap in found.items() if gap.readings}


def left_over(baseline: BaselineFit, fit: JointFit) -> dict[str, LeftOver]:
    """What a fit leaves of every reading, nuisances at their most likely values."""
    unknowns = len(fit.x)
    total = sum(float(w.freedom.sum()) for w in baseline.setting.whitenings.values())
    found = {}
    for name, one in baseline.readings.items():
        white = baseline.setting.whitenings[name]
        plain = baseline.plain[name].noise_only(one.errors(fit.predicted[name]))
        residual = white.left_over(plain)
        # what is fitted takes degrees of freedom from all readings in proportion
        freedom = white.freedom * (1.0 - unknowns / total)
        found[name] = LeftOver(_spread(residual, white.used), _spread(freedom, white.used))
    return found


def _spread(values: Array, used: tuple[NDArray[np.bool_], ...]) -> tuple[Array, ...]:
    """(N,) values back to (T, J, 6) per test."""
    found, at = [], 0
    for one in used:
        array = np.full(one.shape, np.nan)
        count = int(one.sum())
        array[one] = values[at : at + count]
        at += count
        found.append(array)
    return tuple(found)


def _pooled(left: Collection[LeftOver], coordinate: int | slice = slice(None)) -> Gap:
    """The gap over readings of one coordinate or of all; NaN counts nothing."""
    r = np.concatenate([test[..., coordinate].ravel() for one in left for test in one.residual])
    f = np.concatenate([test[..., coordinate].ravel() for one in left for test in one.freedom])
    there = np.isfinite(r)
    return Gap(float(np.sum(r[there] ** 2)), float(np.sum(f[there])), int(there.sum()))


def residual_frame(baseline: BaselineFit, fit: JointFit, joints: Sequence[str]) -> pd.DataFrame:
    """One row per reading: where it is, squared residual in noise SD, freedom it keeps."""
    rows = []
    for name, left in left_over(baseline, fit).items():
        tests = baseline.readings[name].tests
        for test, residual, freedom in zip(tests, left.residual, left.freedom, strict=True):
            for t, j, c in zip(*test.count.nonzero(), strict=True):
                place = (name, test.case.test, test.case.steps[t].step, joints[j], COORDINATES[c])
                rows.append((*place, residual[t, j, c] ** 2, freedom[t, j, c]))
    return pd.DataFrame(rows, columns=[*KEYS, "chi2", "freedom"])


def places(frame: pd.DataFrame) -> list[GapPlace]:
    """Gaps pooled in every way."""
    found = []
    for by, keys in POOLED.items():
        groups = frame.groupby(list(keys), sort=False) if keys else [((), frame)]
        for key, rows in groups:
            at = dict(zip(keys, key if isinstance(key, tuple) else (key,), strict=True))
            gap = Gap(float(rows["chi2"].sum()), float(rows["freedom"].sum()), len(rows))
            found.append(GapPlace(by, at, gap))
    return found


def worst(found: Sequence[GapPlace], count: int) -> list[GapPlace]:
    """The places of joint, coordinate and test with the largest gap that is above the noise."""
    fine = [p for p in found if p.by == "joint x coordinate x test" and p.gap.interval[0] > 0.0]
    return sorted(fine, key=lambda place: -place.gap.gap)[:count]

"""Joint laws that remember the load path: friction and creep, solved implicitly in every step."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import nnls

from .scope import Scope
from .world import Now


def dahl(before, moved):
    """dF/dx = 1 - F sign(dx), x in widths: exponentials towards +-1."""
    side = np.sign(moved)
    return side + (before - side) * np.exp(-np.abs(moved))


def bouc_wen(before, moved):
    """Exponent 2, beta = gamma: dF/dx = 1 against the load, 1 - F^2 along it; in closed form.

    Unloading is straight to zero, loading follows a hyperbolic tangent from there on.
    """
    side = np.sign(moved)
    along, far = side * before, np.abs(moved)
    straight = np.minimum(far, np.maximum(-along, 0.0))
    start = np.clip(along + straight, -10.0, 1.0 - 1e-12)
    loaded = np.tanh(np.arctanh(np.maximum(start, 0.0)) + far - straight)
    return np.where(far > 0.0, side * np.where(far > straight, loaded, start), before)


@dataclass(frozen=True)
class Friction:
    """Rate-independent friction: a load that tends to +-``load`` N m (N) as the joint moves on.

    ``formula`` "dahl" and "bouc_wen": one element that approaches the other side over ``width``.
    "even": twelve springs with sliders (Jenkins) side by side, whose yields lie evenly between 0
    and four widths, so that the loop's branches are parabolas. memory: forces, and last q.
    """

    scope: Scope
    load: float
    width: float
    formula: str = "dahl"

    @property
    def cells(self) -> int:
        """Forces of the elements in units of the limit, and the last q."""
        return len(self._yields()) + 1

    def __call__(self, q, carried, memory, now: Now):
        return self.scope.into(carried, self.load * self._forces(q, memory).mean(axis=0))

    def renewed(self, q, memory, now: Now):
        forces = self._forces(q, memory)
        return np.stack([*(self.scope.into(q, one) for one in forces), q])

    def _yields(self) -> np.ndarray:
        if self.formula != "even":
            return np.array([self.width])
        return 4.0 * self.width * (np.arange(12) + 0.5) / 12.0

    def _forces(self, q, memory):
        """(elements, ..., J), each in units of its limit."""
        moved = self.scope.of(q) - self.scope.of(memory[-1])
        found = []
        for before, width in zip(memory[:-1], self._yields(), strict=True):
            old = self.scope.of(before)
            if self.formula == "even":
                found.append(np.clip(old + moved / width, -1.0, 1.0))
            else:
                step = dahl if self.formula == "dahl" else bouc_wen
                found.append(step(old, moved / width))
        return np.stack(found)


TIMES = np.array([3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0])
"""s: retardation times of the chain that stands for creep without a single time."""

LONG_S = 600.0
"""At which "logarithmic" and "power" creep have grown by ``fraction``."""


def kelvin(t: np.ndarray, time: float) -> np.ndarray:
    """One retardation time."""
    return -np.expm1(-t / time)


def stretched(t: np.ndarray, time: float) -> np.ndarray:
    """Kohlrausch's exponent 1/2."""
    return -np.expm1(-np.sqrt(t / time))


def logarithmic(t: np.ndarray, time: float) -> np.ndarray:
    """Equal parts in every decade from ``time`` / 10 on."""
    start = time / 10.0
    return np.log1p(t / start) / np.log1p(LONG_S / start)


def power(t: np.ndarray, time: float) -> np.ndarray:
    """t^0.3, as of collagen under a held load."""
    return (t / LONG_S) ** 0.3


GROWTH = {one.__name__: one for one in (kelvin, stretched, logarithmic, power)}


@cache
def chain(formula: str, time: float) -> tuple[np.ndarray, np.ndarray]:
    """(K,) shares and times s of Kelvin units that grow as the formula says, from 1 s to 1 hour."""
    if formula == "kelvin":
        return np.array([1.0]), np.array([time])
    t = np.geomspace(1.0, 3600.0, 120)
    units = -np.expm1(-t[:, None] / TIMES)
    instant = np.ones((len(t), 1))
    shares, _ = nnls(np.hstack([units, instant]), GROWTH[formula](t, time))
    return shares, np.append(TIMES, 0.0)  # what is there at once is a unit without a time


@dataclass(frozen=True)
class Creep:
    """A spring in line with Kelvin units: a constant load moves the joint on by ``fraction``.

    q = elastic + sum of slow_k; load = k elastic; time_k * d(slow_k)/dt = fraction * share_k *
    elastic - slow_k, integrated exactly over the step with the elastic part as at its end.
    memory: slow parts.
    """

    scope: Scope
    stiffness: np.ndarray
    fraction: float
    seconds: float
    formula: str = "kelvin"

    @property
    def cells(self) -> int:
        """The slow parts."""
        return len(chain(self.formula, self.seconds)[0])

    def __call__(self, q, carried, memory, now: Now):
        elastic = self._elastic(q, memory, now)
        k = self.scope.of(self.stiffness)
        return self.scope.into(carried, k * (elastic - self.scope.of(q)))

    def renewed(self, q, memory, now: Now):
        elastic = self._elastic(q, memory, now)
        shares, stays = self._units(now)
        return np.stack(
            [
                self.scope.into(q, self.scope.of(old) * s + self.fraction * w * (1.0 - s) * elastic)
                for old, w, s in zip(memory, shares, stays, strict=True)
            ]
        )

    def _units(self, now):
        shares, times = chain(self.formula, self.seconds)
        with np.errstate(divide="ignore", invalid="ignore"):
            stays = np.where(
                times > 0.0, np.exp(-now.seconds / np.where(times > 0, times, 1.0)), 0.0
            )
        return shares, stays

    def _elastic(self, q, memory, now):
        shares, stays = self._units(now)
        slow = sum(self.scope.of(old) * s for old, s in zip(memory, stays, strict=True))
        grown = self.fraction * float(np.sum(shares * (1.0 - stays)))
        return (self.scope.of(q) - slow) / (1.0 + grown)

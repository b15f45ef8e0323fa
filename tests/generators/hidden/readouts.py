"""What instruments add to the true motion: skin that follows a neighbour, zeros that move on."""

from dataclasses import dataclass

import numpy as np

from .scope import Scope


def tanh(u: np.ndarray) -> np.ndarray:
    """Slope 1 at zero and limit 1."""
    return np.tanh(u)


def root(u: np.ndarray) -> np.ndarray:
    """The same, slower: u / sqrt(1 + u^2)."""
    return u / np.sqrt(1.0 + u**2)


SLIPS = {"root": root, "tanh": tanh}


@dataclass(frozen=True)
class SoftTissue:
    """Skin moves with the joint above: reported += ``share * reach * slip(q_above / reach)``."""

    scope: Scope
    reach: float
    share: float
    formula: str = "tanh"

    def __call__(self, q: np.ndarray) -> np.ndarray:
        above = np.zeros_like(self.scope.of(q))
        above[..., :-1] = self.scope.of(q)[..., 1:]
        slip = SLIPS[self.formula](above / self.reach)
        return q + self.scope.into(q, self.share * self.reach * slip)


def settling(share: np.ndarray, pace: float) -> np.ndarray:
    """1 - exp(-s / pace), 1 at the end: a clamp that settles."""
    return np.expm1(-share / pace) / np.expm1(-1.0 / pace)


def square_root(share: np.ndarray, pace: float) -> np.ndarray:
    """sqrt(s): fluid that seeps out of a disc under its fixture."""
    return np.sqrt(share)


def slipping(share: np.ndarray, pace: float) -> np.ndarray:
    """A smooth slip in the middle of the test, over a third of ``pace``."""
    rise = 1.0 / (1.0 + np.exp(-(share - 0.5) / (pace / 6.0)))
    return (rise - rise[0]) / (rise[-1] - rise[0])


COURSES = {one.__name__: one for one in (settling, square_root, slipping)}


@dataclass(frozen=True)
class PoseDrift:
    """The zero moves on by ``drift`` (rad, m) in the course of each test, whatever the load."""

    scope: Scope
    drift: float
    pace: float
    formula: str = "settling"

    def __call__(self, q: np.ndarray) -> np.ndarray:
        passed = np.linspace(0.0, 1.0, q.shape[-3])
        course = self.drift * COURSES[self.formula](passed, self.pace)
        told = np.broadcast_to(course[:, None], self.scope.of(q).shape)
        return q + self.scope.into(q, told)

"""Effects that no vocabulary names: what a search must call unknown."""

from dataclasses import dataclass

import numpy as np

from .anatomy import COORDINATES
from .scope import Scope
from .world import Now

EXTENSION = COORDINATES.index("extension")
BENDING = COORDINATES.index("right_bending")


@dataclass(frozen=True)
class Leaning:
    """A joint feels the rotation of the one above: load ``stiffness * q_above``."""

    scope: Scope
    stiffness: float

    def __call__(self, q, carried, memory, now: Now):
        load = np.zeros_like(self.scope.of(q))
        load[..., :-1] = self.stiffness * self.scope.of(q)[..., 1:]
        return self.scope.into(carried, load)


@dataclass(frozen=True)
class Clicks:
    """A load that comes and goes with the angle: ``load * sin(2 pi q / period)``."""

    scope: Scope
    period: float
    load: float

    def __call__(self, q, carried, memory, now: Now):
        return self.scope.into(
            carried, self.load * np.sin(2.0 * np.pi * self.scope.of(q) / self.period)
        )


@dataclass(frozen=True)
class Bump:
    """A load of ``load`` N m around one angle only: ``load * exp(-((q - angle) / width)^2)``."""

    scope: Scope
    angle: float
    width: float
    load: float

    def __call__(self, q, carried, memory, now: Now):
        off = (self.scope.of(q) - self.angle) / self.width
        return self.scope.into(carried, self.load * np.exp(-(off**2)))


@dataclass(frozen=True)
class QuadraticCross:
    """Extension squared drives lateral bending: ``stiffness * extension^2`` N m/rad^2."""

    joints: np.ndarray
    stiffness: float

    def __call__(self, q, carried, memory, now: Now):
        load = np.zeros_like(carried)
        load[..., BENDING] = self.stiffness * self.joints * q[..., EXTENSION] ** 2
        return load


@dataclass(frozen=True)
class NeutralWalk:
    """Between tests each joint's neutral angle walks on: ``walk`` (T, J) rad, one coordinate."""

    scope: Scope
    stiffness: np.ndarray
    walk: np.ndarray

    def __call__(self, q, carried, memory, now: Now):
        shift = -self.scope.of(self.stiffness) * self.walk[now.tests]
        return self.scope.into(carried, np.broadcast_to(shift, self.scope.of(q).shape))


@dataclass(frozen=True)
class OrderDrift:
    """Readings drift as tests go by, faster at high load: ``angle * number * load_share^2``.

    ``load_share`` (T, S) is the moment over its peak, without sign.
    """

    scope: Scope
    load_share: np.ndarray
    angle: float

    def __call__(self, q: np.ndarray) -> np.ndarray:
        number = 1.0 + np.arange(q.shape[0])[:, None]
        drift = self.angle * (number * self.load_share**2)[:, :, None]
        return q + self.scope.into(q, np.broadcast_to(drift, self.scope.of(q).shape))

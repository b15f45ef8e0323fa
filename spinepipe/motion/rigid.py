"""Rigid parts put together: mass, centre of mass and inertia of several as of one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array


@dataclass(frozen=True, eq=False)
class RigidPart:
    """A rigid part.

    Attributes
    ----------
    name : of what. kg : its mass. com : (3,) m, its centre of mass.
    about_com : (3, 3) kg m2, inertia about it; both in axes that all parts share.
    """

    name: str
    kg: float
    com: Array
    about_com: Array


def joined(name: str, parts: Sequence[RigidPart]) -> RigidPart:
    """All parts as one, by parallel axes."""
    kg = sum(part.kg for part in parts)
    com = sum((part.kg * part.com for part in parts), np.zeros(3)) / kg
    about = [part.about_com + part.kg * steiner(part.com - com) for part in parts]
    return RigidPart(name, kg, com, np.sum(about, axis=0))


def steiner(away: Array) -> Array:
    """(..., 3, 3) m2: what a unit mass so far away (..., 3) m adds to an inertia."""
    square = np.einsum("...i,...i->...", away, away)[..., None, None]
    found: Array = square * np.eye(3) - away[..., :, None] * away[..., None, :]
    return found


def seen_from(part: RigidPart, rotation: Array, origin: Array) -> RigidPart:
    """The part in a frame that has this rotation (3, 3) and origin (3,) m in the present axes."""
    com, about = rotation.T @ (part.com - origin), rotation.T @ part.about_com @ rotation
    return RigidPart(part.name, part.kg, com, about)

"""What a trunk is asked to hold: a posture, what is in the hands, what pushes at the thorax."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array

Tone = Literal["none", "stated", "stable"]
"""Co-activation: none, a stated least activation of all muscles, or the least that is stable."""


@dataclass(frozen=True, eq=False)
class Hands:
    """A load in the hands.

    Attributes
    ----------
    kg : mass of the load.
    at : (3,) m from the centre of L5S1, ground axes; None: hands hang below the shoulders.
    holding : which hands carry it; a load in both lies half and half.
    """

    kg: float = 0.0
    at: Array | None = None
    holding: Literal["both", "right", "left"] = "both"


@dataclass(frozen=True, eq=False)
class Exertion:
    """What pushes at the thorax from outside, ground axes.

    Attributes
    ----------
    force : (3,) N, acts at the vertebra.
    moment : (3,) N m about x, y, z: right bending, left rotation, extension, as it acts on the
        trunk; an exertion in extension is resisted by a flexion moment from outside.
    at : vertebra, T1 to T11.
    as_force : whether the moment about z and x is made by a horizontal force at the vertebra, so
        large that it has that moment about the centre of L5S1; else it is a pure moment.
    """

    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    at: str = "T9"
    as_force: bool = False


@dataclass(frozen=True, eq=False)
class Instant:
    """An instant of a recorded motion, as its inverse dynamics has it.

    Attributes
    ----------
    turned : (8, 3, 3) rotation of each body (BODIES) since the person stood upright, ground axes.
    bodies : (K,) index into BODIES of what carries each load.
    at : (K, 3) m from the centre of L5S1, ground axes.
    forces : (K, 3) N on the carrier: gravity less inertia. moments : (K, 3) N m about `at`.
    """

    turned: Array
    bodies: NDArray[np.int64]
    at: Array
    forces: Array
    moments: Array


@dataclass(frozen=True, eq=False)
class Task:
    """One thing to hold.

    Attributes
    ----------
    name : as the table of tasks calls it.
    number : of Ghezelbash 2016 Table 1, None for others.
    turned : (8, 3) rad, extension, right bending and left rotation of each body (BODIES, caudal to
        cranial), of Z, X', Y'' angles in ground.
    from_upright : whether `turned` is counted from the upright posture of the subject (angle by
        angle added to it) or from the source's pose.
    hands, exertion : what acts.
    pressure_pa : intra-abdominal pressure.
    stress_pa : largest active stress of a muscle.
    tone : co-activation; `tone_share` is the least share of the largest active force, if stated.
    instant : in place of `turned`, weights, arms, hands and exertion; None for a task held still.
    """

    name: str
    number: int | None
    turned: Array
    from_upright: bool
    hands: Hands = field(default_factory=Hands)
    exertion: Exertion = field(default_factory=Exertion)
    pressure_pa: float = 0.0
    stress_pa: float = 0.6e6
    tone: Tone = "none"
    tone_share: float = 0.0
    instant: Instant | None = None

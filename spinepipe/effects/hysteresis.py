"""Hysteresis: dry friction in a joint, so that loading and unloading branches differ."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import ndtri

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import TRIED, Advance, Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.effects.rounding import ramp
from spinepipe.facts import several
from spinepipe.units import COORDINATES, TRANSLATIONS

LAWS = ("dahl", "jenkins")

ELEMENTS = 7
"""Of the law of Jenkins, each with the same part of the friction."""

# Normal deviates of equal probability, with an SD of one: where the logarithms of yields lie.
_NORMAL = ndtri((np.arange(ELEMENTS) + 0.5) / ELEMENTS)
_DEVIATES = {"dahl": np.zeros(1), "jenkins": _NORMAL / np.std(_NORMAL)}

_FRICTION = several(__name__, "joint_friction")
"""N, and mm in which it yields, of a joint in shear and in compression."""


ROUNDING = 1e-4
"""Share of the yield over which the corner at the start of a step is rounded."""

CORNER = 0.05
"""Share of what is left to yield over which an elastic-plastic element's corner is rounded."""

_NONE_LEFT = 1e-12
"""An element with less left to yield has yielded."""


@register("hysteresis")
@dataclass(frozen=True)
class Hysteresis:
    """Holding load ``moment h`` of friction that follows the motion, by steps in closed form.

    Law of Dahl (1968, "A solid friction model", TOR-0158(3107-18)-1) with exponent 1, the Bouc-Wen
    law of exponent 1: ``dh/dq = (1 - h sign(dq)) / yield``. From q0 with h0, where the last step
    ended: ``h = s - (s - h0) exp(-|q - q0| / yield)`` with ``s = sign(q - q0)``, which is
    ``h0 u + s (1 - u)``. A joint that turns on and one that turns back meet different slopes at q0.
    There ``|q - q0|`` of the first term is rounded to ``sqrt(d^2 + e^2) - e``, e = 1e-4 of the
    yield: the slope at q0 is then the mean of both sides and a step without a change of load has a
    derivative. h may pass 1 by a share e / d when steps turn the joint by d each.

    Law of Jenkins: seven springs side by side, each in line with a slider (Iwan 1966, J Appl Mech
    33:893), so that h is the mean of theirs. The logarithms of their yields have the SD ``spread``:
    0 is one element, or Bouc-Wen with a large exponent; a wide one gives loops with sharp ends and
    no sharp knee. Each yields over a twentieth of what it has left.

    Neither knows time. Off: moment 0. Options: ``coordinate``, ``law``. A translation has a
    ``force`` and a ``yield_distance``.
    """

    coordinate: str = "extension"
    law: str = "dahl"
    name: ClassVar[str] = "hysteresis"
    kind: ClassVar[EffectKind] = EffectKind.PATH
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple(
            {"coordinate": c, **law} for law in ({}, {"law": "jenkins"}) for c in COORDINATES
        ),
        spreads=PER_JOINT,
        told_by="loading and unloading over the same loads in one cycle, whatever time it takes",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        require(self.name, "law", self.law, LAWS)

    @property
    def n_states(self) -> int:
        """Where the last step ended, and h of each element there."""
        return 1 + len(_DEVIATES[self.law])

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The friction, the motion in which it yields, and how far elements differ in that."""
        half = "friction: half the distance between the loading and the unloading branch"
        reversed_in = (
            "motion after a reversal in which the friction comes within 1/e of its new side"
        )
        if self.law == "jenkins":
            reversed_in = "motion from rest in which half of the elements yield"
        tried = TRIED if self.law == "dahl" else (0.0,)
        if self.coordinate in TRANSLATIONS:
            size, mm = _FRICTION[self.coordinate]
            own = (
                Parameter("force", "N", 0.0, 2e3, size, size, False, half, off=0.0),
                Parameter(
                    *("yield_distance", "m", 1e-6, 0.02, mm / 1e3, 0.7, True, reversed_in),
                    tried=tried,
                ),
            )
        else:
            low, deg, high = np.deg2rad([0.05, 1.0, 20.0]).tolist()
            own = (
                Parameter("moment", "N m", 0.0, 20.0, 0.5, 0.5, False, half, off=0.0),
                Parameter(
                    "yield_angle", "rad", low, high, deg, 0.7, True, reversed_in, tried=tried
                ),
            )
        return own if self.law == "dahl" else (*own, _SPREAD)

    def respond_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6); state is q0 and all h0 of each joint."""
        at, step = self._at, self._step(q, parameters, state)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at] = parameters[:, 0] * step.h
        tangent[:, at, at] = parameters[:, 0] * step.by_motion
        return JointResponse(load, tangent)

    def by_parameter_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, P): the friction itself, and its slopes by the yield and the spread."""
        step, strength = self._step(q, parameters, state), parameters[:, :1]
        derivative = np.zeros((*q.shape, parameters.shape[1]))
        derivative[:, self._at, 0] = step.h
        derivative[:, self._at, 1:] = strength * step.by_shapes.mean(axis=1)
        return derivative

    def by_state(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, S): by where the step started and by the friction there."""
        step, strength = self._step(q, parameters, state), parameters[:, :1]
        derivative = np.zeros((*q.shape, self.n_states))
        derivative[:, self._at, 0] = -parameters[:, 0] * step.by_motion
        derivative[:, self._at, 1:] = strength * step.own.by_start / step.own.h.shape[1]
        return derivative

    def advance(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Advance:
        """Where the step ended and the friction of each element there."""
        step, n = self._step(q, parameters, state), self.n_states
        h, moving = step.own.h, np.ones_like(step.own.h)
        if self.law == "jenkins":  # what rounding adds beyond the end is not kept
            h, moving = np.clip(h, -1.0, 1.0), np.where(np.abs(h) < 1.0, 1.0, 0.0)
        by_motion = moving * step.own.by_x / step.yields
        by_coordinate, by_state = np.zeros((len(q), n, 6)), np.zeros((len(q), n, n))
        by_parameter = np.zeros((len(q), n, parameters.shape[1]))
        by_coordinate[:, 0, self._at] = 1.0
        by_coordinate[:, 1:, self._at] = by_motion
        by_parameter[:, 1:, 1:] = moving[:, :, None] * step.by_shapes
        by_state[:, 1:, 0] = -by_motion
        own = np.arange(1, n)
        by_state[:, own, own] = moving * step.own.by_start
        after = np.column_stack([q[:, self._at], h])
        return Advance(after, by_coordinate, by_parameter, by_state)

    @property
    def _at(self) -> int:
        return COORDINATES.index(self.coordinate)

    def _step(self, q: Array, parameters: Array, state: Array) -> "_SliderStep":
        """How the elements follow a step to q (J, 6)."""
        deviates = _DEVIATES[self.law]
        spread = parameters[:, 2:] if self.law == "jenkins" else 0.0
        yields = parameters[:, 1:2] * np.exp(spread * deviates)
        x = (q[:, self._at, None] - state[:, :1]) / yields
        law = jenkins if self.law == "jenkins" else dahl
        return _SliderStep(law(state[:, 1:], x), x, yields, parameters[:, 1:2], deviates)


_SPREAD = Parameter(
    "spread",
    "1",
    0.0,
    2.5,
    0.7,
    0.5,
    False,
    "SD of the logarithm of the motions in which elements yield: 0 all at once",
    family=True,
    tried=(0.0,),
)


@dataclass(frozen=True)
class ElementStep:
    """Shares h (J, N), from -1 to 1, of N elements of J joints, and derivatives by x and by h0.

    An element knows h0, at which the step began, and x, how far the joint has moved since over the
    element's own yield. Its step is closed: how finely a way is cut into steps changes little.
    """

    h: Array
    by_x: Array
    by_start: Array


def dahl(start: Array, x: Array) -> ElementStep:
    """``h = s - (s - h0) exp(-|x|)`` with s = sign(x), its corner at x = 0 rounded."""
    rounded = np.hypot(x, ROUNDING)
    kept = np.exp(ROUNDING - rounded)
    h = start * kept - np.sign(x) * np.expm1(-np.abs(x))
    return ElementStep(h, np.exp(-np.abs(x)) - start * kept * x / rounded, kept)


def jenkins(start: Array, x: Array) -> ElementStep:
    """``h = h0 + x`` within ±1: a spring in line with a slider.

    An element that has yielded has another slope on each side of x = 0. There ``min(x, 0)`` is
    rounded to ``(x - sqrt(x^2 + e^2) + e) / 2``, e = `ROUNDING`; h may pass 1 by half of that.
    """
    up, down = 1.0 - start, 1.0 + start
    no_more_up, no_more_down = up < _NONE_LEFT, down < _NONE_LEFT
    rounded = np.hypot(x, ROUNDING)
    size, slope = rounded - ROUNDING, x / rounded
    rising = _room(
        np.where(no_more_down, 0.5 * (size + x), np.maximum(x, 0.0)),
        np.where(no_more_down, 0.5 * (slope + 1.0), x >= 0.0),
        np.where(no_more_up, 0.0, up),
    )
    falling = _room(
        np.where(no_more_up, 0.5 * (size - x), np.maximum(-x, 0.0)),
        np.where(no_more_up, 0.5 * (1.0 - slope), x < 0.0),
        np.where(no_more_down, 0.0, down),
    )
    return ElementStep(
        start + rising[0] - falling[0],
        rising[1] + falling[1],
        1.0 - rising[2] - falling[2],
    )


def _room(x: Array, by_x: Array, room: Array) -> tuple[Array, Array, Array]:
    """``min(x, room)``, rounded, its derivative by the motion, and by the room."""
    left = room > 0.0
    t = np.where(left, x / np.where(left, room, 1.0), 2.0)
    over, slope = ramp(t - 1.0, CORNER)
    share, kept = t - over, 1.0 - slope
    by_room = np.where(left, share - t * kept, x > 0.0)
    return np.where(left, room * share, 0.0), np.where(left, kept * by_x, 0.0), by_room


@dataclass(frozen=True)
class _SliderStep:
    """Elements (J, N) after a step; x is how far they were moved over their yields."""

    own: ElementStep
    x: Array
    yields: Array
    middle: Array
    deviates: Array

    @property
    def h(self) -> Array:
        """(J,) what all of them hold together, their mean."""
        return np.asarray(self.own.h.mean(axis=1))

    @property
    def by_motion(self) -> Array:
        """(J,) its derivative by the motion."""
        return np.asarray((self.own.by_x / self.yields).mean(axis=1))

    @property
    def by_shapes(self) -> Array:
        """(J, N, 1 or 2) of each h by the yield in the middle, and by the spread."""
        by_log = -self.own.by_x * self.x
        if len(self.deviates) == 1:
            return (by_log / self.middle)[:, :, None]
        return np.stack([by_log / self.middle, by_log * self.deviates], axis=2)

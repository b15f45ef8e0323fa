"""Hysteresis: dry friction in a joint, so that loading and unloading branches differ.

The law of Dahl (1968, "A solid friction model", TOR-0158(3107-18)-1) with exponent 1 in each
coordinate: ``dh/dq = (1 - h sign(dq)) / yield_angle``, load ``moment * h``. It knows no time.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Advance, Array, JointResponse, Kind, Parameter
from spinepipe.effects.registry import PER_JOINT, Trial, register
from spinepipe.units import COORDINATES, ROTATIONS

ROUNDING = 1e-4
"""Share of the yield angle over which the corner at the start of a step is rounded."""

_MOMENT = Parameter(
    name="moment",
    unit="N m",
    low=0.0,
    high=20.0,
    default=0.5,
    prior_scale=0.5,
    logarithmic=False,
    meaning="friction: half the distance between the loading and the unloading branch",
    off=0.0,
)
_YIELD_ANGLE = Parameter(
    name="yield_angle",
    unit="rad",
    low=float(np.deg2rad(0.05)),
    high=float(np.deg2rad(20.0)),
    default=float(np.deg2rad(1.0)),
    prior_scale=0.7,
    logarithmic=True,
    meaning="rotation after a reversal in which the friction comes within 1/e of its new side",
)


@register("hysteresis")
@dataclass(frozen=True)
class Hysteresis:
    """Holding moment ``moment h`` of friction that follows the rotation, by steps in closed form.

    From q0 with h0, where the last step ended: ``h = s - (s - h0) exp(-|q - q0| / yield_angle)``
    with ``s = sign(q - q0)``, which is ``h0 u + s (1 - u)``. A joint that turns on and one that
    turns back meet different slopes at q0. There ``|q - q0|`` of the first term is rounded to
    ``sqrt(d^2 + e^2) - e``, e = `ROUNDING` of the yield angle: the slope at q0 is then the mean of
    both sides and a step without a change of load has a derivative. h may pass 1 by a share e / d
    when steps turn the joint by d each. Off: moment 0.

    Options: ``coordinate``, the rotation it acts on.
    """

    coordinate: str = "extension"
    name: ClassVar[str] = "hysteresis"
    kind: ClassVar[Kind] = Kind.PATH
    per_joint: ClassVar[bool] = True
    n_states: ClassVar[int] = 2
    parameters: ClassVar[tuple[Parameter, ...]] = (_MOMENT, _YIELD_ANGLE)
    trial: ClassVar[Trial] = Trial(
        variants=tuple({"coordinate": rotation} for rotation in ROTATIONS),
        spreads=PER_JOINT,
        told_by="loading and unloading over the same loads in one cycle, whatever time it takes",
    )

    def __post_init__(self) -> None:
        if self.coordinate not in ROTATIONS:
            raise ValueError(f"hysteresis: coordinate {self.coordinate!r}; allowed: {ROTATIONS}")

    @property
    def _at(self) -> int:
        return COORDINATES.index(self.coordinate)

    def respond_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6); state is (q0, h0) of each joint."""
        at, friction = self._at, _friction(q[:, self._at], parameters, state)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at] = parameters[:, 0] * friction.h
        tangent[:, at, at] = parameters[:, 0] * friction.by_angle
        return JointResponse(load, tangent)

    def by_parameter_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, 2): the friction itself, and its slope by the yield angle."""
        friction = _friction(q[:, self._at], parameters, state)
        derivative = np.zeros((*q.shape, 2))
        derivative[:, self._at, 0] = friction.h
        derivative[:, self._at, 1] = parameters[:, 0] * friction.by_yield
        return derivative

    def by_state(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, 2): by where the step started and by the friction there."""
        friction = _friction(q[:, self._at], parameters, state)
        derivative = np.zeros((*q.shape, 2))
        derivative[:, self._at, 0] = -parameters[:, 0] * friction.by_angle
        derivative[:, self._at, 1] = parameters[:, 0] * friction.by_start
        return derivative

    def advance(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Advance:
        """Where the step ended and the friction there."""
        friction = _friction(q[:, self._at], parameters, state)
        by_coordinate, by_parameter = np.zeros((len(q), 2, 6)), np.zeros((len(q), 2, 2))
        by_state = np.zeros((len(q), 2, 2))
        by_coordinate[:, 0, self._at] = 1.0
        by_coordinate[:, 1, self._at] = friction.by_angle
        by_parameter[:, 1, 1] = friction.by_yield
        by_state[:, 1, 0] = -friction.by_angle
        by_state[:, 1, 1] = friction.by_start
        after = np.column_stack([q[:, self._at], friction.h])
        return Advance(after, by_coordinate, by_parameter, by_state)


@dataclass(frozen=True)
class _Friction:
    """h (J,) and its derivatives by the angle, the yield angle and h at the step's start."""

    h: Array
    by_angle: Array
    by_yield: Array
    by_start: Array


def _friction(angle: Array, parameters: Array, state: Array) -> _Friction:
    """Friction at an angle (J,); all of it depends on the angle turned over the yield angle."""
    yield_angle, start = parameters[:, 1], state[:, 1]
    turned = (angle - state[:, 0]) / yield_angle
    rounded = np.hypot(turned, ROUNDING)
    kept = np.exp(ROUNDING - rounded)
    side = np.sign(turned)
    h = start * kept - side * np.expm1(-np.abs(turned))
    slope = np.exp(-np.abs(turned)) - start * kept * turned / rounded
    return _Friction(h, slope / yield_angle, -turned * slope / yield_angle, kept)

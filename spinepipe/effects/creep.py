"""Creep: the motion drifts on while the load is constant, since a share of what holds relaxes."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Advance, Array, JointResponse, Kind, Parameter
from spinepipe.effects.registry import PER_JOINT, Trial, register
from spinepipe.units import COORDINATES, ROTATIONS

_FRACTION = Parameter(
    name="fraction",
    unit="1",
    low=0.0,
    high=0.9,
    default=0.2,
    prior_scale=0.2,
    logarithmic=False,
    meaning="share of the joint's stiffness that is lost when a load is held for long",
    off=0.0,
)
_TIME = Parameter(
    name="time",
    unit="s",
    low=0.01,
    high=1e5,
    default=60.0,
    prior_scale=1.0,
    logarithmic=True,
    meaning="time in which all but 1/e of that share is lost at constant motion",
)


LOADS = ("held", "ramped")


@register("creep")
@dataclass(frozen=True)
class Creep:
    """Holding load ``-fraction z``; z lags behind the load of the laws before, ``carried``.

    ``dz/dt = (carried - z) / time``: with a spring before it this is the standard linear solid,
    whose stiffness is the spring's at once and ``1 - fraction`` of it in the end. z follows in
    closed form to the end of a load step, x = seconds / time. Held: the load comes at once and
    stays, ``carried - fraction z`` is constant, and
    ``z (1 - fraction e) = (1 - fraction) e z0 + (1 - e) carried`` with e = exp(-(1 - fraction) x).
    Ramped: carried grows in a straight line, and ``z = exp(-x) z0 + a carried0 + b carried`` with
    b = 1 - (1 - exp(-x)) / x and a = 1 - exp(-x) - b. A step that takes no time moves nothing:
    tests that record no time do not creep. Off: fraction 0.

    Options: ``coordinate``, the one whose load relaxes; ``load``, how it is applied in a step,
    ``held`` or ``ramped``.
    """

    coordinate: str = "extension"
    load: str = "held"
    name: ClassVar[str] = "creep"
    kind: ClassVar[Kind] = Kind.PATH
    per_joint: ClassVar[bool] = True
    n_states: ClassVar[int] = 2
    parameters: ClassVar[tuple[Parameter, ...]] = (_FRACTION, _TIME)
    trial: ClassVar[Trial] = Trial(
        variants=tuple({"coordinate": rotation} for rotation in ROTATIONS),
        spreads=PER_JOINT,
        told_by="recorded times, and a load that is held over several readings",
    )

    def __post_init__(self) -> None:
        if self.coordinate not in COORDINATES:
            raise ValueError(f"creep: coordinate {self.coordinate!r}; allowed: {COORDINATES}")
        if self.load not in LOADS:
            raise ValueError(f"creep: load {self.load!r}; allowed: {LOADS}")

    @property
    def _at(self) -> int:
        return COORDINATES.index(self.coordinate)

    def _lag(
        self, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> "_Lag":
        fraction, time = parameters.T
        here = carried[:, self._at]
        if self.load == "ramped":
            return _ramped(time, state, seconds, here)
        return _held(fraction, time, state, seconds, here)

    def respond_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> JointResponse:
        """Load (J, 6); state is (z, carried) of each joint at the end of the last step."""
        at, lag = self._at, self._lag(parameters, state, seconds, carried)
        load, by_carried = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at] = -parameters[:, 0] * lag.z
        by_carried[:, at, at] = -parameters[:, 0] * lag.by_carried
        return JointResponse(load, np.zeros_like(by_carried), by_carried)

    def by_parameter_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, 2): what lags, and its slope by the time."""
        lag = self._lag(parameters, state, seconds, carried)
        derivative = np.zeros((*q.shape, 2))
        derivative[:, self._at, 0] = -lag.z - parameters[:, 0] * lag.by_fraction
        derivative[:, self._at, 1] = -parameters[:, 0] * lag.by_time
        return derivative

    def by_state(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, 2): by z and carried at the step's start."""
        lag = self._lag(parameters, state, seconds, carried)
        derivative = np.zeros((*q.shape, 2))
        derivative[:, self._at] = -parameters[:, :1] * lag.by_state
        return derivative

    def advance(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Advance:
        """z and carried at the end of the step."""
        here = carried[:, self._at]
        lag = self._lag(parameters, state, seconds, carried)
        by_parameter, by_state = np.zeros((2, len(q), 2, 2))
        by_carried = np.zeros((len(q), 2, 6))
        by_parameter[:, 0] = np.column_stack([lag.by_fraction, lag.by_time])
        by_state[:, 0] = lag.by_state
        by_carried[:, 0, self._at] = lag.by_carried
        by_carried[:, 1, self._at] = 1.0
        after = np.column_stack([lag.z, here])
        return Advance(after, np.zeros_like(by_carried), by_parameter, by_state, by_carried)


@dataclass(frozen=True)
class _Lag:
    """z (J,) at the end of a step and its derivatives; that by the state is (J, 2)."""

    z: Array
    by_carried: Array
    by_state: Array
    by_fraction: Array
    by_time: Array


def _held(
    fraction: Array, time: Array, state: Array, seconds: float | Array, carried: Array
) -> _Lag:
    """What follows carried (J,) while the load is constant."""
    x, z0 = seconds / time, state[:, 0]
    kept = np.exp(-(1.0 - fraction) * x)
    whole = 1.0 - fraction * kept
    z = ((1.0 - fraction) * kept * z0 + (1.0 - kept) * carried) / whole
    by_kept = ((1.0 - fraction) * z0 - carried + fraction * z) / whole
    by_fraction = kept * (z - z0) / whole + by_kept * kept * x
    by_state = np.column_stack([(1.0 - fraction) * kept / whole, np.zeros_like(z0)])
    by_time = by_kept * kept * (1.0 - fraction) * x / time
    return _Lag(z, (1.0 - kept) / whole, by_state, by_fraction, by_time)


def _ramped(time: Array, state: Array, seconds: float | Array, carried: Array) -> _Lag:
    """What follows a straight line to carried (J,) with a time constant."""
    x = seconds / time
    kept, mean, mean_slope = np.exp(-x), _mean(x), _mean_slope(x)
    z0, carried0 = state.T
    z = kept * z0 + (mean - kept) * carried0 + (1.0 - mean) * carried
    by_x = kept * (carried0 - z0) + mean_slope * (carried0 - carried)
    by_state = np.column_stack([kept, mean - kept])
    return _Lag(z, 1.0 - mean, by_state, np.zeros_like(z), -x / time * by_x)


def _mean(x: Array) -> Array:
    """Mean of exp(-t) for t from 0 to x."""
    safe = np.where(x > 0.0, x, 1.0)
    return np.where(x > 0.0, -np.expm1(-safe) / safe, 1.0)


def _mean_slope(x: Array) -> Array:
    """Derivative of `_mean`; its series where the closed form would cancel."""
    large = np.maximum(x, _SERIES)
    series = -0.5 + x / 3.0 - x**2 / 8.0 + x**3 / 30.0 - x**4 / 144.0
    return np.where(x > _SERIES, (np.exp(-large) - _mean(large)) / large, series)


_SERIES = 1e-2
"""Below this the terms left out of the series are below 1e-12."""

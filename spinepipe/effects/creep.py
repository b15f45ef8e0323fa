"""Creep: the motion drifts on while the load is constant, since a share of what holds relaxes.

Where the law of `Creep` is from, told for linear laws before it, K in all. They are a spring in
line with five elements, each a spring beside a dashpot. The elements have moved by q_c, so the
spring carries M = K (q - q_c), and ``carried``, what the laws hold at q, is K q = M + K q_c. Of
K q_c element i makes f / (1 - f) z_i / 5; its z_i, a load (N or N m), follows M with its
retardation time.

Two kinds of time: a retardation time tells how motion creeps under a held load. Where motion is
held, the load relaxes faster, with one element by the factor 1 - f; the parameter ``time`` is that.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Advance, Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.units import COORDINATES

ELEMENTS = 5
"""Retardation times, with equal parts: over three decades they are less than a decade apart.

Three decades is what the largest spread, 2.5, makes of them.
"""

# where their natural logarithms lie, evenly, with an SD of one: -1.41 to 1.41
_DEVIATES = np.linspace(-1.0, 1.0, ELEMENTS)
_DEVIATES = _DEVIATES / np.std(_DEVIATES)

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
_SPREAD = Parameter(
    name="spread",
    unit="1",
    low=0.0,
    high=2.5,
    default=0.5,
    prior_scale=0.75,
    logarithmic=False,
    meaning="SD of the logarithm of the times: 0 is one time, 2 nearly even over decades",
    family=True,
    tried=(0.0,),
    unsaid=0.0,
)

LOADS = ("held", "ramped")
"""How M gets from the last step's value to this one's: at once, or in a straight line."""


@register("creep")
@dataclass(frozen=True)
class Creep:
    """Five Kelvin-Voigt elements in line with what the laws before hold, ``carried``.

    At once the joint has their stiffness, in the end ``1 - fraction`` of it. The whole load, M, is
    carried less what creep takes: ``carried = M + f / (1 - f) sum_i z_i / 5`` with the fraction f
    and ``dz_i/dt = (M - z_i) / time_i``, the times around ``time / (1 - f)`` with ``spread`` as the
    SD of their logarithm. Spread 0 is the standard linear solid (one element, relaxing in
    ``time``); a wide one drifts by like amounts in each decade, as logarithmic and stretched creep
    do (Prony series; Findley 1976, "Creep and relaxation of nonlinear viscoelastic materials").

    z follows in closed form to the end of a load step. Held: the load comes at once and stays.
    Ramped: it grows in a straight line. A step that takes no time moves nothing: tests that record
    no time do not creep. Off: fraction 0.

    Options: ``coordinate``, the one whose load relaxes; ``load``, how it is applied in a step,
    ``held`` or ``ramped``.
    """

    coordinate: str = "extension"
    load: str = "held"
    name: ClassVar[str] = "creep"
    kind: ClassVar[EffectKind] = EffectKind.PATH
    per_joint: ClassVar[bool] = True
    n_states: ClassVar[int] = ELEMENTS + 1
    parameters: ClassVar[tuple[Parameter, ...]] = (_FRACTION, _TIME, _SPREAD)
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c} for c in COORDINATES),
        spreads=PER_JOINT,
        told_by="recorded times, and a load that is held over several readings",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        require(self.name, "load", self.load, LOADS)

    @property
    def _at(self) -> int:
        return COORDINATES.index(self.coordinate)

    def _step(
        self, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> "_CreepStep":
        """The step of each joint on the one coordinate, from the state that the last step left."""
        here, ramped = carried[:, self._at], self.load == "ramped"
        return _CreepStep(parameters, state, np.asarray(seconds, dtype=float), here, ramped)

    def respond_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> JointResponse:
        """Load (J, 6) and its derivatives.

        The load is M less ``carried``, what creep takes off, so it is against the laws before it.

        Parameters
        ----------
        state : (J, 6) at the end of the last step: the five z, then M, N or N m.
        seconds : duration of this step. carried : (J, 6) what the laws before hold at q.
        """
        at, step = self._at, self._step(parameters, state, seconds, carried)
        load, by_carried = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at] = step.whole - carried[:, at]
        by_carried[:, at, at] = step.whole_by_carried - 1.0
        return JointResponse(load, np.zeros_like(by_carried), by_carried)

    def by_parameter_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, 3) derivative of the load by fraction, time and spread."""
        derivative = np.zeros((*q.shape, 3))
        step = self._step(parameters, state, seconds, carried)
        derivative[:, self._at] = step.whole_by_parameter
        return derivative

    def by_state(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, S) derivative of the load by all z and M at the step's start."""
        derivative = np.zeros((*q.shape, self.n_states))
        step = self._step(parameters, state, seconds, carried)
        derivative[:, self._at] = step.whole_by_state
        return derivative

    def advance(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Advance:
        """All z and M at the end of the step.

        Derivatives by the chain rule: each z hangs on its inputs at fixed M, and on M.
        """
        step = self._step(parameters, state, seconds, carried)
        towards = np.column_stack([step.now, np.ones(len(q))])  # (J, S) each state by M
        by_carried = np.zeros((len(q), self.n_states, 6))
        by_carried[:, :, self._at] = towards * step.whole_by_carried[:, None]
        by_parameter = towards[:, :, None] * step.whole_by_parameter[:, None, :]
        by_parameter[:, :-1] += step.z_by_parameter
        by_state = towards[:, :, None] * step.whole_by_state[:, None, :]
        own = np.arange(ELEMENTS)
        by_state[:, own, own] += step.kept
        by_state[:, :-1, -1] += step.before
        after = np.column_stack([step.z, step.whole])
        return Advance(after, np.zeros_like(by_carried), by_parameter, by_state, by_carried)


class _CreepStep:
    """z (J, N) and M (J,) at the end of a step, and their derivatives.

    ``z = kept z0 + before M0 + now M`` with kept = exp(-x), x = seconds / time_i; held: before = 0.
    Ramped: now = 1 - mean and before = mean - kept, with the mean of exp(-t) for t from 0 to x. Put
    into ``carried = M + lost mean(z)``, this gives M; 0 marks the start of the step.

    Attributes
    ----------
    kept, before, now : (J, N). z : (J, N). whole : (J,) M.
    whole_by_carried : (J,). whole_by_state : (J, N + 1). whole_by_parameter : (J, 3).
    z_by_parameter : (J, N, 3) at fixed M.
    """

    def __init__(
        self, parameters: Array, state: Array, seconds: Array, carried: Array, ramped: bool
    ) -> None:
        fraction, time, spread = parameters.T
        lost = fraction / (1.0 - fraction)
        # seconds over each retardation time, which is time / (1 - f) times exp(spread deviate)
        x = (seconds * (1.0 - fraction) / time)[:, None] * np.exp(-spread[:, None] * _DEVIATES)
        self.kept = np.exp(-x)
        mean = _mean(x) if ramped else self.kept
        self.before, self.now = mean - self.kept, 1.0 - mean
        z0, whole0 = state[:, :-1], state[:, -1:]
        rest = self.kept * z0 + self.before * whole0
        self.whole_by_carried = 1.0 / (1.0 + lost * self.now.mean(axis=1))
        self.whole = (carried - lost * rest.mean(axis=1)) * self.whole_by_carried
        self.z = rest + self.now * self.whole[:, None]

        moved = -self.whole_by_carried * lost  # of M by the mean of z at fixed M
        by_z0 = np.column_stack([self.kept, self.before.sum(axis=1)]) / ELEMENTS
        self.whole_by_state = moved[:, None] * by_z0
        slope = _mean_slope(x) if ramped else -self.kept
        # of z by x at fixed M; then x by ln x, and ln x by fraction, time and spread
        by_x = -self.kept * (z0 - whole0) + slope * (whole0 - self.whole[:, None])
        by_logs = [-1.0 / (1.0 - fraction), -1.0 / time]
        columns = [by_x * x * one[:, None] for one in by_logs] + [by_x * x * -_DEVIATES]
        self.z_by_parameter = np.stack(columns, axis=2)
        self.whole_by_parameter = moved[:, None] * self.z_by_parameter.mean(axis=1)
        # the fraction acts through f / (1 - f) as well, whose derivative is 1 / (1 - f)^2
        by_lost = -self.whole_by_carried * self.z.mean(axis=1)
        self.whole_by_parameter[:, 0] += by_lost / (1.0 - fraction) ** 2


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

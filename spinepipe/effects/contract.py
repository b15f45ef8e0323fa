"""The contract of an effect: what a named component of the model must be able to say.

An effect has a name, declared parameters and one of five kinds. Each kind is a protocol below; an
effect is a frozen dataclass that satisfies one of them, in one file, entered in the registry.
Everything is vectorised over the joints in the effect's scope: J joints, P parameters, S states.

Signs. A joint law returns the generalised load that *holds* the joint at q (a spring of stiffness
k returns +k q, conjugate to each coordinate). A load effect returns the generalised load it
*applies*; equilibrium is ``holding loads - applied loads = 0``.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from spinepipe.frames import Pose

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class EffectKind(StrEnum):
    """What an effect acts on."""

    JOINT_LAW = "joint law"
    LOAD = "load"
    GEOMETRY = "geometry"
    PATH = "path"
    MEASUREMENT = "measurement"


TRIED = (-1.0, 0.0, 1.0)
"""Prior SDs from its default at which a search tries a parameter of shape before it is fitted."""


@dataclass(frozen=True)
class Parameter:
    """One declared parameter of an effect, in SI units.

    Attributes
    ----------
    low, high : bounds that a model file and a fit must respect.
    default : value at which the effect is usually started.
    prior_scale : one prior SD; of the natural logarithm when ``logarithmic``.
    logarithmic : whether fits work with the logarithm (positive, spread over decades).
    off : value of a strength at which the effect does nothing, to first order in which it acts;
        None for parameters of shape, which say nothing while the strengths are off.
    family : whether it spans published forms of the same physics: both ends are forms of their own,
        and a fit that ends there is as good as any.
    tried : of a shape, prior SDs from its default at which a search tries it before it is fitted.
    unsaid : what a model file means that does not name it, where that is not the default.
    """

    name: str
    unit: str
    low: float
    high: float
    default: float
    prior_scale: float
    logarithmic: bool
    meaning: str
    off: float | None = None
    family: bool = False
    tried: tuple[float, ...] = TRIED
    unsaid: float | None = None

    @property
    def in_a_file(self) -> float:
        """Value where a model file does not name the parameter."""
        return self.default if self.unsaid is None else self.unsaid

    @property
    def side(self) -> float:
        """The side of off that bounds allow: 1 above, -1 below, 0 both or no strength at all."""
        if self.off is None:
            return 0.0
        return 1.0 if self.low >= self.off else -1.0 if self.high <= self.off else 0.0


@dataclass(frozen=True)
class JointResponse:
    """Generalised load of a law and its derivatives at fixed parameters.

    Attributes
    ----------
    load : (J, 6) N and N m.
    tangent : (J, 6, 6) derivative of the load by the joint's own coordinates.
    by_carried : (J, 6, 6) derivative by the load of the laws before it, or None for none.
    """

    load: Array
    tangent: Array
    by_carried: Array | None = None


@dataclass(frozen=True)
class Advance:
    """State (J, S) after a load step and its derivatives.

    Attributes
    ----------
    by_coordinate, by_parameter, by_state : (J, S, 6), (J, S, P), (J, S, S).
    by_carried : (J, S, 6) derivative by the load of the laws before it, or None for none.
    """

    state: Array
    by_coordinate: Array
    by_parameter: Array
    by_state: Array
    by_carried: Array | None = None


@dataclass(frozen=True)
class Placement:
    """Coordinates at which the joint laws act, as a function of the joint's coordinates.

    Attributes
    ----------
    q : (J, 6) coordinates handed to the laws (m, rad).
    by_coordinate : (J, 6, 6) first derivative.
    by_coordinates : (J, 6, 6, 6) second derivative, ``[j, k, a, b]`` of output k by inputs a, b.
    """

    q: Array
    by_coordinate: Array
    by_coordinates: Array


@dataclass(frozen=True)
class PlacementByParameter:
    """Derivatives of a placement by its parameters: (J, 6, P) and (J, 6, 6, P)."""

    q: Array
    by_coordinate: Array


@dataclass(frozen=True)
class AppliedLoad:
    """Generalised load (n,) an effect applies and its tangent (n, n) by the coordinates."""

    load: Array
    tangent: Array


@dataclass(frozen=True)
class Observation:
    """Observed coordinates (J, 6) and their derivative (J, 6, 6) by the true ones.

    ``by_above``, ``by_below`` : (J, 6, 6) by those of the joint above and below, or None for none.
    """

    q: Array
    by_coordinate: Array
    by_above: Array | None = None
    by_below: Array | None = None


@dataclass(frozen=True)
class MeasurementContext:
    """What readings of joints may hang on besides their own motion.

    Attributes
    ----------
    above, below : (J, 6) coordinates of the joint above and below each; zero where there is none.
    passed : (J,) share of the test that has passed: of its time, else of its load steps.
    """

    above: Array
    below: Array
    passed: Array


@dataclass(frozen=True)
class Neutral:
    """Where a chain is in its neutral pose, m, ground; of many chains with axes (...) in front.

    Attributes
    ----------
    rotations, origins : (..., J, 3, 3) and (..., J, 3) of the joint frames.
    centres_of_mass : (..., J, 3) of the vertebrae.
    """

    rotations: Array
    origins: Array
    centres_of_mass: Array

    def part(self, chosen: Indices) -> "Neutral":
        """Some of many chains."""
        return Neutral(self.rotations[chosen], self.origins[chosen], self.centres_of_mass[chosen])


class Motion(Protocol):
    """The pose of the whole chain, as load effects may ask about it; n = 6 x joints."""

    @property
    def axes(self) -> Array:
        """(n, 3) axis of each rotational coordinate in ground, zero for translations."""

    @property
    def neutral(self) -> Neutral:
        """Where the chain is in its neutral pose."""

    def displacement(self, body: int) -> Pose:
        """Displacement of a body from the neutral pose, in ground; body -1 is ground itself."""

    def velocities(self, body: int, point: Array) -> Array:
        """(n, 3) velocity in ground of a body's point (neutral position, ground, m) by rate."""

    def angular(self, body: int) -> Array:
        """(n, 3) angular velocity in ground of a body by coordinate rate."""

    def wrench(self, body: int, point: Array, force: Array, moment: Array) -> AppliedLoad:
        """Generalised load of a ground-fixed force (N) and moment (N m) on a body."""


@dataclass(frozen=True)
class Wrench:
    """A ground-fixed force (3,) N at a point (3,) m (ground, neutral), and a moment (3,) N m."""

    body: int
    point: Array
    force: Array
    moment: Array


class Effect(Protocol):
    """What every effect declares. ``per_joint``: one parameter row per joint in scope, or one."""

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> EffectKind: ...
    @property
    def per_joint(self) -> bool: ...
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...


@runtime_checkable
class JointLaw(Effect, Protocol):
    """Load and tangent of joints as a function of their own coordinates."""

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Response at q (J, 6) with parameters (J, P); ``carried`` (J, 6): laws before this one."""

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, P) derivative of the load by the parameters at fixed q and carried load."""


STRAIGHT_OVER = 0.05
"""rad, 1 cm counts as 1 rad: within a motion of this size a law that does not say otherwise, by an
attribute ``straight_over``, is not softer than at both ends. Laws that are linear have no end."""


def straight_over(effect: Effect) -> float:
    """How often along a step the tangent of a law or a geometry effect has to be looked at, rad."""
    return float(getattr(effect, "straight_over", STRAIGHT_OVER))


@runtime_checkable
class LoadEffect(Effect, Protocol):
    """A load on the chain besides those listed in the cohort.

    ``joints`` are the joints in scope; the vertebra a joint carries has the same index.
    """

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Load applied at this pose, given the step's listed wrenches and parameters (R, P)."""

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, R, P) derivative of the applied load by the parameters at fixed pose."""


@runtime_checkable
class AcrossJoints(LoadEffect, Protocol):
    """A load effect between the two vertebrae of each joint, which no other joint changes.

    Arrays have any axes (...) in front; parameters (..., P).
    """

    def across(self, q: Array, neutral: Neutral, parameters: Array) -> JointResponse:
        """What holds each joint at q (..., J, 6) against it, and the tangents (..., J, 6, 6)."""

    def across_by_parameter(self, q: Array, neutral: Neutral, parameters: Array) -> Array:
        """(..., J, 6, P) derivative of what holds each joint."""


@runtime_checkable
class GeometryEffect(Effect, Protocol):
    """Where in a joint its laws act."""

    def place(self, q: Array, parameters: Array) -> Placement:
        """Coordinates seen by the laws, with first and second derivatives."""

    def by_parameter(self, q: Array, parameters: Array) -> PlacementByParameter:
        """Derivatives of the placement by the parameters at fixed q."""


@runtime_checkable
class PathLaw(Effect, Protocol):
    """A joint law with an internal state that advances once per load step.

    ``seconds`` is the duration of the step; of each joint, (J,), where joints of several tests are
    handed over at once.
    """

    @property
    def n_states(self) -> int: ...

    def respond_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> JointResponse:
        """Response in a step of that duration with the state (J, S) as the last step left it."""

    def by_parameter_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, P) derivative of the load by the parameters at fixed q and state."""

    def by_state(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Array:
        """(J, 6, S) derivative of the load by the state."""

    def advance(
        self, q: Array, parameters: Array, state: Array, seconds: float | Array, carried: Array
    ) -> Advance:
        """State after a step of ``seconds`` that ended at q with the laws before it at carried."""


@runtime_checkable
class MeasurementEffect(Effect, Protocol):
    """What the instruments report for a true motion."""

    def observe(self, q: Array, parameters: Array) -> Observation:
        """Reported coordinates (J, 6) for true ones."""

    def by_parameter(self, q: Array, parameters: Array) -> Array:
        """(J, 6, P) derivative of the reported coordinates by the parameters."""


@runtime_checkable
class MeasurementBeside(Effect, Protocol):
    """Instruments that follow the neighbouring joints, or drift while a test goes on."""

    def observe_beside(
        self, q: Array, parameters: Array, beside: MeasurementContext
    ) -> Observation:
        """Reported coordinates (J, 6) for true ones, and what stands beside them."""

    def by_parameter_beside(self, q: Array, parameters: Array, beside: MeasurementContext) -> Array:
        """(J, 6, P) derivative of the reported coordinates by the parameters."""

"""A model under one test, ready to be solved: residual and exact tangent at any pose.

What acts on the chain at one moment is a `Loading`: the listed wrenches, how much of the weight,
and where a rig fixes joint coordinates. The balance of such a coordinate is q = value, whatever
load that takes; that load, the reaction, is what its balance misses then.
"""

from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast

import numpy as np

from spinepipe.effects import (
    AppliedLoad,
    EffectKind,
    GeometryEffect,
    JointLaw,
    LoadEffect,
    PathLaw,
    Wrench,
)
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics.joint_forces import (
    ActiveLaw,
    ActivePath,
    JointForceDerivatives,
    JointForces,
    Law,
    States,
    assemble_joint_forces,
    differentiate_joint_forces,
)
from spinepipe.statics.joint_kinematics import Active, JointKinematics, place
from spinepipe.statics.measurement_model import Instrument
from spinepipe.statics.motion import ChainMotion, cross_matrix, dead_tangent
from spinepipe.world import Chain


@dataclass(frozen=True)
class Loading:
    """Wrenches at a case's slots and the share of gravity and load effects that is on.

    Attributes
    ----------
    forces, moments : (S, 3) N and N m, fixed in ground.
    share : 0 (weightless, load effects off) to 1.
    fixed : (k,) m and rad, value of each coordinate that the case fixes.
    """

    forces: Array
    moments: Array
    share: float
    fixed: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def key(self) -> bytes:
        """The same for the same loading of the same slots."""
        numbers = (self.forces, self.moments, np.float64(self.share), self.fixed)
        return b"".join(one.tobytes() for one in numbers)

    def towards(self, other: "Loading", fraction: float) -> "Loading":
        """The loading that far on the straight way to another."""
        return Loading(
            self.forces + fraction * (other.forces - self.forces),
            self.moments + fraction * (other.moments - self.moments),
            self.share + fraction * (other.share - self.share),
            self.fixed + fraction * (other.fixed - self.fixed),
        )


@dataclass(frozen=True)
class Slots:
    """The places at which a case loads the chain: body index and neutral point (3,) m in ground."""

    places: tuple[tuple[int, tuple[float, float, float]], ...]

    @classmethod
    def of(cls, case: LoadCase) -> "Slots":
        """Slots in order of first appearance in the case."""
        places = (
            (wrench.body, tuple(wrench.point.tolist()))
            for step in case.steps
            for wrench in step.wrenches
        )
        return cls(tuple(dict.fromkeys(places)))

    def unloaded(self) -> Loading:
        """No wrench and no weight: the neutral pose."""
        nothing = np.zeros((len(self.places), 3))
        return Loading(nothing, nothing, 0.0)

    def loading(self, wrenches: tuple[Wrench, ...]) -> Loading:
        """Wrenches of one step, summed per slot, with full weight."""
        forces, moments = np.zeros((2, len(self.places), 3))
        for wrench in wrenches:
            slot = self.places.index((wrench.body, tuple(wrench.point.tolist())))
            forces[slot] += wrench.force
            moments[slot] += wrench.moment
        return Loading(forces, moments, 1.0)

    def wrenches(self, loading: Loading) -> tuple[Wrench, ...]:
        """The loading as wrenches, for load effects that act on them."""
        return tuple(
            Wrench(body, np.array(point), force, moment)
            for (body, point), force, moment in zip(
                self.places, loading.forces, loading.moments, strict=True
            )
        )


@dataclass(frozen=True)
class Balance:
    """Residual r (n,), what the joints hold less what is applied, and K = dr/dq (n, n)."""

    residual: Array
    tangent: Array


class System:
    """Effects of a model that are in scope of a case, on a loaded chain."""

    def __init__(self, chain: Chain, model: SpineModel, case: LoadCase) -> None:
        self.chain, self.model, self.case = chain, model, case
        self.slots = Slots.of(case)
        self.local_points = [chain.local_point(b, np.array(p)) for b, p in self.slots.places]
        self.geometry: list[Active[GeometryEffect]] = []
        self.laws: list[Law] = []
        self.load_effects: list[Active[LoadEffect]] = []
        self.measurement: list[Active[Instrument]] = []
        for index, scoped in enumerate(model.effects):
            if not scoped.in_scope(case.test):
                continue
            effect = scoped.effect
            shared = (index, np.array(scoped.joints), scoped.values, effect.per_joint)
            match effect.kind:
                case EffectKind.JOINT_LAW:
                    self.laws.append(ActiveLaw(cast(JointLaw, effect), *shared))
                case EffectKind.PATH:
                    self.laws.append(ActivePath(cast(PathLaw, effect), *shared))
                case EffectKind.GEOMETRY:
                    self.geometry.append(Active(cast(GeometryEffect, effect), *shared))
                case EffectKind.LOAD:
                    self.load_effects.append(Active(cast(LoadEffect, effect), *shared))
                case EffectKind.MEASUREMENT:
                    self.measurement.append(Active(cast(Instrument, effect), *shared))
                case _:
                    raise TypeError(f"{effect.name}: {effect.kind!r} is not a kind of effect")
        # (J, 6, 6) rows and columns of the diagonal blocks of an (n, n) matrix
        at = np.arange(6 * model.n_joints).reshape(-1, 6)
        shape = (model.n_joints, 6, 6)
        self._blocks = np.broadcast_to(at[:, :, None], shape), np.broadcast_to(at[:, None], shape)
        self._heavy = bool(np.any(model.gravity))
        self.fixed: Indices = np.array(case.fixed, dtype=np.int64)

    def with_model(self, model: SpineModel) -> "System":
        """The same chain, case and effects with the parameter values of another model."""
        other = copy(self)
        other.model = model
        other.geometry = [_renewed(active, model) for active in self.geometry]
        other.laws = [_renewed(active, model) for active in self.laws]
        other.load_effects = [_renewed(active, model) for active in self.load_effects]
        other.measurement = [_renewed(active, model) for active in self.measurement]
        return other

    @property
    def paths(self) -> list[ActivePath]:
        """The laws with an internal state."""
        return [law for law in self.laws if isinstance(law, ActivePath)]

    def initial_states(self) -> States:
        """States (J, S) of all path laws before the first step: zero."""
        return States(
            {law.index: np.zeros((len(law.joints), law.effect.n_states)) for law in self.paths}
        )

    @property
    def free(self) -> Indices | None:
        """Places of the coordinates that no rig fixes; None for all."""
        if not len(self.fixed):
            return None
        return np.setdiff1d(np.arange(self.chain.n), self.fixed)

    def unloaded(self) -> Loading:
        """No wrench, no weight, and fixed coordinates where they are in the neutral pose."""
        return replace(self.slots.unloaded(), fixed=np.zeros(len(self.fixed)))

    def loading(self, step: LoadStep) -> Loading:
        """What acts in a step of the case."""
        values = np.array([support.value for support in step.supports])
        return replace(self.slots.loading(step.wrenches), fixed=values)

    def start(self, q: Array, loading: Loading) -> Array:
        """The pose q (n,) with fixed coordinates where the loading has them."""
        if not len(self.fixed):
            return q
        there = q.copy()
        there[self.fixed] = loading.fixed
        return there

    def balance(self, q: Array, loading: Loading, states: States) -> Balance:
        """Residual and tangent at q (n,); those of a fixed coordinate are of q - value.

        Nothing hangs on a fixed coordinate: steps start where it is fixed, see `start`.
        """
        found = self.unsupported(q, loading, states)
        if len(self.fixed):
            found.residual[self.fixed] = q[self.fixed] - loading.fixed
            found.tangent[self.fixed] = found.tangent[:, self.fixed] = 0.0
            found.tangent[self.fixed, self.fixed] = 1.0
        return found

    def unsupported(self, q: Array, loading: Loading, states: States) -> Balance:
        """Residual and tangent at q (n,) without any support: what supports hold is missing."""
        motion = ChainMotion(self.chain, q)
        held = self._joint_forces(q, states)
        applied, tangent = self._apply(motion, loading)
        stiffness = -tangent
        stiffness[self._blocks] += held.tangent
        return Balance(held.load.ravel() - applied, stiffness)

    def joint_kinematics(self, q: Array, by_parameters: bool) -> JointKinematics:
        """Coordinates seen by the laws at q (n,)."""
        return place(q.reshape(-1, 6), self.geometry, by_parameters)

    def _joint_forces(self, q: Array, states: States) -> JointForces:
        if not self.geometry:
            unmoved = JointKinematics.unmoved(q.reshape(-1, 6))
            return assemble_joint_forces(unmoved, self.laws, states, moved=False)
        return assemble_joint_forces(
            self.joint_kinematics(q, by_parameters=False), self.laws, states, moved=True
        )

    def residual(self, q: Array, loading: Loading, states: States) -> Array:
        """Residual alone at q (n,), at half the price of a balance."""
        motion = ChainMotion(self.chain, q)
        found = self.weightless_residual(motion, loading, states)
        if self._heavy:
            found = found - self._weight(motion, loading)
        if len(self.fixed):
            found[self.fixed] = q[self.fixed] - loading.fixed
        return found

    def weightless_residual(self, motion: ChainMotion, loading: Loading, states: States) -> Array:
        """Residual (n,) but for the weight, for callers that get it with the inertial loads."""
        q = motion.q
        applied = self._wrenches(motion, loading, self._slot_velocities(motion, loading))
        for active in self.load_effects:
            applied += loading.share * self._effect(active, motion, loading).load
        return self._joint_forces(q, states).load.ravel() - applied

    def _slot_velocities(self, motion: ChainMotion, loading: Loading) -> list[Array | None]:
        """(n, 3) velocities of the slots that carry a force, None for the others."""
        return [
            self.chain.jacobian(motion.q, body, point)[0] if force.any() else None
            for (body, _), point, force in zip(
                self.slots.places, self.local_points, loading.forces, strict=True
            )
        ]

    def _weight(self, motion: ChainMotion, loading: Loading) -> Array:
        """(n,) generalised load of the weight."""
        return motion.mass_velocity @ (loading.share * self.model.gravity)

    def _wrenches(
        self, motion: ChainMotion, loading: Loading, velocities: list[Array | None]
    ) -> Array:
        """(n,) generalised load of the wrenches."""
        load = np.zeros(self.chain.n)
        for slot, (body, _) in enumerate(self.slots.places):
            velocity, moment = velocities[slot], loading.moments[slot]
            if velocity is not None:
                load += velocity @ loading.forces[slot]
            if moment.any():
                load += motion.angular(body) @ moment
        return load

    def _apply(self, motion: ChainMotion, loading: Loading) -> tuple[Array, Array]:
        """Generalised applied load (n,) and its tangent (n, n)."""
        velocities = self._slot_velocities(motion, loading)
        load = self._wrenches(motion, loading, velocities)
        if self._heavy:
            load += self._weight(motion, loading)
        tangent = self._tangent(motion, loading, velocities)
        for active in self.load_effects:
            response = self._effect(active, motion, loading)
            load += loading.share * response.load
            tangent += loading.share * response.tangent
        return load, tangent

    def _tangent(
        self, motion: ChainMotion, loading: Loading, velocities: list[Array | None]
    ) -> Array:
        """(n, n) change with the coordinates of what weight and wrenches apply."""
        forces = np.zeros((self.chain.n, self.chain.n))
        moments = np.zeros_like(forces)
        if self._heavy:
            weight = cross_matrix(loading.share * self.model.gravity)
            forces += (motion.axes @ weight.T) @ motion.mass_velocity.T
        for slot, (body, _) in enumerate(self.slots.places):
            velocity, moment = velocities[slot], loading.moments[slot]
            if velocity is not None:
                forces += (motion.axes @ cross_matrix(loading.forces[slot]).T) @ velocity.T
            if moment.any():
                angular = motion.angular(body)
                moments += angular @ (angular @ cross_matrix(moment).T).T
        return dead_tangent(forces, moments)

    def _effect(
        self, active: Active[LoadEffect], motion: ChainMotion, loading: Loading
    ) -> AppliedLoad:
        return active.effect.apply(
            motion, self.slots.wrenches(loading), active.joints, active.values
        )

    def derivatives(self, q: Array, states: States) -> JointForceDerivatives:
        """Derivatives of the held loads by all parameters and states, at fixed q (n,)."""
        return differentiate_joint_forces(
            self.joint_kinematics(q, by_parameters=True), self.laws, states
        )

    def load_derivative(self, q: Array, loading: Loading, active: Active[LoadEffect]) -> Array:
        """(n, R, P) derivative of the residual by a load effect's parameters."""
        motion = ChainMotion(self.chain, q)
        wrenches = self.slots.wrenches(loading)
        by_parameter: Array = active.effect.by_parameter(
            motion, wrenches, active.joints, active.values
        )
        return -loading.share * by_parameter


A = TypeVar("A", bound=Active[Any])


def _renewed(active: A, model: SpineModel) -> A:
    """The same effect with the values it has in another model."""
    return replace(active, values=model.effects[active.index].values)

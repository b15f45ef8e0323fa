"""Effects bound to lanes: what the joints of many chains hold at once, and its derivatives.

Laws and geometry are summed and composed as for one chain (`statics.joint_forces`), over the joints
of all lanes as one long list. Derivatives are carried forward: every array has a last axis of m
unknowns, those of the model that the lane belongs to.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import EffectKind, GeometryEffect
from spinepipe.effects.contract import AcrossJoints, Array, Indices, Neutral
from spinepipe.statics.batched.lanes import Acting, Effects
from spinepipe.statics.joint_forces import (
    ActiveLaw,
    ActivePath,
    JointForces,
    Law,
    States,
    assemble_joint_forces,
    states_after,
)
from spinepipe.statics.joint_kinematics import NOTHING, Active, JointKinematics, place

PathStates = Mapping[int, Array]
"""State (K, S), or its derivatives (K, S, m), of each path law, by its number among the laws."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives (K, P, m) of the values by the unknowns, of laws, geometry effects, cables.

    By number among those of the stack; what does not act on the lanes, or does not move, is not
    there.
    """

    laws: Mapping[int, Array]
    geometry: Mapping[int, Array]
    cables: Mapping[int, Array]
    m: int

    @classmethod
    def none(cls, m: int) -> "Slopes":
        """No value moves by any of m unknowns."""
        return cls({}, {}, {}, m)


@dataclass(frozen=True, eq=False)
class _Cable:
    """A load across joints on some of the lanes.

    Attributes
    ----------
    places, lanes : (n,) its first place on each of its lanes, and these. there : (n, J) its joints.
    """

    effect: AcrossJoints
    places: Indices
    lanes: Indices
    there: Array
    values: Array
    neutral: Neutral


class Bound:
    """The effects at work on N lanes of J joints; laws see the coordinates (N J, 6) of all joints.

    Attributes
    ----------
    laws, geometry, cables : those that act on the lanes, by number among those of the stack.
    places, geometry_places : of each, its places on the lanes among all its places.
    """

    def __init__(
        self,
        effects: Effects,
        neutral: Neutral,
        lanes: tuple[Indices, Indices, Array],
        states: PathStates,
        share: Array,
    ) -> None:
        """What acts on N lanes.

        Parameters
        ----------
        neutral : of M chains.
        lanes : (N,) each: chain, run and duration of each lane's step.
        share : (N,) share of loads across joints that is on.
        """
        chain, runs, seconds = lanes
        self.joints = neutral.origins.shape[1]
        self.count = self.joints * len(runs)
        self.share = share
        self.places: dict[int, Indices] = {}
        self.geometry_places: dict[int, Indices] = {}
        self.laws: list[Law] = []
        self.geometry: list[Active[GeometryEffect]] = []
        of: dict[int, Array] = {}
        durations: dict[int, Array] = {}
        for number, one in enumerate(effects.laws):
            places, at, there = self._there(one, number, runs)
            if not len(places):
                continue
            self.places[number] = places
            if one.effect.kind is EffectKind.PATH:
                of[number], durations[number] = states[number][places], seconds[at]
                self.laws.append(ActivePath(one.effect, *there))  # type: ignore[arg-type]
            else:
                self.laws.append(ActiveLaw(one.effect, *there))  # type: ignore[arg-type]
        for number, one in enumerate(effects.geometry):
            places, _, there = self._there(one, number, runs)
            if not len(places):
                continue
            self.geometry_places[number] = places
            self.geometry.append(Active(one.effect, *there))  # type: ignore[arg-type]
        cables = (self._cable(one, neutral, chain, runs) for one in effects.cables)
        self.cables = {n: cable for n, cable in enumerate(cables) if len(cable.lanes)}
        self.states = States(of, durations)

    def _there(
        self, one: Acting, number: int, runs: Indices
    ) -> tuple[Indices, Indices, tuple[int, Indices, Array, bool]]:
        """An effect's places on the lanes, these, and what an active effect is made of."""
        places, at = one.on(runs)
        flat = self.joints * at + one.joint[places]
        return places, at, (number, flat, one.values[one.row[places]], True)

    def _cable(self, one: Acting, neutral: Neutral, chain: Indices, runs: Indices) -> _Cable:
        places, at = one.on(runs)
        lanes, first = np.unique(at, return_index=True)
        there = np.zeros((len(runs), self.joints))
        there[at, one.joint[places]] = 1.0
        values = one.values[one.row[places[first]]]
        assert isinstance(one.effect, AcrossJoints)
        own = neutral.part(chain[lanes])
        return _Cable(one.effect, places[first], lanes, there[lanes], values, own)

    def joint_kinematics(self, q: Array) -> JointKinematics:
        """What the laws see at q (N, J, 6)."""
        flat = q.reshape(-1, 6)
        if not self.geometry:
            return JointKinematics.unmoved(flat)
        return place(flat, self.geometry, by_parameters=False)

    def joint_forces(self, q: Array) -> JointForces:
        """Loads (N, J, 6) and tangents (N, J, 6, 6) of the joints at q (N, J, 6)."""
        found = self.law_forces(q)
        load, tangent = found.load.reshape(q.shape), found.tangent.reshape(*q.shape, 6)
        if not self.cables:
            return JointForces(load, tangent)
        load, tangent = load.copy(), tangent.copy()
        for one in self.cables.values():
            own = one.effect.across(q[one.lanes], one.neutral, one.values)
            on = one.there * self.share[one.lanes, None]
            load[one.lanes] += own.load * on[..., None]
            tangent[one.lanes] += own.tangent * on[..., None, None]
        return JointForces(load, tangent)

    def law_forces(self, q: Array) -> JointForces:
        """Loads (N J, 6) and tangents (N J, 6, 6) but for those of loads across joints."""
        return assemble_joint_forces(
            self.joint_kinematics(q), self.laws, self.states, moved=bool(self.geometry)
        )

    def states_of(self, every: PathStates) -> dict[int, Array]:
        """Of the states of all places, or their derivatives, those of the lanes."""
        return {n: every[n][places] for n, places in self.places.items() if n in every}

    def states_after(self, q: Array) -> dict[int, Array]:
        """State (K, S) of each path law after steps that ended at q (N, J, 6)."""
        advances = states_after(self.joint_kinematics(q).q, self.laws, self.states)
        return {number: one.state for number, one in advances.items()}

    def joint_forces_by(self, q: Array, slopes: Slopes, states_by_x: PathStates) -> Array:
        """(N, J, 6, m) derivative of the loads by the unknowns at fixed q (N, J, 6)."""
        by_x = self._law_forces_by(q, slopes, states_by_x).reshape(*q.shape, slopes.m)
        for number, one in self.cables.items():
            slope = slopes.cables.get(number)
            if slope is None:
                continue
            own = one.effect.across_by_parameter(q[one.lanes], one.neutral, one.values)
            by_x[one.lanes] += one.there[..., None, None] * (own @ slope[:, None])
        return by_x

    def _law_forces_by(self, q: Array, slopes: Slopes, states_by_x: PathStates) -> Array:
        """(N J, 6, m) derivative of what the laws hold."""
        seen = self._kinematics_by(q, slopes)
        load, tangent = np.zeros_like(seen.q), np.zeros((self.count, 6, 6))
        by_x = np.zeros((self.count, 6, slopes.m))
        for law in self.laws:
            j, here, carried = law.joints, seen.q[law.joints], load[law.joints]
            response = law.respond(here, carried, self.states)
            if response.by_carried is not None:
                # chain rule over what is carried; a law changes few of the six loads
                rows = np.flatnonzero(response.by_carried.any(axis=(0, 2)))
                by_carried, at = response.by_carried[:, rows], j[:, None]
                by_x[at, rows] += by_carried @ by_x[j]
                tangent[at, rows] += by_carried @ tangent[j]
            self._add_own(
                by_x, law, here, carried, slopes.laws.get(law.index), states_by_x.get(law.index)
            )
            tangent[j] += response.tangent
            load[j] += response.load
        # back to the joints' own coordinates: s' F, and s itself moves with geometry's unknowns
        if seen.first is None:
            return by_x
        if not slopes.geometry:
            return seen.first.swapaxes(1, 2) @ by_x
        pulled: Array = seen.first.swapaxes(1, 2) @ (by_x + tangent @ seen.q_by_x)
        return pulled + np.einsum("jkcm,jk->jcm", seen.first_by_x, load)

    def _add_own(
        self,
        by_x: Array,
        law: Law,
        here: Array,
        carried: Array,
        slope: Array | None,
        state_by_x: Array | None,
    ) -> None:
        """Add what a law's own unknowns, and its state, do to its load."""
        used = NOTHING if slope is None else np.flatnonzero(slope.any(axis=(0, 1)))
        if slope is not None and len(used):
            own = law.by_parameter(here, carried, self.states)
            if len(used) == by_x.shape[2]:  # all of them: whole rows are added faster
                by_x[law.joints] += own @ slope
            else:
                own = own @ slope[:, :, used]
                by_x[law.joints[:, None, None], np.arange(6)[:, None], used] += own
        if isinstance(law, ActivePath):
            assert state_by_x is not None
            by_x[law.joints] += law.by_state(here, carried, self.states) @ state_by_x

    def states_after_by(
        self,
        q: Array,
        dq: Array,
        slopes: Slopes,
        states_by_x: PathStates,
        shift: Array | None = None,
    ) -> dict[int, Array]:
        """(K, S, m) derivative of each path law's state after steps that ended at q.

        Parameters
        ----------
        q, dq : (N, J, 6) and (N, J, 6, m). shift : (N, J, 6, m) by how much what the laws see moves
            besides.
        """
        # how what the laws see moves: with the pose, with geometry's unknowns, and by the shift
        seen = self._kinematics_by(q, slopes)
        moved = dq.reshape(self.count, 6, slopes.m)
        if seen.first is not None:
            moved = seen.first @ moved
            if slopes.geometry:
                moved += seen.q_by_x
        if shift is not None:
            moved = moved + shift.reshape(moved.shape)
        load, load_by_x = np.zeros_like(seen.q), np.zeros_like(moved)
        found: dict[int, Array] = {}
        for law in self.laws:
            j, here = law.joints, seen.q[law.joints]
            carried, carried_by_x = load[j], load_by_x[j]
            if isinstance(law, ActivePath):
                # by coordinate, earlier state, own unknowns and what is carried
                after = law.advance(here, carried, self.states)
                by_x = after.by_coordinate @ moved[j] + after.by_state @ states_by_x[law.index]
                if law.index in slopes.laws:
                    by_x += after.by_parameter @ slopes.laws[law.index]
                if after.by_carried is not None:
                    by_x += after.by_carried @ carried_by_x
                found[law.index] = by_x
            # what later laws are carried moves along
            response = law.respond(here, carried, self.states)
            load_by_x[j] += response.tangent @ moved[j]
            if response.by_carried is not None:
                rows = np.flatnonzero(response.by_carried.any(axis=(0, 2)))
                load_by_x[j[:, None], rows] += response.by_carried[:, rows] @ carried_by_x
            own, state = slopes.laws.get(law.index), states_by_x.get(law.index)
            self._add_own(load_by_x, law, here, carried, own, state)
            load[j] += response.load
        return found

    def _kinematics_by(self, q: Array, slopes: Slopes) -> "_KinematicsBy":
        """What the laws see, and its derivatives by the geometry's unknowns."""
        flat = q.reshape(-1, 6)
        if not self.geometry:
            return _KinematicsBy(flat, None, NOTHING, NOTHING)
        if not slopes.geometry:
            placed = self.joint_kinematics(q)
            return _KinematicsBy(placed.q, placed.by_coordinate, NOTHING, NOTHING)
        m = slopes.m
        seen, first = flat.copy(), np.tile(np.eye(6), (self.count, 1, 1))
        q_by_x, first_by_x = np.zeros((self.count, 6, m)), np.zeros((self.count, 6, 6, m))
        for active in self.geometry:
            slope, j, here = slopes.geometry[active.index], active.joints, seen[active.joints]
            step = active.effect.place(here, active.values)
            own = active.effect.by_parameter(here, active.values)
            bent = step.by_coordinates @ q_by_x[j][:, None]
            bent += np.einsum("jkap,jpm->jkam", own.by_coordinate, slope)
            turned = np.einsum("jka,jacm->jkcm", step.by_coordinate, first_by_x[j])
            first_by_x[j] = turned + np.einsum("jkam,jac->jkcm", bent, first[j])
            q_by_x[j] = step.by_coordinate @ q_by_x[j] + own.q @ slope
            first[j] = step.by_coordinate @ first[j]
            seen[j] = step.q
        return _KinematicsBy(seen, first, q_by_x, first_by_x)


@dataclass(frozen=True, eq=False)
class _KinematicsBy:
    """What the laws see (N J, 6), how it follows the joints, and both by the unknowns.

    Attributes
    ----------
    first : (N J, 6, 6), None without geometry effects. q_by_x, first_by_x : with a last axis m;
        empty where none of these moves.
    """

    q: Array
    first: Array | None
    q_by_x: Array
    first_by_x: Array

"""The truth of one specimen: bones, springs, and whatever hidden effects were put into it.

Everything an effect does is one more entry in one of the tuples of `World`; the solver knows no
effect by name.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from .anatomy import Bones
from .design import Test
from .rigid import Pose, Wrenches

GRAVITY_M_PER_S2 = 9.81


class Now(NamedTuple):
    """Where in the tests the states are: numbers from 0, one per state, and this step's seconds."""

    tests: np.ndarray
    steps: np.ndarray
    seconds: float


class Law(Protocol):
    """A joint law: what it adds to the load that holds the joints.

    ``q`` and ``carried`` (the sum of the laws before it) are (..., T, J, 6) for states of T tests
    (T of `Now`); so is the answer.
    """

    def __call__(
        self, q: np.ndarray, carried: np.ndarray, memory: np.ndarray, now: Now
    ) -> np.ndarray: ...


class PathLaw(Law, Protocol):
    """A law with a memory (cells, T, J, 6), zero at first and renewed after every step."""

    @property
    def cells(self) -> int: ...

    def renewed(self, q: np.ndarray, memory: np.ndarray, now: Now) -> np.ndarray: ...


Place = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""q (..., J, 6) -> the coordinates at which the laws act, and their derivative (..., J, 6, 6)."""

Push = Callable[[Pose, Now], Wrenches]
"""Wrenches in poses of the spine, one of each state."""

View = Callable[[np.ndarray], np.ndarray]
"""True motion (T, S, J, 6) -> reported motion."""


@dataclass(frozen=True)
class World:
    """One specimen.

    Attributes
    ----------
    number : of the specimen. bones : true geometry. stiffness : (J, 6) of the linear springs.
    tests : load cases as listed in the files.
    weight : whether bodies have weight.
    load_point : (3,) m, neutral, of the uppermost body: where its force acts.
    turn_load : (T, 3, 3) applied to each test's moment and force; gain (T,) to all its loads.
    laws, places, pushes, views : effects, in the order in which they act.
    """

    number: int
    bones: Bones
    stiffness: np.ndarray
    tests: tuple[Test, ...]
    weight: bool
    preload_points: np.ndarray
    load_point: np.ndarray
    turn_load: np.ndarray
    gain: np.ndarray
    laws: tuple[Law, ...] = ()
    places: tuple[Place, ...] = ()
    pushes: tuple[Push, ...] = ()
    views: tuple[View, ...] = ()

    def with_law(self, law: Law) -> "World":
        """The same world with one more law."""
        return replace(self, laws=(*self.laws, law))

    def with_push(self, push: Push) -> "World":
        """The same world with one more load."""
        return replace(self, pushes=(*self.pushes, push))

    def with_view(self, view: View) -> "World":
        """The same world, reported through one more distortion."""
        return replace(self, views=(*self.views, view))

    def with_place(self, place: Place) -> "World":
        """The same world whose laws act at other coordinates."""
        return replace(self, places=(*self.places, place))

    def holding(self, q: np.ndarray, memories: tuple[np.ndarray, ...], now: Now) -> np.ndarray:
        """(..., J, 6) generalised load that holds the joints at q."""
        seen, turns = q, []
        for place in self.places:
            seen, turn = place(seen)
            turns.append(turn)
        load = self.stiffness * seen
        for law, memory in zip(self.laws, memories, strict=True):
            load = load + law(seen, load, memory, now)
        for turn in reversed(turns):
            load = np.einsum("...ji,...j->...i", turn, load)
        return load

    def seen(self, q: np.ndarray) -> np.ndarray:
        """(..., J, 6) coordinates at which the laws act."""
        for place in self.places:
            q, _ = place(q)
        return q

    def wrenches(self, pose: Pose, now: Now) -> list[Wrenches]:
        """Weight, listed loads and hidden loads."""
        found = [_listed(self, pose, now)]
        if self.weight:
            found.append(weights(pose, self.bones.centres, self.bones.masses))
        return found + [push(pose, now) for push in self.pushes]

    def reported(self, q: np.ndarray) -> np.ndarray:
        """(T, S, J, 6) what an instrument without noise says of the true motion."""
        for view in self.views:
            q = view(q)
        return q


def weights(pose: Pose, centres: np.ndarray, masses: np.ndarray) -> Wrenches:
    """Weight of masses (J,) kg at neutral points (J, 3) m of all bodies."""
    bodies = np.arange(len(masses))
    points = pose.point(bodies, centres)
    down = np.zeros_like(points)
    down[..., 1] = -GRAVITY_M_PER_S2 * masses
    return Wrenches(bodies, points, down, np.zeros_like(down))


def _listed(world: World, pose: Pose, now: Now) -> Wrenches:
    """Moment and force on the uppermost body, and an equal share of the preload on each."""
    bodies = np.arange(len(world.bones.masses))
    gain = world.gain[now.tests][:, None]
    turn = world.turn_load[now.tests]
    told = [_told(world, part, now) for part in ("moments", "forces")]
    moment, force = (gain * (turn @ one[:, :, None])[..., 0] for one in told)
    preloads = np.array([case.preload for case in world.tests])[now.tests]
    points = pose.point(bodies, world.preload_points)
    forces, moments = np.zeros_like(points), np.zeros_like(points)
    forces[..., 1] = -gain * preloads[:, None] / len(bodies)
    moments[..., -1, :] = moment
    at = np.concatenate([points, pose.point(bodies[-1:], world.load_point[None])], axis=-2)
    both = np.concatenate([forces, force[..., None, :]], axis=-2)
    extra = np.concatenate([moments, np.zeros_like(force)[..., None, :]], axis=-2)
    return Wrenches(np.append(bodies, bodies[-1]), at, both, extra)


def _told(world: World, part: str, now: Now) -> np.ndarray:
    """(T, 3) moments or forces of these steps of these tests."""
    return np.stack([getattr(case, part) for case in world.tests])[now.tests, now.steps]

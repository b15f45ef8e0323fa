"""What acts on a trunk from outside: weight, arms and what they hold, exertions, pressure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.model import STANDARD_GRAVITY
from spinepipe.muscles.diaphragm import diaphragm_load
from spinepipe.muscles.masses import arm_loads
from spinepipe.muscles.person import Person
from spinepipe.muscles.pose import BodyPoses
from spinepipe.muscles.task import Exertion, Task
from spinepipe.muscles.trunk import BODIES, SLICES, THORAX, Trunk, body_of

_SACRUM = 0


@dataclass(frozen=True, eq=False)
class Applied:
    """Forces on bodies.

    Attributes
    ----------
    bodies : (K,) index into BODIES. at : (K, 3) m, points. pushes : (K, 3) N.
    turning : (8, 3) N m, pure moments on each body.
    """

    bodies: NDArray[np.int64]
    at: Array
    pushes: Array
    turning: Array

    @property
    def forces(self) -> Array:
        """(8, 3) N on each body."""
        found = np.zeros((len(BODIES), 3))
        np.add.at(found, self.bodies, self.pushes)
        return found

    @property
    def moments(self) -> Array:
        """(8, 3) N m on each body, about the origin of ground."""
        found = self.turning.copy()
        np.add.at(found, self.bodies, np.cross(self.at, self.pushes))
        return found


class _Sum:
    """Forces as they are found."""

    def __init__(self) -> None:
        self.bodies: list[int] = []
        self.at: list[Array] = []
        self.pushes: list[Array] = []
        self.turning = np.zeros((len(BODIES), 3))

    def push(self, body: int, force: Array, at: Array) -> None:
        """Add a force (3,) N at a point (3,) m of a body."""
        self.bodies.append(body)
        self.at.append(at)
        self.pushes.append(force)

    def all(self) -> Applied:
        """The sum."""
        return Applied(
            np.array(self.bodies), np.array(self.at), np.array(self.pushes), self.turning
        )


def applied(person: Person, task: Task, poses: BodyPoses) -> Applied:
    """All that acts in a posture, muscles left out.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    trunk, found = person.lines.trunk, _Sum()
    for mass, at in zip(person.masses, poses.masses(person.masses), strict=True):
        found.push(mass.body, mass.kg * STANDARD_GRAVITY, at)
    shoulders = poses.of(np.full(2, THORAX), trunk.shoulders)
    for load in arm_loads(person.subject, shoulders, task.hands, trunk.arm_length):
        found.push(load.body, load.force, load.at)
    _exert(found, trunk, task.exertion, poses)
    _press(found, person, task.pressure_pa, poses)
    return found.all()


def _exert(found: _Sum, trunk: Trunk, exertion: Exertion, poses: BodyPoses) -> None:
    """What pushes at the thorax."""
    body = body_of(exertion.at)
    at = poses.of(np.array(body), trunk.vertebrae[SLICES.index(exertion.at)])
    force, moment = exertion.force, exertion.moment
    if exertion.as_force:
        height = float((at - poses.centres[0])[1])
        force = force + np.array([-moment[2] / height, 0.0, moment[0] / height])
        moment = np.array([0.0, moment[1], 0.0])
    found.push(body, force, at)
    found.turning[body] += moment


def _press(found: _Sum, person: Person, pressure: float, poses: BodyPoses) -> None:
    """Pressure on the diaphragm lifts the ribs ahead of T11 and presses the pelvis down."""
    t11 = poses.of(np.array(THORAX), person.lines.trunk.vertebrae[SLICES.index("T11")])
    lift = diaphragm_load(pressure, person.diaphragm_m2, t11, poses.rotations[THORAX])
    found.push(THORAX, lift.force, lift.at)
    found.push(_SACRUM, -lift.force, lift.at)

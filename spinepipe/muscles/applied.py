"""What acts on a trunk from outside: weight, arms and what they hold, exertions, pressure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.muscles.diaphragm import diaphragm_load
from spinepipe.muscles.masses import arm_loads
from spinepipe.muscles.person import Person
from spinepipe.muscles.pose import BodyPoses, crossed
from spinepipe.muscles.task import Exertion, Task
from spinepipe.muscles.trunk import BODIES, SLICES, THORAX, body_of

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
        return _summed(self.bodies, self.pushes)

    @property
    def moments(self) -> Array:
        """(8, 3) N m on each body, about the origin of ground."""
        return self.turning + _summed(self.bodies, crossed(self.at, self.pushes))


def _summed(bodies: NDArray[np.int64], vectors: Array) -> Array:
    """(8, 3), sums of vectors (K, 3) of bodies (K,)."""
    found = np.zeros((len(BODIES), 3))
    np.add.at(found, bodies, vectors)
    return found


def applied(person: Person, task: Task, poses: BodyPoses) -> Applied:
    """All that acts in a posture, muscles left out.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    trunk = person.lines.trunk
    vertebra = np.array([SLICES.index("T11"), SLICES.index(task.exertion.at)])
    carrier = np.array([THORAX, body_of(task.exertion.at)])
    bodies, centres, weights = person.weights
    places = poses.of(
        np.concatenate([bodies, carrier, [THORAX, THORAX]]),
        np.concatenate([centres, trunk.vertebrae[vertebra], trunk.shoulders]),
    )
    hung, (t11, at), shoulders = np.split(places, [len(bodies), len(bodies) + 2])
    arms = arm_loads(person.subject, shoulders, task.hands, trunk.arm_length)
    # pressure on the diaphragm lifts the ribs ahead of T11 and presses the pelvis down
    lift = diaphragm_load(task.pressure_pa, person.diaphragm_m2, t11, poses.rotations[THORAX])
    force, moment = _exerted(task.exertion, at - poses.centres[0])
    turning = np.zeros((len(BODIES), 3))
    turning[carrier[1]] += moment
    return Applied(
        np.concatenate([bodies, [load.body for load in arms], [carrier[1], THORAX, _SACRUM]]),
        np.concatenate([hung, [*(load.at for load in arms), at, lift.at, lift.at]]),
        np.concatenate([weights, [*(load.force for load in arms), force, lift.force, -lift.force]]),
        turning,
    )


def _exerted(exertion: Exertion, arm: Array) -> tuple[Array, Array]:
    """Force (3,) N and moment (3,) N m at the thorax, (3,) m off the centre of L5S1."""
    force, moment = exertion.force, exertion.moment
    if not exertion.as_force:
        return force, moment
    push = np.array([-moment[2] / arm[1], 0.0, moment[0] / arm[1]])
    return force + push, np.array([0.0, moment[1], 0.0])

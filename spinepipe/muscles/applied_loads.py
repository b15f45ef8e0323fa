"""What acts on a trunk from outside: weight, arms and what they hold, exertions, pressure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.muscles.masses import Load, arm_loads
from spinepipe.muscles.person import Person
from spinepipe.muscles.pose import BodyPoses, cross
from spinepipe.muscles.scaling import DIAPHRAGM_AHEAD_M
from spinepipe.muscles.task import Instant, Task
from spinepipe.muscles.trunk import BODIES, SLICES, THORAX, body_of

_SACRUM = 0


@dataclass(frozen=True, eq=False)
class AppliedLoads:
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
        found = np.zeros((len(BODIES), 3))
        np.add.at(found, self.bodies, cross(self.at, self.pushes))
        return self.turning + found


def applied_loads(person: Person, task: Task, poses: BodyPoses) -> AppliedLoads:
    """All that acts in a posture, muscles left out.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    if task.instant is not None:
        return _loads_of_instant(person, task, task.instant, poses)
    trunk, exertion = person.lines.trunk, task.exertion
    carrier = body_of(exertion.at)
    bodies, centres, weights = person.weights
    places = poses.of(
        np.concatenate([bodies, [THORAX, carrier, THORAX, THORAX]]),
        np.concatenate(
            [
                centres,
                trunk.vertebrae[[SLICES.index("T11"), SLICES.index(exertion.at)]],
                trunk.shoulders,
            ]
        ),
    )
    hung, (t11, at), shoulders = np.split(places, [len(bodies), len(bodies) + 2])
    arms = arm_loads(person.subject, shoulders, task.hands, trunk.arm_length)
    lift = diaphragm_load(task.pressure_pa, person.diaphragm_m2, t11, poses.rotations[THORAX])
    force, moment = exertion.force, exertion.moment
    if exertion.as_force:
        # the horizontal force whose moment about L5S1, for z and x, is the one that is asked for
        arm = at - poses.centres[0]
        force = force + np.array([-moment[2] / arm[1], 0.0, moment[0] / arm[1]])
        moment = np.array([0.0, moment[1], 0.0])
    turning = np.zeros((len(BODIES), 3))
    turning[carrier] += moment
    # pressure lifts the ribs and presses the pelvis down on the same line
    return AppliedLoads(
        np.concatenate([bodies, [load.body for load in arms], [carrier, THORAX, _SACRUM]]),
        np.concatenate([hung, [*(load.at for load in arms), at, lift.at, lift.at]]),
        np.concatenate([weights, [*(load.force for load in arms), force, lift.force, -lift.force]]),
        turning,
    )


def _loads_of_instant(
    person: Person, task: Task, instant: Instant, poses: BodyPoses
) -> AppliedLoads:
    """What the inverse dynamics has, where it has it, and the pressure."""
    t11 = poses.of(np.array(THORAX), person.lines.trunk.vertebrae[SLICES.index("T11")])
    lift = diaphragm_load(task.pressure_pa, person.diaphragm_m2, t11, poses.rotations[THORAX])
    turning = np.zeros((len(BODIES), 3))
    np.add.at(turning, instant.bodies, instant.moments)
    return AppliedLoads(
        np.concatenate([instant.bodies, [THORAX, _SACRUM]]),
        np.vstack([poses.centres[0] + instant.at, lift.at, lift.at]),
        np.vstack([instant.forces, lift.force, -lift.force]),
        turning,
    )


def diaphragm_load(pressure_pa: float, area_m2: float, t11: Array, turned: Array) -> Load:
    """Lift of the ribs along their own axis, ahead of T11 (Ghezelbash 2016, section 2.8).

    Parameters
    ----------
    area_m2 : of the diaphragm.
    t11 : (3,) m, centre of T11 in the posture of the moment.
    turned : (3, 3) rotation of the thorax: its columns are forwards, up and right of T11.
    """
    lift: Array = pressure_pa * area_m2 * turned[:, 1]
    return Load("diaphragm", THORAX, lift, t11 + DIAPHRAGM_AHEAD_M * turned[:, 0])

"""What acts on a trunk from outside: weight, arms and what they hold, exertions, pressure."""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.muscles.diaphragm import AHEAD_M
from spinepipe.muscles.masses import arm_loads
from spinepipe.muscles.person import Person, weight
from spinepipe.muscles.pose import BodyPoses
from spinepipe.muscles.task import Exertion, Task
from spinepipe.muscles.trunk import SLICES, THORAX, Trunk, body_of

_SACRUM = 0


@dataclass(frozen=True, eq=False)
class Applied:
    """Forces (8, 3) N on the bodies and moments (8, 3) N m of them about the origin of ground."""

    forces: Array
    moments: Array

    def plus(self, body: int, force: Array, at: Array, moment: Array | None = None) -> "Applied":
        """The same with a force (3,) at a point (3,) m of a body, and a pure moment (3,)."""
        forces, moments = self.forces.copy(), self.moments.copy()
        forces[body] += force
        moments[body] += np.cross(at, force) + (0.0 if moment is None else moment)
        return Applied(forces, moments)


def applied(person: Person, task: Task, poses: BodyPoses) -> Applied:
    """All that acts in a posture, muscles left out.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    trunk = person.lines.trunk
    found = Applied(*weight(person.masses, poses))
    shoulders = poses.of(np.full(2, THORAX), trunk.shoulders)
    for load in arm_loads(person.subject, shoulders, task.hands, trunk.arm_length):
        found = found.plus(load.body, load.force, load.at)
    found = _exerted(found, trunk, task.exertion, poses)
    return _pressed(found, person, task.pressure_pa, poses)


def _exerted(found: Applied, trunk: Trunk, exertion: Exertion, poses: BodyPoses) -> Applied:
    body = body_of(exertion.at)
    at = poses.of(np.array(body), trunk.vertebrae[SLICES.index(exertion.at)])
    force, moment = exertion.force, exertion.moment
    if exertion.as_force:
        height = float((at - poses.centres[0])[1])
        push = np.array([-moment[2] / height, 0.0, moment[0] / height])
        force, moment = force + push, np.array([0.0, moment[1], 0.0])
    return found.plus(body, force, at, moment)


def _pressed(found: Applied, person: Person, pressure: float, poses: BodyPoses) -> Applied:
    """Pressure on the diaphragm lifts the ribs ahead of T11 and presses the pelvis down."""
    trunk = person.lines.trunk
    t11 = trunk.vertebrae[SLICES.index("T11")]
    at = poses.of(np.array(THORAX), t11 + np.array([AHEAD_M, 0.0, 0.0]))
    lift = pressure * person.diaphragm_m2 * poses.rotations[THORAX][:, 1]
    return found.plus(THORAX, lift, at).plus(_SACRUM, -lift, at)

"""Derivatives of a stack's poses by what was given: its loads, and where its joints are.

What palpation errors do to the motion: moving a joint's frame by a small twist in the neutral pose,
with vertebrae and load points staying where they are, displaces its lower frame by the twist as the
vertebra below carries it, and its upper frame by minus the twist as the vertebra above does.
"""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics.given_sensitivity import ROTATION_AXES
from spinepipe.statics.many.elimination import Changes, answers
from spinepipe.statics.many.stack import Stack
from spinepipe.statics.many.survey import Survey, survey


def by_load(stack: Stack, q: Array, wrench: int) -> Array:
    """(L, J, 6, 9) derivative of poses q (L, J, 6) by a wrench of each lane, in its listed order.

    By force (N), moment (N m), and point in the neutral pose (m), three components each; zero on
    lanes with fewer wrenches.

    Raises
    ------
    ValueError
        With effects that hang on the listed loads themselves, or remember.
    """
    _require_plain(stack)
    seen = _seen(stack, q)
    body, lanes = stack.listed.bodies[:, wrench], np.arange(len(q))
    turned, shifted = seen.turned[lanes, body], seen.shifted[lanes, body]
    point = (turned @ stack.listed.points[:, wrench, :, None])[..., 0] + shifted
    force = stack.listed.forces[:, wrench]
    unit = np.eye(3)
    changes = np.zeros((len(q), 6, 9))
    changes[:, :3, :3] = np.cross(point[:, None], unit).swapaxes(1, 2)
    changes[:, 3:, :3] = unit
    changes[:, :3, 3:6] = unit
    changes[:, :3, 6:] = np.cross(turned.swapaxes(1, 2), force[:, None]).swapaxes(1, 2)
    pushes = np.zeros((*q.shape, 9))
    there = body >= 0
    pushes[lanes[there], body[there]] = changes[there]
    return answers(seen, Changes(np.zeros(pushes.shape), pushes))[0]


def by_joint_pose(stack: Stack, q: Array) -> Array:
    """(L, J, 6, J, 6) derivative of poses q (L, J, 6) by small displacements of each joint frame.

    The last six are displacements in the frame's own neutral axes: anterior, superior, right (m),
    then rotations about z, x, y (rad).

    Raises
    ------
    ValueError
        With effects whose own dependence on the joint poses is not known here, or that remember.
    """
    _require_plain(stack)
    seen, joints = _seen(stack, q), q.shape[1]
    lower, upper = np.zeros((2, *q.shape, joints, 6))
    chain = stack.loads.chain
    for joint in range(joints):
        twists = _twists(stack.chains.rotations[:, joint], stack.chains.origins[:, joint])[chain]
        lower[:, joint, :, joint] = twists
        if joint:
            below = seen.turned[:, joint - 1], seen.shifted[:, joint - 1]
            lower[:, joint, :, joint] = _carried(twists, *below)
        above = seen.turned[:, joint], seen.shifted[:, joint]
        upper[:, joint, :, joint] = -_carried(twists, *above)
    shape = (*q.shape, 6 * joints)
    nothing = np.zeros(shape)
    changes = Changes(nothing, lower=lower.reshape(shape), upper=upper.reshape(shape))
    return answers(seen, changes)[0].reshape(*q.shape, joints, 6)


def _require_plain(stack: Stack) -> None:
    """Refuse load effects and laws that remember."""
    effects = stack.effects
    if effects.dead or effects.cables or effects.others or stack.remembers.any():
        raise ValueError("sensitivities to what is given do not cover load and path effects")


def _seen(stack: Stack, q: Array) -> Survey:
    tangents = stack.bound(np.arange(len(q)), {}).held(q).tangent
    return survey(stack.chains, stack.loads, q, tangents)


def _twists(rotations: Array, origins: Array) -> Array:
    """(M, 6, 6) twists by column: unit displacements of frames (M, 3, 3) at origins (M, 3)."""
    found = np.zeros((len(origins), 6, 6))
    turns = rotations[:, :, list(ROTATION_AXES)]
    found[:, 3:, :3] = rotations
    found[:, :3, 3:] = turns
    found[:, 3:, 3:] = np.cross(origins[:, :, None], turns, axis=1)
    return found


def _carried(twists: Array, turned: Array, shifted: Array) -> Array:
    """(N, 6, k) twists of the neutral pose as carried by vertebrae so displaced."""
    found = np.empty(twists.shape)
    found[:, :3] = turned @ twists[:, :3]
    found[:, 3:] = turned @ twists[:, 3:] + np.cross(shifted[:, :, None], found[:, :3], axis=1)
    return found

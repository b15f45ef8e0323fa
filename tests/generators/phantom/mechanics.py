"""Static poses of a chain by free bodies and fixed-point iteration, many load states at once.

Joint coordinates: anterior, superior, right (m) along the axes fixed in the lower vertebra, then
extension, right bending, left rotation (rad) about z, x', y''. Everything above a joint is one free
body: its weight and its moment about the upper frame's origin load the joint's six springs, the
springs give the next pose, and so on until the pose stays.
Leading dimensions: P specimens, N load states; J joints, caudal to cranial.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

GRAVITY_M_PER_S2 = 9.81
TOLERANCE = 1e-14
"""m and rad, of the last change: the iteration contracts, so the error is of the same order."""
MOST_ITERATIONS = 2000

STIFFENS_AT_RAD = np.deg2rad([4.0, 4.0, 2.0])
"""Extension, right bending, left rotation at which the stiffening law's stiffness has doubled."""
COUPLING = 0.5
"""How much a rotation stiffens the two others, as a share of how it stiffens itself."""

Law = Literal["linear", "stiffening"]
Springs = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class Chains(NamedTuple):
    """P chains as in `Anatomy`, with their stiffness (P, J, 6)."""

    origins: np.ndarray
    rotations: np.ndarray
    masses: np.ndarray
    centres: np.ndarray
    stiffness: np.ndarray


class Placed(NamedTuple):
    """Where joints and bodies are: every member (P, N, J, 3), axes (P, N, J, 3, 6)."""

    origins: np.ndarray
    centres: np.ndarray
    axes: np.ndarray


def equilibrium(chains: Chains, moments: np.ndarray, law: Law = "linear") -> np.ndarray:
    """(P, N, J, 6) m and rad: static poses under weight and a moment (P, N, 3) N m on the top body.

    Raises
    ------
    RuntimeError
        When the iteration does not settle, as for a column near buckling.
    """
    stiffness = chains.stiffness[:, None]
    q = np.zeros((*moments.shape[:2], *chains.stiffness.shape[1:]))
    for _ in range(MOST_ITERATIONS):
        moved = SPRINGS[law](_joint_loads(chains, _place(chains, q), moments), stiffness, q)
        change = np.abs(moved - q).max()
        q = moved
        if change < TOLERANCE:
            return q
    raise RuntimeError(f"no equilibrium in {MOST_ITERATIONS} iterations: last change {change:.1e}")


def turned(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(..., 3, 3) rotations about z, then z and x', then z, x' and y'' of coordinates (..., 6)."""
    (cz, cx, cy), (sz, sx, sy) = (np.moveaxis(f(q[..., 3:]), -1, 0) for f in (np.cos, np.sin))
    zero, one = np.zeros_like(cz), np.ones_like(cz)
    about_z = _matrix((cz, -sz, zero), (sz, cz, zero), (zero, zero, one))
    about_x = _matrix((one, zero, zero), (zero, cx, -sx), (zero, sx, cx))
    about_y = _matrix((cy, zero, sy), (zero, one, zero), (-sy, zero, cy))
    bent = about_z @ about_x
    return about_z, bent, bent @ about_y


def _matrix(*rows):
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _place(chains, q):
    """Carry the bodies upwards from the ground: a neutral point p goes to carried @ p + shift."""
    carried, shift = np.broadcast_to(np.eye(3), (*q.shape[:2], 3, 3)), np.zeros(3)
    by_z, by_zx, by_zxy = turned(q)
    placed = []
    for joint in range(q.shape[2]):
        frame = chains.rotations[:, None, joint]
        neutral, centre = chains.origins[:, None, joint], chains.centres[:, None, joint]
        axes = carried @ frame
        origin = _times(carried, neutral) + shift + _times(axes, q[:, :, joint, :3])
        carried = axes @ by_zxy[:, :, joint] @ np.swapaxes(frame, -1, -2)
        shift = origin - _times(carried, neutral)
        turning = (
            axes[..., 2],
            _times(axes, by_z[:, :, joint, :, 0]),
            _times(axes, by_zx[:, :, joint, :, 1]),
        )
        six = np.concatenate([axes, np.stack(turning, axis=-1)], axis=-1)
        placed.append((origin, _times(carried, centre) + shift, six))
    return Placed(*(np.stack(parts, axis=2) for parts in zip(*placed, strict=True)))


def _times(matrices, vectors):
    return np.einsum("...ij,...j->...i", matrices, vectors)


def _joint_loads(chains, placed, moments):
    """(P, N, J, 6) force and moment of all that is above each joint, along its six axes."""
    weights = np.zeros((len(chains.masses), 1, chains.masses.shape[1], 3))
    weights[:, 0, :, 1] = -GRAVITY_M_PER_S2 * chains.masses
    force = _from_the_top(weights)
    about_ground = _from_the_top(np.cross(placed.centres, weights)) + moments[:, :, None]
    moment = about_ground - np.cross(placed.origins, force)
    along = np.einsum(
        "pnjka,pnjk->pnja", placed.axes[..., :3], np.broadcast_to(force, moment.shape)
    )
    around = np.einsum("pnjka,pnjk->pnja", placed.axes[..., 3:], moment)
    return np.concatenate([along, around], axis=-1)


def _from_the_top(per_body):
    """Sums (P, N, J, 3) over each body and all above it."""
    return np.cumsum(per_body[:, :, ::-1], axis=2)[:, :, ::-1]


def _linear(loads, stiffness, _q):
    return loads / stiffness


def _stiffening(loads, stiffness, q):
    """Rotations r = angle / its reference store k reference^2 (r^2 / 2 + r^4 / 4) and, coupled,
    r^2 C r^2 / 4; the others' rotations are those of ``q``.

    With u the joint's own r, u^3 + a u = s has the one root of the hyperbolic sine.
    """
    k, squares = stiffness[..., 3:], (q[..., 3:] / STIFFENS_AT_RAD) ** 2
    others = _coupling(k) @ squares[..., None]
    a = 1.0 + others[..., 0] / (k * STIFFENS_AT_RAD**2)
    s = loads[..., 3:] / (k * STIFFENS_AT_RAD)
    root = 2.0 * np.sqrt(a / 3.0)
    u = root * np.sinh(np.arcsinh(3.0 * s / (a * root)) / 3.0)
    return np.concatenate([loads[..., :3] / stiffness[..., :3], STIFFENS_AT_RAD * u], axis=-1)


def _coupling(k):
    """(..., 3, 3) N m rad, symmetric and without diagonal, so that an energy exists."""
    scale = np.sqrt(k) * STIFFENS_AT_RAD
    return COUPLING * scale[..., :, None] * scale[..., None, :] * (1.0 - np.eye(3))


SPRINGS: dict[str, Springs] = {"linear": _linear, "stiffening": _stiffening}

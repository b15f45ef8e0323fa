"""A serial spine chain in bare numbers, the one thing all peers are built from.

Joint coordinates are anterior, superior, right (m), extension, right_bending, left_rotation (rad),
all zero in the neutral pose. The upper joint frame stands in the lower one at
``Trans(anterior, superior, right) Rz(extension) Rx(right_bending) Ry(left_rotation)``.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

EARTH = np.array([0.0, -9.81, 0.0])
WEIGHTLESS = np.zeros(3)


@dataclass(frozen=True)
class Load:
    """A constant load on one body.

    Attributes
    ----------
    body : index of the loaded body; body i is the upper body of joint i.
    force : (3,) N, fixed in ground.
    moment : (3,) N m, fixed in ground.
    point : (3,) m, where the force acts: a material point of the body, in ground when neutral.
    """

    body: int
    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    point: Array = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Chain:
    """J joints and J moving bodies, caudal to cranial; the body below joint 0 is ground.

    Attributes
    ----------
    origins : (J, 3) m, joint origins in ground, neutral pose.
    rotations : (J, 3, 3) joint axes as columns, in ground, neutral pose.
    masses : (J,) kg.
    centres : (J, 3) m, centres of mass in ground, neutral pose.
    inertias : (J, 3, 3) kg m2, about the centre of mass, ground axes, neutral pose.
    stiffness : (J, 6) N/m and N m/rad.
    damping : (J, 6) N s/m and N m s/rad.
    loads : constant loads.
    gravity : (3,) m/s2, in ground.
    """

    origins: Array
    rotations: Array
    masses: Array
    centres: Array
    inertias: Array
    stiffness: Array
    damping: Array
    loads: tuple[Load, ...] = ()
    gravity: Array = field(default_factory=EARTH.copy)

    @property
    def n_joints(self) -> int:
        """Number of joints J."""
        return len(self.masses)

    def with_loads(self, *loads: Load) -> "Chain":
        """The same chain under other loads."""
        return replace(self, loads=loads)

    def with_stiffness(self, stiffness: Array) -> "Chain":
        """The same chain with other stiffness values, (J, 6)."""
        return replace(self, stiffness=np.array(stiffness))


def rotation_zxy(extension: float, right_bending: float, left_rotation: float) -> Array:
    """``Rz(extension) Rx(right_bending) Ry(left_rotation)``, written out by hand."""
    (cz, cx, cy) = np.cos([extension, right_bending, left_rotation])
    (sz, sx, sy) = np.sin([extension, right_bending, left_rotation])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return about_z @ about_x @ about_y


def displacements(chain: Chain, q: Array) -> Array:
    """Carry each body from the neutral pose to pose q: (J, 4, 4), ground to ground.

    A material point that is at p in ground when neutral is at ``T[i] @ (p, 1)`` in pose q.
    """
    carried = np.eye(4)
    transforms = []
    for origin, axes, coordinates in zip(chain.origins, chain.rotations, q, strict=True):
        frame = _transform(axes, origin)
        moved = _transform(rotation_zxy(*coordinates[3:]), coordinates[:3])
        carried = carried @ frame @ moved @ np.linalg.inv(frame)
        transforms.append(carried)
    return np.array(transforms)


def random_chain(rng: np.random.Generator, n_joints: int, tilt_deg: float = 25.0) -> Chain:
    """A stable chain with tilted frames, odd bodies and every coordinate loaded.

    Stiffness spans 1e4-1e6 N/m and 20-300 N m/rad. The uppermost body carries up to 7.5 N m and
    100 N per axis; the others less, the more joints there are.
    """
    shape = (n_joints, 3)
    steps = np.array([0.0, 0.036, 0.0]) + rng.uniform(-0.006, 0.006, shape)
    origins = np.cumsum(steps, axis=0)
    tilts = np.deg2rad(tilt_deg) * rng.uniform(-1, 1, shape) / np.sqrt(3)
    ones = np.ones((1, 3))
    return Chain(
        origins=origins,
        rotations=Rotation.from_rotvec(tilts).as_matrix(),
        masses=rng.uniform(0.05, 0.5, n_joints),
        centres=origins + rng.uniform(-0.02, 0.02, shape) + np.array([0.0, 0.018, 0.0]),
        inertias=np.array([_random_inertia(rng) for _ in range(n_joints)]),
        stiffness=np.hstack([10 ** rng.uniform(4, 6, shape), rng.uniform(20, 300, shape)]),
        damping=np.hstack([1000 * ones, 2.3 * ones]).repeat(n_joints, axis=0),
        loads=tuple(_random_load(rng, origins[i], i, n_joints) for i in range(n_joints)),
    )


def t12_s1_chain() -> Chain:
    """Six joints, L5S1 to T12L1, lordotic; the literature stiffness and damping of Gould 2024b."""
    levels_deg = np.array([-25.0, -14.0, -6.0, 1.0, 6.0, 9.0])
    stiffness = (149_000.0, 1_890_000.0, 135_000.0, 51.0, 68.8, 291.0)
    damping = (1000.0, 1000.0, 1000.0, 2.3, 2.3, 2.3)
    return lordotic_chain(levels_deg, mass=0.1, stiffness=stiffness, damping=damping)


def l1_l4_chain(top_mass: float = 1.0) -> Chain:
    """Three joints, L3L4 to L1L2; the uppermost body carries the pot (Gould 2024a)."""
    levels_deg = np.array([-6.0, 1.0, 6.0])
    stiffness = (149_000.0, 1_890_000.0, 135_000.0, 51.0, 68.8, 291.0)
    damping = (1000.0, 1000.0, 1000.0, 1.4, 1.4, 1.4)
    chain = lordotic_chain(levels_deg, mass=0.1, stiffness=stiffness, damping=damping)
    return replace(
        chain,
        masses=np.array([0.1, 0.1, top_mass]),
        inertias=chain.inertias * np.array([1.0, 1.0, top_mass / 0.1])[:, None, None],
    )


def lordotic_chain(
    levels_deg: Array,
    mass: float,
    stiffness: tuple[float, ...],
    damping: tuple[float, ...],
    spacing: float = 0.036,
) -> Chain:
    """A sagittally symmetric chain whose joints are turned ``levels_deg`` about +z (extension).

    Each joint lies ``spacing`` (m) along the mean superior axis of the two joints beside the step;
    each centre of mass lies halfway to the next joint.
    """
    n_joints = len(levels_deg)
    rotations = np.array([rotation_zxy(np.deg2rad(level), 0.0, 0.0) for level in levels_deg])
    superior = rotations[:, :, 1]
    steps = np.vstack([np.zeros(3), spacing * 0.5 * (superior[1:] + superior[:-1])])
    origins = np.cumsum(steps, axis=0)
    return Chain(
        origins=origins,
        rotations=rotations,
        masses=np.full(n_joints, mass),
        centres=origins + 0.5 * spacing * superior,
        inertias=np.tile(mass * np.diag([1.5e-4, 2.5e-4, 1.5e-4]), (n_joints, 1, 1)),
        stiffness=np.tile(stiffness, (n_joints, 1)),
        damping=np.tile(damping, (n_joints, 1)),
    )


def _transform(rotation: Array, origin: Array) -> Array:
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = origin
    return transform


def _random_inertia(rng: np.random.Generator) -> Array:
    """Principal moments of a cloud of mass, so the triangle inequality holds; random axes."""
    (a, b, c) = rng.uniform(2e-5, 2e-4, 3)
    axes = Rotation.random(rng=rng).as_matrix()
    return axes @ np.diag([b + c, c + a, a + b]) @ axes.T


def _random_load(rng: np.random.Generator, origin: Array, body: int, n_bodies: int) -> Load:
    share = 1.0 if body == n_bodies - 1 else 1.0 / n_bodies
    return Load(
        body=body,
        force=share * rng.uniform(-100, 100, 3),
        moment=share * rng.uniform(-7.5, 7.5, 3),
        point=origin + rng.uniform(-0.03, 0.03, 3),
    )

"""The only file that imports pybullet: rigid-body terms of a model, guarded against its traps.

One client per process, reset before each model: removing and reloading a body leaves stale
dynamics behind. Link poses are never read (single precision in part); every quantity comes from
inverse dynamics, Jacobians or the mass matrix, which are exact to rounding.
"""

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator
from functools import cache
from tempfile import NamedTemporaryFile

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model.spine import RefusedModel, SpineModel
from spinepipe.model.urdf import urdf

_STREAMS = (1, 2)


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Swallow what C code prints on standard output and error of the process."""
    flush = ctypes.CDLL(None).fflush
    sys.stdout.flush()
    flush(None)
    saved = [os.dup(stream) for stream in _STREAMS]
    sink = os.open(os.devnull, os.O_WRONLY)
    for stream in _STREAMS:
        os.dup2(sink, stream)
    try:
        yield
        flush(None)
    finally:
        for stream, copy in zip(_STREAMS, saved, strict=True):
            os.dup2(copy, stream)
            os.close(copy)
        os.close(sink)


with _silent():  # PyBullet greets on import
    import pybullet

_FLAGS = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_MAINTAIN_LINK_ORDER
_LAST_LINK = 5
_UNIT_GRAVITY = np.eye(3)


class StaleChain(RuntimeError):
    """A chain was used after another model had been loaded into the same client."""


class _Client:
    """The process's one physics client and the count of models it has been given."""

    def __init__(self) -> None:
        self.id = pybullet.connect(pybullet.DIRECT)
        self.generation = 0

    def load(self, model: SpineModel) -> int:
        """Reset and load; the file name is new each time, PyBullet caches by name.

        No folder is kept between loads: nobody would remove it when the process is ended outright.
        """
        pybullet.resetSimulation(physicsClientId=self.id)
        self.generation += 1
        name = f"spinepipe-{os.getpid()}-{self.generation}-"
        with NamedTemporaryFile("w", prefix=name, suffix=".urdf", encoding="ascii") as file:
            file.write(urdf(model))
            file.flush()
            try:
                body = pybullet.loadURDF(
                    file.name, useFixedBase=True, flags=_FLAGS, physicsClientId=self.id
                )
            except pybullet.error as error:
                raise RefusedModel(
                    f"{model.specimen}: PyBullet refused the model ({error})"
                ) from error
        return int(body)


@cache
def _client_of(_process: int) -> _Client:
    return _Client()


class Chain:
    """Rigid-body terms of one loaded model; n = 6 x joints coordinates, SI, ground axes."""

    def __init__(self, model: SpineModel) -> None:
        """Load the model, replacing whatever the process had loaded.

        Raises
        ------
        RefusedModel
            When PyBullet does not take it.
        """
        self._client = _client_of(os.getpid())
        self._body = self._client.load(model)
        self._generation = self._client.generation
        self.model = model
        self.n = 6 * model.n_joints
        self._zero = [0.0] * self.n
        with _silent():  # axes that are off unit length by rounding are worth no warning
            self._inverse_dynamics(self._zero, self._zero)
        self._principal = [self._principal_axes(j) for j in range(model.n_joints)]
        self._gravity_now: tuple[float, ...] | None = None

    def _ready(self) -> None:
        if self._client.generation != self._generation:
            raise StaleChain("another model was loaded since; load this one again")

    def _principal_axes(self, body: int) -> Array:
        """(3, 3) principal axes of inertia in the joint frame.

        PyBullet measures a Jacobian's local point from the link's origin, but along these axes.

        Raises
        ------
        RefusedModel
            When PyBullet has put zero in place of an inertia that no body can have.
        """
        info = pybullet.getDynamicsInfo(
            self._body, 6 * body + _LAST_LINK, physicsClientId=self._client.id
        )
        given = self.model.bodies[body]
        if not np.isclose(sum(info[2]), np.trace(given.inertia), rtol=1e-9, atol=0.0):
            raise RefusedModel(f"body {given.name}: PyBullet does not take its inertia")
        return np.array(pybullet.getMatrixFromQuaternion(info[4])).reshape(3, 3)

    def _set_gravity(self, gravity: Array) -> None:
        wanted = tuple(gravity.tolist())
        if wanted != self._gravity_now:
            pybullet.setGravity(*wanted, physicsClientId=self._client.id)
            self._gravity_now = wanted

    def _inverse_dynamics(self, q: list[float], rate: list[float]) -> tuple[float, ...]:
        load: tuple[float, ...] = pybullet.calculateInverseDynamics(
            self._body, q, rate, self._zero, physicsClientId=self._client.id
        )
        return load

    def local_point(self, body: int, point: Array) -> Array:
        """(3,) a body's point, given in ground at the neutral pose, in its joint frame, m."""
        frame = self.model.frames[body]
        local: Array = frame.rotation.T @ (point - frame.origin)
        return local

    def mass_velocity(self, q: Array) -> Array:
        """(n, 3) sum over bodies of mass times centre-of-mass velocity by coordinate rate, kg.

        Its product with gravity is the generalised weight. Read off inverse dynamics under unit
        gravity along each axis.
        """
        self._ready()
        at = q.tolist()
        columns = []
        for direction in _UNIT_GRAVITY:
            self._set_gravity(direction)
            columns.append(self._inverse_dynamics(at, self._zero))
        return -np.array(columns).T

    def jacobian(self, q: Array, body: int, local_point: Array) -> tuple[Array, Array]:
        """(n, 3) linear and (n, 3) angular velocity by coordinate rate of a body's point.

        Parameters
        ----------
        q : (n,) coordinates, m and rad.
        body : index of the vertebra, caudal to cranial.
        local_point : (3,) m in the frame of the joint that carries the body.
        """
        self._ready()
        linear, angular = pybullet.calculateJacobian(
            self._body,
            6 * body + _LAST_LINK,
            (local_point @ self._principal[body]).tolist(),
            q.tolist(),
            self._zero,
            self._zero,
            physicsClientId=self._client.id,
        )
        return np.array(linear).T, np.array(angular).T

    def mass_matrix(self, q: Array) -> Array:
        """(n, n) generalised mass matrix."""
        self._ready()
        return np.array(
            pybullet.calculateMassMatrix(self._body, q.tolist(), physicsClientId=self._client.id)
        )

    def bias(self, q: Array, rate: Array, gravity: Array) -> Array:
        """(n,) generalised load needed by inertia at this rate and by gravity (3,)."""
        self._ready()
        self._set_gravity(gravity)
        return np.array(self._inverse_dynamics(q.tolist(), rate.tolist()))

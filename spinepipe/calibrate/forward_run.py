"""One forward run as users of multibody tools make it: a general-purpose implicit integrator.

It stands beside `spinepipe.statics.settle`, whose end is a smoother function of the stiffness than
that of any of these tools; that smoothness is what a fit by difference quotients lives on.

The integrator is LSODA (scipy's; variable order, variable step, its own difference Jacobian): of
what scipy has, its noise is nearest to that of OpenSim's CPodes, of the same family. Relative
error of the cost's derivative (difference step 1.5e-8 of the stiffness, 12 stiffness sets, the
L1-L4 segment, accuracy 1e-5), median and largest:

    OpenSim 4.6 CPodes                  0.5     7
    LSODA, difference Jacobian          0.06    0.3     <- here
    scipy's BDF, difference Jacobian    2e-4    2e-3
    LSODA, exact Jacobian               7e-6    1e-2
    scipy's BDF, exact Jacobian         8e-8    2e-7
    `settle`                            6e-8    3e-7

At a step of 1e-3 all have 1.7e-3, the curvature of the cost. So the noise is that of iterating
with a rough Jacobian, and what follows from it is understated here. OpenSim's default integrator,
explicit Runge-Kutta-Merson, has 1e-3 (one stiffness set), at 29 s per run. scipy's VODE, nearest
kin of CPodes, transposes the Jacobian in release 1.17 (scipy issue 24933) and cannot be used.
"""

import warnings

import numpy as np
from scipy.integrate import ode
from scipy.linalg.lapack import dpotrf, dpotrs

from spinepipe.effects.contract import Array
from spinepipe.statics import Loading, System
from spinepipe.statics.holding import NO_STATES
from spinepipe.statics.motion import ChainMotion

ABSOLUTE_SHARE = 0.1
"""Absolute tolerance (m, rad, m/s, rad/s) per relative one: that of Simbody's CPodes integrator."""

MOST_STEPS = 5000
"""A run to rest takes some 200; one that needs so many is lost."""


def forward_run(
    system: System, loading: Loading, duration_s: float, accuracy: float
) -> Array | None:
    """(n,) pose after a time under constant load, from rest in the neutral pose; None if lost.

    The caller sees to it that the chain has inertia and no path effects.
    """
    motion = _Motion(system, loading)
    integrator = ode(motion.rate).set_integrator(
        "lsoda",
        rtol=accuracy,
        atol=ABSOLUTE_SHARE * accuracy,
        nsteps=MOST_STEPS,
        with_jacobian=True,  # its own, by differences: no user of these tools has an exact one
    )
    integrator.set_initial_value(np.zeros(2 * system.chain.n), 0.0)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # why a run is lost: the caller learns that it is
        end: Array = integrator.integrate(duration_s)
    pose = end[: system.chain.n]
    return pose if integrator.successful() and np.isfinite(pose).all() else None


class _Motion:
    """The damped equations of motion under a constant load, as a first-order system."""

    def __init__(self, system: System, loading: Loading) -> None:
        self.system, self.loading = system, loading
        self.damping = system.model.damping.ravel()
        self.gravity = loading.share * system.model.gravity
        self._pose, self._held, self._lower = b"", np.empty(0), np.empty(0)

    def rate(self, _time: float, state: Array) -> Array:
        """(2n,) rate of change of pose and rate."""
        q, rate = state[: self.system.chain.n], state[self.system.chain.n :]
        self._place(q)
        inertia_and_weight = self.system.chain.bias(q, rate, self.gravity)
        force = -self._held - inertia_and_weight - self.damping * rate
        acceleration, _ = dpotrs(self._lower, force, lower=True)
        return np.concatenate([rate, acceleration])

    def _place(self, q: Array) -> None:
        """What depends on the pose alone; asked for again when only rates have been varied."""
        if q.tobytes() == self._pose:
            return
        chain = self.system.chain
        motion = ChainMotion(chain, q)
        self._held = self.system.weightless_residual(motion, self.loading, NO_STATES)
        self._lower, _ = dpotrf(chain.mass_matrix(q), lower=True)
        self._pose = q.tobytes()

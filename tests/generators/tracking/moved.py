"""A person moved in MuJoCo: pelvis on a seat, trunk bent by torques or by muscles."""

from dataclasses import dataclass, fields

import mujoco
import numpy as np

from tests.generators.tracking.driven import LARGEST_DEG, Muscles, Torques
from tests.generators.tracking.engine import STEP_S, built
from tests.generators.tracking.laws import TRANSLATION_N_PER_M, Array, resisted
from tests.generators.tracking.person import Person

SETTLES_S = 1.5
_SEAT = np.array([2e5] * 3 + [4e3] * 3)
"""N/m and N m/rad."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion as it was.

    Attributes
    ----------
    time_s : (F,). turns : (F, 18, 3, 3), places : (F, 18, 3) m of bodies in ground. q, speed :
        (F, 18, 6) coordinates, m and rad, and their rates. passive, active : (F, 17, 6) N and N m
        that joints resist with, and that are done to them. bent : (F,) share of a whole flexion.
    """

    time_s: Array
    turns: Array
    places: Array
    q: Array
    speed: Array
    passive: Array
    active: Array
    bent: Array


@dataclass(frozen=True)
class Filmed:
    """How often and how long a trial is seen."""

    rate_hz: float
    long_s: float

    @property
    def frames(self) -> int:
        """First and last included."""
        return round(self.rate_hz * self.long_s) + 1

    @property
    def every(self) -> int:
        """Steps of the engine from a frame to the next."""
        return round(1.0 / self.rate_hz / STEP_S)


def moved(
    person: Person, kind: str, generator: str, rng: np.random.Generator, filmed: Filmed
) -> Motion:
    """A trial, after some settling.

    Raises
    ------
    RuntimeError
        If the engine loses the motion.
    """
    model = built(person, generator == "muscles")
    data = mujoco.MjData(model)
    act = Torques(kind, rng) if generator == "torques" else Muscles(model, kind, rng)
    settling = round(SETTLES_S / STEP_S)
    kept: list[tuple[Array, ...]] = []
    for step in range(settling + (filmed.frames - 1) * filmed.every + 1):
        t = max(step - settling, 0) * STEP_S
        share = _share(kind, t / filmed.long_s)
        mujoco.mj_step1(model, data)
        passive = resistance(person, data.qpos[6:].reshape(17, 6))
        active = act(data, share)
        data.qfrc_applied[6:] = (active - passive).ravel()
        data.qfrc_applied[:6] = data.qfrc_bias[:6] - _SEAT * data.qpos[:6]
        if step >= settling and (step - settling) % filmed.every == 0:
            bent = abs(share * LARGEST_DEG[kind] / LARGEST_DEG["flexion_extension"])
            kept.append(_frame(t, data, passive, active, bent))
        mujoco.mj_step2(model, data)
    if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
        raise RuntimeError(f"the engine lost a {kind}")
    return Motion(*(np.array(column) for column in zip(*kept, strict=True)))


def _frame(
    t: float, data: mujoco.MjData, passive: Array, active: Array, bent: float
) -> tuple[Array, ...]:
    """One frame's values, in the order of `Motion`."""
    found = (
        np.array(t),
        data.xmat[1:].reshape(18, 3, 3).copy(),
        data.xpos[1:].copy(),
        data.qpos.reshape(18, 6).copy(),
        data.qvel.reshape(18, 6).copy(),
        passive,
        active,
        np.array(bent),
    )
    assert len(found) == len(fields(Motion))
    return found


def _share(kind: str, x: float) -> float:
    """How far of the whole bend at a share of the time; sideways first left, then right."""
    if kind == "stance":
        return 0.0
    x = min(x, 1.0)
    if kind == "flexion_extension":
        return float(np.sin(np.pi * x) ** 2)
    return float(-np.sin(2.0 * np.pi * x) * (1.0 - np.exp(-30.0 * x * (1.0 - x))))


def resistance(person: Person, q: Array) -> Array:
    """(17, 6) N and N m that joints resist with at q (17, 6); damping is the engine's own."""
    found = np.zeros((17, 6))
    found[:, :3] = np.array(TRANSLATION_N_PER_M) * q[:, :3]
    found[:, 3:] = resisted(person.curves_nm, q[:, 3:])
    return found

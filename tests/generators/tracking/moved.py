"""A person moved in MuJoCo: pelvis on a seat, trunk bent by torques or by muscles."""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.generators.tracking.person import (
    BODIES,
    TRANSLATION_N_PER_M,
    Array,
    Person,
)

STEP_S = 0.001
AXES = ("1 0 0", "0 1 0", "0 0 1")
TURNS = ("0 0 1", "1 0 0", "0 1 0")

LARGEST_DEG = {"flexion_extension": -48.0, "lateral_bending": 24.0, "stance": 0.0}
"""Of T1 against the pelvis: forwards is negative, to the right positive."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion as it was.

    Attributes
    ----------
    time_s : (F,). turns : (F, 18, 3, 3), places : (F, 18, 3) m of bodies in ground. q : (F, 17, 6)
        coordinates of joints, m and rad. passive_nm, active_nm : (F, 17, 3) about z, x, y.
    bent : (F,) from 0 to 1, share of the whole bend.
    """

    time_s: Array
    turns: Array
    places: Array
    q: Array
    passive_nm: Array
    active_nm: Array
    bent: Array


def moved(
    person: Person,
    kind: str,
    generator: str,
    rng: np.random.Generator,
    rate_hz: float,
    long_s: float,
) -> Motion:
    """A trial, after 1.5 s of settling."""
    model = mujoco.MjModel.from_xml_string(_xml(person, generator == "muscles"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    act = (
        _Torques(person, model, kind, rng)
        if generator == "torques"
        else _Muscles(person, model, kind, rng)
    )
    settle, frames = 1.5, int(round(rate_hz * long_s)) + 1
    every = int(round(1.0 / rate_hz / STEP_S))
    kept: list[tuple[Array, ...]] = []
    while len(kept) < frames:
        step = int(round((data.time - settle) / STEP_S))
        t = max(data.time - settle, 0.0)
        share = _share(kind, t, long_s)
        passive = _passive(person, data.qpos[6:].reshape(17, 6))
        active = act(data, share)
        data.qfrc_applied[6:] = (active - passive).ravel()
        data.qfrc_applied[:6] = _seat(data)
        if step >= 0 and step % every == 0:
            kept.append(
                (
                    np.array(t),
                    data.xmat[1:].reshape(18, 3, 3).copy(),
                    data.xpos[1:].copy(),
                    data.qpos[6:].reshape(17, 6).copy(),
                    passive[:, 3:].copy(),
                    active[:, 3:].copy(),
                    np.array(abs(share)),
                )
            )
        mujoco.mj_step(model, data)
    columns = [np.array(column) for column in zip(*kept, strict=True)]
    return Motion(*columns)


def _share(kind: str, t: float, long_s: float) -> float:
    """How far of the whole bend; to the left and then to the right when bending sideways."""
    if kind == "stance":
        return 0.0
    x = min(t / long_s, 1.0)
    if kind == "flexion_extension":
        return float(np.sin(np.pi * x) ** 2)
    return float(-np.sin(2.0 * np.pi * x) * (1.0 - np.exp(-30.0 * x * (1.0 - x))))


def _seat(data: mujoco.MjData) -> Array:
    """What holds the pelvis on the seat."""
    stiff = np.array([2e5] * 3 + [4e3] * 3)
    found: Array = data.qfrc_bias[:6] - stiff * data.qpos[:6]
    return found


def _passive(person: Person, q: Array) -> Array:
    """(17, 6) that joints resist with; damping is the engine's own."""
    found = np.zeros((17, 6))
    found[:, :3] = np.array(TRANSLATION_N_PER_M) * q[:, :3]
    knots = person.knots_rad
    at = np.clip((q[:, 3:] - knots[0]) / (knots[1] - knots[0]), 0.0, len(knots) - 1.001)
    low = at.astype(int)
    level, axis = np.ogrid[:17, :3]
    before, after = person.curves_nm[level, axis, low], person.curves_nm[level, axis, low + 1]
    found[:, 3:] = before + (at - low) * (after - before)
    return found


class _Torques:
    """A controller of the whole bend, with torques at all joints that carry most of the weight.

    Joints are also stiffened a little while the trunk works: both sides pull together.
    """

    def __init__(
        self, person: Person, model: mujoco.MjModel, kind: str, rng: np.random.Generator
    ) -> None:
        self.kind, self.wanted = kind, np.deg2rad(LARGEST_DEG[kind] * rng.uniform(0.9, 1.1))
        self.axis = 1 if kind == "lateral_bending" else 0
        self.weights = rng.lognormal(0.0, 0.25, 17)
        self.carried = rng.uniform(0.85, 1.0, 17)
        self.together = rng.uniform(5.0, 20.0, 17)
        self.sum = 0.0

    def __call__(self, data: mujoco.MjData, share: float) -> Array:
        q, speed = data.qpos[6:].reshape(17, 6), data.qvel[6:].reshape(17, 6)
        found = np.zeros((17, 6))
        found[:, 3:] = self.carried[:, None] * data.qfrc_bias[6:].reshape(17, 6)[:, 3:]
        found[:, 3:] -= self.together[:, None] * (0.3 + abs(share)) * q[:, 3:]
        off = self.wanted * share - q[:, 3 + self.axis].sum()
        self.sum += STEP_S * off
        pull = 60.0 * off + 60.0 * self.sum - 2.0 * speed[:, 3 + self.axis].sum()
        found[:, 3 + self.axis] += self.weights * pull
        for other in range(3):
            if other != self.axis:
                found[:, 3 + other] -= 30.0 * q[:, 3 + other].sum()
        return found


class _Muscles:
    """Muscles that span several joints, each pulling towards the length it is meant to have."""

    def __init__(
        self, person: Person, model: mujoco.MjModel, kind: str, rng: np.random.Generator
    ) -> None:
        self.model, self.kind = model, kind
        self.wanted = np.deg2rad(LARGEST_DEG[kind] * rng.uniform(0.9, 1.1))
        self.axis = 1 if kind == "lateral_bending" else 0
        share = np.array([0.16, 0.17, 0.16, 0.14, 0.12, 0.08, *[0.17 / 11] * 11])
        self.share = share * rng.lognormal(0.0, 0.2, 17)
        self.share /= self.share.sum()
        self.stiff = rng.uniform(1.0e4, 2.0e4, model.ntendon)
        self.tone = rng.uniform(5.0, 25.0, model.ntendon)
        self.other = mujoco.MjData(model)

    def __call__(self, data: mujoco.MjData, share: float) -> Array:
        self.other.qpos[:] = 0.0
        target = self.other.qpos[6:].reshape(17, 6)
        target[:, 3 + self.axis] = self.wanted * share * self.share
        mujoco.mj_fwdPosition(self.model, self.other)
        off = data.ten_length - self.other.ten_length
        force = np.maximum(self.tone + self.stiff * off + 150.0 * data.ten_velocity, 0.0)
        m = self.model
        arms = np.zeros((m.ntendon, m.nv))
        mujoco.mju_sparse2dense(arms, data.ten_J, m.ten_J_rownnz, m.ten_J_rowadr, m.ten_J_colind)
        return -(force @ arms)[6:].reshape(17, 6)


def _xml(person: Person, muscles: bool) -> str:
    """The chain as MuJoCo reads it; ground is y up."""
    parts, closing = [], ""
    for k, body in enumerate(BODIES):
        step = person.steps[k - 1] if k else np.zeros(3)
        turn = person.turns[k - 1] if k else np.eye(3)
        w = Rotation.from_matrix(turn).as_quat(scalar_first=True)
        parts.append(f'<body name="{body}" pos="{_row(step)}" quat="{_row(w)}">')
        drag = (12000.0, 240.0) if k == 0 else (600.0, 1.2)
        for n in range(6):
            kind, axes = ("slide", AXES) if n < 3 else ("hinge", TURNS)
            parts.append(
                f'<joint name="{body}_{n}" type="{kind}" axis="{axes[n % 3]}" '
                f'damping="{drag[n // 3]}" armature="{0.0 if n < 3 else 1e-3}"/>'
            )
        parts.append(
            f'<inertial pos="{_row(person.com[k])}" mass="{person.kg[k]:.9g}" '
            f'diaginertia="{_row(person.about[k])}"/>'
        )
        parts += [
            f'<site name="{body}_{name}" pos="{_row(at)}"/>' for name, at in _sites(body).items()
        ]
        closing += "</body>"
    tendons = "".join(map(_tendon, _lines())) if muscles else ""
    return (
        f'<mujoco><option timestep="{STEP_S}" gravity="0 -9.81 0" integrator="implicitfast">'
        '<flag contact="disable"/></option><compiler angle="radian" inertiafromgeom="false" '
        'balanceinertia="true" boundmass="0"/><size memory="64M"/>'
        f"<worldbody>{''.join(parts)}{closing}</worldbody><tendon>{tendons}</tendon></mujoco>"
    )


def _row(values: Array) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _sites(body: str) -> dict[str, Array]:
    """Where muscles take hold, right and left: behind, beside and, of a few, ahead."""
    found = {}
    for side, z in (("r", 1.0), ("l", -1.0)):
        found[f"back_{side}"] = np.array([-0.055, 0.0, 0.02 * z])
        found[f"aside_{side}"] = np.array([0.0, 0.0, 0.09 * z])
        if body in ("S1", "T12", "T8"):
            found[f"front_{side}"] = np.array([0.13, 0.0, 0.06 * z])
    return found


def _lines() -> list[tuple[str, ...]]:
    """Sites of muscles, one side after the other."""
    found: list[tuple[str, ...]] = []
    for s in "rl":
        for low in range(0, 15):
            found.append((f"{BODIES[low]}_back_{s}", f"{BODIES[low + 2]}_back_{s}"))
            found.append((f"{BODIES[low]}_aside_{s}", f"{BODIES[low + 3]}_aside_{s}"))
        for top in ("L3", "T12", "T9", "T6", "T3", "T1"):
            path = BODIES[: BODIES.index(top) + 1 : 3]
            stops = [*path, *([top] if path[-1] != top else [])]
            found.append(tuple(f"{body}_back_{s}" for body in stops))
        for bottom, top in (("S1", "T12"), ("S1", "T8")):
            found.append((f"{bottom}_front_{s}", f"{top}_front_{s}"))
    return found


def _tendon(path: tuple[str, ...]) -> str:
    return "<spatial>" + "".join(f'<site site="{name}"/>' for name in path) + "</spatial>"

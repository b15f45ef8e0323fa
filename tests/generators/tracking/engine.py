"""A person in the language of MuJoCo: a chain of bodies on a seat, with muscles if wanted."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.generators.tracking.laws import Array
from tests.generators.tracking.person import BODIES, Person

STEP_S = 0.0005
MUSCLE_DRAG_N_S_PER_M = 800.0

_AXES = ("1 0 0", "0 1 0", "0 0 1")
_TURNS = ("0 0 1", "1 0 0", "0 1 0")
_FRONT = ("S1", "T12", "T8")
_SEAT_DRAG, _JOINT_DRAG = (12000.0, 240.0), (600.0, 1.2)
"""Damping of translations, N s/m, and of rotations, N m s/rad."""


def built(person: Person, muscles: bool) -> mujoco.MjModel:
    """The chain; ground is y up. Passive moments are not in it."""
    parts = []
    for k, body in enumerate(BODIES):
        step = person.steps[k - 1] if k else np.zeros(3)
        turn = person.turns[k - 1] if k else np.eye(3)
        w = Rotation.from_matrix(turn).as_quat(scalar_first=True)
        parts.append(f'<body name="{body}" pos="{_row(step)}" quat="{_row(w)}">')
        parts += _joints(body, _JOINT_DRAG if k else _SEAT_DRAG)
        parts.append(
            f'<inertial pos="{_row(person.com[k])}" mass="{person.kg[k]:.9g}" '
            f'diaginertia="{_row(person.about[k])}"/>'
        )
        parts += [
            f'<site name="{body}_{name}" pos="{_row(at)}"/>' for name, at in _sites(body).items()
        ]
    tendons = "".join(map(_tendon, _lines())) if muscles else ""
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP_S}" gravity="0 -9.81 0" integrator="implicitfast">'
        '<flag contact="disable"/></option><compiler angle="radian" inertiafromgeom="false" '
        'balanceinertia="true" boundmass="0"/><size memory="64M"/>'
        f"<worldbody>{''.join(parts)}{'</body>' * len(BODIES)}</worldbody>"
        f"<tendon>{tendons}</tendon></mujoco>"
    )


def _joints(body: str, drag: tuple[float, float]) -> list[str]:
    found = []
    for n in range(6):
        kind, axes = ("slide", _AXES) if n < 3 else ("hinge", _TURNS)
        found.append(
            f'<joint name="{body}_{n}" type="{kind}" axis="{axes[n % 3]}" '
            f'damping="{drag[n // 3]}" armature="{0.0 if n < 3 else 1e-3}"/>'
        )
    return found


def _row(values: Array) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _sites(body: str) -> dict[str, Array]:
    """Where muscles take hold, right and left: behind, beside and, of a few, ahead."""
    found = {}
    for side, z in (("r", 1.0), ("l", -1.0)):
        found[f"back_{side}"] = np.array([-0.055, 0.0, 0.02 * z])
        found[f"aside_{side}"] = np.array([0.0, 0.0, 0.09 * z])
        if body in _FRONT:
            found[f"front_{side}"] = np.array([0.13, 0.0, 0.06 * z])
    return found


def _lines() -> list[tuple[str, ...]]:
    """Sites of muscles, one side after the other."""
    found: list[tuple[str, ...]] = []
    for s in "rl":
        for low in range(15):
            found.append((f"{BODIES[low]}_back_{s}", f"{BODIES[low + 2]}_back_{s}"))
            found.append((f"{BODIES[low]}_aside_{s}", f"{BODIES[low + 3]}_aside_{s}"))
        for top in ("L3", "T12", "T9", "T6", "T3", "T1"):
            path = BODIES[: BODIES.index(top) + 1 : 3]
            stops = [*path, *([top] if path[-1] != top else [])]
            found.append(tuple(f"{body}_back_{s}" for body in stops))
        for bottom, top in (("S1", "T12"), ("S1", "T8")):
            found.append((f"{bottom}_front_{s}", f"{top}_front_{s}"))
        other = "l" if s == "r" else "r"
        for low in range(0, 15, 2):
            found.append((f"{BODIES[low]}_aside_{s}", f"{BODIES[low + 3]}_back_{other}"))
        found.append((f"S1_front_{s}", f"T12_aside_{other}"))
        found.append((f"T12_front_{s}", f"T8_aside_{other}"))
    return found


def _tendon(path: tuple[str, ...]) -> str:
    sites = "".join(f'<site site="{name}"/>' for name in path)
    return f'<spatial damping="{MUSCLE_DRAG_N_S_PER_M}">{sites}</spatial>'

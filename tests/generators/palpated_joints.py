"""Single joints whose stiffness and true landmarks are known, felt with an error: small phantoms.

Everything is to first order in motion of a thousandth of a radian, so that what is left out is a
thousandth of it, far below the noise. It shares no code with spinepipe.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

START = np.array([1e5, 2e5, 1e5, 60.0, 60.0, 100.0])
"""Stiffness in N/m and N m/rad about anterior, superior, right; extension, bending, rotation."""

FACTOR = 10.0
"""True stiffnesses are as likely anywhere, in their logarithm, within this factor of the start."""

FREE = (0, 1, 3)
"""Which of the six are unknown: anterior, superior, extension."""

SD_MM = 1.0
ROTATION_SD_DEG, TRANSLATION_SD_MM = 0.02, 0.002
"""Noise of a reading: the softest springs yield twenty times as much, the stiffest a fifth."""

MARKS = {
    ("V2", "superior_endplate_centre"): (0.0, -9.0, 0.0),
    ("V1", "superior_endplate_centre"): (1.0, 27.0, 0.0),
    ("V1", "inferior_endplate_centre"): (0.0, 0.0, 0.0),
    ("V1", "left_pedicle_base"): (-20.0, 18.0, -16.0),
    ("V1", "right_pedicle_base"): (-20.0, 18.0, 16.0),
}
LOADS = (
    ((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), (12.0, 30.0, 0.0)),
    ((2.0, -2.0, 0.0), (0.0, 0.0, 0.05), (12.0, 30.0, 0.0)),
    ((-2.0, -1.0, 0.0), (0.0, 0.0, -0.05), (-10.0, 30.0, 0.0)),
)
"""Force in N, moment in N m, and where the force acts in mm; ground."""


@dataclass(frozen=True)
class Joint:
    """One phantom.

    Attributes
    ----------
    stiffness : (6,). felt, true : (5, 3) mm, landmarks in the order of `MARKS`.
    motion : (steps, 6) mm and deg, told in the frame of the felt landmarks.
    """

    stiffness: Array
    felt: Array
    true: Array
    motion: Array


def joint(seed: int) -> Joint:
    """One phantom, all of it drawn."""
    rng = np.random.default_rng([2026, seed])
    stiffness = START.copy()
    stiffness[list(FREE)] *= FACTOR ** rng.uniform(-1.0, 1.0, len(FREE))
    true = np.array(list(MARKS.values()))
    felt = true + SD_MM * rng.normal(size=true.shape)
    motion = _motion(stiffness, true, felt)
    motion[:, :3] += TRANSLATION_SD_MM * rng.normal(size=(len(LOADS), 3))
    motion[:, 3:] += ROTATION_SD_DEG * rng.normal(size=(len(LOADS), 3))
    return Joint(stiffness, felt, true, motion)


def _frame(marks: Array) -> tuple[Array, Array]:
    """Axes as columns (anterior, superior, right) and origin in mm, of the one whole vertebra."""
    below, top, bottom, left, right = marks
    z = (right - left) / np.linalg.norm(right - left)
    x = np.cross(top - bottom, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z]), (below + bottom) / 2.0


def _motion(stiffness: Array, true: Array, felt: Array) -> Array:
    """(steps, 6) mm and deg: springs in the true frame, told in the felt one."""
    (axes, centre), (seen, origin) = _frame(true), _frame(felt)
    rows = []
    for force, moment, point in np.array(LOADS):
        about = np.cross((point - centre) / 1000.0, force) + moment
        shift = axes @ (axes.T @ force / stiffness[:3])
        turns = axes.T @ about / stiffness[[4, 5, 3]]  # bending about x, rotation about y
        turn = axes @ turns
        there = seen.T @ (shift + np.cross(turn, (origin - centre) / 1000.0))
        bending, rotation, extension = np.rad2deg(seen.T @ turn)
        rows.append([*(1000.0 * there), extension, bending, rotation])
    return np.array(rows)


def write(joints: dict[str, Joint], folder: Path) -> None:
    """Write a cohort of them, a specimen each."""
    folder.mkdir(parents=True)
    (folder / "cohort.yaml").write_text(
        f"cohort: {folder.name}\ntitle: palpated joints\nsource: made up\nvertebrae: [V2, V1]\n"
        f"gravity: false\nmeasurement_sd: {{rotation_deg: {ROTATION_SD_DEG}, "
        f"translation_mm: {TRANSLATION_SD_MM}}}\n"
    )
    (folder / "specimens.csv").write_text("\n".join(["specimen", *joints]) + "\n")
    marks = ["specimen,vertebra,landmark,x_mm,y_mm,z_mm,sd_mm"]
    motion = [
        "specimen,test,step,joint,anterior_mm,superior_mm,right_mm,"
        "extension_deg,right_bending_deg,left_rotation_deg"
    ]
    for name, one in joints.items():
        for (vertebra, mark), (x, y, z) in zip(MARKS, one.felt, strict=True):
            marks.append(f"{name},{vertebra},{mark},{x:.9f},{y:.9f},{z:.9f},{SD_MM}")
        motion.append(f"{name},push,0,V1V2,,,,,,")
        for step, row in enumerate(one.motion, start=1):
            motion.append(f"{name},push,{step},V1V2," + ",".join(f"{v:.9f}" for v in row))
    (folder / "landmarks.csv").write_text("\n".join(marks) + "\n")
    (folder / "motion.csv").write_text("\n".join(motion) + "\n")
    loads = ["specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm"]
    loads.append("*,push,0,V1,0,0,0,0,0,0,0,30,0")
    for step, (force, moment, point) in enumerate(LOADS, start=1):
        cells = ",".join(f"{v:g}" for v in (*force, *moment, *point))
        loads.append(f"*,push,{step},V1,{cells}")
    (folder / "loads.csv").write_text("\n".join(loads) + "\n")

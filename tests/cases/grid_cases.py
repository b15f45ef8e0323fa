"""Projects with a range-of-motion study on made-up spines of joint frames only."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from spinepipe.studies.range_of_motion.tables import RANGE_OF_MOTION
from spinepipe.tables import from_rows, write

STUDY = "probe"
STIFFNESS = {
    "anterior_n_per_m": 100000.0,
    "superior_n_per_m": 1000000.0,
    "right_n_per_m": 100000.0,
    "extension_nm_per_rad": 50.0,
    "right_bending_nm_per_rad": 80.0,
    "left_rotation_nm_per_rad": 250.0,
}
VERTEBRAE = ("L4", "L3", "L2", "L1")
JOINTS = ("L3L4", "L2L3", "L1L2")


def project(
    root: Path,
    study: str = "",
    *,
    specimens: Sequence[str] = ("a", "b", "c"),
    tilts_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    header: str = "measurement_sd: {rotation_deg: 3.0, translation_mm: 1.2}\n",
) -> Path:
    """A project with one study; all joint frames of its cohort are tilted alike.

    Parameters
    ----------
    study : lines added to the study file.
    tilts_deg : Z, X', Y'' angles of all joint frames.
    header : lines added to ``cohort.yaml``.
    """
    (root / "config" / "studies").mkdir(parents=True, exist_ok=True)
    cohort = root / "config" / "cohorts" / "stack"
    cohort.mkdir(parents=True, exist_ok=True)
    values = ", ".join(f"{name}: {value}" for name, value in STIFFNESS.items())
    (root / "config" / "studies" / f"{STUDY}.yaml").write_text(
        f"study: {STUDY}\nkind: range_of_motion\ncohort: stack\nstiffness: {{{values}}}\n{study}"
    )
    (root / "config" / "config.yaml").write_text(f"studies: [{STUDY}]\n")
    (cohort / "cohort.yaml").write_text(
        "cohort: stack\ntitle: stacked joints\nsource: written for the tests\n"
        f"vertebrae: [{', '.join(VERTEBRAE)}]\ngravity: false\n{header}"
    )
    (cohort / "specimens.csv").write_text("\n".join(["specimen", *specimens]) + "\n")
    angles = ",".join(map(str, tilts_deg))
    rows = [
        f"{specimen},{joint},0,{36 * number},0,{angles}"
        for specimen in specimens
        for number, joint in enumerate(JOINTS)
    ]
    names = "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"
    (cohort / "joints.csv").write_text("\n".join([names, *rows]) + "\n")
    return root


def table_of(
    root: Path, size: tuple[int, int, int], lost: tuple[tuple[int, int, int], ...] = ()
) -> tuple[Path, pd.DataFrame]:
    """A whole table as a run would write it, with made-up numbers and some runs lost."""
    rng = np.random.default_rng(5)
    rows = []
    for specimen, pose, stiffness in product(*map(range, size)):
        gone = (specimen, pose, stiffness) in lost
        for test, joint in product(("flexion", "left_rotation"), JOINTS):
            values = np.full(6, np.nan) if gone else rng.normal(size=6)
            names = [c.name for c in RANGE_OF_MOTION.columns if c.name.startswith("predicted")]
            rows.append(
                {
                    "specimen": "abc"[specimen],
                    "pose": pose,
                    "stiffness": stiffness,
                    "test": test,
                    "step": 10,
                    "largest_load": True,
                    "joint": joint,
                    **dict(zip(names, values, strict=True)),
                    "status": "unstable" if gone else "converged",
                    "message": "",
                }
            )
    path = root / "range_of_motion.parquet"
    write(from_rows(RANGE_OF_MOTION, rows), path, {})
    return path, pd.DataFrame(rows)


def made_up(tmp_path: Path, size: tuple[int, int, int]) -> Path:
    """A project of so many specimens, poses and stiffness sets."""
    poses, sets = size[1:]
    study = f"poses: {poses}\nstiffness_sets: {sets}\n"
    tests = "virtual_tests: {tests: [flexion, left_rotation]}\n"
    return project(tmp_path, study + tests, specimens="abc"[: size[0]])

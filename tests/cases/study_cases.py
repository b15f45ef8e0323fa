"""Projects of any size with results as a run would write them: tables made up, not computed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import joint_names
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.report.forms.chart import Chart
from spinepipe.schema import Table
from spinepipe.studies.joint_pose_sensitivity.kind import KIND
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import CALIBRATIONS, POSES, SIMULATIONS
from spinepipe.studies.registry import PACKAGE
from spinepipe.tables import to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, STIFFNESS_COLUMNS, TRANSLATIONS

STUDY = "probe"
TABLES = {table.name: table for table in KIND.tables}
FIGURES = tuple(figure.name for figure in KIND.figures)
START = (24600.0, 110000.0, 13500.0, 37.0, 64.0, 268.0)
_POINTS = {
    "superior_endplate_centre": (0.0, 26.0, 0.0),
    "inferior_endplate_centre": (0.0, 0.0, 0.0),
    "left_pedicle_base": (-20.0, 18.0, -15.0),
    "right_pedicle_base": (-20.0, 18.0, 15.0),
}


@dataclass(frozen=True)
class Size:
    """How large a project is, and how its calibrations ended."""

    specimens: tuple[str, ...] = ("a", "b")
    n_joints: int = 2
    poses: int = 12
    free: tuple[str, ...] = ("superior", "extension")
    grouping: str = "per_specimen"
    solved: bool = True
    best: int = 2

    @property
    def vertebrae(self) -> tuple[str, ...]:
        """Names, caudal to cranial."""
        return tuple(f"V{number}" for number in range(self.n_joints + 1, 0, -1))

    @property
    def joints(self) -> tuple[str, ...]:
        """Names, caudal to cranial."""
        return joint_names(self.vertebrae)


def project(root: Path, size: Size) -> Path:
    """A project folder with one sound study and its cohort."""
    cohort = root / "config" / "cohorts" / "straight"
    cohort.mkdir(parents=True)
    (root / "config" / "studies").mkdir()
    (root / "config" / "config.yaml").write_text(f"studies: [{STUDY}]\n")
    (root / "config" / "studies" / f"{STUDY}.yaml").write_text(_study(size))
    vertebrae = ", ".join(size.vertebrae)
    (cohort / "cohort.yaml").write_text(
        "cohort: straight\ntitle: a straight spine\nsource: written for the tests\n"
        f"vertebrae: [{vertebrae}]\ngravity: false\n"
    )
    (cohort / "specimens.csv").write_text("\n".join(["specimen", *size.specimens]) + "\n")
    (cohort / "landmarks.csv").write_text(_landmarks(size))
    top = size.vertebrae[-1]
    header = "specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm"
    at = f"0,{36 * size.n_joints + 13},0"
    steps = [f"*,flexion,{step},{top},0,{-20 * step},0,0,0,{-step},{at}" for step in (0, 1)]
    (cohort / "loads.csv").write_text("\n".join([header, *steps]) + "\n")
    rows = ["specimen,test,step,joint,extension_deg,superior_mm"]
    for specimen in size.specimens:
        for joint in size.joints:
            rows += [f"{specimen},flexion,0,{joint},,", f"{specimen},flexion,1,{joint},-1.5,-0.2"]
    (cohort / "motion.csv").write_text("\n".join(rows) + "\n")
    return root


def _study(size: Size) -> str:
    weights = "{anterior: 0, superior: 1, right: 0, extension: 1}"
    return (
        f"study: {STUDY}\nkind: joint_pose_sensitivity\ncohort: straight\nposes: {size.poses}\n"
        f"best_models: {size.best}\ncalibration:\n  free: [{', '.join(size.free)}]\n"
        f"  grouping: {size.grouping}\n  weights: {weights}\n"
    )


def _landmarks(size: Size) -> str:
    rows = ["specimen,vertebra,landmark,x_mm,y_mm,z_mm,sd_mm"]
    for specimen in size.specimens:
        for level, vertebra in enumerate(size.vertebrae):
            for name in FRAME_LANDMARKS:
                x, y, z = _POINTS[name]
                rows.append(f"{specimen},{vertebra},{name},{x},{y + 36 * level - 26},{z},1")
    return "\n".join(rows) + "\n"


def results(root: Path, size: Size) -> Path:
    """Tables of a finished run in ``results/probe``; returns that folder."""
    folder = root / "results" / STUDY
    rng = np.random.default_rng(7)
    _write(POSES, folder / "poses.parquet", _poses(size, rng))
    _write(CALIBRATIONS, folder / "calibrations.parquet", _calibrations(size, rng))
    _write(SIMULATIONS, folder / "simulations.parquet", _simulations(size, rng))
    return folder


def drawing(
    name: str,
) -> Callable[[JointPoseSensitivity, Cohort, Mapping[str, pd.DataFrame]], Chart]:
    """The function that draws a figure, as the kind declares it."""
    module, _, function = KIND.figure(name).at.partition(":")
    found = import_module(f"{PACKAGE}.joint_pose_sensitivity.{module}")
    draws: Callable[[JointPoseSensitivity, Cohort, Mapping[str, pd.DataFrame]], Chart] = getattr(
        found, function
    )
    return draws


def _write(table: Table, path: Path, rows: list[dict[str, object]]) -> None:
    columns = {c.name: [row.get(c.name) for row in rows] for c in table.columns}
    write(to_arrow(table, columns), path, {})


def _end(size: Size) -> dict[str, object]:
    solved = {"status": "converged", "message": ""}
    return solved if size.solved else {"status": "unstable", "message": "it tips over"}


def _poses(size: Size, rng: np.random.Generator) -> list[dict[str, object]]:
    names = ("x_mm", "y_mm", "z_mm", "extension_deg", "right_bending_deg", "left_rotation_deg")
    rows = []
    for specimen in size.specimens:
        for pose in range(size.poses):
            for level, joint in enumerate(size.joints):
                nominal = np.array([0.0, 36.0 * level + 5.0, 0.0, 0.0, 0.0, 0.0])
                sampled = nominal + rng.normal(0.0, [0.7] * 3 + [2.0] * 3)
                ended = {"status": "converged", "message": ""}
                key = {"specimen": specimen, "pose": pose, "joint": joint}
                rows.append({**key, **dict(zip(names, sampled, strict=True)), **ended})
    return rows


def _calibrations(size: Size, rng: np.random.Generator) -> list[dict[str, object]]:
    joints = size.joints if size.grouping == "per_joint" else ("*",)
    counts = ("degrees_of_freedom", "iterations", "evaluations", "n_optima", "start_stiffened")
    rows = []
    for specimen in size.specimens:
        for pose in range(size.poses):
            for joint in joints:
                row: dict[str, object] = {"specimen": specimen, "pose": pose, "joint": joint}
                row |= dict.fromkeys(counts, 1) | _end(size)
                if size.solved:
                    row |= {"cost": 1.0, **_stiffness(size, rng)}
                rows.append(row)
    return rows


def _stiffness(size: Size, rng: np.random.Generator) -> dict[str, object]:
    row: dict[str, object] = {}
    for name, column, start in zip(COORDINATES, STIFFNESS_COLUMNS, START, strict=True):
        row[column] = start
        if name in size.free:
            row[column] = start * np.exp(rng.normal(0.0, 0.3))
            row[f"{name}_identifiable"] = bool(rng.random() < 0.9)
            if rng.random() < 0.05:
                row |= {column: start * 1000.0, f"{name}_identifiable": False}
    return row


def _simulations(size: Size, rng: np.random.Generator) -> list[dict[str, object]]:
    names = ["calibrated", *(f"best{rank:02d}" for rank in range(1, size.best + 1))]
    rows = []
    for specimen in size.specimens:
        for pose in range(size.poses):
            for name in names:
                stands = size.solved and (name == "calibrated" or rng.random() < 0.8)
                for step in (0, 1):
                    for joint in size.joints:
                        key = {
                            "specimen": specimen,
                            "pose": pose,
                            "stiffness": name,
                            "joint": joint,
                        }
                        case = {"test": "flexion", "cycle": 1, "step": step}
                        rows.append({**key, **case, **_motion(stands, step, rng)})
    return rows


def _motion(stands: bool, step: int, rng: np.random.Generator) -> dict[str, object]:
    row: dict[str, object] = {"unmeasured_taken_as_zero": True, "message": ""}
    row["status"] = "converged" if stands else "unstable"
    for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True):
        if stands:
            row[f"predicted_{column}"] = step * rng.normal(-1.0, 0.2)
        if step and name in ("superior", "extension"):
            row[f"measured_{column}"] = -1.0
            if stands:
                size = 0.05 if name in TRANSLATIONS else 0.4
                row[f"error_{column}"] = rng.normal(0.0, size)
    return row

"""A cohort whose motion is known in closed form: straight chains of coaxial joints in pure moments.

All joint frames are upright and above one another, nothing has weight. A moment about one of the
axes turns every joint about that axis, by moment over stiffness, however large the motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.studies.cohort_stiffness import experiment, fit, left_out, literature, pool
from spinepipe.tables import read_frame

STUDY = "probe"
JOINTS = ("L5S1", "L4L5", "L3L4")
ROTATIONS = ("extension", "right_bending", "left_rotation")
TOP = "L3"
MOMENT_OF = {
    "flexion": ("mz_nm", -1.0, "extension"),
    "left_lateral_bending": ("mx_nm", -1.0, "right_bending"),
    "left_axial_rotation": ("my_nm", 1.0, "left_rotation"),
}
"""Moment about which ground axis, its sign, and the coordinate it drives."""

WRENCH = ("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")
DEGREES = tuple(f"{name}_deg" for name in ROTATIONS)
MILLIMETRES = ("anterior_mm", "superior_mm", "right_mm")

Tables = dict[str, pd.DataFrame]
LEFT_OUT = ("stiffness", "errors")


@dataclass
class Chains:
    """Specimens with their stiffness (3 joints, 3 rotations) in N m/rad, and what was done to them.

    With ``growth`` b in 1/rad, per specimen, joints hold ``k (exp(b |q|) - 1) / b``, so that a
    moment M turns them by ``log(1 + b M / k) / b``.
    ``loads`` and ``motion`` may be changed before they are written.
    """

    stiffness: Mapping[str, Any]
    tests: Sequence[str] = tuple(MOMENT_OF)
    cycles: int = 1
    steps: int = 4
    step_nm: float = 1.0
    noise_deg: float = 0.0
    zeroed: bool = False
    sd: bool = True
    study: str = ""
    growth: Mapping[str, Any] = field(default_factory=dict)
    loads: pd.DataFrame = field(init=False)
    motion: pd.DataFrame = field(init=False)

    def __post_init__(self) -> None:
        """Loads and motion as the closed form has them, with noise."""
        loads, motion = [], []
        rng = np.random.default_rng(5)
        for specimen, test, cycle, step in self._keys():
            column, sign, driven = MOMENT_OF[test]
            moment = sign * self.step_nm * step
            key = {"specimen": specimen, "test": test, "cycle": cycle, "step": step}
            loads.append({**key, "vertebra": TOP, **dict.fromkeys(WRENCH, 0.0), column: moment})
            for level, (joint, k) in enumerate(
                zip(JOINTS, np.asarray(self.stiffness[specimen]), strict=True)
            ):
                linear = moment / k
                if specimen in self.growth:
                    b = np.broadcast_to(self.growth[specimen], (3, 3))[level]
                    linear = np.sign(moment) * np.log1p(b * np.abs(moment) / k) / b
                turned = np.rad2deg(linear) * [name == driven for name in ROTATIONS]
                read = turned + self.noise_deg * rng.normal(size=3)
                motion.append({**key, "joint": joint, **dict(zip(DEGREES, read, strict=True))})
        self.loads, self.motion = pd.DataFrame(loads), pd.DataFrame(motion)
        if self.zeroed:
            keys = ["specimen", "test", "cycle", "joint"]
            first = self.motion.groupby(keys)[list(DEGREES)].transform("first")
            self.motion[list(DEGREES)] -= first

    def _keys(self) -> list[tuple[str, str, int, int]]:
        return [
            (specimen, test, cycle, step)
            for specimen in self.stiffness
            for test in self.tests
            for cycle in range(1, self.cycles + 1)
            for step in range(self.steps)
        ]

    def where(self, **values: object) -> pd.Series:
        """Which rows of motion have these values in all of these columns."""
        same = [self.motion[column] == value for column, value in values.items()]
        return pd.concat(same, axis=1).all(axis=1)

    def write(self, root: Path) -> "Written":
        """A project folder with this cohort and one study of it."""
        folder = root / "config" / "cohorts" / "chains"
        folder.mkdir(parents=True)
        (root / "config" / "studies").mkdir(exist_ok=True)
        (root / "config" / "config.yaml").write_text(f"studies: [{STUDY}]\n")
        head = f"study: {STUDY}\nkind: cohort_stiffness\ncohort: chains\n"
        (root / "config" / "studies" / f"{STUDY}.yaml").write_text(head + self.study)
        (folder / "cohort.yaml").write_text(self._header())
        specimens = "\n".join(["specimen", *self.stiffness]) + "\n"
        (folder / "specimens.csv").write_text(specimens)
        poses = ["specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"]
        poses += [
            f"{specimen},{joint},0,{36 * level},0,0,0,0"
            for specimen in self.stiffness
            for level, joint in enumerate(JOINTS)
        ]
        (folder / "joints.csv").write_text("\n".join(poses) + "\n")
        self.loads.to_csv(folder / "loads.csv", index=False)
        self.motion.to_csv(folder / "motion.csv", index=False)
        return Written(root)

    def _header(self) -> str:
        sd = "measurement_sd: {rotation_deg: 0.1, translation_mm: 0.1}\n" if self.sd else ""
        return (
            "cohort: chains\ntitle: straight chains\nsource: written for the tests\n"
            "vertebrae: [S1, L5, L4, L3]\ngravity: false\n"
            f"zeroed_at_step_0: {str(self.zeroed).lower()}\n{sd}"
        )


@dataclass(frozen=True)
class Written:
    """A project folder, and jobs run in it."""

    root: Path

    def literature(self, specimen: str) -> Tables:
        """Tables of the job ``literature``."""
        files = self._files("stiffness", "errors", "sign_checks")
        literature.run(str(self.root), STUDY, specimen, **files)
        return _read(files)

    def fit(self, specimen: str, representation: str, fitted_to: str = "all") -> Tables:
        """Tables of the job ``fit``."""
        files = self._files("stiffness", "fits", "errors", "nuisances")
        fit.run(str(self.root), STUDY, specimen, representation, fitted_to, **files)
        return _read(files)

    def fit_all(
        self, specimens: Sequence[str], representation: str, fitted_to: str = "all"
    ) -> dict[str, tuple[Tables, Tables]]:
        """Tables of the jobs ``fit`` and ``left_out`` of every specimen; each is fitted once."""
        own, kept = {}, {}
        for name in specimens:
            own[name] = self.fit(name, representation, fitted_to)
            kept[name] = str(
                (self.root / "stiffness.parquet").rename(self.root / f"{name}.parquet")
            )
        found = {}
        for name in specimens:
            others, files = [kept[n] for n in specimens if n != name], self._files(*LEFT_OUT)
            left_out.run(str(self.root), STUDY, others, name, representation, fitted_to, **files)
            found[name] = own[name], _read(files)
        return found

    def left_out(
        self, others: Sequence[str], specimen: str, representation: str, fitted_to: str = "all"
    ) -> Tables:
        """Tables of the job ``left_out`` and, before it, of the fits of the others."""
        paths = []
        for other in others:
            self.fit(other, representation, fitted_to)
            kept = self.root / f"{other}.parquet"
            (self.root / "stiffness.parquet").replace(kept)
            paths.append(str(kept))
        files = self._files(*LEFT_OUT)
        root = str(self.root)
        left_out.run(root, STUDY, paths, specimen, representation, fitted_to, **files)
        return _read(files)

    def pool(
        self,
        fitted_to: str = "all",
        without: str = "nobody",
        representation: str = "partially_pooled",
    ) -> Tables:
        """Tables of the job ``pool``."""
        files = self._files("stiffness", "fits", "errors", "pooling")
        pool.run(str(self.root), STUDY, representation, fitted_to, without, **files)
        return _read(files)

    def experiment(
        self,
        specimen: str,
        representation: str | None = "per_joint",
        fitted: Sequence[str] = (),
    ) -> Tables:
        """Tables of the job ``experiment`` and, before it, of the fit that it simulates."""
        if representation is not None:
            tests = pd.read_csv(self.root / "config/cohorts/chains/motion.csv")["test"].unique()
            self.fit(specimen, representation, "all" if len(tests) > 1 else tests[0])
            fitted = [str(self.root / "stiffness.parquet")]
        files = self._files("load_displacement", "helical_axes")
        experiment.run(str(self.root), STUDY, list(fitted), specimen, **files)
        return _read(files)

    def _files(self, *names: str) -> dict[str, str]:
        return {name: str(self.root / f"{name}.parquet") for name in names}


def _read(files: Mapping[str, str]) -> Tables:
    return {name: read_frame(path) for name, path in files.items()}


def by_joint(stiffness: pd.DataFrame, column: str = "stiffness") -> pd.DataFrame:
    """One column of a table ``stiffness``: rows are joints, columns coordinates."""
    found = stiffness.pivot(index="joint", columns="coordinate", values=column)
    return found.loc[list(JOINTS)]

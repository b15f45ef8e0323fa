"""A copy of the project that runs small studies, so that no test touches its results."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

_ROOT = Path(__file__).parents[2]
_PARTS = ("Snakefile", "workflow", "profiles", "spinepipe")
SKIPPED = shutil.ignore_patterns("__pycache__")
_STUDY = """\
study: {name}
kind: joint_pose_sensitivity
cohort: palanca_l1l4
seed: 1
poses: {poses}
best_models: 2
block: 4
calibration:
  weights:
    {{anterior: 10, superior: 100, right: 1, extension: 1, right_bending: 0, left_rotation: 0}}
start_bootstrap: {{sets: 3, loadings: [equilibrium, quasi_static, dynamic]}}
damping_bootstrap: {{sets: 2, loadings: [equilibrium]}}
methods: {{poses: 1}}
landmark_precision: {{sd_mm: [1.0, 3.0], poses: 4}}
"""


@dataclass(frozen=True)
class Project:
    """A copy of the project with its own configuration and results."""

    folder: Path

    def write_study(self, name: str, poses: int) -> None:
        """Write a study on the cohort that comes with the project."""
        text = _STUDY.format(name=name, poses=poses)
        self.path(f"config/studies/{name}.yaml").write_text(text)

    def path(self, name: str) -> Path:
        return self.folder / name

    def edit(self, name: str, old: str, new: str) -> None:
        """Replace a text in a file; it must be there."""
        text = self.path(name).read_text()
        assert old in text
        self.path(name).write_text(text.replace(old, new))

    def command(self, *arguments: str) -> list[str]:
        return [sys.executable, "-m", "snakemake", *arguments]

    def environment(self) -> dict[str, str]:
        """Without the path of the original package: the copy must find itself."""
        return {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run Snakemake to its end; `stdout` holds both streams."""
        return subprocess.run(
            self.command(*arguments),
            cwd=self.folder,
            env=self.environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=170,
            check=False,
        )

    def run_all(self) -> str:
        """`snakemake -j2 all` that has to succeed; returns what it said."""
        done = self.snakemake("-j2", "all")
        assert done.returncode == 0, done.stdout
        return done.stdout

    def files(self) -> dict[str, int]:
        """Result files and when each was written, ns; logs left out."""
        results = self.path("results")
        return {
            path.relative_to(results).as_posix(): path.stat().st_mtime_ns
            for path in results.rglob("*")
            if path.is_file() and "logs" not in path.parts
        }

    def contents(self) -> dict[str, bytes]:
        return {name: self.path(f"results/{name}").read_bytes() for name in self.files()}


def written(before: Mapping[str, int], after: Mapping[str, int]) -> set[str]:
    """Files that were computed between two looks."""
    return {name for name, time in after.items() if before.get(name) != time}


def copy_project(folder: Path) -> Project:
    """The project without results and with nothing selected but a study `small`."""
    for part in _PARTS:
        source = _ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=SKIPPED)
        else:
            folder.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, folder / part)
    cohort = Path("config/cohorts/palanca_l1l4")
    shutil.copytree(_ROOT / cohort, folder / cohort)
    (folder / "config/studies").mkdir()
    (folder / "config/config.yaml").write_text("studies: [small]\n")
    return Project(folder)

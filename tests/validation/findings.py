"""What the whole study says about phantoms of linear and of stiffening truth."""

import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd

from tests.generators.phantom import phantom, write
from tests.validation.made_by import made_by

ROOT = Path(__file__).resolve().parents[2]
LAWS = ("linear", "stiffening")
PHANTOMS = 3
PARTS = ("Snakefile", "workflow", "profiles", "spinepipe")
STUDY = "study: phantom\nkind: cohort_stiffness\ncohort: phantom\n"
MODULES = ("fit", "pool", "literature", "left_out", "mae", "ranking", "significance", "findings")
KEPT = ("findings", "ranking", "mae", "statistics", "sign_checks")
"""Tables of each study that are kept."""


def tables(seeds: Sequence[int] = range(PHANTOMS)) -> dict[str, pd.DataFrame]:
    """The kept tables of all studies, with columns ``law`` and ``seed``."""
    parts: dict[str, list[pd.DataFrame]] = {name: [] for name in KEPT}
    for law, seed, folder in _studies(seeds):
        for name in KEPT:
            frame = pd.read_parquet(folder / f"{name}.parquet")
            parts[name].append(frame.assign(law=law, seed=seed))
    return {name: pd.concat(frames, ignore_index=True) for name, frames in parts.items()}


def _studies(seeds: Sequence[int]) -> Iterator[tuple[str, int, Path]]:
    base = ROOT / "results" / "validation" / "findings" / made_by(*MODULES)
    for seed in seeds:
        for law in LAWS:
            folder = base / f"law-{law}" / f"seed={seed:04d}"
            if not (folder / "done").exists():
                _run(law, seed, folder)
                print(f"findings: {law} truth, seed {seed} done", flush=True)
            yield law, seed, folder


def _run(law: str, seed: int, folder: Path) -> None:
    """Run the study of one phantom in a copy of the project; a second call goes on with it."""
    project = folder / "project"
    project.mkdir(parents=True, exist_ok=True)
    for part in PARTS:
        if not (project / part).exists():
            (project / part).symlink_to(ROOT / part)
    (project / "config" / "studies").mkdir(parents=True, exist_ok=True)
    (project / "config" / "config.yaml").write_text("studies: [phantom]\n")
    (project / "config" / "studies" / "phantom.yaml").write_text(STUDY)
    cohort = project / "config" / "cohorts" / "phantom"
    if not cohort.exists():
        write(phantom(seed, law=law), cohort)
    wanted = [f"results/phantom/{name}.parquet" for name in KEPT]
    command = [sys.executable, "-m", "snakemake", "-j2", "--rerun-incomplete", *wanted]
    subprocess.run(command, cwd=project, check=True, capture_output=True)
    for name in wanted:
        shutil.copy(project / name, folder)
    shutil.rmtree(project)
    (folder / "done").touch()

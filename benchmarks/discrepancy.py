"""Searches for missing effects as a user runs them, at HEAD and at an older commit, in turn.

Cohorts are made by OpenSim and numpy; those of shear from slopes that are no part of the project.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.equilibria import tree_of
from benchmarks.study import ROOT, Run, copy_of_project, run_workflow
from tests.generators import shear_slopes
from tests.generators.hidden import Recipe, draw_hidden, make

SLOPES_VARIABLE = "SPINEPIPE_SHEAR_SLOPES"
"""Environment variable with the path of the slopes, where it is not given on the command line."""

AGAIN = "10 s"
_TEXT = "study: {study}\nkind: discrepancy\ncohort: {cohort}\nbase: {{stiffness: per_specimen}}\n"

Texts = Mapping[str, str]
"""Study files by the names of their studies."""


@dataclass(frozen=True)
class Work:
    """Studies that are made in one run.

    Attributes
    ----------
    texts : makes their cohorts in a folder, and their files.
    """

    about: str
    texts: Callable[[Path], Texts]
    goal: str


@dataclass(frozen=True)
class Beside:
    """One work at both commits, and what came out at HEAD.

    Attributes
    ----------
    new_s : wall seconds at HEAD. new_cpu_s, old_cpu_s : of all processes of a run; they are
        compared, as what else a machine does moves them less.
    """

    about: str
    new_s: float
    new_cpu_s: float
    old_cpu_s: float
    goal: str
    said: str


def _hidden(recipes: Mapping[str, Recipe], folder: Path) -> Texts:
    for name, recipe in recipes.items():
        make(recipe, folder / name)
    return {name: _TEXT.format(study=name, cohort=folder / name) for name in recipes}


def _with(recipe: Recipe, *names: str, other: bool = False) -> Recipe:
    """Data in which every base model lacks these, to a gap of one noise SD."""
    effects = (draw_hidden(name, recipe, n, other) for n, name in enumerate(names))
    return replace(recipe, gap=1.0, hidden=tuple(effects))


def _shear(slopes: Path, folder: Path) -> Texts:
    shear_slopes.make(slopes, folder / "shear")
    return {"shear": _TEXT.format(study="shear", cohort=folder / "shear")}


FEW = Recipe(seed=71, joints=1, n_specimens=2, steps=10)
SMALL = Recipe(seed=71)
FULL = Recipe(
    seed=71, n_specimens=6, design="directions", steps=10, unloading=True, translations=True
)
TWELVE = {
    f"searched_{n:02d}": _with(replace(SMALL, seed=71 + n), "neutral_zone") for n in range(12)
}


def works(slopes: Path | None) -> Iterator[Work]:
    """All that are measured; that of shear where its slopes are there."""
    few = _with(FEW, "nonlinear_stiffening", "hysteresis", other=True)
    full = "6 specimens x 6 joints x 6 tests x 21 steps x 3 cycles, six coordinates"
    yield Work("2 segments, 3 tests, 378 rows", partial(_hidden, {"few": few}), "20 s")
    known, other = (_with(FULL, "neutral_zone", other=which) for which in (False, True))
    yield Work(full, partial(_hidden, {"full": known}), "60 s")
    yield Work(f"{full}, another formula", partial(_hidden, {"full_other": other}), "60 s")
    yield Work(
        "twelve studies, 3 specimens x 6 joints x 3 tests x 7 steps x 3 cycles",
        partial(_hidden, TWELVE),
        "60 s",
    )
    own = (ROOT / "config" / "studies" / "l4l5_disc.yaml").read_text(encoding="utf-8")
    yield Work("l4l5_disc", lambda folder: {"l4l5_disc": own}, "15 s")
    if slopes is None or not slopes.is_file():
        where = f"no slopes at {slopes}" if slopes else "no slopes given"
        print(f"shear is left out: {where}; pass --slopes FILE or set {SLOPES_VARIABLE}")
        return
    yield Work("8 C6-C7 segments in shear", partial(_shear, slopes), "60 s")


def beside(old: str, slopes: Path | None) -> Iterator[Beside]:
    """Each from nothing, at HEAD and at an older commit."""
    tree = tree_of(old, "discrepancy")
    # what is compiled lies beside the code, and copies of a tree have it
    compiling = [sys.executable, "-m", "spinepipe.cli.engine"]
    subprocess.run(compiling, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)}, check=True)
    for work in works(slopes):
        with tempfile.TemporaryDirectory() as cohorts:
            texts = work.texts(Path(cohorts))
            (new, said), (was, _) = (_cold(root, work, texts) for root in (ROOT, tree))
        yield Beside(work.about, new.wall_s, new.cpu_s, was.cpu_s, work.goal, said)


def _cold(root: Path, work: Work, texts: Texts) -> tuple[Run, str]:
    """A run from nothing, and what it said."""
    with _project(root, texts) as folder:
        run = run_workflow(work.about, folder, _verdicts(texts), work.goal)
        return run, "; ".join(_said(Path(folder, one)) for one in _verdicts(texts))


def again() -> Iterator[Run]:
    """A verdict that is there is asked for again, and made again from its pieces."""
    with tempfile.TemporaryDirectory() as cohorts:
        texts = _hidden({"small": _with(SMALL, "neutral_zone")}, Path(cohorts))
        with _project(ROOT, texts) as folder:
            wanted = _verdicts(texts)
            yield run_workflow("small cohort, cold", folder, wanted, "20 s")
            yield run_workflow("asked for again: nothing to do", folder, wanted, AGAIN)
            yield run_workflow("made again from the store", folder, ["--force", *wanted], AGAIN)


def _verdicts(texts: Texts) -> list[str]:
    return [f"results/{name}/discrepancy/verdict.json" for name in texts]


@contextlib.contextmanager
def _project(root: Path, texts: Texts) -> Iterator[str]:
    """A copy of a project with these studies and no other."""
    with copy_of_project(root) as folder:
        config = Path(folder, "config")
        for name, text in texts.items():
            (config / "studies" / f"{name}.yaml").write_text(text, encoding="utf-8")
        names = ", ".join(texts)
        (config / "config.yaml").write_text(f"studies: [{names}]\n", encoding="utf-8")
        yield folder


def _said(path: Path) -> str:
    """The verdict and its likeliest names: ``NAMED neutral_zone 1.00``."""
    data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    ranked = sorted(data["probabilities"].items(), key=lambda one: -one[1])[:2]
    names = ", ".join(f"{name} {p:.2f}" for name, p in ranked if p >= 0.05)
    ended = (data.get("search") or {}).get("ended", "")
    return f"{data['verdict']} {names}{f' ({ended})' if ended else ''}"

"""Good cohorts to be spoilt, and what is said of them once they are."""

import re
import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from cohort_cases import joints, text
from cohort_cases import write as write_small
from mistaken_cases import Mistake

from spinepipe import cohort as cohorts
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.plausibility import suspicions
from spinepipe.studies.registry import every_form
from tests.generators.hidden import Recipe, make
from tests.generators.phantom import phantom
from tests.generators.phantom import write as write_phantom

ROOT = Path(__file__).resolve().parents[2]
REAL = ROOT.parent / "shared" / "data"
"""Geometry of real spines, where it is there; no part of this repository."""

SHIPPED: Mapping[str, tuple[str, ...]] = {
    "t12s1_phantom": ("s01", "s02"),
    "linear_spines": ("s01", "s02"),
    "cross_coupled_spines": ("s03",),
    "palanca_l1l4": ("s01",),
    "l4l5_disc": ("heuer_2007", "jaramillo"),
    "tracking_phantom": ("s01",),
}
"""Cohorts that come along, and the specimens of them that are taken."""

REAL_SPINES = ("thoracolumbar_male", "visible_human_l1s1", "vid_t1l5")
SMALL = ("small", "small_joints")

_SHEAR = {"design": "two_shears", "peak_n": 100.0, "translations": True, "cycles": 2}
_RECIPES: Mapping[str, Recipe] = {
    "fresh_lumbar": Recipe(seed=7101, n_specimens=2, steps=4),
    "fresh_directions": Recipe(seed=7102, n_specimens=2, design="directions", unloading=True),
    "fresh_neck": Recipe(seed=7103, n_specimens=2, region="cervical", joints=4),
    "fresh_shear": Recipe(seed=7104, n_specimens=2, joints=2, **_SHEAR),
    "fresh_zeroed": Recipe(seed=7105, n_specimens=2, joints=3, lowest=2, zeroed=True),
}
FRESH_COHORTS = (*_RECIPES, "fresh_phantom", "fresh_frames")
"""Made up from seeds that nobody looked at while the rules were written."""


def there(name: str) -> bool:
    """Whether a cohort can be had here."""
    return name not in REAL_SPINES or (REAL / name).is_dir()


def good(name: str, into: Path) -> Path:
    """A good cohort by its name, cut down to a few specimens."""
    if name in SMALL:
        changes = (text("joints.csv", joints()),) if name.endswith("joints") else ()
        return write_small(into / "small", *changes)
    if name in _RECIPES:
        make(_RECIPES[name], into / name)
        return into / name
    if name.startswith("fresh"):
        frames = {"frame_error_mm": 3.0} if name == "fresh_frames" else {"zeroed": False}
        write_phantom(phantom(7106, **frames), into / name)
        return _few(into / name, into / name, ("s02", "s05"))
    source = REAL / name if name in REAL_SPINES else ROOT / "config" / "cohorts" / name
    shutil.copytree(source, into / name)
    return _few(source, into / name, SHIPPED.get(name))


def _few(source: Path, folder: Path, keep: Iterable[str] | None) -> Path:
    """The folder with rows of some specimens alone: the first three, if none are named."""
    every = pd.read_csv(source / "specimens.csv")["specimen"]
    kept = [*(every[:3] if keep is None else keep), "*"]
    for file in folder.glob("*.csv"):
        table = pd.read_csv(file)
        if "specimen" in table:
            table[table["specimen"].isin(kept)].to_csv(file, index=False)
    return folder


def told(folder: Path) -> tuple[InputProblem, ...]:
    """Everything that `check` says of a cohort."""
    try:
        return tuple(one.problem for one in suspicions(cohorts.read(folder, every_form())))
    except InputError as error:
        return error.problems


Told = Callable[[Path], tuple[InputProblem, ...]]


@dataclass(frozen=True)
class Score:
    """How well one mistake in one cohort was told.

    Attributes
    ----------
    told : in a file where it may be. column : and the column that is wrong is named. remedy : and
        how to mend it. alone : and no line says anything else.
    """

    cohort: str
    mistake: str
    told: bool
    column: bool
    remedy: bool
    alone: bool


def score(name: str, mistake: Mistake, found: Iterable[InputProblem]) -> Score:
    """What was told of a mistake against what is wrong."""
    lines = list(found)
    right = [one for one in lines if one.file.split("/")[-1] in mistake.places]
    columns = [one for one in right if _names(one, mistake.columns)]
    remedies = [one for one in columns if _mends(one, mistake.remedy)]
    alone = bool(remedies) and len(remedies) == len(lines)
    return Score(name, mistake.name, bool(right), bool(columns), bool(remedies), alone)


def _names(problem: InputProblem, columns: tuple[str, ...]) -> bool:
    if problem.column is not None and problem.column in columns:
        return True
    said = f"{problem.column or ''} {problem.remedy}"
    return any(re.search(rf"\b{re.escape(name)}\b", said) for name in columns)


def _mends(problem: InputProblem, remedy: str) -> bool:
    return re.search(remedy, f"{problem.found} {problem.remedy}") is not None


def scores(name: str, mistakes: Iterable[Mistake], root: Path, tell: Told = told) -> list[Score]:
    """Every mistake that can be made in a cohort, in turn."""
    folder = good(name, root / "good")
    found = []
    for mistake in mistakes:
        spoilt = root / mistake.name / folder.name
        shutil.copytree(folder, spoilt)
        if mistake.apply(spoilt):
            found.append(score(name, mistake, tell(spoilt)))
        shutil.rmtree(root / mistake.name)
    return found

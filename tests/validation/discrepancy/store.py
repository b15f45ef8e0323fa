"""Rows as files: one per cohort, in a folder named by the code that made them."""

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from spinepipe.jobs.code import code_digest
from spinepipe.jobs.digest import value_digest
from tests.validation.discrepancy.row import Row
from tests.validation.discrepancy.targets import Target

ROOT = Path(__file__).resolve().parents[3]
PLACE = ROOT / "results" / "validation" / "discrepancy"
SEARCH = ("search.investigation", "search.model_files", "design.testable")
"""Modules of the kind discrepancy that a row hangs on, with all that they import."""

SOURCES = ("generators/hidden/*.py", "validation/discrepancy/row.py")
"""Files of tests that a row hangs on; its recipe is in its name."""


def folder() -> Path:
    """Where rows of the code as it is now are kept."""
    found = hashlib.sha256()
    for module in SEARCH:
        found.update(code_digest(f"spinepipe.studies.discrepancy.{module}").encode())
    for pattern in SOURCES:
        for path in sorted((ROOT / "tests").glob(pattern)):
            found.update(path.read_bytes())
    return PLACE / found.hexdigest()[:12]


def path_of(target: Target, place: Path) -> Path:
    """The file of a target's row: another recipe is another file."""
    recipe = value_digest(target.recipe.as_dict())[:8]
    return place / f"{target.kind}-seed={target.seed:05d}-{recipe}.json"


def keep(row: Row, path: Path) -> None:
    """Write a row as a file that appears whole."""
    partial = path.with_suffix(".part")
    partial.write_text(json.dumps(plain(row), allow_nan=False) + "\n", encoding="utf-8")
    partial.rename(path)


def plain(value: Any) -> Any:
    """What JSON can hold; a number that is not finite is None."""
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def kept(targets: list[Target], place: Path) -> list[Row]:
    """Rows of those targets that have one, in their order."""
    files = [path_of(target, place) for target in targets]
    return [json.loads(file.read_text(encoding="utf-8")) for file in files if file.exists()]

"""Rows as files: one per cohort, in a folder named by the code of the search that made them."""

import ast
import hashlib
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from spinepipe.jobs.digest import value_digest
from tests.validation.discrepancy.row import Row
from tests.validation.discrepancy.targets import Target

ROOT = Path(__file__).resolve().parents[3]
PLACE = ROOT / "results" / "validation" / "discrepancy"
KIND = "spinepipe/studies/discrepancy"
SEARCH = (
    *(f"{KIND}/{folder}/*.py" for folder in ("search", "proof", "mistakes")),
    f"{KIND}/design/testable.py",
    f"{KIND}/design/seen.py",
    f"{KIND}/settings.py",
    "spinepipe/effects/*.py",
    "tests/generators/hidden/*.py",
    "tests/validation/discrepancy/row.py",
)
"""What a row hangs on: the search, the effects, and what made the data; not all of the package."""


def folder() -> Path:
    """Where rows of the search as it is now are kept."""
    files = sorted(path for pattern in SEARCH for path in ROOT.glob(pattern))
    return PLACE / digest(files)


def digest(files: Iterable[Path]) -> str:
    """Of what files mean: comments, docstrings and layout do not count."""
    found = hashlib.sha256()
    for path in files:
        tree = ast.parse(path.read_bytes())
        for node in ast.walk(tree):
            body = getattr(node, "body", None)
            if isinstance(body, list):
                node.body = [one for one in body if not _is_text(one)]  # type: ignore[attr-defined]
        found.update(f"{path.name} {ast.dump(tree)}\n".encode())
    return found.hexdigest()[:12]


def _is_text(node: ast.AST) -> bool:
    value = node.value if isinstance(node, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


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


def kept(targets: list[Target], place: Path) -> list[tuple[Path, Row]]:
    """Files and rows of those targets that have one, in their order."""
    files = [path_of(target, place) for target in targets]
    return [(file, json.loads(file.read_text(encoding="utf-8"))) for file in files if file.exists()]

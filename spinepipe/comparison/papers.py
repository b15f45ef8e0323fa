"""The way to the folder `papers`: published numbers, and what sets them beside those of a run.

Where it does not come along with this package, a study leaves the comparison out and says so.
"""

import hashlib
import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import pandas as pd

from spinepipe.shipped import SHIPPED

FOLDER = SHIPPED / "papers"


def beside() -> bool:
    """Whether published numbers lie beside this package."""
    return (FOLDER / "engine.py").is_file()


def digest(paper: str) -> str:
    """sha256 of all that a comparison hangs on: the paper's rows and selectors, and the engine."""
    if not beside():
        return ""
    # selectors of a paper may stand in several files, `<paper>.py` and `<paper>_<idea>.py`
    others = tuple(f"{name}{end}" for name in papers() if name != paper for end in "._")
    files = (file for file in FOLDER.iterdir() if file.suffix in (".csv", ".py"))
    found = hashlib.sha256()
    for file in sorted(file for file in files if not file.name.startswith(others)):
        found.update(f"{file.name} {hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return found.hexdigest()


def papers() -> list[str]:
    """Names of the papers."""
    return sorted(file.stem for file in FOLDER.glob("*.csv"))


def hangs_on(paper: str) -> Callable[[Any, Mapping[str, str]], list[str]]:
    """What a job reads that compares with a paper, besides tables; see `Job.also`."""
    return lambda expected, place: [digest(paper)]


def compare(
    paper: str, tables: Mapping[str, pd.DataFrame], asked: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Rows of the table ``against_<paper>``.

    Parameters
    ----------
    tables : of the run, and of its cohort's folder, by name; of a paper of one specimen its rows.
    asked : settings of the study that the paper has numbers for.
    """
    root = str(FOLDER.parent)
    if root not in sys.path:
        sys.path.append(root)
    engine = import_module("papers.engine")
    if Path(str(engine.__file__)).resolve().parent != FOLDER:
        raise ImportError(f"another package is called papers: {engine.__file__}; expected {FOLDER}")
    rows: list[dict[str, Any]] = engine.compare(paper, tables, asked)
    return rows


def left_out(cited: str, wanted: bool = True) -> tuple[str, ...]:
    """One line for the page of a study whose comparison is left out for want of the numbers."""
    if beside() or not wanted:
        return ()
    return (
        f"comparison with {cited} (its numbers, the folder papers, do not lie beside spinepipe)",
    )

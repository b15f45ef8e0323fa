"""Figures of a kind of study as its declaration names them."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from spinepipe.studies.registry import PACKAGE, kind_of

ROOT = Path(__file__).resolve().parents[2]


def drawings(kind: str) -> dict[str, Callable[..., Any]]:
    """What draws each figure, by its name; called with study, cohort and tables."""
    found = {}
    for figure in kind_of(kind).figures:
        module, _, function = figure.at.partition(":")
        found[figure.name] = getattr(import_module(f"{PACKAGE}.{kind}.{module}"), function)
    return found


def caption(kind: str, figure: str) -> Path:
    """The file of what is said below a figure."""
    return ROOT / "spinepipe" / "studies" / kind / "figures" / f"{figure}.rst"

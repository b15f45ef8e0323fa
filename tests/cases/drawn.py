"""Figures of a kind of study as its declaration names them."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from spinepipe.report.forms.chart import saying
from spinepipe.studies.registry import PACKAGE, kind_of


def drawings(kind: str) -> dict[str, Callable[..., Any]]:
    """What draws each figure, by its name; called with study, cohort and tables."""
    found = {}
    for figure in kind_of(kind).figures:
        module, _, function = figure.at.partition(":")
        found[figure.name] = getattr(import_module(f"{PACKAGE}.{kind}.{module}"), function)
    return found


def a_picture(kind: str) -> bytes:
    """Some figure of ours as the bytes of an ``svg``, ``png`` or ``pdf``."""
    chart = saying("Nothing", "There is nothing to show.")
    return chart.svg().encode() if kind == "svg" else chart.picture(kind)

"""Figures of a kind of study as its declaration names them."""

from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from spinepipe.report.style import WIDTH_MM
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


def faults_of_layout(figure: Figure) -> Iterator[str]:
    """Labels of ticks that stand on each other, words and keys beyond the page, another width."""
    if abs(figure.get_figwidth() * 25.4 - WIDTH_MM) > 1e-6 * WIDTH_MM:
        yield f"{figure.get_figwidth() * 25.4:.1f} mm wide"
    page = figure.bbox
    for axis in (one for one in figure.axes if one.get_visible() and one.axison):
        for line in (axis.xaxis, axis.yaxis):
            low, high = sorted(line.get_view_interval())
            ticks = [t for t in line.get_major_ticks() if low <= t.get_loc() <= high]
            shown = [t.label1 for t in ticks if t.label1.get_visible() and t.label1.get_text()]
            boxes = [label.get_window_extent() for label in shown]
            for one, other in pairwise(boxes):
                if one.shrunk(0.98, 0.9).overlaps(other.shrunk(0.98, 0.9)):
                    yield "labels stand on each other"
            for box in [*boxes, line.label.get_window_extent(), axis.title.get_window_extent()]:
                if not page.x0 - 1.0 < box.x0 or not box.x1 < page.x1 + 1.0:
                    yield "words leave the page"
    for legend in figure.legends:
        inside = legend.get_window_extent()
        if not page.x0 - 1.0 < inside.x0 < inside.x1 < page.x1 + 1.0:
            yield "the key leaves the page"
        if not inside.y0 > page.y0 - 1.0:
            yield "the key leaves the page below"

"""The 3-D view of a page: scenes of which one is shown at a time, by default of the specimens."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.scene import MOST_POSES, groups_of, scenes
from spinepipe.report.specimen import SpecimenView, draw_specimen, view_of
from spinepipe.report.style import picture, style

_MOST_SHOWN = 6


@dataclass(frozen=True)
class Space:
    """What is shown in space, and on paper instead; without scenes nothing is.

    Attributes
    ----------
    title : above it. chooser : what the menu chooses. shows : what a reader who cannot see it is
        told.
    scenes : a plotly figure, as plain data, of each choice; `meta` of a trace is its group. One
        that moves has `frames` besides: of each its `name`, and `x`, `y` and `z` of all traces.
    groups : what can be switched on and off, in words.
    still : a drawing (SVG) for paper and for readers without scripts; `still_shows` what it has.
    caption : below it.
    """

    title: str = ""
    chooser: str = ""
    shows: str = ""
    scenes: Mapping[str, Any] = field(default_factory=dict)
    groups: Mapping[str, str] = field(default_factory=dict)
    still: bytes = b""
    still_shows: str = ""
    caption: str = ""

    @property
    def moves(self) -> bool:
        """Whether some scene has frames."""
        return any(scene.get("frames") for scene in self.scenes.values())

    def as_data(self) -> dict[str, Any]:
        """The scenes for plotly, which reads its texts as markup: names are no tags of its own."""
        return {name: {**one, "data": _as_text(one["data"])} for name, one in self.scenes.items()}


_TEXTS = ("name", "text")
"""Keys of a trace that plotly shows."""


def _as_text(traces: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [
        {**trace, **{key: _escaped(trace[key]) for key in _TEXTS if key in trace}}
        for trace in traces
    ]


def _escaped(words: Any) -> Any:
    """A text, or texts, without what begins a tag or an entity."""
    if isinstance(words, list | tuple):
        return [_escaped(one) for one in words]
    return html.escape(words, quote=False) if isinstance(words, str) else words


def segment(
    cohort: Cohort,
    poses: pd.DataFrame,
    with_loads: bool,
    tests: Sequence[str] | None,
    load_shift_mm: Sequence[float],
) -> Space:
    """The first specimens of a cohort; nothing where it does not tell where joints are."""
    if not cohort.has_frames:
        return Space()
    shown = cohort.specimen_names[:_MOST_SHOWN]
    views = [view_of(cohort, name, tests, load_shift_mm) for name in shown]
    views = views if with_loads else [replace(view, tested=()) for view in views]
    drawn = scenes(views, cohort, poses)
    groups = groups_of(drawn)
    marks = "landmarks, " if "vertebrae" in groups else ""
    loads = " and loads" if "loads" in groups else ""
    return Space(
        "The segment in 3-D",
        "Specimen",
        f"A specimen in space: {', '.join(groups.values())}",
        drawn,
        groups,
        _still(views[0], cohort),
        f"Specimen {shown[0]} from its right side and from behind, with {marks}joint frames{loads}",
        _caption(cohort, groups, len(drawn)),
    )


def _still(view: SpecimenView, cohort: Cohort) -> bytes:
    """A specimen as a drawing."""
    with style():
        return picture(draw_specimen(cohort, view), "svg")


def _caption(cohort: Cohort, groups: Mapping[str, str], drawn: int) -> str:
    bodies = (
        "Landmarks at the neutral pose; drums join the endplate centres of a vertebra and are as "
        "wide as its pedicle bases are apart (shape not measured; a lone endplate has a drum of "
        "6 mm)."
    )
    sampled = (
        "Thick axes: the cohort's own joint frames; thin axes: at most "
        f"{MOST_POSES} sampled joint frames."
    )
    parts = [
        bodies if "vertebrae" in groups else "The neutral pose.",
        sampled if "sampled" in groups else "Axes: the cohort's own joint frames.",
    ]
    if "loads" in groups:
        parts.append("Arrows end where the largest load of each test acts.")
    n = len(cohort.specimen_names)
    if n > drawn:
        parts.append(f"The first {drawn} of {n} specimens.")
    return " ".join(parts)

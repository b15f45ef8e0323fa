"""One specimen: its frames, points, bodies, loads and motion, drawn from the right and behind."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle, measured_specimen
from spinepipe.cohort.specimen import (
    Landmarks,
    bodies,
    joint_frames,
    landmarks,
)
from spinepipe.effects.contract import Array, Wrench
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase
from spinepipe.report.panels import side_by_side
from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, VERMILLION, blank
from spinepipe.report.words import count
from spinepipe.units import MM_PER_M

AXIS_COLORS = {"anterior": VERMILLION, "superior": GREEN, "right": BLUE}
"""Colours of the x, y and z axes of joint frames."""

_LINES = (
    ("inferior_endplate_centre", "superior_endplate_centre"),
    ("left_pedicle_base", "right_pedicle_base"),
)

_ARROW_SHARE = 0.16
_TRIAD_SHARE = 0.3
_LABEL_X, _LABEL_Y = 0.04, 0.085
"""Where a load is described, beside its arrow, as shares of the height."""

_HEIGHT_MM, _WIDTH_MM = 150.0, 140.0


@dataclass(frozen=True)
class SpecimenView:
    """One specimen; SI, ground axes, neutral pose.

    Attributes
    ----------
    frames : of the joints, caudal to cranial; none where the cohort does not tell them.
    points : landmarks, empty where there are none.
    bodies : the moving vertebrae that have a mass. tested : one per test and cycle.
    """

    specimen: str
    frames: tuple[Pose, ...]
    points: Landmarks
    bodies: tuple[Body, ...]
    tested: tuple[MeasuredCycle, ...]

    @property
    def cases(self) -> tuple[LoadCase, ...]:
        """The loads of every cycle."""
        return tuple(one.case for one in self.tested)


def view_of(
    cohort: Cohort,
    specimen: str,
    tests: Sequence[str] | None = None,
    load_shift_mm: Sequence[float] = (0.0, 0.0, 0.0),
) -> SpecimenView:
    """A specimen of a cohort with its tests, by default all of them.

    Parameters
    ----------
    load_shift_mm : (3,) by which a study moves the point where loads act: x anterior, y superior,
        z right.
    """
    shift = np.array(load_shift_mm) / MM_PER_M
    asked = tests or cohort.tests
    tested = (
        () if cohort.loads is None else measured_specimen(cohort, specimen, asked, shift).tested
    )
    return SpecimenView(
        specimen=specimen,
        frames=joint_frames(cohort, specimen) if cohort.has_frames else (),
        points={} if cohort.landmarks is None else landmarks(cohort, specimen),
        bodies=tuple(body for body in bodies(cohort, specimen) if body.mass > 0.0),
        tested=tested,
    )


@dataclass(frozen=True)
class _Side:
    """A direction of view: ground axes that run across and up, and which moment turns in it.

    Attributes
    ----------
    turn : +1 where a positive moment about the normal turns counterclockwise in the picture.
    """

    title: str
    across: int
    label: str
    normal: int
    turn: int

    def flat(self, point: Array) -> Array:
        """(2,) of a point or direction (3,)."""
        return point[[self.across, 1]]


SAGITTAL = _Side("Sagittal, from the right", 0, "x, anterior (mm)", 2, 1)

FRONTAL = _Side("Frontal, from behind", 2, "z, right (mm)", 0, -1)


def draw_specimen(cohort: Cohort, view: SpecimenView) -> Figure:
    """Both views at one scale; of every test the step with the largest load is drawn."""
    figure = blank(_HEIGHT_MM, _WIDTH_MM)
    # height of all points that are drawn, 30 mm at least
    points = [frame.origin for frame in view.frames] + [body.com for body in view.bodies]
    points += [point for named in view.points.values() for point in named.values()]
    points += [w.point for case in view.cases for s in case.steps for w in s.wrenches]
    every = np.array(points) * MM_PER_M
    low = every.min(axis=0)
    size = float((np.maximum(every.max(axis=0), low + 30.0) - low)[1])
    for axis, side in zip(
        side_by_side(figure, 2, 2, sharey=True), (SAGITTAL, FRONTAL), strict=True
    ):
        axis.set_title(side.title)
        axis.set_xlabel(side.label)
        axis.set_aspect("equal", adjustable="box")
        _landmarks(axis, side, view)
        _bodies(axis, side, view)
        _frames(axis, side, cohort, view)
        _loads(axis, side, view, size)
        axis.margins(0.12)
        axis.spines["left"].set_visible(True)
        axis.tick_params(axis="y", size=2.5)
    figure.axes[0].set_ylabel("y, superior (mm)")
    # the same width of both views, so that equal heights are equal lengths
    ends = [axis.get_xlim() for axis in figure.axes]
    half = max(right - left for left, right in ends) / 2.0
    for axis, (left, right) in zip(figure.axes, ends, strict=True):
        middle = (left + right) / 2.0
        axis.set_xlim(middle - half, middle + half)
    _legend(figure, cohort, view)
    return figure


def _landmarks(axis: Axes, side: _Side, view: SpecimenView) -> None:
    for named in view.points.values():
        flat = {name: side.flat(point * MM_PER_M) for name, point in named.items()}
        for start, end in _LINES:
            if start in flat and end in flat:
                axis.plot(*np.array([flat[start], flat[end]]).T, color=GREY, lw=0.8, zorder=1)
        axis.plot(*np.array(list(flat.values())).T, "o", color=GREY, ms=2.5, mew=0, zorder=2)


def _bodies(axis: Axes, side: _Side, view: SpecimenView) -> None:
    for body in view.bodies:
        at = side.flat(body.com * MM_PER_M)
        axis.plot(*at, "o", mfc="white", mec=BLACK, ms=5.0, mew=0.7, zorder=2)
        axis.plot(*at, "+", color=BLACK, ms=5.0, mew=0.7, zorder=2)
        axis.annotate(
            body.name,
            _spot(at),
            (-4, -3),
            textcoords="offset points",
            fontsize=7.5,
            weight="bold",
            ha="right",
            va="top",
            zorder=6,
        )


def _frames(axis: Axes, side: _Side, cohort: Cohort, view: SpecimenView) -> None:
    """Three axes per joint, as they are seen from this side, and the joint's name."""
    origins = np.array([frame.origin for frame in view.frames]) * MM_PER_M
    gaps = np.linalg.norm(np.diff(origins, axis=0), axis=1)
    length = _TRIAD_SHARE * (float(gaps.min()) if len(gaps) else 30.0)
    for joint, frame, origin in zip(cohort.joint_names, view.frames, origins, strict=True):
        start = side.flat(origin)
        for direction, color in zip(frame.rotation.T, AXIS_COLORS.values(), strict=True):
            end = start + length * side.flat(direction)
            axis.annotate(
                "", _spot(end), _spot(start), arrowprops=_arrow(color, 1.2, 5.0), zorder=4
            )
            axis.update_datalim([end])
        axis.plot(*start, "o", color=BLACK, ms=2.0, zorder=5)
        name_at = start + length * np.array([-0.4, -0.4])
        axis.annotate(joint, _spot(name_at), fontsize=6.5, ha="right", va="top", zorder=6)


def _loads(axis: Axes, side: _Side, view: SpecimenView, size: float) -> None:
    """The largest load of each test: force as an arrow, moment in this plane as an arc."""
    chosen = [(case, wrench) for case in view.cases for wrench in largest_load(case)]
    forces = [float(np.linalg.norm(wrench.force)) for _, wrench in chosen]
    most = max(forces, default=0.0)
    words: dict[tuple[float, float], list[str]] = {}
    for case, wrench in chosen:
        at = side.flat(wrench.point * MM_PER_M)
        force, moment = side.flat(wrench.force), float(wrench.moment[side.normal])
        told = []
        if np.linalg.norm(force) > 1e-9:
            tail = at - _ARROW_SHARE * size * force / most
            axis.annotate("", _spot(at), _spot(tail), arrowprops=_arrow(BLACK, 1.6, 9.0), zorder=7)
            axis.update_datalim([tail])
            told.append(f"{float(np.linalg.norm(force)):.4g} N")
        if abs(moment) > 1e-9:
            _arc(axis, at, side.turn * moment, 0.45 * _ARROW_SHARE * size)
            told.append(f"{abs(moment):.4g} N m")
        if abs(wrench.moment[1]) > 1e-9:
            told.append(f"{abs(float(wrench.moment[1])):.4g} N m about y")
        if told:
            place = _spot(np.round(at, 6))
            words.setdefault(place, []).append(f"{case.test}: {', '.join(told)}")
    for place, lines in words.items():
        corner = _spot(np.add(place, (_LABEL_X * size, _LABEL_Y * size)))
        axis.annotate("\n".join(dict.fromkeys(lines)), corner, fontsize=6.5, va="bottom", zorder=8)
        axis.update_datalim([np.add(corner, (0.3 * size, 0.05 * size))])


def largest_load(case: LoadCase) -> tuple[Wrench, ...]:
    """Loads of the step of a test with the largest forces, or moments where there is no force."""

    def total(wrenches: tuple[Wrench, ...]) -> tuple[float, float]:
        force = sum(float(np.linalg.norm(wrench.force)) for wrench in wrenches)
        moment = sum(float(np.linalg.norm(wrench.moment)) for wrench in wrenches)
        return round(force, 9), moment

    return max((step.wrenches for step in case.steps), key=total)


def _spot(point: Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _arc(axis: Axes, at: Array, moment: float, radius: float) -> None:
    """Three quarters of a circle with an arrow head, counterclockwise where positive."""
    angles = np.deg2rad(np.linspace(-45.0, 225.0, 60))[:: 1 if moment > 0.0 else -1]
    path = at + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    axis.plot(*path.T, color=BLACK, lw=1.2, zorder=7)
    axis.annotate(
        "", _spot(path[-1]), _spot(path[-4]), arrowprops=_arrow(BLACK, 1.2, 8.0), zorder=7
    )


def _arrow(color: str, width_pt: float, head_pt: float) -> dict[str, object]:
    return {
        "arrowstyle": "-|>",
        "color": color,
        "lw": width_pt,
        "mutation_scale": head_pt,
        "shrinkA": 0.0,
        "shrinkB": 0.0,
    }


def _legend(figure: Figure, cohort: Cohort, view: SpecimenView) -> None:
    handles = [
        Line2D([], [], color=color, lw=1.2, label=f"joint axis, {name}")
        for name, color in AXIS_COLORS.items()
    ]
    if view.points:
        marker = {"marker": "o", "ms": 3.0, "mew": 0.0}
        handles.append(Line2D([], [], color=GREY, lw=0.8, label="landmarks", **marker))  # type: ignore[arg-type]
    if view.bodies:
        label = "centre of mass"
        handles.append(
            Line2D([], [], color="none", marker="o", mfc="white", mec=BLACK, ms=5.0, label=label)
        )
    title = f"{cohort.name}, {view.specimen}, neutral pose"
    if view.cases:
        steps = count(sum(len(case.steps) for case in view.cases), "load step")
        title += f"; largest load of each test ({steps})"
    figure.legend(
        handles=handles, title=title, loc="outside lower center", ncols=3, title_fontsize=6.5
    )

"""Figure: how lumbar joints turn over a motion's cycle, mean and SD over persons."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.motion.skeleton import JOINTS, LUMBAR_JOINTS, PELVIS, body_poses
from spinepipe.report.panels import explain_marks, lettered
from spinepipe.report.style import BLACK, LineStyle, blank, saying
from spinepipe.report.words import capital, listed, plain
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.error_metrics import Truth, joint_rotations, truths
from spinepipe.studies.tracking.figures.line_styles import (
    choose_approaches,
    key_of,
    persons_words,
    show_ticks,
    styles_of_approaches,
    zero_line,
)
from spinepipe.studies.tracking.persons import skeleton_in
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import INSTANTS
from spinepipe.studies.tracking.tracked_motions import TrackedMotion, motions
from spinepipe.studies.tracking.trials import AXIS, kinds_of_trials
from spinepipe.studies.tracking.words import short_of
from spinepipe.units import DEG_PER_RAD

MOST_TRIALS = 2
COUNTED = ("extension positive", "bending to the right positive", "rotation to the left positive")
"""How rotations that motions are about are counted, in the order of `trials.AXIS`."""

NO_MOTION = "Nothing can be shown: no approach found a motion of more than one frame."

_CYCLE = np.linspace(0.0, 1.0, INSTANTS)
_ROW_MM, _HEAD_MM, _KEY_MM, _ACROSS = 31.0, 10.0, 20.0, 3
_MARGIN, _TIMES, _LEAST_DEG = 0.15, 3.0, 25.0
"""Room above and below curves, as a share; what goes so many times as far as the calmest approach,
and farther than the least, leaves the axis."""


@dataclass(frozen=True, eq=False)
class Courses:
    """Rotations of lumbar joints over the cycle of one trial.

    Attributes
    ----------
    kind : of the trial. found : by approach (P, 101, 6) deg, a person each.
    true : (P, 101, 6) deg where it is known, no persons else.
    """

    kind: str
    found: Mapping[str, Array]
    true: Array

    @property
    def calm(self) -> list[str]:
        """Approaches that stay on the axis."""
        # what goes far beyond the calmest approach would flatten all other curves
        reach = {name: float(np.abs(persons).max()) for name, persons in self.found.items()}
        most = max(_TIMES * min(reach.values()), _LEAST_DEG)
        return [name for name, size in reach.items() if size <= most]


def kinematics_figure(
    study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A block of panels for each trial, a panel for each lumbar joint."""
    tracked = tables["tracked"]
    names = choose_approaches(study, tracked["approach"].unique()) if len(tracked) else []
    courses = courses_of(cohort, tracked[tracked["approach"].isin(names)]) if names else {}
    if not courses:
        return saying(NO_MOTION)
    looks = styles_of_approaches(names)
    shown = dict(list(courses.items())[:MOST_TRIALS])
    down = 2 * len(shown)
    figure = blank(down * _ROW_MM + len(shown) * _HEAD_MM + _KEY_MM)
    blocks = figure.subfigures(len(shown), 1, squeeze=False).ravel()
    for index, (block, (trial, one)) in enumerate(zip(blocks, shown.items(), strict=True)):
        _block(block, index, trial, one, looks)
    _explain(figure, looks, shown, len(courses))
    return figure


def _block(
    block: SubFigure, index: int, trial: str, one: Courses, looks: dict[str, LineStyle]
) -> None:
    block.suptitle(
        lettered(index, f"{capital(plain(trial))}, {COUNTED[AXIS[one.kind]]}"),
        **{"x": 0.01, "ha": "left", "fontsize": 7.5, "fontweight": "bold"},
    )
    panels = block.subplots(2, _ACROSS, sharex=True, sharey=True).ravel()
    for k, (axis, joint) in enumerate(zip(panels, LUMBAR_JOINTS, strict=True)):
        axis.set_title(joint, fontweight="normal", loc="center")
        zero_line(axis)
        show_ticks(axis)
        for name, persons in one.found.items():
            _course(axis, persons[:, :, k], looks[name], name in one.calm)
        if len(one.true):
            axis.plot(100.0 * _CYCLE, one.true[:, :, k].mean(axis=0), color=BLACK, ls=":", lw=1.1)
        axis.set_xlim(0.0, 100.0)
    panels[0].set_ylim(*ends_of(one))
    block.supylabel("rotation of the joint (°)", fontsize=7.0)
    block.supxlabel("cycle of the motion (%)", fontsize=7.0)


def _course(axis: Axes, persons: Array, look: LineStyle, calm: bool) -> None:
    """Mean over persons; of calm approaches one SD to either side, where there are persons."""
    mean = persons.mean(axis=0)
    if not calm:
        axis.plot(100.0 * _CYCLE, mean, color=look.color, lw=0.6, alpha=0.8, zorder=1)
        return
    axis.plot(100.0 * _CYCLE, mean, color=look.color, ls=look.dashes, lw=1.0, zorder=3)
    if len(persons) > 1:
        sd = persons.std(axis=0, ddof=1)
        axis.fill_between(
            100.0 * _CYCLE, mean - sd, mean + sd, color=look.color, alpha=0.18, lw=0, zorder=2
        )


def ends_of(one: Courses) -> tuple[float, float]:
    """Ends of the axis, deg: all of calm curves; what vibrates leaves it rather than hide them."""
    kept = [one.found[name].ravel() for name in one.calm]
    values = np.concatenate([*kept, one.true.ravel(), [0.0]])
    low, high = float(values.min()), float(values.max())
    room = _MARGIN * max(high - low, 1.0)
    return low - room, high + room


def courses_of(cohort: Cohort, tracked: pd.DataFrame) -> dict[str, Courses]:
    """Of all trials in which something turns, in the order of the table."""
    kinds = kinds_of_trials(cohort)
    every = [one for one in motions(tracked) if len(one.time_s) > 1]
    known = {(truth.specimen, truth.trial): truth for truth in truths(dict(cohort.further))}
    found = {}
    for trial in dict.fromkeys(one.trial for one in every):
        persons = tracked.loc[tracked["trial"] == trial, "specimen"].unique()
        of_persons = [kinds.get((str(who), trial)) for who in persons]
        kind = next((kind for kind in of_persons if kind in AXIS), None)
        if kind is None:
            continue
        own = [one for one in every if one.trial == trial]
        by_approach: dict[str, list[Array]] = {}
        for one in own:
            # lumbar joints about the axis of the motion
            turned = one.at(_times(one.time_s))[:, PELVIS + 1 :, 3 + AXIS[kind]]
            degrees = DEG_PER_RAD * turned[:, : len(LUMBAR_JOINTS)]
            by_approach.setdefault(one.approach, []).append(degrees)
        curves = {name: np.array(persons) for name, persons in by_approach.items()}
        found[trial] = Courses(kind, curves, _true(cohort, own, known, kind))
    return found


def _times(time_s: Array) -> Array:
    """(101,) s over the cycle of a motion with frames (F,)."""
    found: Array = time_s[0] + _CYCLE * (time_s[-1] - time_s[0])
    return found


def _true(
    cohort: Cohort, own: list[TrackedMotion], known: Mapping[tuple[str, str], Truth], kind: str
) -> Array:
    """(P, 101, 6) deg of persons whose lumbar joints are known at two instants or more."""
    spans = {one.specimen: one for one in own}
    curves = []
    for name, one in spans.items():
        truth = known.get((name, one.trial))
        if truth is not None and len(truth.time_s) > 1 and truth.turned[:, :7].all():
            # rotation of each joint from the neutral pose of the model, as its coordinates have it
            skeleton = skeleton_in(cohort, name, subject_of(cohort, name))
            neutral = joint_rotations(body_poses(skeleton, np.zeros((1, len(JOINTS) + 1, 6)))[0])
            turned = np.swapaxes(neutral, -1, -2) @ joint_rotations(truth.turns)
            angles = DEG_PER_RAD * zxy_angles(turned)[..., AXIS[kind]]
            times, joints = _times(one.time_s), range(len(LUMBAR_JOINTS))
            curves.append(
                np.array([np.interp(times, truth.time_s, angles[:, k]) for k in joints]).T
            )
    return np.array(curves).reshape(-1, INSTANTS, len(LUMBAR_JOINTS))


def _explain(
    figure: Figure, looks: dict[str, LineStyle], shown: Mapping[str, Courses], trials: int
) -> None:
    handles = key_of(looks, marks=False)
    if any(len(one.true) for one in shown.values()):
        handles.append(Line2D([], [], color=BLACK, ls=":", lw=1.1, label="truth, mean"))
    most = max(len(persons) for one in shown.values() for persons in one.found.values())
    words = persons_words(most) + (" Line: mean. Band: one SD to either side." * (most > 1))
    wild = dict.fromkeys(n for one in shown.values() for n in one.found if n not in one.calm)
    if wild:
        told = capital(listed([short_of(name) for name in wild]))
        words += f" {told}: without a band where it leaves the axis."
    if trials > len(shown):
        words += f" The first {len(shown)} of {trials} trials."
    explain_marks(figure, handles, words, 4)

"""Are markers those that their names say: in sight, on their side, not taken for one another?

Nothing of this is repaired: which of two names is wrong is for the one to say who placed them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.motion.marker_groups import rigid_rotations, runs
from spinepipe.motion.reading import DEFAULT_AXES
from spinepipe.motion.recording import MarkerRecording
from spinepipe.motion.skeleton import PELVIS, MarkerSet, MarkerTrial
from spinepipe.problems import InputProblem
from spinepipe.studies.recordings import STANCE, TRIALS, Row, trial_of
from spinepipe.units import MM_PER_M

LONGEST_GAP_S = 0.5

PAIR_MM = 30.0
"""Two markers of the pelvis are left and right where they mirror each other so closely."""

DEEP_M = 0.03
"""A pelvis whose markers lie less far behind one another does not tell forwards."""

SQUARE = 0.3
"""Sine of the angle between forwards and up below which they tell no right."""

BACKWARDS = -0.5
"""Cosine between two markers' line and that of the set, beyond which they are exchanged."""

APART_M = 0.01
"""Two markers closer than this are not told apart by where they are."""

LANDED = 0.25
"""Two markers are exchanged that land so near each other's former places, over how far they go."""

STILL_M = 1e-5
"""A marker that is measured goes farther from frame to frame, by noise alone: 0.1 mm and more."""

MOVES_M = 0.01
NEIGHBOURS = 3
"""A marker is frozen where most of so many neighbours go so far while it stands still."""

JUMP_M = 0.01
FASTEST_M_PER_S = 10.0

RIGID_MM = 5.0
"""A cluster's markers keep their distance to 0.27 mm (SD 0.04, Wang 2021); placing them by X-ray
or by hand is worse."""

SWAY_MM = 2.0


@dataclass(frozen=True, eq=False)
class LoadedTrial:
    """A trial as it is checked.

    Attributes
    ----------
    trial : markers in the order of the set. markers : the set. neutral : (K, 3) m, its markers in
        ground while all coordinates are zero.
    axes : what forwards, up and right are in the axes of the file.
    file : of the motion. trials : name of the table of trials, line : of the trial in it.
    first : number of the trial's first frame in the file. set : where the set stands, in messages.
    """

    trial: MarkerTrial
    markers: MarkerSet
    neutral: Array
    axes: str
    file: str
    trials: str
    line: int
    first: int
    set: str = "marker_set.csv"

    @classmethod
    def of(
        cls,
        cohort: Cohort,
        row: Row,
        read: MarkerRecording,
        markers: MarkerSet,
        neutral: Array,
        set: str = "marker_set.csv",
    ) -> "LoadedTrial":
        """A row of `trials.csv` and its recording, in which markers have the names of the set."""
        axes = row["axes"] if isinstance(row["axes"], str) else DEFAULT_AXES
        files = f"{cohort.name}/{row['file']}", f"{cohort.name}/{TRIALS.file}"
        trial = trial_of(row, markers, read)
        return cls(trial, markers, neutral, axes, *files, row["line"], read.first, set)

    @cached_property
    def turned(self) -> tuple[Array, NDArray[np.bool_]]:
        """(F, 3, 3) how all markers together are turned against rest, and where they tell it."""
        return rigid_rotations(self.neutral, self.trial.places, self.trial.seen)

    def frames(self, begin: int, end: int) -> str:
        """Frames from one to another, both of the trial and included, as a user finds them."""
        times = self.trial.time_s
        if begin == end:
            return f"frame {self.first + begin} ({times[begin]:.3f} s)"
        return (
            f"frames {self.first + begin} to {self.first + end} "
            f"({times[begin]:.3f} to {times[end]:.3f} s)"
        )

    def in_motion(self, marker: str | None, found: str, allowed: str, remedy: str) -> InputProblem:
        """A problem of the file of motion."""
        return InputProblem(self.file, None, marker, found, allowed, remedy)

    def in_table(self, column: str, found: str, allowed: str, remedy: str) -> InputProblem:
        """A problem of the trial's row."""
        return InputProblem(self.trials, self.line, column, found, allowed, remedy)


def marker_problems(look: LoadedTrial) -> Iterator[InputProblem]:
    """Everything that is wrong with markers of a trial whose unit and axes are sound."""
    yield from _gaps(look)
    yield from _frozen(look)
    sides = list(_sides(look))
    yield from sides
    if not sides:
        exchanged = [*_exchanged(look), *_exchanged_later(look)]
        yield from exchanged
        if not exchanged:
            yield from _clusters(look)


def _gaps(look: LoadedTrial) -> Iterator[InputProblem]:
    times = look.trial.time_s
    allowed = f"gaps of at most {LONGEST_GAP_S:g} s"
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    for k, name in enumerate(look.markers.names):
        seen = look.trial.seen[:, k]
        if not seen.any():
            remedy = "crop the trial, or delete the marker from the set"
            found = "the marker is never in sight"
            yield look.in_motion(name, found, "markers that are seen", remedy)
            continue
        for begin, end in runs(~seen):
            if times[end] - times[begin] + step > LONGEST_GAP_S:
                found = f"not in sight in {look.frames(begin, end)}"
                remedy = "fill the gap where it was recorded, or crop the trial"
                yield look.in_motion(name, found, allowed, remedy)


def _frozen(look: LoadedTrial) -> Iterator[InputProblem]:
    """Markers that stand still while their neighbours move: gaps filled with the last place.

    All of them together: a picture that stood still.
    """
    times, places, seen = look.trial.time_s, look.trial.places, look.trial.seen
    markers, names = look.markers, look.markers.names
    apart = np.linalg.norm(look.neutral[:, None] - look.neutral[None, :], axis=-1)
    still = np.linalg.norm(np.diff(places, axis=0), axis=-1) < STILL_M
    still &= seen[1:] & seen[:-1]
    step = np.median(np.diff(times))
    allowed = f"places that were measured; gaps of at most {LONGEST_GAP_S:g} s"
    remedy = "leave the cells empty where the marker was not seen, or crop the trial"
    # a stance may be one picture; elsewhere no frame is the same as the one before it
    every = (still == (seen[1:] & seen[:-1])).all(axis=1) & still.any(axis=1)
    for begin, last in runs(every & (look.trial.kind != STANCE)):
        if (lasts := times[last + 1] - times[begin] + step) > LONGEST_GAP_S:
            found = f"all markers stand still in {look.frames(begin, last + 1)}, {lasts:.2f} s"
            yield look.in_motion(None, found, allowed, "crop the trial, or export it again")
    for k, name in enumerate(names):
        cluster = np.array([bool(one) and one == markers.cluster[k] for one in markers.cluster])
        for begin, last in runs(still[:, k]):
            frames = slice(begin, last + 2)
            lasts = times[last + 1] - times[begin] + step
            if lasts <= LONGEST_GAP_S:
                continue
            # neighbours that are not lost with it: of no rigid cluster with it, nor frozen on
            # another body
            lost = still[begin : last + 1].all(axis=0) & (markers.body != markers.body[k])
            order = np.argsort(np.where(lost | cluster, np.inf, apart[k]), kind="stable")
            near = [one for one in order.tolist() if one != k and not (lost | cluster)[one]]
            near = near[:NEIGHBOURS]
            went = np.linalg.norm(places[frames, near] - places[begin, near], axis=-1)
            far = (went * (seen[frames, near] & seen[begin, near])).max(axis=0)
            if near and np.median(far) > MOVES_M:
                found = f"stands still in {look.frames(begin, last + 1)}, {lasts:.2f} s"
                found += f", while {', '.join(names[one] for one in near)} move"
                yield look.in_motion(name, found, allowed, remedy)


def _sides(look: LoadedTrial) -> Iterator[InputProblem]:
    """Markers of the pelvis that are on the wrong side of it."""
    right = _rightwards(look)
    if right is None:
        return
    for left_one, right_one in _pairs(look):
        both = look.trial.seen[:, left_one] & look.trial.seen[:, right_one]
        across = look.trial.places[:, right_one] - look.trial.places[:, left_one]
        wrong = both & (np.einsum("fi,fi->f", across, right) < 0.0)
        names = f"{look.markers.names[left_one]} and {look.markers.names[right_one]}"
        for begin, end in runs(wrong):
            found = f"left and right are swapped in {look.frames(begin, end)}"
            remedy = "exchange the two names in the file"
            yield look.in_motion(names, found, "the left marker on the left", remedy)


def _pairs(look: LoadedTrial) -> Iterator[tuple[int, int]]:
    """Markers of the pelvis that mirror each other: left, right."""
    on_pelvis = np.flatnonzero(look.markers.body == PELVIS)
    for one, other in combinations(on_pelvis.tolist(), 2):
        mirrored = look.markers.at[other] * [1.0, 1.0, -1.0]
        off = float(np.abs(look.markers.at[one] - mirrored).max()) * MM_PER_M
        wide = float(np.abs(look.markers.at[[one, other], 2]).min()) * MM_PER_M
        if off < PAIR_MM and wide > PAIR_MM / 2.0:
            on_left = look.markers.at[one, 2] < 0.0
            yield (one, other) if on_left else (other, one)


def _rightwards(look: LoadedTrial) -> Array | None:
    """(F, 3) to the right by what is ahead and what is above, nought where these do not tell it.

    Exchanging left and right changes neither.
    """
    at, seen = look.trial.places, look.trial.seen
    on_pelvis = look.markers.body == PELVIS
    ahead = look.markers.at[:, 0] - look.markers.at[on_pelvis, 0].mean()
    front, back = on_pelvis & (ahead > 0.0), on_pelvis & (ahead <= 0.0)
    top = look.markers.body == look.markers.body.max()
    groups = (front, back, top)
    if not all(group.any() for group in groups) or np.ptp(look.markers.at[on_pelvis, 0]) < DEEP_M:
        return None
    # forwards from the markers behind to those ahead, up to the highest body: means of groups that
    # are whole, so that no marker's loss moves them
    whole = np.all([seen[:, group].all(axis=1) for group in groups], axis=0)
    first, last, highest = (at[:, group].mean(axis=1) for group in groups)
    forwards, up = first - last, highest - (first + last) / 2.0
    right = np.cross(forwards, up)
    size = np.linalg.norm(forwards, axis=1) * np.linalg.norm(up, axis=1)
    told = whole & (np.linalg.norm(right, axis=1) > SQUARE * size)
    return np.where(told[:, None], right, 0.0)


def _exchanged(look: LoadedTrial) -> Iterator[InputProblem]:
    """Pairs of markers that stand in each other's place when they are first seen together.

    The line between two markers cannot point backwards: where it does, they are exchanged.
    """
    rotations, told = look.turned
    if not told.any():
        return
    # of the first tenth, the frame that sees the most
    early = max(1, len(look.trial.time_s) // 10)
    frame = int(np.argmax(np.where(told, look.trial.seen.sum(axis=1), 0)[:early]))
    # the worst pair is put right before the next is looked for: an exchange bends other lines too
    places = look.trial.places[frame].copy()
    model = look.neutral @ rotations[frame].T
    there = look.trial.seen[frame]
    for _ in range(len(look.markers) // 2):
        pair = _worst_pair(places, model, there)
        if pair is None:
            return
        yield _exchange(look, pair, f"from {look.frames(frame, frame)} on")
        places[list(pair)] = places[list(pair[::-1])]


def _worst_pair(places: Array, model: Array, there: NDArray[np.bool_]) -> tuple[int, int] | None:
    """Which two markers stand backwards the most; None: no two do."""
    # cosine of the angle between each line of two markers and that of the set, times both lengths
    lines, wanted = (at[:, None] - at[None, :] for at in (places, model))
    lengths, asked = (np.linalg.norm(line, axis=-1) for line in (lines, wanted))
    along = np.einsum("abi,abi->ab", lines, wanted)
    backwards = along < BACKWARDS * lengths * asked
    backwards &= (np.minimum(lengths, asked) > APART_M) & there[:, None] & there[None, :]
    if not backwards.any():
        return None
    worst = int(np.argmin(np.where(backwards, along, np.inf)))
    first, second = divmod(worst, len(places))
    return min(first, second), max(first, second)


def _exchange(look: LoadedTrial, pair: tuple[int, int], when: str) -> InputProblem:
    first, second = (look.markers.names[k] for k in pair)
    allowed = "each marker where the set has it"
    remedy = "exchange the two names there"
    return look.in_motion(f"{first} and {second}", f"exchanged {when}", allowed, remedy)


def _exchanged_later(look: LoadedTrial) -> Iterator[InputProblem]:
    """Markers that land on each other's former place, or farther than anybody moves."""
    times, places = look.trial.time_s, look.trial.places
    # the last frame before each in which a marker was seen; -1: in none
    frames = np.where(look.trial.seen, np.arange(len(times))[:, None], -1)
    ever = np.maximum.accumulate(frames, axis=0)
    before = np.concatenate([np.full((1, places.shape[1]), -1), ever[:-1]])
    since = np.where(before < 0, np.inf, times[:, None] - times[before])
    recent = look.trial.seen & (since < LONGEST_GAP_S)
    markers = np.arange(places.shape[1])
    steps = np.linalg.norm(places - places[before, markers], axis=-1)
    steps[~recent] = 0.0
    # two that jump in one frame are exchanged if each lands where the other was
    for frame in np.flatnonzero((steps > JUMP_M).any(axis=1)).tolist():
        step, last = steps[frame], places[before[frame], markers]
        jumped = np.flatnonzero(step > JUMP_M).tolist()
        partners: set[int] = set()
        for one, other in combinations(jumped, 2):
            crossed = np.linalg.norm(places[frame, [one, other]] - last[[other, one]], axis=1)
            if crossed.sum() < LANDED * (step[one] + step[other]):
                partners |= {one, other}
                yield _exchange(look, (one, other), f"at {look.frames(frame, frame)}")
        for k in jumped:
            if k not in partners and step[k] > FASTEST_M_PER_S * since[frame, k]:
                found = f"jumps {step[k] * MM_PER_M:.0f} mm at {look.frames(frame, frame)}"
                allowed = f"at most {FASTEST_M_PER_S:g} m/s"
                remedy = "correct the name or delete the place"
                yield look.in_motion(look.markers.names[k], found, allowed, remedy)


def _clusters(look: LoadedTrial) -> Iterator[InputProblem]:
    """Clusters whose markers are not as far apart as in the set, or that are not rigid."""
    names, cluster = look.markers.names, look.markers.cluster
    for one, other in combinations(range(len(names)), 2):
        both = look.trial.seen[:, one] & look.trial.seen[:, other]
        if not cluster[one] or cluster[one] != cluster[other] or not both.any():
            continue
        lines = look.trial.places[both, one] - look.trial.places[both, other]
        apart = np.linalg.norm(lines, axis=1) * MM_PER_M
        wanted = float(np.linalg.norm(look.neutral[one] - look.neutral[other])) * MM_PER_M
        place = f"{names[one]} and {names[other]}"
        if abs(float(apart.mean()) - wanted) > RIGID_MM:
            found = f"{apart.mean():.1f} mm apart, and {wanted:.1f} mm in the set"
            remedy = f"correct cluster {cluster[one]} in marker_set.csv, or the names in the file"
            yield look.in_motion(place, found, f"the same within {RIGID_MM:g} mm", remedy)
        elif float(apart.std()) > SWAY_MM:
            worst = int(np.flatnonzero(both)[np.argmax(np.abs(apart - apart.mean()))])
            found = (
                f"their distance has an SD of {apart.std():.1f} mm, most at "
                f"{look.frames(worst, worst)}"
            )
            allowed = f"a rigid cluster: at most {SWAY_MM:g} mm"
            yield look.in_motion(place, found, allowed, "correct the places, or make them single")

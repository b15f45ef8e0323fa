"""All cycles of a test on common load steps.

Loading and unloading are branches of their own, so a loop stays a loop.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.problems import InputError, InputProblem
from spinepipe.testing_machine.channels import DIRECTIONS, LOAD_COLUMNS
from spinepipe.testing_machine.cycles import Cycle, Segmentation, segment
from spinepipe.testing_machine.local_regression import read_at, sds_of
from spinepipe.testing_machine.recording import Recording
from spinepipe.testing_machine.settings import LoadSteps, TestFile

Array = NDArray[np.float64]
Place = tuple[str, str]
"""Joint and column of ``motion.csv``."""

BEYOND = 0.02
"""Share of the range of a cycle by which a level may lie beyond the turn of a branch."""


UNLIKE = 5.0
"""Ratio of ranges of load, or of slopes of motion, that no two repeats of a test have; nor has any
load that is not driven so much more of a range.
"""

FOLLOWS = 0.8
"""Correlation of motion and load from which a slope says something."""


@dataclass(frozen=True, eq=False)
class ResampledCycle:
    """One cycle on its load steps.

    Attributes
    ----------
    of : what the YAML says of its file. complete : whether the load comes back.
    loads : (T, 6) N and N m. time : (T,) s from step 0, None where no time was mapped.
    motion, sds, raw : (T, C) reading, its SD, and the SD of a single row.
    rows : (T,) rows of the recording near each step.
    """

    of: TestFile
    complete: bool
    loads: Array
    time: Array | None
    motion: Array
    sds: Array
    raw: Array
    rows: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ResampledTest:
    """A test of a specimen: every cycle that is kept, in the order of the files.

    Attributes
    ----------
    places : C, what was read. levels : load of each step. cuts : by recording.
    """

    specimen: str
    test: str
    driving: str
    places: tuple[Place, ...]
    levels: tuple[float, ...]
    cycles: tuple[ResampledCycle, ...]
    recordings: tuple[Recording, ...]
    cuts: tuple[Segmentation, ...]


@dataclass(frozen=True)
class Step:
    """One load step of a cycle: a level of the load on one of its branches."""

    level: float
    branch: int


def common_levels(
    cut: Segmentation, cycles: Sequence[Cycle], per_side: int, asked: Sequence[float] | None
) -> tuple[tuple[float, ...], ...]:
    """Levels beyond the reference that all cycles reach, by turn, outwards; signed, absolute.

    Parameters
    ----------
    cycles : those that are kept. asked : sizes of the driving load instead of equal steps.
    """
    sides = []
    for turn in range(max(len(cycle.peaks) for cycle in cycles)):
        way = cut.way if turn == 0 else -cut.way
        reached = min(way * (c.peaks[turn] - cut.reference) for c in cycles if len(c.peaks) > turn)
        if asked is None:
            round_one = float(f"{reached:.2g}")
            top = round_one if round_one <= reached * (1 + BEYOND) else reached
            sizes = [top * (n + 1) / per_side for n in range(per_side)]
            sides.append(tuple(cut.reference + way * size for size in sizes))
        else:
            told = [way * size for size in sorted(asked)]
            told = [one for one in told if way * (one - cut.reference) > 0]
            sides.append(tuple(one for one in told if _within(way * one, way, cut, reached)))
    return tuple(sides)


def _within(size: float, way: int, cut: Segmentation, reached: float) -> bool:
    return size - way * cut.reference <= reached * (1 + BEYOND)


def plan(
    cut: Segmentation, sides: Sequence[Sequence[float]], cycle: Cycle, load: Array
) -> list[Step]:
    """The load steps of a cycle in the order in which it passes them, the reference first.

    It has those that it passes: a recording may end on the way back, or short of the reference.
    """
    steps = [Step(cut.reference, 0)]
    for turn, levels in enumerate(sides):
        if turn:
            steps.append(Step(cut.reference, turn))
        steps += [Step(level, turn) for level in levels]
        steps += [Step(level, turn + 1) for level in levels[-2::-1]]
    steps.append(Step(cut.reference, len(sides)))
    kept: list[Step] = []
    for step in steps:
        if step.branch >= len(cycle.branches) or not _passed(cut, cycle, step, load):
            break
        kept.append(step)
    return kept


def _passed(cut: Segmentation, cycle: Cycle, step: Step, load: Array) -> bool:
    rows = load[cycle.branches[step.branch].rows]
    slack = BEYOND * (cut.high - cut.low)
    return bool(rows.min() - slack <= step.level <= rows.max() + slack)


def resample_test(recordings: Sequence[Recording], steps: LoadSteps, zeroed: bool) -> ResampledTest:
    """The cycles of recordings of one test of one specimen, on steps that all of them reach.

    Parameters
    ----------
    zeroed : whether readings count from those of step 0 of their cycle.

    Raises
    ------
    InputError
        Where there is no cycle, where files are no repeats, or where a level is out of reach.
    """
    if problems := [found for one in recordings for found in _out_of_range(one, steps)]:
        raise InputError(problems)
    cuts = [
        segment(
            *(one.loads[one.driving], steps.smallest_reversal),
            *(one.of.preconditioning_cycles, steps.reference),
        )
        for one in recordings
    ]
    problems = [p for one in recordings[1:] for p in _no_repeat(one, recordings[0])]
    told = {one.file for one in problems}
    problems += [
        problem
        for one, found in zip(recordings, cuts, strict=True)
        for problem in _cut_problems(one, found, cuts[0])
        if problem.file not in told
    ]
    if problems:
        raise InputError(problems)
    kept = [
        (one, cycle) for one, found in zip(recordings, cuts, strict=True) for _, cycle in found.kept
    ]
    cycles = [cycle for _, cycle in kept]
    if problems := list(_beyond(recordings[0], cuts[0], cycles, steps)):
        raise InputError(problems)
    sides = common_levels(cuts[0], cycles, steps.per_side, steps.levels)
    first = recordings[0]
    places = tuple(first.motion)
    done, longest = [], list[Step]()
    for one, cycle in kept:
        planned = plan(cuts[0], sides, cycle, one.loads[one.driving])
        longest = max(longest, planned, key=len)
        done.append(_resample(one, cycle, planned, zeroed))
    levels = tuple(step.level for step in longest)
    of = first.of
    return ResampledTest(
        of.specimen, of.test, first.driving, places, levels, tuple(done),
        tuple(recordings), tuple(cuts),
    )  # fmt: skip


def _out_of_range(one: Recording, steps: LoadSteps) -> Iterator[InputProblem]:
    load = one.loads[one.driving]
    low, high = float(load.min()), float(load.max())
    if low == high:
        found, remedy = "a driving load that never changes", "look whether it is the right column"
        yield InputProblem(
            one.file, None, one.driving, found, "a load that goes up and down", remedy
        )
        return
    kind = one.driving.rpartition("_")[2]
    most, other = max((float(np.ptp(one.loads[it])), it) for it in one.loads if it.endswith(kind))
    if most >= UNLIKE * (high - low):
        found = f"{one.driving} with a range of {high - low:.3g}, and {other} with {most:.3g}"
        remedy = "correct `driving`, or the units of loads"
        yield InputProblem(one.file, None, "driving", found, "the load that is driven", remedy)
    if steps.reference is not None:
        start = float(np.copysign(steps.reference, low + high))
        slack = BEYOND * (high - low)
        if not low - slack <= start <= high + slack:
            found, allowed = (
                f"a reference of {start:g}",
                f"{low:.3g} to {high:.3g}, what it reaches",
            )
            yield InputProblem(
                one.file, None, one.driving, found, allowed, "correct `steps.reference`"
            )


def _no_repeat(one: Recording, first: Recording) -> Iterator[InputProblem]:
    """A file with loads or motion of another size or sign than the first one of its test."""
    driving = first.driving
    allowed = f"about what {first.file} has, as a repeat of its test"
    remedy = "look at unit and `positive` of its columns, or give its test another name"
    ranges = [float(np.ptp(it.loads[driving])) for it in (one, first)]
    if max(ranges) >= UNLIKE * min(ranges):
        found = "a range of {:.3g} where {:.3g} is usual".format(*ranges)
        yield InputProblem(one.file, None, driving, found, allowed, remedy)
        return
    driven = {way.motion for way in DIRECTIONS.values() if way.load == driving}
    for place in [p for p in one.motion if p[1] in driven] or one.motion:
        slopes = []
        for it in (one, first):
            (load, _), (both, motion) = np.cov(it.loads[driving], it.motion[place])
            follows = abs(both) > FOLLOWS * np.sqrt(load * motion)
            slopes.append(float(both / load) if follows else np.nan)
        sizes = np.abs(slopes)
        if slopes[0] * slopes[1] < 0 or sizes.max() >= UNLIKE * sizes.min():
            found = "{:.3g} for 1 of the load, where {:.3g} is usual".format(*slopes)
            yield InputProblem(one.file, None, " ".join(place), found, allowed, remedy)


def _cut_problems(
    one: Recording, found: Segmentation, first: Segmentation
) -> Iterator[InputProblem]:
    if not found.kept:
        told = f"{len(found.cycles)} cycles, of which none is kept"
        told += "".join(f"; {number}: {why}" for number, why in found.left_out[:1])
        remedy = "lower `preconditioning_cycles` or `steps.smallest_reversal`, or look at the file"
        yield InputProblem(one.file, None, one.driving, told, "at least one cycle", remedy)
    elif (found.way, found.both_sides) != (first.way, first.both_sides):
        told = "cycles that go another way than those of the first file of this test"
        remedy = "give the test of this file another name"
        yield InputProblem(one.file, None, one.driving, told, "repeats of one test", remedy)
    elif not all(
        _passed(first, cycle, Step(first.reference, 0), one.loads[one.driving])
        for _, cycle in found.kept
    ):
        told = f"cycles that begin at {found.reference:.3g}"
        allowed = (
            f"cycles that pass {first.reference:.3g}, where the first file of this test begins"
        )
        remedy = "give the test of this file another name, or set `steps.reference` to a load that "
        remedy += "the cycles of all files pass"
        yield InputProblem(one.file, None, one.driving, told, allowed, remedy)


def _beyond(
    one: Recording, found: Segmentation, cycles: Sequence[Cycle], steps: LoadSteps
) -> Iterator[InputProblem]:
    """Levels that were asked for and that some cycle does not reach."""
    if steps.levels is None:
        return
    reached = min(abs(peak - found.reference) for cycle in cycles for peak in cycle.peaks)
    far = [size for size in steps.levels if size - abs(found.reference) > reached * (1 + BEYOND)]
    if far:
        told = f"load steps at {', '.join(f'{size:g}' for size in far)}"
        allowed = f"at most {reached + abs(found.reference):.3g}, which every cycle reaches"
        remedy = "take them out of `steps.levels`, or split the test"
        yield InputProblem(one.file, None, one.driving, told, allowed, remedy)


def _resample(
    one: Recording, cycle: Cycle, planned: Sequence[Step], zeroed: bool
) -> ResampledCycle:
    load = one.loads[one.driving]
    others = [name for name in one.loads if name != one.driving]
    columns = [*one.motion.values(), *(one.loads[name] for name in others)]
    columns += [] if one.time is None else [one.time]
    quantities = np.column_stack(columns)
    readings = []
    # width of each window: the distance of its level to the nearest other one
    known = np.unique([step.level for step in planned])
    gaps = np.diff(known)
    near = np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps))
    width_of = {level: float(gap) for level, gap in zip(known, near, strict=True)}
    for step in planned:
        branch = cycle.branches[step.branch]
        reading = read_at(step.level, width_of[step.level], branch, load, quantities)
        if reading is None:
            line = int(one.lines[branch.first])
            found = f"{branch.last - branch.first + 1} lines on the way to or from a reversal"
            remedy = "record more often, or raise `steps.smallest_reversal`"
            where = (one.file, line, one.driving)
            raise InputError([InputProblem(*where, found, "at least 3", remedy)])
        readings.append(reading)
    values = np.array([reading.values for reading in readings])
    n = len(one.motion)
    loads = np.zeros((len(planned), len(LOAD_COLUMNS)))
    loads[:, LOAD_COLUMNS.index(one.driving)] = [step.level for step in planned]
    for number, name in enumerate(others):
        loads[:, LOAD_COLUMNS.index(name)] = values[:, n + number]
    motion = values[:, :n] - values[0, :n] if zeroed else values[:, :n]
    return ResampledCycle(
        of=one.of,
        complete=cycle.complete,
        loads=loads,
        time=None if one.time is None else _times(values[:, -1], planned, cycle, one.time),
        motion=motion,
        sds=sds_of(readings)[:, :n],
        raw=np.array([reading.raw[:n] for reading in readings]),
        rows=np.array([len(reading.left) for reading in readings]),
    )


def _times(regressed: Array, planned: Sequence[Step], cycle: Cycle, time: Array) -> Array:
    """(T,) s from step 0: at turns that of the turn, for a load may creep up to it, but of a hold
    its mean, as at other levels; never back.
    """
    told = regressed.copy()
    for place in range(1, len(planned)):
        before = cycle.branches[planned[place - 1].branch]
        if planned[place].branch > planned[place - 1].branch and not before.held:
            told[place - 1] = time[before.last]
    told = np.maximum.accumulate(told)
    return told - told[0]

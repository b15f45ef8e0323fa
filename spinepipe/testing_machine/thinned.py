"""All cycles of one test of one specimen on common load steps, and how sure the readings are."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.problems import InputProblem
from spinepipe.testing_machine.channels import LOAD_COLUMNS
from spinepipe.testing_machine.cycles import Cut, Cycle, cut
from spinepipe.testing_machine.recording import Recording
from spinepipe.testing_machine.settings import LoadSteps
from spinepipe.testing_machine.thinning import BEYOND, Step, common_levels, plan, read_at, sds_of

Array = NDArray[np.float64]
Place = tuple[str, str]
"""Joint and column of ``motion.csv``."""


@dataclass(frozen=True, eq=False)
class ThinnedCycle:
    """One cycle on its load steps.

    Attributes
    ----------
    loads : (T, 6) N and N m. time : (T,) s from step 0, None where no time was mapped.
    motion, sds, raw : (T, C) reading, its SD, and the SD of a single row.
    rows : (T,) rows of the recording near each step.
    """

    loads: Array
    time: Array | None
    motion: Array
    sds: Array
    raw: Array
    rows: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ThinnedTest:
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
    cycles: tuple[ThinnedCycle, ...]
    recordings: tuple[Recording, ...]
    cuts: tuple[Cut, ...]


def thinned_test(
    recordings: Sequence[Recording], steps: LoadSteps, zeroed: bool
) -> tuple[ThinnedTest | None, list[InputProblem]]:
    """The cycles of recordings of one test of one specimen, on steps that all of them reach.

    Parameters
    ----------
    zeroed : whether readings count from those of step 0 of their cycle.
    """
    problems = [found for one in recordings for found in _out_of_range(one, steps)]
    if problems:
        return None, problems
    cuts = [_cut(one, steps) for one in recordings]
    problems = [
        problem
        for one, found in zip(recordings, cuts, strict=True)
        for problem in _cut_problems(one, found, cuts[0])
    ]
    if problems:
        return None, problems
    kept = [
        (one, cycle) for one, found in zip(recordings, cuts, strict=True) for _, cycle in found.kept
    ]
    cycles = [cycle for _, cycle in kept]
    problems = list(_beyond(recordings[0], cuts[0], cycles, steps))
    if problems:
        return None, problems
    sides = common_levels(cuts[0], cycles, steps.per_side, steps.levels)
    first = recordings[0]
    places = tuple(first.motion)
    done = []
    for one, cycle in kept:
        planned = plan(cuts[0], sides, cycle, one.loads[one.driving])
        result = _thinned(one, cycle, planned, zeroed)
        if isinstance(result, InputProblem):
            problems.append(result)
        else:
            done.append(result)
    if problems:
        return None, problems
    levels = tuple(step.level for step in planned)
    of = first.of
    made = ThinnedTest(
        of.specimen, of.test, first.driving, places, levels, tuple(done),
        tuple(recordings), tuple(cuts),
    )  # fmt: skip
    return made, []


def _out_of_range(one: Recording, steps: LoadSteps) -> Iterator[InputProblem]:
    load = one.loads[one.driving]
    low, high = float(load.min()), float(load.max())
    if low == high:
        found, remedy = "a driving load that never changes", "look whether it is the right column"
        yield InputProblem(
            one.file, None, one.driving, found, "a load that goes up and down", remedy
        )
    elif steps.reference is not None:
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


def _cut(one: Recording, steps: LoadSteps) -> Cut:
    load = one.loads[one.driving]
    return cut(load, steps.smallest_reversal, one.of.preconditioning_cycles, steps.reference)


def _cut_problems(one: Recording, found: Cut, first: Cut) -> Iterator[InputProblem]:
    if not found.kept:
        told = f"{len(found.cycles)} cycles, of which none is kept"
        remedy = "lower `preconditioning_cycles` or `steps.smallest_reversal`, or look at the file"
        yield InputProblem(one.file, None, one.driving, told, "at least one cycle", remedy)
    elif (found.way, found.both_sides) != (first.way, first.both_sides):
        told = "cycles that go another way than those of the first file of this test"
        remedy = "give the test of this file another name"
        yield InputProblem(one.file, None, one.driving, told, "repeats of one test", remedy)


def _beyond(
    one: Recording, found: Cut, cycles: Sequence[Cycle], steps: LoadSteps
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


def _thinned(
    one: Recording, cycle: Cycle, planned: Sequence[Step], zeroed: bool
) -> ThinnedCycle | InputProblem:
    load = one.loads[one.driving]
    others = [name for name in one.loads if name != one.driving]
    columns = [*one.motion.values(), *(one.loads[name] for name in others)]
    columns += [] if one.time is None else [one.time]
    quantities = np.column_stack(columns)
    readings = []
    for step, width in zip(planned, _widths([step.level for step in planned]), strict=True):
        branch = cycle.branches[step.branch]
        reading = read_at(step.level, width, branch, load, quantities)
        if reading is None:
            line = int(one.lines[branch.first])
            found = f"{branch.last - branch.first + 1} lines on the way to or from a reversal"
            remedy = "record more often, or raise `steps.smallest_reversal`"
            return InputProblem(one.file, line, one.driving, found, "at least 3", remedy)
        readings.append(reading)
    values = np.array([reading.values for reading in readings])
    n = len(one.motion)
    loads = np.zeros((len(planned), len(LOAD_COLUMNS)))
    loads[:, LOAD_COLUMNS.index(one.driving)] = [step.level for step in planned]
    for place, name in enumerate(others):
        loads[:, LOAD_COLUMNS.index(name)] = values[:, n + place]
    motion = values[:, :n] - values[0, :n] if zeroed else values[:, :n]
    return ThinnedCycle(
        loads=loads,
        time=None if one.time is None else _times(values[:, -1], planned, cycle, one.time),
        motion=motion,
        sds=sds_of(readings)[:, :n],
        raw=np.array([reading.raw[:n] for reading in readings]),
        rows=np.array([len(reading.left) for reading in readings]),
    )


def _widths(levels: Sequence[float]) -> list[float]:
    """Distance of each level to its nearest neighbour among all levels."""
    known = np.unique(levels)
    gaps = np.diff(known)
    near = np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps))
    at = {level: float(gap) for level, gap in zip(known, near, strict=True)}
    return [at[level] for level in levels]


def _times(regressed: Array, planned: Sequence[Step], cycle: Cycle, time: Array) -> Array:
    """(T,) s from step 0: at turns that of the turn, for a load may creep up to it; never back."""
    told = regressed.copy()
    for place in range(1, len(planned)):
        if planned[place].branch > planned[place - 1].branch:
            told[place - 1] = time[cycle.branches[planned[place - 1].branch].last]
    told = np.maximum.accumulate(told)
    return told - told[0]


@dataclass(frozen=True)
class Sureness:
    """How sure the readings of one kind (deg or mm) are; NaN where it cannot be told.

    Attributes
    ----------
    row : SD of a single row of the recordings around the regression.
    regression : SD of a reading after it. cycles : SD of a reading between repeats.
    finest : SD that the resolution of the files makes at least.
    """

    row: float
    regression: float
    cycles: float
    finest: float

    @property
    def sd(self) -> float:
        """What is declared: the largest of what is known, as each leaves something out."""
        return float(np.nanmax([self.regression, self.cycles, self.finest]))


def sureness(tests: Sequence[ThinnedTest], unit: str, zeroed: bool) -> Sureness | None:
    """Pooled over all readings whose column ends with this unit; None where there are none."""
    of_rows, of_regression, of_cycles, finest = [], [], [], []
    for test in tests:
        for place, (joint, column) in enumerate(test.places):
            if not column.endswith(unit):
                continue
            of_rows += [cycle.raw[:, place] for cycle in test.cycles]
            of_regression += [cycle.sds[:, place] for cycle in test.cycles]
            finest += [one.finest[joint, column] for one in test.recordings]
            if len(test.cycles) > 1:
                of_cycles.append(_between([c.motion[:, place] for c in test.cycles], zeroed))
    if not of_rows:
        return None
    return Sureness(
        _rms(np.concatenate(of_rows)),
        _rms(np.concatenate(of_regression)),
        _rms(np.concatenate(of_cycles)) if of_cycles else float("nan"),
        max(finest) / np.sqrt(12.0),
    )


def _between(cycles: Sequence[Array], zeroed: bool) -> Array:
    """(T,) SD of one reading between cycles; zeroed readings carry the error of step 0 as well."""
    shortest = min(map(len, cycles))
    sds = np.std([one[:shortest] for one in cycles], axis=0, ddof=1)
    return sds[1:] / np.sqrt(2.0) if zeroed else sds


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))

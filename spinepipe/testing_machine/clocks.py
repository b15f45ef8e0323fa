"""Loads and motion of one test from two files, whose clocks differ by a shift.

The shift is told, or it is where two rates correlate most: of a signal that both files have, or of
the driving load and the motion that follows it best. What was read more seldom is then put on the
rows of the other, along straight lines, where both were recorded.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, correlation_lags, savgol_filter

from spinepipe.problems import InputError, InputProblem
from spinepipe.testing_machine.channels import DIRECTIONS
from spinepipe.testing_machine.conversions import SHIFTS, joint_rotations
from spinepipe.testing_machine.instruments import SYNC
from spinepipe.testing_machine.recording import FEWEST_LINES, Recording, read_recording
from spinepipe.testing_machine.settings import OF_A_FILE, MachineMapping, MotionChannel, TestFile

Array = NDArray[np.float64]

SMOOTHED = 100
"""Rates are slopes of parabolas over this fraction of the shorter recording."""

LIKENESS, NEXT_BEST = 0.8, 0.9
"""A shift is refused where rates correlate by less than the one, or where another shift, off the
peak, has more than the other of it.
"""

AS_TOLD = 0.7
"""Share of the peak that rates must have at a shift that is told; a motion that lags has more."""

GAP = 3.0
"""Usual intervals without a reading that are too long for a straight line."""


def read_test(folder: Path, of: TestFile, mapping: MachineMapping) -> Recording:
    """The recording of a test, from one file or from two.

    Raises
    ------
    InputError
        With every problem of both files, or of their clocks.
    """
    beside = mapping.motion_files
    if beside is None or of.motion_file is None:
        return read_recording(folder / of.file, of, mapping)
    motion_file = of.motion_file.replace("{stem}", Path(of.file).stem)
    mapping, of = mapping.of_file(of), of.model_copy(update=dict.fromkeys(OF_A_FILE))
    other = of.model_copy(update={"file": motion_file})
    wanted = list(mapping.motion)
    if (markers := beside.markers) is not None:
        wanted = [
            _length(
                markers.columns.replace("{marker}", name).replace("{axis}", axis),
                *(name, way, markers.unit),
            )
            for names in markers.clusters.values()
            for name in names
            for axis, way in zip("xyz", markers.axes, strict=True)
        ]
    sync = beside.sync
    signal = [_length(name, SYNC) for name in (sync.load, sync.motion)] if sync else []
    of_loads = {"motion": tuple(signal[:1])}
    of_motion = {"loads": (), "form": beside.form, "time": beside.time}
    of_motion |= {"motion": (*wanted, *signal[1:])}
    found, problems = list[Recording](), list[InputProblem]()
    for one, columns in ((of, of_loads), (other, of_motion)):
        try:
            found.append(read_recording(folder / one.file, one, mapping.model_copy(update=columns)))
        except InputError as error:
            # what is told of the form is told of the one that this file has
            told = "`motion_files.form" if one is other else "`form"
            problems += [
                replace(each, remedy=each.remedy.replace("`form", told)) for each in error.problems
            ]
    if problems:
        raise InputError(problems)
    loads, motion = found
    time, seen = loads.time, motion.time
    if beside.rate_hz is not None:
        seen = motion.rows / beside.rate_hz
    assert time is not None
    assert seen is not None
    jumps = [one.motion.pop((SYNC, SHIFTS[0]), None) for one in (loads, motion)]
    if markers is not None:
        motion = joint_rotations(motion, markers, mapping.vertebrae)
    clocks = (loads, time), (motion, seen)
    # what the load drives goes its way; other motion may go either way
    driven = {d.motion for d in DIRECTIONS.values() if d.load == loads.driving}
    moved = [(one, name not in driven) for (_, name), one in motion.motion.items()]
    moved = [pair for pair in moved if not pair[1]] or moved
    load = loads.loads[loads.driving]
    if jumps[0] is not None and jumps[1] is not None:
        load, moved = jumps[0], [(jumps[1], False)]
    shifts = [best_shift(time, load, seen, one, either, of.shift_s) for one, either in moved]
    best = max(shifts, key=lambda one: one.likeness)
    whose = f"rates of {'the signal' if beside.sync else 'load and motion'}"
    likest = f"{whose} correlate by {best.likeness:.2f}"
    sure = best.likeness >= LIKENESS and best.next_best <= NEXT_BEST
    if all(one.opposite > 1 / NEXT_BEST or one.as_told < -AS_TOLD for one in shifts):
        words = f"{whose} that are more alike with the sign of one of them turned"
        remedy = (
            "look at `positive` of loads and motion or at `markers`, and at `time` or `rate_hz`"
        )
        remedy = "take one that jumps the same way in both files" if beside.sync else remedy
        problem = words, "rates of one sign", remedy
    elif of.shift_s is not None and sure and best.as_told < AS_TOLD:
        near = abs(best.seconds + of.shift_s) < abs(best.seconds) / 4
        turned = ", the told one with its sign turned" if near else ""
        words = f"{of.shift_s:g}, where they correlate by {best.as_told:.2f} of their best"
        allowed = f"about {best.seconds:.3f}{turned}: there {likest}"
        problem = words, allowed, "correct it: above 0 where the motion's file begins first"
    elif of.shift_s is None and not sure:
        words = (
            f"no shift that is sure: {likest} at best, by {best.next_best:.2f} of that elsewhere"
        )
        allowed = f"a correlation of {LIKENESS:g}, and no more than {NEXT_BEST:g} of it elsewhere"
        remedy = (
            "look at `positive` of loads and motion; if it is right, add `shift_s` to the file, "
        )
        remedy += "or `sync` to `motion_files`"
        problem = words, allowed, remedy
    elif of.shift_s is not None:
        told = f"as told; {likest} at {best.seconds:.3f} s"
        return _together(*clocks, of.shift_s, told)
    else:
        told = f"found: {likest}, and by {best.next_best:.2f} of that at the next best shift"
        return _together(*clocks, best.seconds, told)
    raise InputError([InputProblem(of.file, None, "shift_s", *problem)])


def _length(column: str | int, of: str, way: str = "anterior", unit: str = "mm") -> MotionChannel:
    """A column that is no joint's."""
    told = {"column": column, "unit": unit, "joint": of, "positive": way}
    return MotionChannel.model_validate(told)


def _together(
    of_loads: tuple[Recording, Array], of_motion: tuple[Recording, Array], shift: float, told: str
) -> Recording:
    """Both on the rows of what was read more often, and on the clock of the motion."""
    (loads, time), (motion, seen) = of_loads, of_motion
    both = [(time + shift, loads), (seen, motion)]
    both.sort(key=lambda one: -float(np.median(np.diff(one[0]))))
    (at, slow), (on, fast) = both
    after = np.clip(np.searchsorted(at, on), 1, len(at) - 1)
    gaps = np.diff(at)
    known = (on >= at[0]) & (on <= at[-1]) & (gaps[after - 1] <= GAP * np.median(gaps))
    rows = int(np.count_nonzero(known))
    if rows < FEWEST_LINES:
        found = f"{rows} rows within the time of both files, at a shift of {shift:g} s"
        remedy = "correct it: from the first row of the motion to the first row of the loads"
        allowed = f"at least {FEWEST_LINES}"
        raise InputError([InputProblem(loads.file, None, "shift_s", found, allowed, remedy)])

    def put(one: Recording, values: Array) -> Array:
        return values[known] if one is fast else np.asarray(np.interp(on[known], at, values))

    side = "before" if shift >= 0 else "after"
    note = (
        f"{motion.file} begins {abs(shift):.3f} s {side} it ({told}); {slow.file} is put on the "
        f"rows of {fast.file}"
    )
    return replace(
        loads,
        lines=fast.lines[known],
        rows=fast.rows[known],
        time=on[known] - on[known][0],
        loads={name: put(loads, values) for name, values in loads.loads.items()},
        motion={place: put(motion, values) for place, values in motion.motion.items()},
        finest=motion.finest,
        spikes=loads.spikes + motion.spikes,
        notes=(*loads.notes, *(f"{motion.file}: {one}" for one in motion.notes), note),
    )


@dataclass(frozen=True)
class BestShift:
    """Where two rates are most alike.

    Attributes
    ----------
    seconds : the shift. likeness : the correlation there.
    next_best : share of the peak that another shift has, beyond where it has fallen to half.
    opposite : that of the most negative correlation. as_told : that at the shift that is told.
    """

    seconds: float
    likeness: float
    next_best: float
    opposite: float
    as_told: float


def best_shift(
    time: Array,
    load: Array,
    other_time: Array,
    motion: Array,
    either: bool,
    told: float | None = None,
) -> BestShift:
    """Shift, s, at which the rate of ``motion`` is most like that of ``load``, or like its negative
    one if it may go ``either`` way.
    """
    spans = [(time, load), (other_time, motion)]
    step = min(float(np.median(np.diff(at))) for at, _ in spans)
    shortest = min(float(np.ptp(at)) for at, _ in spans)
    window = max(2 * int(shortest / step / SMOOTHED / 2) + 1, 5)
    grids = [(np.arange(at[0], at[-1], step), at, values) for at, values in spans]
    a, b = (savgol_filter(np.interp(*one), window, 2, deriv=1) for one in grids)
    product, lags = correlate(b, a, method="fft"), correlation_lags(len(b), len(a))
    product = np.abs(product) if either else product
    top = int(np.argmax(product))
    peak, lag = float(product[top]), int(lags[top])
    here, there = a[max(-lag, 0) : len(b) - lag], b[max(lag, 0) : len(a) + lag]
    power = float(np.linalg.norm(here) * np.linalg.norm(there))
    low = np.flatnonzero(product < peak / 2)
    edge = int(np.searchsorted(low, top))
    left, right = (low[edge - 1] if edge else 0), (low[edge] if edge < len(low) else len(lags))
    elsewhere = float(np.r_[0.0, product[:left], product[right:]].max())
    # the top of the parabola through the peak and its neighbours
    before, after = (float(product[np.clip(top + n, 0, len(lags) - 1)]) for n in (-1, 1))
    bend = before - 2 * peak + after
    fine = (before - after) / bend / 2 if bend < 0 else 0.0
    start = float(other_time[0] - time[0])
    asked = (
        0.0 if told is None else float(np.interp((told - start) / step, lags, product, 0.0, 0.0))
    )
    shares = elsewhere, -float(product.min()), asked
    nothing = peak <= 0 or not power
    return BestShift(
        (lag + fine) * step + start,
        0.0 if nothing else peak / power,
        *((1.0, 0.0, 0.0) if nothing else (share / peak for share in shares)),
    )

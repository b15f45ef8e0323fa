"""Loads and motion of one test from two files, whose clocks differ by a shift.

The shift is told, or it is where two rates correlate most: of a signal that both files have, or of
the driving load and the motion that follows it best. What was read more seldom is then put on the
rows of the other, along straight lines, where both were recorded.
"""

from dataclasses import replace
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
    if of.shift_s is not None:
        return _together(*clocks, of.shift_s, "as told")
    # what the load drives goes its way; other motion may go either way
    driven = {d.motion for d in DIRECTIONS.values() if d.load == loads.driving}
    moved = [(one, name not in driven) for (_, name), one in motion.motion.items()]
    moved = [pair for pair in moved if not pair[1]] or moved
    load = loads.loads[loads.driving]
    if jumps[0] is not None and jumps[1] is not None:
        load, moved = jumps[0], [(jumps[1], False)]
    shifts = [best_shift(time, load, seen, one, either) for one, either in moved]
    seconds, likeness, next_best = max(shifts, key=lambda one: one[1])
    told = (
        f"found by rates of {'the signal' if beside.sync else 'load and motion'}, which correlate "
        f"by {likeness:.2f}, and by {next_best:.2f} of that at the next best shift"
    )
    if likeness < LIKENESS or next_best > NEXT_BEST:
        allowed = f"a correlation of {LIKENESS:g}, and no more than {NEXT_BEST:g} of it elsewhere"
        remedy = "add `shift_s` to the file, or `sync` to `motion_files`"
        words = (f"a shift of {seconds:.3f} s, {told}", allowed, remedy)
        raise InputError([InputProblem(of.file, None, "shift_s", *words)])
    return _together(*clocks, seconds, told)


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


def best_shift(
    time: Array, load: Array, other_time: Array, motion: Array, either: bool
) -> tuple[float, float, float]:
    """Shift, s, at which the rate of ``motion`` is most like that of ``load``, or like its negative
    one if it may go ``either`` way.

    Returns
    -------
    The shift; the correlation there; the share of the peak that another shift has, beyond where it
    has fallen to half.
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
    shift = (lag + fine) * step + float(other_time[0] - time[0])
    return shift, peak / power if power else 0.0, elsewhere / peak if peak > 0 else 1.0

"""A recorded lift of a cohort as a motion of the person's spine, with all that loads it."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.motion.joint_tables import USUAL_SHARES, ratio_sets
from spinepipe.motion.lifted_load import LiftedLoad, borne_by_height, borne_by_plates
from spinepipe.motion.plug_in_gait import NEEDED, marker_places
from spinepipe.motion.recorded_motion import RecordedMotion, move
from spinepipe.motion.recording import MarkerRecording
from spinepipe.motion.smoothing import USUAL_CUTOFF_HZ, low_pass
from spinepipe.motion.standing_spine import StandingSpine
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.recordings import (
    BOX,
    FORCE_PLATES,
    STANCE,
    TRIALS,
    Row,
    of_trial,
    read_recording,
    static_trial,
    trial_rows,
)
from spinepipe.units import MM_PER_M

EVEN = 0.01
"""Share by which steps of time may differ."""

HANDS = ("LFIN", "RFIN")


def recorded_motion(
    cohort: Cohort,
    specimen: str,
    trial: str,
    spine: StandingSpine,
    cutoff_hz: float = USUAL_CUTOFF_HZ,
    shares: Array | None = None,
) -> RecordedMotion:
    """A trial of a person of a cohort, markers of Plug-in-Gait.

    Parameters
    ----------
    spine : the person's. cutoff_hz : of the zero-phase low-pass filter of all places.
    shares : (17, 3) of joints in the rotation from pelvis to thorax; None: `USUAL_SHARES`.

    Raises
    ------
    InputError
        Of a trial that cannot be read, that lacks markers, or whose load cannot be placed.
    """
    rows = {str(row["trial"]): row for row in trial_rows(cohort, specimen)}
    still = static_trial(cohort, specimen)
    if trial not in rows or still is None:
        lacking = trial if still else STANCE
        found, allowed = f"no trial {lacking} of '{specimen}'", f"one of {', '.join(rows)}"
        remedy = "name another" if still else "add a trial of kind stance, or mark one static"
        table = f"{cohort.name}/{TRIALS.file}"
        raise InputError([InputProblem(table, None, "trial", found, allowed, remedy)])
    _, stance = places_of(rows[still], cohort)
    time_s, places = smooth_places(rows[trial], cohort, cutoff_hz)
    return move(
        trial,
        time_s,
        spine,
        ratio_sets()[USUAL_SHARES] if shares is None else shares,
        {name: at.mean(axis=0) for name, at in stance.items()},
        places,
        lifted_load(cohort, specimen, rows[trial], time_s, places, cutoff_hz),
    )


def smooth_places(row: Row, cohort: Cohort, cutoff_hz: float) -> tuple[Array, dict[str, Array]]:
    """Times (F,) s and filtered places (F, 3) m of the markers of the set in a trial.

    Raises
    ------
    InputError
        Of frames that cannot be filtered, besides what `places_of` raises.
    """
    time_s, raw = places_of(row, cohort)
    return time_s, smoothed(row, cohort, time_s, raw, cutoff_hz)


def smoothed(
    row: Row, cohort: Cohort, time_s: Array, raw: Mapping[str, Array], cutoff_hz: float
) -> dict[str, Array]:
    """Places (F, 3) m of the markers of a trial, filtered.

    Raises
    ------
    InputError
        Of frames that cannot be filtered.
    """
    table = f"{cohort.name}/{TRIALS.file}"
    steps = np.diff(time_s)
    if len(steps) == 0 or np.ptp(steps) > EVEN * steps.mean():
        found, allowed = "frames that are not evenly spaced in time", "one step between all frames"
        remedy = "export it at one frame rate"
        raise InputError([InputProblem(table, row["line"], "file", found, allowed, remedy)])
    rate = 1.0 / float(steps.mean())
    try:
        return {name: low_pass(at, rate, cutoff_hz) for name, at in raw.items()}
    except ValueError as why:
        allowed, remedy = "a trial that can be filtered", "record longer, or lower the cutoff"
        problem = InputProblem(table, row["line"], "file", str(why), allowed, remedy)
        raise InputError([problem]) from why


def lifted_load(
    cohort: Cohort,
    specimen: str,
    row: Row,
    time_s: Array,
    places: Mapping[str, Array],
    cutoff_hz: float,
) -> LiftedLoad | None:
    """What hands lift in a trial; None where its row has no `load_kg`.

    Where `box.csv` tells nothing, of a direction or at all, the load is midway between the hands;
    without heights and plates the hands bear it all the time.

    Raises
    ------
    InputError
        Of a box that was not measured while markers were.
    """
    kg = float(row.get("load_kg", np.nan))
    if not kg > 0.0:
        return None
    rate = 1.0 / float(np.mean(np.diff(time_s)))
    at = np.mean([places[name] for name in HANDS], axis=0)
    box = of_trial(cohort, BOX, specimen, str(row["trial"]))
    borne = np.ones(len(time_s))
    for axis, column in enumerate(("x_mm", "y_mm", "z_mm")):
        if box[column].isna().all():
            continue
        measured = _on_clock(cohort, BOX.file, box, column, time_s) / MM_PER_M
        at[:, axis] = low_pass(measured, rate, cutoff_hz)
        if column == "y_mm":
            borne = borne_by_height(at[:, axis])
    plates = of_trial(cohort, FORCE_PLATES, specimen, str(row["trial"]))
    upwards = {
        str(name): _on_clock(cohort, FORCE_PLATES.file, one, "fy_n", time_s)
        for name, one in plates.dropna(subset="fy_n").groupby("plate", sort=False)
    }
    kg, borne = borne_by_plates(kg, upwards) or (kg, borne)
    return LiftedLoad(kg, at, borne)


def places_of(row: Row, cohort: Cohort) -> tuple[Array, dict[str, Array]]:
    """Times (F,) s and places (F, 3) m of the markers of the set; gaps are straight lines.

    Raises
    ------
    InputError
        Of a file that cannot be read, or that lacks markers.
    """
    read = read_recording(row, cohort.name, cohort.folder)
    return read.time_s, places_in(read, f"{cohort.name}/{row['file']}")


def places_in(read: MarkerRecording, file: str) -> dict[str, Array]:
    """The same places of a recording; `file`: its name in messages."""
    at = marker_places(read.names)
    lacking = list(_lacking(file, read, at))
    if lacking:
        raise InputError(lacking)
    found = {}
    for name, k in at.items():
        seen = read.seen[:, k]
        if seen.any():
            found[name] = np.stack(
                [
                    np.interp(read.time_s, read.time_s[seen], one[seen])
                    for one in read.places[:, k].T
                ],
                axis=1,
            )
    return found


def _lacking(file: str, read: MarkerRecording, at: Mapping[str, int]) -> Iterator[InputProblem]:
    """Markers of the set that a file lacks, or never sees."""
    for name in NEEDED:
        if name not in at or not read.seen[:, at[name]].any():
            found = "never in sight" if name in at else "no such marker"
            allowed = f"all markers of Plug-in-Gait above the legs: {', '.join(NEEDED)}"
            yield InputProblem(file, None, name, found, allowed, "correct its name in the file")


def _on_clock(cohort: Cohort, file: str, rows: pd.DataFrame, column: str, time_s: Array) -> Array:
    """(F,) of a column, straight between its times and held at both ends.

    Raises
    ------
    InputError
        Where the times are not those of the markers.
    """
    rows = rows[rows[column].notna()].sort_values("time_s")
    times = rows["time_s"].to_numpy(float)
    within = np.clip(times[[0, -1]], time_s[0], time_s[-1])
    if np.ptp(within) < 0.5 * np.ptp(time_s):
        found = f"times from {times[0]:g} to {times[-1]:g} s"
        allowed = f"most of the markers' time, {time_s[0]:g} to {time_s[-1]:g} s"
        remedy = "put it on the clock of the markers, in s (`shift_s` of spinepipe import)"
        place = (f"{cohort.name}/{file}", int(str(rows.index[0])), "time_s")
        raise InputError([InputProblem(*place, found, allowed, remedy)])
    return np.interp(time_s, times, rows[column].to_numpy(float))

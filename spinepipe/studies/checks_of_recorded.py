"""Is a recorded lift what its tables say: markers of Plug-in-Gait, what is lifted, its clock?"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.motion.lifted_load import LiftedLoad
from spinepipe.motion.plug_in_gait import PLACES, marker_places
from spinepipe.motion.recording import MarkerRecording
from spinepipe.motion.skeleton import BODIES, PELVIS, MarkerSet
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.checks_of_markers import LoadedTrial
from spinepipe.studies.checks_of_motion import better_axes, motion_problems
from spinepipe.studies.recorded_motion import HANDS, lifted_load, places_in, smoothed
from spinepipe.studies.recordings import (
    BOX,
    STANCE,
    Row,
    read_recording,
    static_trial,
    trial_rows,
)
from spinepipe.studies.subjects import subject_of
from spinepipe.units import DEG_PER_RAD, MM_PER_M

SEGMENTS = (("SHO", "ELB"), ("ELB", "WRA"), ("ELB", "WRB"), ("WRA", "FIN"))
"""Pairs of markers of an arm that keep their distance."""

ASKEW_DEG = 15.0
"""How far to a side a person may look who bends straight forwards: a choice."""

STRETCHED_M = 0.05
"""By how much skin may change that distance: a choice; wrist and knuckle are 80 mm apart."""

HELD_M = 0.06
"""By how much the way from the hands to what they hold may vary (5 to 95 % of the frames)."""

REACH_M = 0.6
"""How far from the hands the middle of what they hold can be."""

MOST_SHIFT_S = 2.0


def recorded_problems(cohort: Cohort, cutoff_hz: float) -> Iterator[InputProblem]:
    """Everything that is wrong with recordings of a cohort whose tables are sound."""
    for specimen in cohort.specimen_names:
        rows, still = trial_rows(cohort, specimen), static_trial(cohort, specimen)
        stance: dict[str, Array] = {}
        for row in sorted(rows, key=lambda row: row["trial"] != still):
            try:
                read = read_recording(row, cohort.name, cohort.folder)
                places = places_in(read, f"{cohort.name}/{row['file']}")
                look = _loaded(row, cohort, specimen, read)
                found = [*motion_problems(look)] or [*_facing(look)]
                stance = stance or {name: at.mean(axis=0) for name, at in places.items()}
                found = found or list(_arms(f"{cohort.name}/{row['file']}", stance, places))
                if not found and row["kind"] != STANCE:
                    places = smoothed(row, cohort, read.time_s, places, cutoff_hz)
                    load = lifted_load(cohort, specimen, row, read.time_s, places, cutoff_hz)
                    found = list(_load(cohort, row, read.time_s, places, load))
                yield from found
            except InputError as error:
                yield from error.problems


def _loaded(row: Row, cohort: Cohort, specimen: str, read: MarkerRecording) -> LoadedTrial:
    """A trial with the markers of the trunk, as checks of markers look at it."""
    known = {k: name for name, k in marker_places(read.names).items()}
    read = replace(read, names=tuple(known.get(k, text) for k, text in enumerate(read.names)))
    names = tuple(name for name in PLACES if name in read.names)
    at = subject_of(cohort, specimen).height_m * np.array([PLACES[name] for name in names])
    pelvis = [name.endswith(("ASI", "PSI")) for name in names]
    markers = MarkerSet(
        names,
        np.where(pelvis, PELVIS, BODIES.index("T1")),
        at,
        np.ones(len(names)),
        ("",) * len(names),
    )
    return LoadedTrial.of(cohort, row, read, markers, at, "Plug-in-Gait")


def _facing(look: LoadedTrial) -> Iterator[InputProblem]:
    """A person who begins by looking elsewhere than forwards: what turns is told in ground axes."""
    rotations, told = look.turned
    turn = rotations[int(np.argmax(told))]
    left = DEG_PER_RAD * float(np.arctan2(-turn[2, 0], turn[0, 0]))
    if told.any() and abs(left) > ASKEW_DEG:
        found = f"'{look.axes}', and the person looks {left:.0f} deg to the left of forwards"
        remedy = f"did you mean '{better_axes(look.axes, turn)}'? else turn the recording"
        yield look.in_table("axes", found, f"at most {ASKEW_DEG:g} deg", remedy)


def _arms(
    file: str, stance: Mapping[str, Array], places: Mapping[str, Array]
) -> Iterator[InputProblem]:
    """Segments of the arms that are not as long as in the stance."""
    for side in "LR":
        for one, other in ((side + a, side + b) for a, b in SEGMENTS):
            usual = float(np.linalg.norm(stance[one] - stance[other]))
            now = float(np.median(np.linalg.norm(places[one] - places[other], axis=1)))
            if abs(now - usual) > STRETCHED_M:
                found = (
                    f"{MM_PER_M * now:.0f} mm apart, and {MM_PER_M * usual:.0f} mm in the stance"
                )
                allowed = f"the same within {MM_PER_M * STRETCHED_M:g} mm"
                remedy = "one of the two is another marker: correct its name in the file"
                yield InputProblem(file, None, f"{one} and {other}", found, allowed, remedy)
                break


def _load(
    cohort: Cohort, row: Row, time_s: Array, places: Mapping[str, Array], load: LiftedLoad | None
) -> Iterator[InputProblem]:
    """What hands hold that is out of their reach, or moves otherwise than they do."""
    if load is None or not (held := load.borne >= 0.5).any():
        return
    hands = np.mean([places[name] for name in HANDS], axis=0)
    away = np.linalg.norm(load.at - hands, axis=1)
    far, file = float(np.median(away[held])), f"{cohort.name}/{BOX.file}"
    trial = f"of {row['trial']}"
    if far > REACH_M:
        found = f"the load {trial} {MM_PER_M * far:.0f} mm from the hands that hold it (median)"
        allowed = f"at most {MM_PER_M * REACH_M:g} mm"
        remedy = "is it in m or cm, not in mm? is it on the axes of the markers?"
        yield InputProblem(file, None, "x_mm", found, allowed, remedy)
        return

    def spread(shift: int) -> float:
        # what is beyond the ends stands there as it does at the end
        frames = np.clip(np.arange(len(time_s)) - shift, 0, len(time_s) - 1)
        apart = np.linalg.norm(load.at[frames] - hands, axis=1)[held]
        return float(np.ptp(np.percentile(apart, [5.0, 95.0])))

    if (moves := spread(0)) > HELD_M:
        step = float(np.mean(np.diff(time_s)))
        most = int(MOST_SHIFT_S / step)
        best = min(range(-most, most + 1), key=spread)
        found = f"the way from the hands to the load {trial} varies by {MM_PER_M * moves:.0f} mm"
        remedy = "check the clock of box.csv and that of force_plates.csv"
        if spread(best) < 0.5 * moves:
            remedy += f"; box.csv {best * step:+.2f} s would fit"
        allowed = f"at most {MM_PER_M * HELD_M:g} mm while hands hold it"
        yield InputProblem(file, None, "time_s", found, allowed, remedy)

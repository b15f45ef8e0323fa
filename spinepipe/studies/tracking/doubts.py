"""Persons, marker sets and times of recordings that are sound and most likely wrong."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.problems import InputError, Problem
from spinepipe.studies.doubtful_subjects import subject_doubts
from spinepipe.studies.tracking.forms import MARKER_SET, STANCE, TRIALS
from spinepipe.studies.tracking.persons import recording, trial_rows

AWAY_MM = (25.0, 500.0)
"""Markers from the origins of their bodies, in the median: skin lies 40 mm and more behind them."""

USUAL_MM = (40.0, 250.0)
"""The same, once a unit is undone."""

UNITS = {10.0: "cm", 1000.0: "m", 25.4: "inches", 0.1: "mm multiplied by 10"}

FRAMES_PER_S = (5.0, 2000.0)
"""Of cameras."""

BEND_S = (0.5, 120.0)
"""How long a trial that moves lasts; a person bends and comes back in some seconds."""

MOST_BYTES = 5_000_000
"""Larger files of motion are read when the study starts, not by `check`."""


def doubts(cohort: Cohort) -> Iterator[Doubt]:
    """Doubts about subjects, marker set and recordings."""
    yield from subject_doubts(cohort)
    if MARKER_SET.stem in cohort.further:
        yield from _markers(cohort, cohort.further[MARKER_SET.stem])
    if TRIALS.stem in cohort.further:
        yield from _times(cohort)


def _markers(cohort: Cohort, table: pd.DataFrame) -> Iterator[Doubt]:
    """Marker sets in another unit, or in front of the body."""
    names = ["x_mm", "y_mm", "z_mm"]
    file = f"{cohort.name}/{MARKER_SET.file}"
    for specimen, rows in table.groupby("specimen", sort=False):
        points = rows[names].to_numpy(float)
        away = float(np.median(np.linalg.norm(points, axis=1)))
        place = (file, int(rows.index[0]), names[0])
        if not AWAY_MM[0] <= away <= AWAY_MM[1]:
            words = "look at the unit"
            for factor, unit in UNITS.items():
                if USUAL_MM[0] <= away * factor <= USUAL_MM[1]:
                    words = (
                        f"suspected: {unit} and not mm; multiply {', '.join(names)} by {factor:g}"
                    )
                    break
            found = f"markers {away:.3g} mm from the origins of their bodies ({specimen})"
            allowed = f"{AWAY_MM[0]:g} to {AWAY_MM[1]:g} mm in the median"
            yield Doubt(Problem(*place, found, allowed, words), "lengths")
            continue
        on_spine = points[(rows["vertebra"] != cohort.vertebrae[0]).to_numpy()]
        if len(on_spine) and np.median(on_spine[:, 0]) > 0.0:
            words = "suspected: the sign of x_mm, or x_mm and another axis exchanged; x is forwards"
            found = f"markers of vertebrae in front of them ({specimen})"
            problem = Problem(*place, found, "skin behind the spine", words)
            yield Doubt(problem, "postures")


def _times(cohort: Cohort) -> Iterator[Doubt]:
    """Frame rates and durations that no recording of a person has."""
    for specimen in cohort.specimen_names:
        for row in trial_rows(cohort, specimen):
            path = cohort.folder / str(row["file"])
            if not path.is_file() or path.stat().st_size > MOST_BYTES:
                continue
            try:
                times = recording(row, cohort.name, cohort.folder).time_s
            except (InputError, ValueError):
                continue  # told when the study is read
            yield from _of_times(f"{cohort.name}/{row['file']}", str(row["kind"]), times)


def _of_times(file: str, kind: str, times: np.ndarray) -> Iterator[Doubt]:
    if len(times) < 2:
        return
    rate, lasts = 1.0 / float(np.median(np.diff(times))), float(times[-1] - times[0])
    fast = rate > FRAMES_PER_S[1] or (kind != STANCE and lasts < BEND_S[0])
    slow = rate < FRAMES_PER_S[0] or (kind != STANCE and lasts > BEND_S[1])
    if not fast and not slow:
        return
    remedy = (
        "suspected: times or DataRate in another unit (kHz, minutes); correct it"
        if fast
        else "suspected: times in ms and not s, or DataRate too small; correct it"
    )
    found = f"{rate:.4g} frames a second, {lasts:.4g} s in all"
    allowed = "{:g} to {:g} frames a second".format(*FRAMES_PER_S)
    allowed += ", motions of {:g} to {:g} s".format(*BEND_S)
    yield Doubt(Problem(file, None, "Time", found, allowed, remedy), "motion")

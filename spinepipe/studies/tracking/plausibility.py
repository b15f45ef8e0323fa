"""Persons, marker sets and times of recordings that are sound and most likely wrong."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.plausibility.score import suspect, usual
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell, warn
from spinepipe.problems import InputError
from spinepipe.studies.plausibility import subject_doubts
from spinepipe.studies.recordings import STANCE, TRIALS, read_recording, trial_rows
from spinepipe.studies.tracking.trials import MARKER_SET

MOST_BYTES = 5_000_000
"""Larger files of motion are read when the study starts, not by `check`."""


def doubts(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """Warnings about subjects, marker set and recordings."""
    yield from subject_doubts(cohort)
    if MARKER_SET.stem in cohort.further:
        yield from _markers(cohort, cohort.further[MARKER_SET.stem])
    if TRIALS.stem in cohort.further:
        yield from _times(cohort)


def _markers(cohort: Cohort, table: pd.DataFrame) -> Iterator[PlausibilityWarning]:
    """Marker sets in another unit, in front of the body, or in the bone."""
    names = ["x_mm", "y_mm", "z_mm"]
    for specimen, rows in table.groupby("specimen", sort=False):
        points = rows[names].to_numpy(float)
        away = float(np.median(np.linalg.norm(points, axis=1)))
        place = TableCell(MARKER_SET.stem, rows.index[0], names[0])
        on_spine = points[(rows["vertebra"] != cohort.vertebrae[0]).to_numpy()]
        if not usual("markers_away").holds(away):
            unit = suspect("length", away, "markers_away")
            remedy = unit and unit.mend(what="markers", columns=", ".join(names))
            yield warn(cohort, "markers_away", place, remedy=remedy, whose=[specimen], away=away)
        elif len(on_spine) and np.median(on_spine[:, 0]) > 0.0:
            yield warn(cohort, "markers_in_front", place, whose=[specimen])
        elif (inside := on_bone(rows, cohort.vertebrae[0])).any():
            place = TableCell(MARKER_SET.stem, rows.index[inside][0], names[0])
            markers = ", ".join(rows["marker"][inside])
            yield warn(cohort, "marker_in_bone", place, whose=[specimen], markers=markers)


def on_bone(rows: pd.DataFrame, lowest: str) -> NDArray[np.bool_]:
    """(K,) which markers of vertebrae above the lowest lie where only bone is."""
    aside = np.hypot(rows["x_mm"].to_numpy(float), rows["z_mm"].to_numpy(float))
    inside: NDArray[np.bool_] = ~np.array([usual("marker_in_bone").holds(one) for one in aside])
    return inside & (rows["vertebra"] != lowest).to_numpy()


def _times(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """Frame rates and durations that no recording of a person has."""
    rates, bends = usual("frame_rate"), usual("bend_time")
    for specimen in cohort.specimen_names:
        for row in trial_rows(cohort, specimen):
            path = cohort.folder / str(row["file"])
            if not path.is_file() or path.stat().st_size > MOST_BYTES:
                continue
            try:
                times = read_recording(row, cohort.name, cohort.folder).time_s
            except (InputError, ValueError):
                continue  # told when the study is read
            if len(times) < 2:
                continue
            rate, lasts = 1.0 / float(np.median(np.diff(times))), float(times[-1] - times[0])
            moves = row["kind"] != STANCE
            short = rate > rates.high or (moves and lasts < bends.low)
            if short or rate < rates.low or (moves and lasts > bends.high):
                place = TableCell(str(row["file"]), None, "Time")
                yield warn(
                    cohort,
                    "times_short" if short else "times_long",
                    place,
                    rate=rate,
                    lasts=lasts,
                    rates=rates,
                    bends=bends,
                )

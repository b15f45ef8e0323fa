"""Are the trials of a cohort sound: the files they name, and what these hold?"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.documents.inside import outside
from spinepipe.effects.contract import Array
from spinepipe.motion.points import marker_places
from spinepipe.motion.reading import DEFAULT_AXES, READERS, axes_of
from spinepipe.motion.recorded import Recorded
from spinepipe.motion.skeleton import BODIES, MarkerSet
from spinepipe.problems import InputError, InputProblem, Spelling
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.checks_of_motion import motion_problems
from spinepipe.studies.tracking.forms import MARKER_SET, STANCE, TRIALS
from spinepipe.studies.tracking.persons import (
    Row,
    marker_set,
    recording,
    skeleton_in,
    static_trial,
    trial_of,
    trial_rows,
)
from spinepipe.studies.tracking.trial_preview import LoadedTrial
from spinepipe.units import COORDINATES

LISTED = 4
"""So many names are written out."""


def row_problems(cohort: Cohort) -> Iterator[InputProblem]:
    """Files and axes in `trials.csv`, and persons without a trial that tells their size."""
    file = f"{cohort.name}/{TRIALS.file}"
    for specimen in cohort.specimen_names:
        for row in trial_rows(cohort, specimen):
            yield from _motion(file, row)
            yield from _led_out(file, row, cohort.folder)
        if static_trial(cohort, specimen) is None:
            found = f"no static trial of '{specimen}'"
            allowed = f"a trial of kind {STANCE}, or one marked static"
            remedy = "add it: without it nobody's size is known"
            yield InputProblem(file, None, "kind", found, allowed, remedy)


def _motion(file: str, row: Row) -> Iterator[InputProblem]:
    if Path(row["file"]).suffix.lower() not in READERS:
        found, allowed = f"'{row['file']}'", f"a file of motion: {', '.join(READERS)}"
        yield InputProblem(file, row["line"], "file", found, allowed, "export it as one of these")
    if isinstance(row["axes"], str):
        try:
            axes_of(row["axes"])
        except ValueError as error:
            allowed = "forwards, up and right in the axes of the file, as in 'x z -y'"
            remedy = "name each axis once, a minus where it points the other way"
            yield InputProblem(file, row["line"], "axes", str(error), allowed, remedy)


def _led_out(file: str, row: Row, folder: Path) -> Iterator[InputProblem]:
    name = str(row["file"])
    led_out = outside(folder / name, folder, (file, row["line"], "file"), name)
    if led_out is not None:
        yield led_out


def recording_problems(cohort: Cohort) -> Iterator[InputProblem]:
    """Everything that is wrong with files of motion; tables are sound."""
    for specimen in cohort.specimen_names:
        markers = marker_set(cohort, specimen)
        skeleton = skeleton_in(cohort, specimen, subject_of(cohort, specimen))
        rest = np.zeros((1, len(BODIES), len(COORDINATES)))
        neutral = marker_places(skeleton, markers, rest)[0]
        for row in trial_rows(cohort, specimen):
            try:
                read = recording(row, cohort.name, cohort.folder)
            except InputError as error:
                yield from error.problems
                continue
            yield from _names(cohort, row, markers, read)
            there = np.array([name in read.names for name in markers.names])
            if there.any():
                yield from motion_problems(_look(cohort, row, markers, neutral, there, read))


def _look(
    cohort: Cohort,
    row: Row,
    markers: MarkerSet,
    neutral: Array,
    there: NDArray[np.bool_],
    read: Recorded,
) -> LoadedTrial:
    """The trial with the markers that its file has."""
    kept = np.flatnonzero(there)
    part = MarkerSet(
        tuple(markers.names[k] for k in kept),
        markers.body[kept],
        markers.at[kept],
        markers.weight[kept],
        tuple(markers.cluster[k] for k in kept),
    )
    axes = row["axes"] if isinstance(row["axes"], str) else DEFAULT_AXES
    return LoadedTrial(
        trial_of(row, part, read),
        part,
        neutral[kept],
        axes,
        f"{cohort.name}/{row['file']}",
        f"{cohort.name}/{TRIALS.file}",
        row["line"],
        read.first,
    )


def _names(cohort: Cohort, row: Row, markers: MarkerSet, read: Recorded) -> Iterator[InputProblem]:
    """Markers of the set that the file lacks; further ones in the file are a remark."""
    spare = [name for name in read.names if name not in markers.names]
    spelling = Spelling(spare, "rename it in the file, or delete it from the set")
    for name in markers.names:
        if name not in read.names:
            allowed = f"all markers of {MARKER_SET.file}; further ones are " + (
                ", ".join(spare[:LISTED]) + (" ..." if len(spare) > LISTED else "") or "none"
            )
            file = f"{cohort.name}/{row['file']}"
            yield InputProblem(file, None, name, "no such marker", allowed, spelling.remedy(name))

"""Recordings of persons: the tables about them, and the files of motion that they name.

What a cohort of recorded persons brings is declared in `forms.yaml`: trials, and what was measured
beside the markers.
"""

from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.documents.form import TableForm, read_forms
from spinepipe.documents.inside import outside
from spinepipe.motion.reading import DEFAULT_AXES, READERS, NoFrameError, axes_of, read_motion
from spinepipe.motion.recording import MarkerRecording
from spinepipe.motion.skeleton import MarkerSet, MarkerTrial
from spinepipe.problems import InputError, InputProblem

_FORMS = read_forms(Path(__file__).with_name("forms.yaml"))
RECORDED = TRIALS, FORCE_PLATES, BOX, MEASURED_MOMENTS = tuple(
    _FORMS[name] for name in ("trials", "force_plates", "box", "measured_moments")
)

STANCE = "stance"
MOVING = ("flexion_extension", "lateral_bending", "axial_rotation")
"""Kinds of trials that move, in the order of the rotation that they are about."""

Row = Mapping[Any, Any]
"""Cells of a row by their columns."""


def of_specimen(table: pd.DataFrame, specimen: str) -> pd.DataFrame:
    """The rows of a specimen."""
    return table[table["specimen"] == specimen]


def trial_rows(cohort: Cohort, specimen: str) -> tuple[Row, ...]:
    """Rows of `trials.csv`, with the line of each as `line`."""
    rows = of_specimen(cohort.further[TRIALS.stem], specimen)
    return tuple(rows.assign(line=rows.index).to_dict("records"))


def of_trial(cohort: Cohort, form: TableForm, specimen: str, trial: str) -> pd.DataFrame:
    """The rows of a trial in a table of the cohort; none of a table that it has not."""
    if form.stem not in cohort.further:
        return pd.DataFrame(columns=list(form.names))
    rows = of_specimen(cohort.further[form.stem], specimen)
    return rows[rows["trial"] == trial]


def motion_files(cohort: Cohort, specimen: str) -> tuple[Path, ...]:
    """Files of motion of a person, each once: what a job of the person reads besides tables."""
    names = of_specimen(cohort.further[TRIALS.stem], specimen)["file"]
    return tuple(cohort.folder / name for name in dict.fromkeys(names))


def motion_digests(cohort: Cohort, specimen: str) -> list[str]:
    """Digests of the files of motion of a person, on which results hang besides tables."""
    return [sha256(path.read_bytes()).hexdigest() for path in motion_files(cohort, specimen)]


def static_trial(cohort: Cohort, specimen: str) -> str | None:
    """Name of the trial that tells the size: the one marked static, else the first stance."""
    rows = of_specimen(cohort.further[TRIALS.stem], specimen)
    for chosen in (rows["static"] == "yes", rows["kind"] == STANCE):
        if chosen.any():
            return str(rows["trial"][chosen].iloc[0])
    return None


def read_recording(row: Row, cohort: str, folder: Path) -> MarkerRecording:
    """The motion that a row of `trials.csv` names, all markers of the file.

    Raises
    ------
    InputError
        Of a file that cannot be read, or a row that leaves no frame of it.
    ValueError
        Of axes that are none.
    """
    name, axes = str(row["file"]), row["axes"]
    start, end = (float(str(row[key])) for key in ("start_s", "end_s"))
    text = axes if isinstance(axes, str) else DEFAULT_AXES
    try:
        return read_motion(folder / name, text, start, end, f"{cohort}/{name}")
    except NoFrameError as error:
        (problem,) = error.problems
        found = f"{problem.found} in {name}"
        at = (f"{cohort}/{TRIALS.file}", row["line"], "start_s" if error.late else "end_s")
        raise InputError([InputProblem(*at, found, problem.allowed, problem.remedy)]) from error


def trial_of(row: Row, markers: MarkerSet, recorded: MarkerRecording) -> MarkerTrial:
    """The trial of a row; markers of the set that the file lacks are never seen."""
    # markers in the order of the set
    n = len(recorded.time_s)
    places, seen = np.zeros((n, len(markers), 3)), np.zeros((n, len(markers)), dtype=bool)
    for k, name in enumerate(markers.names):
        if name in recorded.names:
            there = recorded.names.index(name)
            places[:, k], seen[:, k] = recorded.places[:, there], recorded.seen[:, there]
    name, kind, arms = (str(row[key]) for key in ("trial", "kind", "arms"))
    return MarkerTrial(name, kind, recorded.time_s, places, seen, arms)


def row_problems(cohort: Cohort) -> Iterator[InputProblem]:
    """Faults of files and axes in `trials.csv`; persons without a trial that tells their size."""
    file = f"{cohort.name}/{TRIALS.file}"
    for specimen in cohort.specimen_names:
        for row in trial_rows(cohort, specimen):
            name, place = str(row["file"]), (file, row["line"], "file")
            if Path(name).suffix.lower() not in READERS:
                found, allowed = f"'{name}'", f"a file of motion: {', '.join(READERS)}"
                yield InputProblem(*place, found, allowed, "export it as one of these")
            if isinstance(row["axes"], str):
                try:
                    axes_of(row["axes"])
                except ValueError as error:
                    allowed = "forwards, up and right in the axes of the file, as in 'x z -y'"
                    remedy = "name each axis once, a minus where it points the other way"
                    yield InputProblem(file, row["line"], "axes", str(error), allowed, remedy)
            # a file outside the cohort's folder, by .. or by a link
            if (led_out := outside(cohort.folder / name, cohort.folder, place, name)) is not None:
                yield led_out
        if static_trial(cohort, specimen) is None:
            found = f"no static trial of '{specimen}'"
            allowed = f"a trial of kind {STANCE}, or one marked static"
            remedy = "add it, the person standing upright, or mark one static"
            yield InputProblem(file, None, "kind", found, allowed, remedy)

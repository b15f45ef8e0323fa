"""What a study of trunk loads demands of its cohort: each fault with its place and remedy."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.documents.inside import outside
from spinepipe.documents.names import name_fault
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.motion.smoothing import USUAL_CUTOFF_HZ
from spinepipe.muscles.folder import PELVIS, SHEATH, in_ground
from spinepipe.muscles.myo_sim import PACKAGE, REMEDY, VERSION, NoSource
from spinepipe.muscles.regressions import PACKAGED
from spinepipe.muscles.trunk import BODIES, LEVELS, SIDES, SLICES
from spinepipe.plausibility.warnings.columns import beyond_ranges
from spinepipe.plausibility.warnings.warning import PlausibilityWarning
from spinepipe.problems import InputError, InputProblem, Spelling, did_you_mean, one_of
from spinepipe.studies.checks_of_recorded import recorded_problems
from spinepipe.studies.places import lacking_tables, unknown_names
from spinepipe.studies.plausibility import subject_doubts
from spinepipe.studies.recordings import TRIALS, row_problems
from spinepipe.studies.subjects import HEIGHT_CM, SUBJECTS, subject_problems
from spinepipe.studies.trunk_loads.checks_of_tasks import task_problems
from spinepipe.studies.trunk_loads.forms import MUSCLE_PARAMETERS, MUSCLES, TASKS
from spinepipe.studies.trunk_loads.persons import regressions_of, source_of
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.units import MM_PER_M

CARRIERS = tuple(dict.fromkeys((*BODIES, *reversed(SLICES))))
"""Vertebrae that a body may move with: T1 to T10 move with T11."""

PLACES = (*CARRIERS, *PELVIS, SHEATH)
"""Bodies that a point of a muscle may belong to, where the cohort tells of no others."""

_FIRST_ROW = 2
"""Line of a file below its header."""


def check_trunk(
    document: YamlDocument, study: TrunkLoads, cohort: Cohort
) -> Iterator[InputProblem]:
    """Everything that is wrong with the subjects, tasks and muscles of a cohort."""
    further = cohort.further
    needed = (SUBJECTS, TRIALS) if study.motions.trials else (SUBJECTS, TASKS)
    yield from lacking_tables(document, needed, cohort)
    if "subjects" in further:
        yield from subject_problems(cohort, further["subjects"])
    if "tasks" in further:
        tallest = None  # m, of those whose height can be
        if "subjects" in further:
            heights = further["subjects"]["height_cm"]
            sound = heights[heights.between(*HEIGHT_CM)]
            tallest = None if sound.empty else float(sound.max()) / 100.0
        file = f"{cohort.name}/{TASKS.file}"
        yield from task_problems(file, further["tasks"], tallest, study.trunk_angle)
        yield from _named(document, study, cohort, list(further["tasks"]["task"]))
    elif study.motions.trials:
        yield from _named(document, study, cohort, [])
    if study.motions.trials and TRIALS.stem in further:
        known = list(dict.fromkeys(further[TRIALS.stem]["trial"].astype(str)))
        yield from unknown_names(document, "motions.trials", "trial", study.motions.trials, known)
        yield from row_problems(cohort)
    if study.geometry == "cohort":
        yield from _without_geometry(document, cohort)
        yield from _several_trunks(cohort)
    yield from muscle_problems(cohort)
    yield from _regressions(document, study, cohort)


def check_source(
    document: YamlDocument, study: TrunkLoads, cohort: Cohort, _root: Path
) -> Iterator[InputProblem]:
    """Refuse a study whose geometry and muscles cannot be read or make no trunk."""
    place = document.place_of("geometry")
    try:
        source_of(study, cohort)
    except NoSource as error:
        allowed = f"{PACKAGE} in version {VERSION}"
        yield InputProblem(*place, error.found, allowed, f"{REMEDY}, or write geometry: cohort")
    except ValueError as error:
        allowed = "a trunk from S1 to T1 with its muscles"
        yield InputProblem(*place, str(error), allowed, f"complete the files of {cohort.name}")


def check_lifts(
    _document: YamlDocument, study: TrunkLoads, cohort: Cohort, _root: Path
) -> Iterator[InputProblem]:
    """Refuse recordings that are not what their tables say; nothing where no lift is asked for."""
    if study.motions.trials and TRIALS.stem in cohort.further and not any(row_problems(cohort)):
        yield from recorded_problems(cohort, USUAL_CUTOFF_HZ)


def _without_geometry(document: YamlDocument, cohort: Cohort) -> Iterator[InputProblem]:
    """Files that a cohort must have which brings its own geometry."""
    there = {name: name in cohort.further for name in (MUSCLES.stem, MUSCLE_PARAMETERS.stem)}
    there["joints"] = cohort.joints is not None
    for name in [name for name, is_there in there.items() if not is_there]:
        found = f"cohort, and {cohort.name} has no {name}.csv"
        remedy = f"add {name}.csv, or write geometry: myo_sim"
        yield InputProblem(
            *document.place_of("geometry"), found, f"a cohort with {name}.csv", remedy
        )


def _several_trunks(cohort: Cohort) -> Iterator[InputProblem]:
    """Joints that differ between specimens: one trunk is read, and scaled to every person."""
    if cohort.joints is None:
        return
    of_each = {
        str(name): rows.drop(columns="specimen").set_index("joint").sort_index()
        for name, rows in cohort.joints.groupby("specimen", sort=False)
    }
    first = next(iter(of_each))
    for name, own in of_each.items():
        if not own.equals(of_each[first]):
            line = _FIRST_ROW + list(cohort.joints["specimen"]).index(name)
            found, allowed = f"joints of {name} that are not those of {first}", "one trunk"
            remedy = f"the trunk is scaled to each person: repeat the joints of {first}"
            yield InputProblem(
                f"{cohort.name}/joints.csv", line, "specimen", found, allowed, remedy
            )


def _regressions(
    document: YamlDocument, study: TrunkLoads, cohort: Cohort
) -> Iterator[InputProblem]:
    """Faults of a table of the user's own, which lies in the cohort's folder."""
    name, folder = study.regressions, cohort.folder
    led_out = outside(folder / name, folder, document.place_of("regressions"), name)
    if led_out is not None:
        yield led_out
        return
    if name not in PACKAGED and (name_fault(name) or not (folder / name).is_file()):
        found = f"'{name}', which is no file of {cohort.name}"
        remedy = "correct the name, or add the file to the cohort's folder"
        allowed = f"{', '.join(PACKAGED)}, or a CSV file of the cohort"
        yield InputProblem(*document.place_of("regressions"), found, allowed, remedy)
        return
    try:
        regressions_of(study, cohort.folder)
    except InputError as error:
        yield from error.problems


def _named(
    document: YamlDocument, study: TrunkLoads, cohort: Cohort, tasks: list[str]
) -> Iterator[InputProblem]:
    """Tasks and persons that the study names."""
    lists = {
        "drawn_tasks": study.drawn_tasks,
        "simplified_tasks": study.simplified_tasks,
        "uncertain.tasks": study.uncertain.tasks,
    }
    for key, names in lists.items():
        yield from unknown_names(document, key, "task", names, tasks)
    known = cohort.specimen_names
    yield from unknown_names(
        document, "uncertain.specimens", "specimen", study.uncertain.specimens, known
    )
    if study.volunteer is not None and study.volunteer.specimen not in known:
        name = study.volunteer.specimen
        place = document.place_of("volunteer.specimen")
        remedy = did_you_mean(name, known, "name a person of specimens.csv")
        yield InputProblem(*place, f"unknown specimen '{name}'", one_of(known), remedy)


def muscle_problems(cohort: Cohort) -> Iterator[InputProblem]:
    """Everything that is wrong with muscles.csv, muscle_parameters.csv, body_frames.csv and columns
    of levels."""
    name, further = cohort.name, cohort.further
    points, muscles = further.get("muscles"), further.get("muscle_parameters")
    frames = further.get("body_frames")
    if frames is not None and cohort.joints is not None:
        # of the specimen whose joints are taken, the first of joints.csv
        frames = frames[frames["specimen"] == cohort.joints["specimen"].iloc[0]]
    if frames is not None:
        yield from _frames(f"{name}/body_frames.csv", further["body_frames"], not frames.empty)
    if points is not None:
        yield from _points(f"{name}/muscles.csv", points, frames)
    if points is not None and muscles is not None:
        yield from _sides(f"{name}/muscles.csv", points, muscles, frames)
    levels = Spelling((*LEVELS, *SLICES), "a joint is named upper vertebra first")
    for stem, rows in further.items():
        if "level" in rows:
            column = rows["level"].dropna()
            for line, level in column[~column.isin(levels.known)].items():
                place, found = (f"{name}/{stem}.csv", int(str(line)), "level"), f"'{level}'"
                remedy = levels.remedy(str(level))
                yield InputProblem(*place, f"unknown level {found}", levels.allowed, remedy)


def _frames(file: str, rows: pd.DataFrame, has_owner: bool) -> Iterator[InputProblem]:
    """Bodies of anybody that move with nothing known; no rows of whose muscles are taken."""
    if not has_owner:
        found, allowed = "no row of the first specimen of joints.csv", "a frame for each body"
        yield InputProblem(
            file, None, "specimen", found, allowed, "add its rows, or delete the file"
        )
    as_written = {name.casefold(): name for name in CARRIERS}
    for line, body in rows["body"].items():
        if body not in CARRIERS and (meant := as_written.get(str(body).casefold())):
            place, found = (file, int(str(line)), "body"), f"unknown body '{body}'"
            yield InputProblem(*place, found, f"'{meant}', as elsewhere", f"write '{meant}'")


def _points(file: str, rows: pd.DataFrame, frames: pd.DataFrame | None) -> Iterator[InputProblem]:
    known = PLACES if frames is None else tuple(frames["body"])
    otherwise = "ribs, arms and head belong to T11, or add body_frames.csv with their frames"
    if frames is not None:
        otherwise = "add its frame to body_frames.csv"
    bodies = Spelling(known, otherwise)
    for line, body in rows["body"][~rows["body"].isin(known)].items():
        place, found = (file, int(str(line)), "body"), f"unknown body '{body}'"
        yield InputProblem(*place, found, bodies.allowed, bodies.remedy(str(body)))


def _sides(
    file: str, points: pd.DataFrame, muscles: pd.DataFrame, frames: pd.DataFrame | None
) -> Iterator[InputProblem]:
    """Sides most of whose muscles lie on the other one; single ones are mirrored with a remark."""
    side = dict(zip(muscles["muscle"], muscles["side"], strict=True))
    if frames is not None:
        points = points[points["body"].isin(list(frames["body"]))]
    if points.empty:
        return
    # metres by which points lie to the right in ground, muscle by muscle
    own = points[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / MM_PER_M
    placed = own if frames is None else in_ground(frames, points["body"].tolist(), own)
    right = points.assign(right_m=np.asarray(placed[:, 2])).groupby("muscle", sort=False)
    lies = {str(name): float(rows["right_m"].sum()) for name, rows in right}
    outwards = {"right": 1.0, "left": -1.0}
    wrong = {
        one: [m for m, z in lies.items() if side.get(m) == one and z * outwards[one] < 0.0]
        for one in SIDES
    }
    judged = {one: [m for m in lies if side.get(m) == one] for one in SIDES}
    most = [one for one in SIDES if 2 * len(wrong[one]) > len(judged[one])]
    if len(most) == len(SIDES):
        found, allowed = "most muscles on the other side of the body", "z to the right"
        remedy = "change the sign of z: the axes are x forwards, y up, z to the right"
        yield InputProblem(file, None, "z_mm", found, allowed, remedy)
        return
    for one in most:
        first = points.index[points["muscle"] == wrong[one][0]][0]
        found = (
            f"{len(wrong[one])} of {len(judged[one])} muscles that are {one} lie on the other side,"
            f" {wrong[one][0]} among them"
        )
        allowed = "z above 0 on the right, below 0 on the left"
        remedy = "not mirrored, or mirrored twice? change the sign of their z, or their side"
        yield InputProblem(file, int(str(first)), "z_mm", found, allowed, remedy)


def doubts(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """Persons and tasks that are sound cell by cell and most likely wrong."""
    yield from subject_doubts(cohort)
    yield from beyond_ranges(cohort, "abdominal_pressure", "muscle_stress", "trunk_rotation")
    yield from beyond_ranges(cohort, "hands_away", "push", "twist")

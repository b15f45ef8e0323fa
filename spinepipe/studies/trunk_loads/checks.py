"""What a study of trunk loads demands of its cohort: each fault with its place and remedy."""

from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.documents.inside import outside
from spinepipe.documents.names import name_fault
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.muscles.myo_sim import PACKAGE, REMEDY, VERSION, NoSource
from spinepipe.muscles.regressions import PACKAGED
from spinepipe.problems import InputError, InputProblem, did_you_mean, one_of
from spinepipe.studies.places import at, unknown_names
from spinepipe.studies.subjects import HEIGHT_CM, SUBJECTS, subject_problems
from spinepipe.studies.trunk_loads.checks_of_muscles import muscle_problems
from spinepipe.studies.trunk_loads.checks_of_tasks import task_problems
from spinepipe.studies.trunk_loads.forms import MUSCLE_PARAMETERS, MUSCLES, TASKS
from spinepipe.studies.trunk_loads.persons import regressions_of, source_of
from spinepipe.studies.trunk_loads.settings import TrunkLoads

_FIRST_ROW = 2
"""Line of a file below its header."""


def check_trunk(
    document: YamlDocument, study: TrunkLoads, cohort: Cohort
) -> Iterator[InputProblem]:
    """Everything that is wrong with the subjects, tasks and muscles of a cohort."""
    further = cohort.further
    for form in (SUBJECTS, TASKS):
        if form.stem not in further:
            found, allowed = f"a cohort without {form.file}", f"a cohort with {form.file}"
            remedy = f"add {form.file}, or name another cohort"
            yield InputProblem(*at(document, "cohort"), found, allowed, remedy)
    if "subjects" in further:
        yield from subject_problems(cohort, further["subjects"])
    if "tasks" in further:
        tallest = _tallest(further.get("subjects"))
        file = f"{cohort.name}/{TASKS.file}"
        yield from task_problems(file, further["tasks"], tallest, study.trunk_angle)
        yield from _named(document, study, cohort, list(further["tasks"]["task"]))
    if study.geometry == "cohort":
        yield from _without_geometry(document, cohort)
        yield from _several_trunks(cohort)
    yield from muscle_problems(cohort)
    yield from _regressions(document, study, cohort)


def check_source(
    document: YamlDocument, study: TrunkLoads, cohort: Cohort, _root: Path
) -> Iterator[InputProblem]:
    """Refuse a study whose geometry and muscles cannot be read or make no trunk."""
    place = at(document, "geometry")
    try:
        source_of(study, cohort)
    except NoSource as error:
        allowed = f"{PACKAGE} in version {VERSION}"
        yield InputProblem(*place, error.found, allowed, f"{REMEDY}, or write geometry: cohort")
    except ValueError as error:
        allowed = "a trunk from S1 to T1 with its muscles"
        yield InputProblem(*place, str(error), allowed, f"complete the files of {cohort.name}")


def _without_geometry(document: YamlDocument, cohort: Cohort) -> Iterator[InputProblem]:
    """Files that a cohort must have which brings its own geometry."""
    there = {name: name in cohort.further for name in (MUSCLES.stem, MUSCLE_PARAMETERS.stem)}
    there["joints"] = cohort.joints is not None
    for name in [name for name, is_there in there.items() if not is_there]:
        found = f"cohort, and {cohort.name} has no {name}.csv"
        remedy = f"add {name}.csv, or write geometry: myo_sim"
        yield InputProblem(*at(document, "geometry"), found, f"a cohort with {name}.csv", remedy)


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
    led_out = outside(folder / name, folder, at(document, "regressions"), name)
    if led_out is not None:
        yield led_out
        return
    if name not in PACKAGED and (name_fault(name) or not (folder / name).is_file()):
        found = f"'{name}', which is no file of {cohort.name}"
        remedy = "correct the name, or add the file to the cohort's folder"
        allowed = f"{', '.join(PACKAGED)}, or a CSV file of the cohort"
        yield InputProblem(*at(document, "regressions"), found, allowed, remedy)
        return
    try:
        regressions_of(study, cohort.folder)
    except InputError as error:
        yield from error.problems


def _tallest(subjects: pd.DataFrame | None) -> float | None:
    """Height of the tallest whose height can be, m; None where nobody's can."""
    if subjects is None:
        return None
    sound = subjects["height_cm"][subjects["height_cm"].between(*HEIGHT_CM)]
    return None if sound.empty else float(sound.max()) / 100.0


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
        place = at(document, "volunteer.specimen")
        remedy = did_you_mean(name, known, "name a person of specimens.csv")
        yield InputProblem(*place, f"unknown specimen '{name}'", one_of(known), remedy)

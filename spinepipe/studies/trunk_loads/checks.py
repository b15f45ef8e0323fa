"""What a study of trunk loads demands of its cohort: each fault with its place and remedy."""

from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.text import Document
from spinepipe.muscles.myo_sim import PACKAGE, REMEDY, VERSION, NoSource
from spinepipe.problems import InputError, Problem, did_you_mean, one_of
from spinepipe.studies.places import at, unknown_names
from spinepipe.studies.trunk_loads.checks_of_muscles import muscle_problems
from spinepipe.studies.trunk_loads.checks_of_tasks import task_problems
from spinepipe.studies.trunk_loads.forms import SEXES, SUBJECTS, TASKS
from spinepipe.studies.trunk_loads.geometry_forms import MUSCLE_PARAMETERS, MUSCLES
from spinepipe.studies.trunk_loads.persons import regressions_of, source_of
from spinepipe.studies.trunk_loads.settings import TrunkLoads

HEIGHT_CM = (120.0, 220.0)
MASS_KG = (30.0, 300.0)
BMI = (14.0, 55.0)

LARGEST_HEIGHT_M = 3.0
"""A height that is no more than this is in metres."""

STANDARD_GRAVITY = 9.80665

_FIRST_ROW = 2
"""Line of a file below its header."""


def check_trunk(document: Document, study: TrunkLoads, cohort: Cohort) -> Iterator[Problem]:
    """Everything that is wrong with the subjects, tasks and muscles of a cohort."""
    further = cohort.further
    for form in (SUBJECTS, TASKS):
        if form.stem not in further:
            found, allowed = f"a cohort without {form.file}", f"a cohort with {form.file}"
            remedy = f"add {form.file}, or name another cohort"
            yield Problem(*at(document, "cohort"), found, allowed, remedy)
    if "subjects" in further:
        yield from _subjects(cohort, further["subjects"])
    if "tasks" in further:
        tallest = _tallest(further.get("subjects"))
        file = f"{cohort.name}/{TASKS.file}"
        yield from task_problems(file, further["tasks"], tallest, study.trunk_angle)
        yield from _named(document, study, cohort, list(further["tasks"]["task"]))
    if study.geometry == "cohort":
        yield from _without_geometry(document, cohort)
        yield from _several_trunks(cohort)
    yield from muscle_problems(cohort)
    yield from _regressions(study, cohort)


def check_source(
    document: Document, study: TrunkLoads, cohort: Cohort, _root: Path
) -> Iterator[Problem]:
    """Refuse a study whose geometry and muscles cannot be read or make no trunk."""
    place = at(document, "geometry")
    try:
        source_of(study, cohort)
    except NoSource as error:
        allowed = f"{PACKAGE} in version {VERSION}"
        yield Problem(*place, error.found, allowed, f"{REMEDY}, or write geometry: cohort")
    except ValueError as error:
        allowed = "a trunk from S1 to T1 with its muscles"
        yield Problem(*place, str(error), allowed, f"complete the files of {cohort.name}")


def _without_geometry(document: Document, cohort: Cohort) -> Iterator[Problem]:
    """Files that a cohort must have which brings its own geometry."""
    there = {name: name in cohort.further for name in (MUSCLES.stem, MUSCLE_PARAMETERS.stem)}
    there["joints"] = cohort.joints is not None
    for name in [name for name, is_there in there.items() if not is_there]:
        found = f"cohort, and {cohort.name} has no {name}.csv"
        remedy = f"add {name}.csv, or write geometry: myo_sim"
        yield Problem(*at(document, "geometry"), found, f"a cohort with {name}.csv", remedy)


def _several_trunks(cohort: Cohort) -> Iterator[Problem]:
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
            yield Problem(f"{cohort.name}/joints.csv", line, "specimen", found, allowed, remedy)


def _regressions(study: TrunkLoads, cohort: Cohort) -> Iterator[Problem]:
    """Faults of a table of the user's own."""
    try:
        regressions_of(study, cohort.folder)
    except InputError as error:
        yield from error.problems


def _subjects(cohort: Cohort, rows: pd.DataFrame) -> Iterator[Problem]:
    """One row for each specimen (the reader sees to it that it is one), and bodies that exist."""
    file = f"{cohort.name}/{SUBJECTS.file}"
    known = set(rows["specimen"])
    for name in cohort.specimen_names:
        if name not in known:
            found = f"no row of '{name}'"
            remedy = "add sex, age, height and mass, or delete it from specimens.csv"
            yield Problem(file, None, "specimen", found, "every specimen of specimens.csv", remedy)
    for line, row in rows.iterrows():
        place = (file, int(str(line)))
        if row["sex"] not in SEXES:
            remedy = did_you_mean(str(row["sex"]).lower(), SEXES, "write male or female")
            yield Problem(*place, "sex", f"'{row['sex']}'", one_of(SEXES), remedy)
        yield from _size(place, str(row["specimen"]), row["height_cm"], row["mass_kg"])


def _size(place: tuple[str, int], who: str, cm: float, kg: float) -> Iterator[Problem]:
    """Height and mass each by itself; only where both can be, the two together."""
    if not HEIGHT_CM[0] <= cm <= HEIGHT_CM[1]:
        remedy = "correct it"
        if cm <= LARGEST_HEIGHT_M:
            remedy = f"is it in m? write {100.0 * cm:g}"
        elif HEIGHT_CM[0] <= cm / 10.0 <= HEIGHT_CM[1]:
            remedy = f"is it in mm? write {cm / 10.0:g}"
        yield Problem(*place, "height_cm", f"{who} is {cm:g} cm tall", _range(HEIGHT_CM), remedy)
    if not MASS_KG[0] <= kg <= MASS_KG[1]:
        remedy = "correct it"
        if kg > MASS_KG[1]:
            remedy = f"is it the weight in N? write {kg / STANDARD_GRAVITY:.1f}"
        yield Problem(*place, "mass_kg", f"{who} weighs {kg:g} kg", _range(MASS_KG), remedy)
    elif HEIGHT_CM[0] <= cm <= HEIGHT_CM[1]:
        bmi = kg / (cm / 100.0) ** 2
        if not BMI[0] <= bmi <= BMI[1]:
            found = f"{who} has a BMI of {bmi:.1f} ({kg:g} kg, {cm:g} cm)"
            yield Problem(*place, "mass_kg", found, _range(BMI), "correct height or mass")


def _range(pair: tuple[float, float]) -> str:
    return f"{pair[0]:g} to {pair[1]:g}"


def _tallest(subjects: pd.DataFrame | None) -> float | None:
    """Height of the tallest whose height can be, m; None where nobody's can."""
    if subjects is None:
        return None
    sound = subjects["height_cm"][subjects["height_cm"].between(*HEIGHT_CM)]
    return None if sound.empty else float(sound.max()) / 100.0


def _named(
    document: Document, study: TrunkLoads, cohort: Cohort, tasks: list[str]
) -> Iterator[Problem]:
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
        yield Problem(*place, f"unknown specimen '{name}'", one_of(known), remedy)

<<<<<<< HEAD
"""What a cohort study demands of its cohort."""
=======
"""What a cohort study demands of its cohort, and of the model file that it builds on."""
>>>>>>> wt2-kinds

import re
from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.cohort.text import Document
from spinepipe.problems import Problem, did_you_mean, one_of
from spinepipe.studies.cohort_stiffness.representations import named
from spinepipe.studies.cohort_stiffness.settings import (
    ALL,
    ALL_BUT,
    NOBODY,
    NOTHING,
    CohortStiffness,
)
<<<<<<< HEAD
from spinepipe.studies.places import at, readings, unknown_tests
from spinepipe.units import ROTATIONS

_UNFIT = re.compile(r"[/={}\\\x00-\x1f]|^\.|^\s|\s$")
"""What names of files, or of rules' wildcards, do not bear."""
=======
from spinepipe.studies.places import at, unknown_levels, unknown_tests
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS
>>>>>>> wt2-kinds


def check_cohort_stiffness(
    document: Document, study: CohortStiffness, cohort: Cohort
) -> Iterator[Problem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from _tests(document, study, cohort)
    yield from _specimens(cohort)
    yield from _levels(document, study, cohort)
    yield from _cost(document, study, cohort)


<<<<<<< HEAD
=======
_UNFIT = re.compile(r"[/={}\\\x00-\x1f]|^\.|^\s|\s$")
"""What names of files, or of rules' wildcards, do not bear."""


>>>>>>> wt2-kinds
def _tests(document: Document, study: CohortStiffness, cohort: Cohort) -> Iterator[Problem]:
    """Tests must exist, have names that can name files, and someone must have been measured."""
    if cohort.motion is None:
        found = f"cohort '{cohort.name}', which has no motion.csv"
        allowed = "a cohort with loads.csv and motion.csv: stiffness is fitted to motion"
        remedy = "choose another cohort, or a study of kind range_of_motion"
        yield Problem(*at(document, "cohort"), found, allowed, remedy)
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
    for name in study.tests or cohort.tests:
        reserved = name in (ALL, NOTHING) or name.startswith(ALL_BUT)
        if name in cohort.tests and (reserved or _UNFIT.search(name)):
            allowed = (
                "names without / \\ = { } and control characters, not beginning with a dot or a "
                "space, not ending with a space, and other than "
                f"'{ALL}', '{NOTHING}' and '{ALL_BUT}...'"
            )
            place = (f"{cohort.folder.name}/loads.csv", None, "test")
            yield Problem(*place, f"test {name!r}", allowed, "rename it in loads and motion")
    yield from _measured(document, study, cohort)


def _specimens(cohort: Cohort) -> Iterator[Problem]:
    """A name that folders of results use for something else."""
    if NOBODY in cohort.specimen_names:
        place = (f"{cohort.folder.name}/specimens.csv", None, "specimen")
        allowed = f"any other name: '{NOBODY}' stands for fits that leave no specimen out"
        yield Problem(*place, f"'{NOBODY}'", allowed, "rename the specimen in every file")


def _measured(document: Document, study: CohortStiffness, cohort: Cohort) -> Iterator[Problem]:
    """Readings of a free coordinate in each test that is asked for, and of every specimen."""
<<<<<<< HEAD
    measured = readings(cohort, study.tests, study.free)
=======
    assert cohort.motion is not None
    columns = [
        column
        for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
        if name in study.free
    ]
    chosen = cohort.motion[cohort.motion["test"].isin(study.tests or cohort.tests)]
    zeros = cohort.zeroed_at_step_0 & (chosen["step"] == 0)  # made by zeroing, no readings
    measured = chosen[chosen[columns].notna().any(axis=1) & ~zeros]
>>>>>>> wt2-kinds
    for index, name in enumerate(study.tests or ()):
        if name in cohort.tests and name not in set(measured["test"]):
            found = f"test '{name}', which has no motion"
            allowed = f"tests with readings of {one_of(study.free)} of a specimen at least"
            place = at(document, f"tests.{index}")
            yield Problem(*place, found, allowed, "delete it or add its motion")
    for specimen in cohort.specimen_names:
        if specimen not in set(measured["specimen"]):
            found = f"no motion of specimen '{specimen}' in any chosen test"
            allowed = f"readings of {one_of(study.free)} of every specimen in one test at least"
            remedy = "choose more tests, or leave the specimen out of the cohort"
            yield Problem(*at(document, "tests"), found, allowed, remedy)


def _levels(document: Document, study: CohortStiffness, cohort: Cohort) -> Iterator[Problem]:
    """Ratios of levels need a value for each level, and a value needs its level."""
    given = study.level_stiffness if "level_stiffness" in study.model_fields_set else ()
<<<<<<< HEAD
    for joint in given:
        if joint not in cohort.joint_names:
            place = at(document, f"level_stiffness.{joint}")
            remedy = did_you_mean(joint, cohort.joint_names, "delete it or correct its name")
            yield Problem(*place, f"unknown joint '{joint}'", one_of(cohort.joint_names), remedy)
=======
    yield from unknown_levels(document, given, cohort.joint_names)
>>>>>>> wt2-kinds
    chosen = [name for name in study.representations if named(name).by_level]
    if not chosen:
        return
    missing = [joint for joint in cohort.joint_names if joint not in study.level_stiffness]
    if missing:
        found = f"no value for {', '.join(missing)}"
        names, verb = " and ".join(chosen), "is" if len(chosen) == 1 else "are"
        allowed = f"a value for every joint of the cohort, as {names} {verb} among representations"
        remedy = f"add them, or leave {names} out of representations"
        yield Problem(*at(document, "level_stiffness"), found, allowed, remedy)


def _cost(document: Document, study: CohortStiffness, cohort: Cohort) -> Iterator[Problem]:
    """Weights need SDs; the published cost knows rotations only."""
    if study.cost == "measurement_sd" and (study.measurement_sd or cohort.measurement_sd) is None:
        found = "null, and the cohort has none"
        allowed = "SDs of one reading, here or in cohort.yaml, for cost: measurement_sd"
        remedy = "fill them in, or choose cost: published"
        yield Problem(*at(document, "measurement_sd"), found, allowed, remedy)
    others = [name for name in study.free if name not in ROTATIONS]
    if study.cost == "published" and others:
        allowed = f"{one_of(ROTATIONS)} with cost: published, which has no translations"
        remedy = "free rotations only, or choose cost: measurement_sd"
        yield Problem(*at(document, "free"), ", ".join(others), allowed, remedy)
<<<<<<< HEAD
=======


KEY = "base.model"
LAWS = (Kind.JOINT_LAW, Kind.PATH)


def check_cohort_base(
    document: Document, study: CohortStiffness, cohort: Cohort, root: Path
) -> Iterator[Problem]:
    """Every way in which the model file is none, or is of something other than the cohort.

    Parameters
    ----------
    document : the study file, for the line of the key.
    root : folder of the Snakefile.
    """
    base = study.base
    if base is None:
        return
    path = base.path(root)
    maker = made_by(path, root)
    if not path.is_file():
        if maker is None:
            allowed = "a model file, or a result of a study in config/studies"
            remedy = "correct the path (it begins at the folder of the Snakefile) or add the file"
            yield Problem(*at(document, KEY), f"no file '{base.model}'", allowed, remedy)
        return
    remade = f"; or delete the file, and study {maker} makes it anew" if maker else ""
    for problem in _of_file(path, base.model, cohort):
        yield replace(problem, remedy=problem.remedy + remade)


def _of_file(path: Path, name: str, cohort: Cohort) -> Iterator[Problem]:
    """Problems of a file that is there, told under the name that the study gives it."""
    try:
        model = read_model(path)
        effects_for(model, "*", cohort.joint_names)
    except InputError as error:
        yield from (replace(problem, file=name) for problem in error.problems)
        return
    yield from _order(model, name)
    for number, entry in enumerate(model.effects):
        if entry.effect != BUSHING:
            yield from _strangers(entry, name, f"effects.{number}", cohort)
            yield from _without_values(entry, name, f"effects.{number}", cohort)


def _order(model: ModelFile, name: str) -> Iterator[Problem]:
    """The study's bushing comes first; laws before the file's would no longer be before it."""
    names = [entry.effect for entry in model.effects]
    if BUSHING not in names:
        return
    for number, entry in enumerate(model.effects[: names.index(BUSHING)]):
        if create(entry.effect, entry.options).kind in LAWS:
            allowed = f"{BUSHING} before all laws: later ones may scale what it carries"
            place = (name, None, f"effects.{number}")
            yield Problem(*place, f"{entry.effect} first", allowed, f"move {BUSHING} to the top")


def _strangers(entry: EffectEntry, name: str, place: str, cohort: Cohort) -> Iterator[Problem]:
    """Specimens and tests that the cohort does not have."""
    specimens = cohort.specimen_names
    named = [("scope.specimens", "specimen", one, specimens) for one in entry.scope.specimens]
    named += [("scope.tests", "test", one, cohort.tests) for one in entry.scope.tests]
    named += [("values.specimen", "specimen", row.specimen, specimens) for row in entry.values]
    for where, what, one, known in named:
        if one != "*" and one not in known:
            remedy = did_you_mean(one, known, "delete it or correct its name")
            found, allowed = f"unknown {what} '{one}'", f"* or {one_of(known)}"
            yield Problem(name, None, f"{place}.{where}", found, allowed, remedy)


def _without_values(entry: EffectEntry, name: str, place: str, cohort: Cohort) -> Iterator[Problem]:
    """Specimens in scope for which a file with values has none."""
    rows, scope = {row.specimen for row in entry.values}, entry.scope.specimens
    if not rows or "*" in rows:
        return
    acts_in = [one for one in cohort.specimen_names if "*" in scope or one in scope]
    missing = [one for one in acts_in if one not in rows]
    if missing:
        found, allowed = f"no value for {', '.join(missing)}", "a value for every specimen in scope"
        remedy = "add values for them or for *, or name the others as its scope"
        yield Problem(name, None, f"{place}.values", found, allowed, remedy)
>>>>>>> wt2-kinds

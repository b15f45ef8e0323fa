"""What a study of global sensitivity demands of its cohort, its design and its factors."""

from collections.abc import Callable, Iterator, Sequence
from math import log2
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.problems import InputProblem, did_you_mean, one_of
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY, Method
from spinepipe.sensitivity_analysis.global_indices.estimates import INDICES
from spinepipe.studies.global_sensitivity.factors import FactorChange, Of
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.start import frame_landmarks, given_joints, moved_by
from spinepipe.studies.parts import AUTO
from spinepipe.studies.places import (
    measured_columns,
    readings,
    unknown_levels,
    unknown_names,
    unknown_tests,
)
from spinepipe.units import COORDINATE_COLUMNS

TAKE_GROUPS = ("sobol", "morris")
FEWEST = 2
_FORCES = ["fx_n", "fy_n", "fz_n"]
_MOMENTS = ["mx_nm", "my_nm", "mz_nm"]


def check_global_sensitivity(
    document: YamlDocument, study: GlobalSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from check_sensitivity_design(document, study)
    yield from unknown_names(
        document, "specimens", "specimen", study.specimens, cohort.specimen_names
    )
    yield from unknown_levels(document, study.level_stiffness, cohort.joint_names)
    yield from _tests(document, study, cohort)
    yield from _motion(document, study, cohort)
    yield from check_factors(document, study, cohort)


def check_sensitivity_design(
    document: YamlDocument, study: GlobalSensitivity
) -> Iterator[InputProblem]:
    """Everything about names, groups and numbers that a method cannot do with."""
    yield from _samples(document, study)
    yield from _indices(document, study)
    yield from _names(document, study)
    yield from _groups(document, study)
    compared = [name for name in study.compared if name != DUMMY]
    if len(compared) < FEWEST:
        what = f"{len(study.factors)} factors, compared as {len(compared)}"
        allowed = f"at least {FEWEST} factors or groups: one alone has nothing to be compared with"
        yield InputProblem(
            *document.place_of("factors"), what, allowed, "add factors, or split the group"
        )


def _samples(document: YamlDocument, study: GlobalSensitivity) -> Iterator[InputProblem]:
    """Numbers that the methods ask for."""
    design = study.design
    n, place = design.samples, document.place_of("design.samples")
    if design.method == "sobol" and n & (n - 1):
        below = 2 ** int(log2(n))
        remedy = f"take {below} or {2 * below}"
        yield InputProblem(*place, str(n), "a power of two with method sobol", remedy)
    others = max(1, len(study.factor_names) - 1)
    fewest = 4 * design.harmonics**2 * others + 1  # for each factor a frequency of its own
    if design.method == "fast" and n < fewest:
        count = f"{design.harmonics} harmonics and {others + 1} factors"
        allowed = f"at least {fewest} with method fast, {count}"
        yield InputProblem(*place, str(n), allowed, "take more samples, or fewer harmonics")
    if design.method == "morris" and design.levels % 2:
        allowed = "an even number: steps of half the levels must stay on the grid"
        levels = str(design.levels)
        yield InputProblem(
            *document.place_of("design.levels"), levels, allowed, "take one more or one less"
        )


def _indices(document: YamlDocument, study: GlobalSensitivity) -> Iterator[InputProblem]:
    """Each method has indices of its own."""
    there = INDICES[Method(study.design.method)]
    for number, index in enumerate(study.indices or ()):
        if index not in there:
            place = document.place_of(f"indices.{number}")
            allowed = f"with method {study.design.method}: {one_of(there)}"
            yield InputProblem(*place, index, allowed, "delete it, or choose another method")


def _names(document: YamlDocument, study: GlobalSensitivity) -> Iterator[InputProblem]:
    """Factors are told apart by their names."""
    seen: dict[str, int] = {}
    for number, factor in enumerate(study.factors):
        name = factor.label
        key = f"factors.{number}.name" if factor.name else f"factors.{number}"
        if name == DUMMY and study.dummy:
            allowed = f"any other name: '{DUMMY}' is the factor that changes nothing"
            yield InputProblem(*document.place_of(key), f"'{name}'", allowed, "rename it")
        if name in seen:
            found = f"'{name}', the name of factor {seen[name] + 1} as well"
            remedy = "delete one, or give one a `name:` of its own"
            yield InputProblem(*document.place_of(key), found, "each name once", remedy)
        seen.setdefault(name, number)


def _groups(document: YamlDocument, study: GlobalSensitivity) -> Iterator[InputProblem]:
    """Groups are told apart from factors, and only some methods have indices of groups."""
    labels = [*(factor.label for factor in study.factors), *([DUMMY] if study.dummy else [])]
    for number, factor in enumerate(study.factors):
        if factor.group is None:
            continue
        place = document.place_of(f"factors.{number}.group")
        if factor.group in labels:
            allowed = "a name that no factor has"
            yield InputProblem(*place, f"'{factor.group}'", allowed, "rename the group")
        if study.design.method not in TAKE_GROUPS:
            found = f"'{factor.group}' with method {study.design.method}"
            allowed = f"no group, or method {one_of(TAKE_GROUPS)}"
            yield InputProblem(*place, found, allowed, "delete the group, or choose another method")


def _tests(
    document: YamlDocument, study: GlobalSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Tests must exist, and every specimen must have one."""
    if cohort.loads is None:
        found = f"cohort '{cohort.name}', which has no loads.csv"
        allowed = "a cohort with loads.csv: the study moves specimens in its tests"
        yield InputProblem(
            *document.place_of("cohort"), found, allowed, "add loads, or take another cohort"
        )
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
    rows = cohort.loads[cohort.loads["test"].isin(study.chosen_tests(cohort))]
    if rows.empty:  # no chosen test is known
        return
    loaded = set(rows["specimen"])
    for specimen in study.chosen_specimens(cohort):
        if specimen in cohort.specimen_names and not loaded & {specimen, "*"}:
            found = f"no load of specimen '{specimen}' in any chosen test"
            remedy = "choose more tests, or leave the specimen out"
            allowed = "a load of every chosen specimen in one chosen test at least"
            yield InputProblem(*document.place_of("tests"), found, allowed, remedy)


def _motion(
    document: YamlDocument, study: GlobalSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Stiffness is fitted to measured motion, which every specimen must have."""
    asked = (
        ("stiffness", "fitted", "give `stiffness` as a mapping", study.is_fitted),
        ("outputs.stiffness", "true", "set outputs.stiffness: false", study.outputs.stiffness),
    )
    for key, word, otherwise, wanted in asked:
        if wanted:
            missing = _without_motion(study, cohort)
            if missing:
                remedy = f"{otherwise}, or choose other specimens and tests"
                whose = "every chosen specimen in one chosen test at least"
                allowed = f"{word} with measured motion of {whose}"
                yield InputProblem(
                    *document.place_of(key), f"{word}, and {missing}", allowed, remedy
                )
    if study.is_fitted and study.level_stiffness:
        found = "levels of their own with stiffness: fitted, which all joints of a specimen share"
        yield InputProblem(
            *document.place_of("level_stiffness"), found, "none of them", "delete it"
        )
    if study.is_fitted or study.outputs.stiffness:
        yield from _weights(document, study, cohort)


def _without_motion(study: GlobalSensitivity, cohort: Cohort) -> str:
    """Whose motion there is not; empty where there is everybody's."""
    if cohort.motion is None:
        return f"cohort '{cohort.name}' has no motion.csv"
    measured = set(readings(cohort, study.chosen_tests(cohort), None)["specimen"])
    known = set(cohort.specimen_names)
    chosen = [name for name in study.chosen_specimens(cohort) if name in known]
    names = [name for name in chosen if name not in measured]
    return f"no motion of {', '.join(names)}" if names else ""


def _weights(
    document: YamlDocument, study: GlobalSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Something that was measured must count."""
    if cohort.motion is None:
        return
    read = readings(cohort, study.chosen_tests(cohort), None)
    columns = measured_columns(read)
    weights = zip(COORDINATE_COLUMNS, study.calibration.weights.in_order(), strict=True)
    if columns and not any(weight for name, weight in weights if name in columns):
        place = document.place_of("calibration.weights")
        found = "no weight on anything that was measured"
        yield InputProblem(
            *place, found, f"a weight on {one_of(columns)}", "weigh what was measured"
        )
    elif AUTO in study.calibration.free:
        found = "auto, and no coordinate was both loaded and measured"
        place = document.place_of("calibration.free")
        yield InputProblem(
            *place, found, "coordinates that were", "name some, or choose other tests"
        )


def check_factors(
    document: YamlDocument, study: GlobalSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Problems of all factors, in their order."""
    specimens = [s for s in study.chosen_specimens(cohort) if s in cohort.specimen_names]
    for number, factor in enumerate(study.factors):
        change, key = factor.change, f"factors.{number}"
        if change.of is Of.LANDMARK:
            yield from check_landmark(document, key, change, cohort, specimens)
        elif change.of in _CHECKS:
            yield from _CHECKS[change.of](document, key, change, cohort, study, specimens)


def _joints(
    document: YamlDocument, key: str, change: FactorChange, cohort: Cohort, *_: Any
) -> Iterator[InputProblem]:
    yield from unknown_names(document, f"{key}.joints", "joint", change.at, cohort.joint_names)


def _bodies(
    document: YamlDocument,
    key: str,
    change: FactorChange,
    cohort: Cohort,
    study: GlobalSensitivity,
    specimens: Sequence[str],
) -> Iterator[InputProblem]:
    """Bodies must be vertebrae that move, listed, and felt: in equilibrium only weight is."""
    moving, place = cohort.vertebrae[1:], f"{key}.vertebrae"
    yield from unknown_names(document, place, "moving vertebra", change.at, moving)
    if cohort.bodies is None:
        found = f"{change.of.value} in cohort '{cohort.name}', which has no bodies.csv"
        allowed = "factors of bodies in a cohort that lists them"
        yield InputProblem(
            *document.place_of(key), found, allowed, "delete the factor, or add bodies.csv"
        )
        return
    if not cohort.gravity:
        found = f"{change.of.value} in cohort '{cohort.name}' without gravity: it would do nothing"
        allowed = "factors of bodies where gravity is true: in equilibrium bodies only weigh"
        yield InputProblem(*document.place_of(key), found, allowed, "delete the factor")
    rows = zip(cohort.bodies["specimen"], cohort.bodies["vertebra"], strict=True)
    listed = set(rows)
    asked = [name for name in change.at or moving if name in moving]
    missing = [f"{v} of {s}" for s in specimens for v in asked if (s, v) not in listed]
    if missing:
        found = f"no body in bodies.csv for {', '.join(missing[:5])}"
        allowed = "bodies that the cohort lists, of all chosen specimens"
        yield InputProblem(
            *document.place_of(place), found, allowed, "leave them out, or add their bodies"
        )


def _loads(
    document: YamlDocument,
    key: str,
    change: FactorChange,
    cohort: Cohort,
    study: GlobalSensitivity,
    specimens: Sequence[str],
) -> Iterator[InputProblem]:
    """Something must act: a point matters to forces, direction and size to moments as well."""
    if cohort.loads is None:
        return
    columns = _FORCES if change.of is Of.LOAD_POINT else [*_FORCES, *_MOMENTS]
    chosen = cohort.loads["test"].isin(study.chosen_tests(cohort))
    chosen &= cohort.loads["specimen"].isin([*specimens, "*"])
    if chosen.any() and not cohort.loads.loc[chosen, columns].any(axis=None):
        what = "force" if change.of is Of.LOAD_POINT else "load"
        found = f"{change.of.value}, but no {what} acts in any chosen test: it would do nothing"
        allowed = f"{change.of.value} in tests with a {what}"
        yield InputProblem(
            *document.place_of(key), found, allowed, "delete the factor, or choose other tests"
        )


def check_landmark(
    document: YamlDocument, key: str, change: FactorChange, cohort: Cohort, specimens: Sequence[str]
) -> Iterator[InputProblem]:
    """Problems of one factor.

    Parameters
    ----------
    key : of the factor in the study file.
    specimens : of the cohort, those that the study has.
    """
    (vertebra,) = change.at
    if cohort.landmarks is None:
        found = f"a landmark in cohort '{cohort.name}', which has no landmarks.csv"
        allowed = "landmarks of a cohort that has them"
        remedy = "use joint_centre and joint_axes, or take another cohort"
        yield InputProblem(*document.place_of(key), found, allowed, remedy)
        return
    if vertebra not in cohort.vertebrae:
        known = cohort.vertebrae
        remedy = did_you_mean(vertebra, known, "correct its name")
        place = document.place_of(f"{key}.vertebra")
        yield InputProblem(*place, f"unknown vertebra '{vertebra}'", one_of(known), remedy)
    if change.landmark not in FRAME_LANDMARKS:
        # a landmark that makes no frame may be moved as far as one likes
        there = change.landmark in set(cohort.landmarks["landmark"])
        why = "in no joint frame: it would do nothing" if there else "unknown"
        remedy = did_you_mean(
            change.landmark, FRAME_LANDMARKS, "correct its name, or delete the factor"
        )
        found = f"landmark '{change.landmark}', {why}"
        yield InputProblem(
            *document.place_of(f"{key}.landmark"), found, one_of(FRAME_LANDMARKS), remedy
        )
    elif vertebra in cohort.vertebrae:
        yield from _of_specimens(document, key, change, cohort, specimens)


def _of_specimens(
    document: YamlDocument, key: str, change: FactorChange, cohort: Cohort, specimens: Sequence[str]
) -> Iterator[InputProblem]:
    """Specimens without the landmark, then those in which nothing hangs on it."""
    vertebra = cohort.vertebrae.index(change.at[0])
    landmark = FRAME_LANDMARKS.index(change.landmark)
    without, idle = [], []
    for specimen in specimens:
        _, known = frame_landmarks(cohort, specimen)
        if not known[vertebra, landmark]:
            without.append(specimen)
        elif not moved_by(known, given_joints(cohort, specimen), vertebra, landmark):
            idle.append(specimen)
    what = f"{change.landmark} of {change.at[0]}"
    if without:
        found = f"{what}, which landmarks.csv does not have of {', '.join(without[:5])}"
        allowed = "a landmark of all chosen specimens"
        yield InputProblem(
            *document.place_of(f"{key}.landmark"), found, allowed, "delete the factor"
        )
    if idle:
        found = f"{what}, on which no joint frame of {', '.join(idle[:5])} hangs"
        allowed = "a landmark of a frame that joints.csv does not give: it would do nothing"
        remedy = "delete the factor, or use joint_centre and joint_axes"
        yield InputProblem(*document.place_of(key), found, allowed, remedy)


_CHECKS: dict[Of, Callable[..., Iterator[InputProblem]]] = {
    Of.STIFFNESS: _joints,
    Of.JOINT_CENTRE: _joints,
    Of.JOINT_AXES: _joints,
    Of.MASS: _bodies,
    Of.CENTRE_OF_MASS: _bodies,
    Of.LOAD_POINT: _loads,
    Of.LOAD_DIRECTION: _loads,
    Of.LOAD_SIZE: _loads,
}
"""What is demanded of the cohort; damping is always there."""

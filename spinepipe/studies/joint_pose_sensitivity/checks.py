"""What a study of joint-pose sensitivity demands of its cohort."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.check_geometry import landmark_problems
from spinepipe.cohort.columns import TABLES
from spinepipe.cohort.draft import Draft
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.problems import InputProblem, one_of
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.parts import AUTO
from spinepipe.studies.places import unknown_tests
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES


def check_joint_pose_sensitivity(
    document: YamlDocument, study: JointPoseSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from _landmarks(document, study, cohort)
    yield from _loading(document, study, cohort)
    yield from _tests(document, study, cohort)
    yield from _load_point(document, study, cohort)
    if study.best_models > study.poses:
        place = document.place_of("best_models")
        allowed = f"at most the number of poses, {study.poses}"
        yield InputProblem(*place, str(study.best_models), allowed, "take fewer, or more poses")


def _landmarks(
    document: YamlDocument, study: JointPoseSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    if cohort.landmarks is None:
        allowed = "a cohort with landmarks.csv: the study samples landmarks"
        found = f"cohort '{cohort.name}', which has none"
        yield InputProblem(*document.place_of("cohort"), found, allowed, "choose another cohort")
        return
    tables = {"specimens": cohort.specimens, "landmarks": cohort.landmarks}
    absent = frozenset(TABLES) - set(tables)
    draft = Draft(cohort.name, cohort.vertebrae, cohort.gravity, tables, absent)
    for problem in landmark_problems(draft, set()):
        place = (problem.file, None, problem.column)  # blank lines may have shifted the rows
        yield InputProblem(*place, problem.found, problem.allowed, problem.remedy)
    frame = cohort.landmarks[cohort.landmarks["landmark"].isin(FRAME_LANDMARKS)]
    bare = frame[frame["sd_mm"].isna()]
    if study.landmark_sd_mm is None and len(bare):
        first = ", ".join(bare.iloc[0][["specimen", "vertebra", "landmark"]])
        found = f"null, and {len(bare)} of {len(frame)} landmarks without sd_mm (first: {first})"
        allowed = "a number in mm, or an sd_mm for every landmark of a joint frame"
        remedy = "set landmark_sd_mm or fill the column"
        yield InputProblem(*document.place_of("landmark_sd_mm"), found, allowed, remedy)


def _loading(
    document: YamlDocument, study: JointPoseSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Settling moves the vertebrae in time: each needs mass and inertia."""
    if study.loading != "settle":
        return
    lacking = f"cohort '{cohort.name}' has no bodies.csv"
    if cohort.bodies is not None:
        whole = cohort.bodies[cohort.bodies["ixx_kg_m2"].notna()]
        given = set(zip(whole["specimen"], whole["vertebra"], strict=True))
        missing = [
            f"{vertebra} of {specimen}"
            for specimen in cohort.specimen_names
            for vertebra in cohort.vertebrae[1:]
            if (specimen, vertebra) not in given
        ]
        if not missing:
            return
        lacking = f"no inertia in bodies.csv for {', '.join(missing[:5])}"
    place = document.place_of("loading")
    allowed = "equilibrium, or a cohort with masses and inertias of all moving vertebrae"
    yield InputProblem(
        *place, f"settle, but {lacking}", allowed, "choose equilibrium, or fill them in"
    )


def _load_point(
    document: YamlDocument, study: JointPoseSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Only forces have a point: another one changes nothing under pure moments."""
    if not study.load_point.asked or cohort.loads is None or has_force(study, cohort):
        return
    found = "other load points, but no force in any chosen test"
    place = document.place_of("load_point")
    allowed = "tests with a force: a pure moment has no point"
    yield InputProblem(*place, found, allowed, "choose tests with forces, or leave load_point out")


def has_force(study: JointPoseSensitivity, cohort: Cohort) -> bool:
    """Whether any load of the chosen tests is a force."""
    forces = ["fx_n", "fy_n", "fz_n"]
    loads = cohort.loads
    if loads is not None:
        loads = loads[loads["test"].isin(study.tests or cohort.tests)]
    acting = [table for table in (loads, cohort.preload) if table is not None]
    return any(bool(table[forces].abs().gt(0.0).any(axis=None)) for table in acting)


def _tests(
    document: YamlDocument, study: JointPoseSensitivity, cohort: Cohort
) -> Iterator[InputProblem]:
    """Tests must exist, and every specimen must have been measured in one of them."""
    if cohort.motion is None:
        found = f"cohort '{cohort.name}', which has no motion.csv"
        allowed = "a cohort with loads.csv and motion.csv: the study calibrates on motion"
        yield InputProblem(*document.place_of("cohort"), found, allowed, "choose another cohort")
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
    chosen = cohort.motion[cohort.motion["test"].isin(study.tests or cohort.tests)]
    measured = chosen[chosen[list(COORDINATE_COLUMNS)].notna().any(axis=1)]
    if measured.empty:
        tests = one_of(dict.fromkeys(cohort.motion["test"]))
        found = "no motion in any chosen test"
        yield InputProblem(*document.place_of("tests"), found, tests, "choose a test with motion")
        return
    for specimen in cohort.specimen_names:
        if specimen not in set(measured["specimen"]):
            found = f"no motion of specimen '{specimen}' in any chosen test"
            allowed = "motion of every specimen in one chosen test at least"
            remedy = "choose more tests, or leave the specimen out of the cohort"
            yield InputProblem(*document.place_of("tests"), found, allowed, remedy)
    yield from _weights(document, study, measured)


def _weights(
    document: YamlDocument, study: JointPoseSensitivity, measured: pd.DataFrame
) -> Iterator[InputProblem]:
    """Terms of what was not measured drop out of the cost; something to fit must remain."""
    weights = study.calibration.weights.in_order()
    known = [c for c in COORDINATE_COLUMNS if measured[c].notna().any()]
    if not any(w > 0 for w, c in zip(weights, COORDINATE_COLUMNS, strict=True) if c in known):
        place = document.place_of("calibration.weights")
        found = "no weight on anything that was measured"
        yield InputProblem(*place, found, f"a weight on {one_of(known)}", "weigh what was measured")
    elif AUTO in study.calibration.free:
        found = "auto, and no coordinate was both loaded and measured"
        allowed = f"{one_of(COORDINATES)}, whose stiffness the data tell"
        place = document.place_of("calibration.free")
        yield InputProblem(*place, found, allowed, "look at loads.csv and motion.csv, or name some")

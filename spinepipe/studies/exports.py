"""What kinds share in writing a specimen's model for OpenSim: what is refused, and the file."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import measured_specimen
from spinepipe.cohort.specimen import landmarks
from spinepipe.model import LoadCase, SpineModel
from spinepipe.model.osim import expressible, osim, times
from spinepipe.motion.export import mot
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.statics import Chain, System, follow
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.selected_tests import first_cycles
from spinepipe.units import COORDINATES


class Exported(NamedTuple):
    """OpenSim's document of a model, in words what it is, and of a test the motion as .mot."""

    document: str
    words: str
    motion: str = ""


def refuse(
    wanted: WantedFiles,
    *,
    poses: bool = False,
    representations: bool = False,
    tests: bool = True,
) -> None:
    """Refuse what a kind of study does not have.

    Parameters
    ----------
    poses, representations, tests : whether it has them.

    Raises
    ------
    InputError
        With every such option.
    """
    problems = list(_options(wanted, poses, representations, tests))
    if problems:
        raise InputError(problems)


def _options(
    wanted: WantedFiles, poses: bool, representations: bool, tests: bool
) -> Iterator[InputProblem]:
    if wanted.test is not None and not tests:
        allowed = "none: motions of this kind of study are among its results"
        yield problem("--test", wanted.test, allowed, "leave it out")
    if wanted.pose is not None and not poses:
        allowed = "none: this kind of study exports no sampled joints"
        yield problem("--pose", f"pose {wanted.pose}", allowed, "leave it out")
    if wanted.representation is not None and not representations:
        allowed = "none: stiffness of this kind of study has one representation"
        yield problem("--representation", wanted.representation, allowed, "leave it out")


def opensim_document(
    model: SpineModel,
    words: str,
    cohort: Cohort,
    wanted: WantedFiles,
    cases: Sequence[LoadCase] = (),
) -> Exported:
    """OpenSim's document of a model, and in words what it is and what it leaves out.

    Its markers are the landmarks of the cohort. Where a test is wanted, its loads are in the
    document, and its motion counts from the neutral pose.

    Parameters
    ----------
    cases : the tests of the study; by default those of the cohort.

    Raises
    ------
    InputError
        For a test that there is not, or that has no equilibrium.
    RefusedModel
        For a name that OpenSim cannot take.
    """
    case, motion = None, ""
    if wanted.test is not None:
        case = _case(wanted, cases or _cases(cohort, wanted.specimen))
        steps = follow(System(Chain(model), model, case))
        if failed := [one for one in steps if not one.usable]:
            how = failed[0].equilibrium
            found = f"{wanted.test}: {how.status.value} in step {failed[0].step.step}"
            allowed, remedy = "a test with equilibria", how.message or "choose another test"
            raise InputError([problem("--test", found, allowed, remedy)])
        q = np.array([one.equilibrium.q for one in steps]).reshape(len(steps), -1, 6)
        names = [f"{joint}_{name}" for joint in model.joints for name in COORDINATES]
        motion = mot(f"{model.specimen}_{case.test}", times(case), q, names)
        words += f"; loads and motion of {case.test}, cycle {case.cycle}"
    said, unsaid = expressible(model, case)
    points = {} if cohort.landmarks is None else landmarks(cohort, model.specimen)
    document = osim(said, case, unsaid, points)
    if unsaid:
        words += f"; not in the file, as OpenSim has no counterpart: {', '.join(unsaid)}"
        words += " (the motion is of the model with them)" if case else ""
    return Exported(document, words, motion)


def _cases(cohort: Cohort, specimen: str) -> Sequence[LoadCase]:
    return () if cohort.loads is None else measured_specimen(cohort, specimen, cohort.tests).cases


def _case(wanted: WantedFiles, cases: Sequence[LoadCase]) -> LoadCase:
    """The first cycle of the test that is wanted."""
    known = {one.test: one for one in first_cycles(cases)}
    if wanted.test not in known:
        allowed = one_of(list(known)) if known else "none: no loads are known"
        raise InputError([problem("--test", str(wanted.test), allowed, "correct the name")])
    return known[wanted.test]


def required_result(path: Path, what: str) -> Path:
    """A result file that must be there.

    Raises
    ------
    InputError
        With the command that makes it.
    """
    if not path.is_file():
        folders = path.parts
        name = "/".join(folders[folders.index("results") :])
        remedy = f"run `snakemake -j2 {name}` first, or add --start"
        raise InputError([problem("STUDY", f"no {name}", what, remedy)])
    return path


def problem(column: str, found: str, allowed: str, remedy: str) -> InputProblem:
    """A problem of the command line."""
    return InputProblem("command line", None, column, found, allowed, remedy)

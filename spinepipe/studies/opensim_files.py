"""A specimen's model for OpenSim: its file, and of a test the loads in it and the motion."""

from collections.abc import Sequence

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import measured_specimen
from spinepipe.cohort.specimen import landmarks
from spinepipe.model import LoadCase, SpineModel
from spinepipe.model.osim import expressible, osim, times
from spinepipe.motion.export import mot
from spinepipe.problems import InputError, one_of
from spinepipe.statics import Chain, System, follow
from spinepipe.studies.exports import Exported, problem
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.selected_tests import first_cycles
from spinepipe.units import COORDINATES


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
        if not cases and cohort.loads is not None:
            cases = measured_specimen(cohort, wanted.specimen, cohort.tests).cases
        known = {one.test: one for one in first_cycles(cases)}
        if wanted.test not in known:
            allowed = one_of(list(known)) if known else "none: no loads are known"
            raise InputError([problem("--test", wanted.test, allowed, "correct the name")])
        case = known[wanted.test]
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
    _, unsaid = expressible(model, case)
    points = {} if cohort.landmarks is None else landmarks(cohort, model.specimen)
    document = osim(model, case, points)
    if unsaid:
        words += f"; not in the file, as OpenSim has no counterpart: {', '.join(unsaid)}"
        words += " (the motion is of the model with them)" if case else ""
    return Exported(document, words, motion)

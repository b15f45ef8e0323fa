"""Cohort study: a specimen's fit beside OpenSim, the pooled fit, the study as users run it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.engine import Result, off, with_moments
from benchmarks.study import ROOT, Run, copy_of_project, run_workflow
from benchmarks.timing import cpu_seconds
from spinepipe.calibration import MeasuredCase, Problem, fit, pool
from spinepipe.model import LoadCase
from spinepipe.statics import System, follow, free_parameters, with_parameters
from spinepipe.studies.cohort_stiffness.problem import calibration_problem, specimen_tests
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of
from spinepipe.units import STIFFNESS_COLUMNS
from spinepipe.world import Chain
from tests.reference.bridge import load_case, spine_model
from tests.reference.peers import opensim_calibration
from tests.reference.peers.chain import Chain as PeerChain
from tests.reference.peers.chain import t12_s1_chain

STUDY = "t12s1_cohort_stiffness"
STEPS = 10
FIT = "fits/stiffness/specimen-s01/representation-per_joint/fitted_to-all.parquet"


def specimen() -> Result:
    """18 stiffnesses of T12-S1 from three load cases of ten steps each, exact data."""
    chain = t12_s1_chain()
    groups = opensim_calibration.one_per_joint_and_axis(chain.n_joints)
    rng = np.random.default_rng(5)
    truth = chain.stiffness * np.append(np.exp(rng.normal(0.0, 0.3, groups.max() + 1)), 1.0)[groups]
    shares = np.arange(1, STEPS + 1) / STEPS
    tests = [[with_moments(chain, share)[axis] for share in shares] for axis in range(3)]
    problem = _problem(chain, tests, truth)
    ours = cpu_seconds(lambda: fit(problem), 10)
    found = with_parameters(problem.model, problem.free, fit(problem).x).effects[0].values
    observed = np.concatenate([case.measured for case in problem.cases])
    predict = opensim_calibration.static_predictor(
        chain, [one.loads for test in tests for one in test]
    )
    fits = []
    peer = cpu_seconds(
        lambda: fits.append(
            opensim_calibration.calibrate(predict, chain.stiffness, observed, groups)
        ),
        1,
        warm_up=0,
    )
    return Result(
        f"fit of 18 stiffnesses, three load cases of {STEPS} steps (goal 400 ms)",
        ours.median,
        "OpenSim static root-find + least squares",
        peer.median,
        f"off truth by {off(found, truth)}, OpenSim by {off(fits[-1].stiffness, truth)}",
    )


def _problem(chain: PeerChain, tests: list[list[PeerChain]], truth: np.ndarray) -> Problem:
    """Exact motion of a spine of the true stiffness, to be fitted from the chain's own."""
    true_model, model = spine_model(chain.with_stiffness(truth)), spine_model(chain)
    cases = []
    for number, steps in enumerate(tests):
        single = [load_case(one, test=str(number)).steps[-1] for one in steps]
        case = LoadCase(str(number), 1, tuple(single))
        solved = follow(System(Chain(true_model), true_model, case))
        motion = np.stack([step.equilibrium.q.reshape(-1, 6) for step in solved])
        cases.append(MeasuredCase(case, motion))
    free = free_parameters(model, 0, list(STIFFNESS_COLUMNS[3:]), "per_joint")
    reach = np.full(len(free), np.log(1000.0))
    return Problem(model, tuple(cases), free, np.array([0, 0, 0, 1, 1, 1.0]), -reach, reach)


def pooled_s() -> float:
    """CPU seconds of pooling the six specimens of the shipped study, all load cases."""
    study, cohort = check(ROOT, STUDY)
    assert isinstance(study, CohortStiffness)
    problems = []
    for name in cohort.specimen_names:
        tests = specimen_tests(study, cohort, name)
        problems.append(
            calibration_problem(study, cohort, name, "partially_pooled", tests.frames, tests.tested)
        )
    return cpu_seconds(lambda: pool(problems), 3).median


def runs() -> Iterator[Run]:
    """The shipped study in a copy of the project: cold, again, and after losing a fit."""
    wanted = files_of(*check(ROOT, STUDY)).results()
    with copy_of_project() as folder:
        yield run_workflow("cohort study, cold", folder, wanted, "180 s")
        yield run_workflow("nothing to do", folder, wanted, "")
        lost = f"results/{STUDY}/{FIT}"
        Path(folder, lost).unlink()
        yield run_workflow("one fit lost", folder, [lost, *wanted], "")

"""The identification study's parts: fits by method, bootstrap fits, settling runs.

The published way is emulated with LSODA in the study; here the same optimiser is also given runs
of OpenSim itself (CPodes), on the same model, so that a reader sees how good the emulation is.
"""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.timing import cpu_seconds
from spinepipe.calibration import Problem, fit
from spinepipe.calibration.forward_runs import (
    DEFAULT_STEP,
    MOST_EVALUATIONS,
    ForwardCost,
    exact_gradient,
    fit_by_cost,
    relative_error,
)
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics import Course, Program, settle
from spinepipe.studies.joint_pose_sensitivity import bootstrap
from spinepipe.studies.joint_pose_sensitivity import poses as build_models
from spinepipe.studies.joint_pose_sensitivity import poses as sample_landmarks
from spinepipe.studies.joint_pose_sensitivity.filters import near_start
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    sampled_poses,
    specimen_inputs,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem
from tests.reference.bridge import system
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import Chain as PeerChain
from tests.reference.peers.chain import Load

ROOT = str(Path(__file__).resolve().parents[1])
STUDY, SPECIMEN = "l1l4_joint_pose", "s01"
SAMPLED = (1, 2)
"""Sampled poses that are fitted beside the cohort's own."""

SECONDS, ACCURACY, SANE_STEP = 1.5, 1e-5, 1e-3
PERCENT = 1.0
BOOTSTRAP_FITS = 20


@dataclass(frozen=True)
class Speed:
    """One line: what, ours and OpenSim's CPU seconds (None: no such thing there), and the goal."""

    what: str
    ours_s: float
    peer_s: float | None
    goal: str


@dataclass(frozen=True)
class MethodFit:
    """One fit.

    Attributes
    ----------
    near_start : free stiffnesses within 1 % of their start, of all free ones.
    cost_ratio : cost over that of the exact fit, 1 where it has arrived.
    """

    pose: str
    method: str
    claims_success: bool
    near_start: str
    cost_ratio: float
    derivative_error: float | None
    runs: int
    cpu_s: float


class OpenSimCost(ForwardCost):
    """The same cost by runs of OpenSim's CPodes."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, SECONDS, ACCURACY, MOST_EVALUATIONS)
        self._built: dict[tuple[str, int, int], opensim_peer.OpenSimChain] = {}

    def end(self, model: SpineModel, case: LoadCase) -> Array | None:
        """(n,) pose at the end of OpenSim's run; None when CPodes stops early."""
        (step,) = case.steps
        key = (case.test, case.cycle, step.step)
        if key not in self._built:
            self._built[key] = opensim_peer.build(peer_chain(model, step))
        built = self._built[key]
        opensim_peer.set_stiffness(built, model.effects[0].values)
        try:
            return opensim_peer.settle_of(built, self.duration_s, accuracy=self.accuracy).ravel()
        except RuntimeError:
            return None


def peer_chain(model: SpineModel, step: LoadStep) -> PeerChain:
    """A model on linear bushings and the loads of one step, as the peers' bare numbers."""
    return PeerChain(
        origins=np.array([frame.origin for frame in model.frames]),
        rotations=np.array([frame.rotation for frame in model.frames]),
        masses=np.array([body.mass for body in model.bodies]),
        centres=np.array([body.com for body in model.bodies]),
        inertias=np.array([body.inertia for body in model.bodies]),
        stiffness=np.array(model.effects[0].values),
        damping=np.array(model.damping),
        loads=tuple(Load(w.body, w.force, w.moment, w.point) for w in step.wrenches),
        gravity=np.array(model.gravity),
    )


def problems(numbers: Sequence[int] = SAMPLED) -> Iterator[tuple[str, Problem]]:
    """The study's problem in the cohort's own joint poses and in sampled ones."""
    settings, cohort = study_and_cohort(ROOT, STUDY)
    with tempfile.TemporaryDirectory(prefix="spinepipe-bench-") as folder:
        landmarks, poses = (f"{folder}/{name}.parquet" for name in ("landmarks", "poses"))
        sample_landmarks.sample(ROOT, STUDY, SPECIMEN, landmarks)
        build_models.build(ROOT, STUDY, landmarks, SPECIMEN, poses)
        sampled = sampled_poses(poses)
    own = specimen_inputs(ROOT, STUDY, SPECIMEN, cohort.digest).frames
    yield "the cohort's own", calibration_problem(ROOT, settings, SPECIMEN, own)
    for pose in numbers:
        frames, reason = sampled.of(SPECIMEN, pose)
        assert frames is not None, reason
        yield f"sampled {pose}", calibration_problem(ROOT, settings, SPECIMEN, frames)


def fits() -> Iterator[MethodFit]:
    """The same poses fitted exactly, by the emulation, and by OpenSim's own runs."""
    ways: list[tuple[str, Callable[[Problem], ForwardCost]]] = [
        ("emulated run", lambda problem: ForwardCost(problem, SECONDS, ACCURACY, MOST_EVALUATIONS)),
        ("OpenSim CPodes run", OpenSimCost),
    ]
    steps = (
        ("default step", DEFAULT_STEP, False),
        ("sane step", SANE_STEP, False),
        ("default step, raw units", DEFAULT_STEP, True),
        ("sane step, raw units", SANE_STEP, True),
    )
    for pose, problem in problems():
        start = time.process_time()
        exact = fit(problem)
        seconds = time.process_time() - start
        near = _near(exact.x)
        yield MethodFit(pose, "exact", True, near, 1.0, 0.0, exact.evaluations, seconds)
        gradient = exact_gradient(problem, Course(SECONDS))
        for way, cost_of in ways:
            for words, step, raw in steps:
                start = time.process_time()
                found = fit_by_cost(cost_of(problem), step, raw)
                seconds = time.process_time() - start
                yield MethodFit(
                    pose,
                    f"{way}, {words}",
                    found.claims_success,
                    _near(found.x),
                    found.cost / exact.cost,
                    relative_error(found.start_gradient, gradient),
                    found.evaluations,
                    seconds,
                )


def _near(x: Array) -> str:
    near = near_start(np.exp(x)[None], np.ones_like(x), PERCENT)
    return f"{int(near.sum())} of {len(x)}"


def speeds() -> Iterator[Speed]:
    """One bootstrap fit, and one run of 1.5 s of a short and a long segment."""
    yield Speed("bootstrap fit at rest, L1-L4", _bootstrap_fit(), None, "30 ms")
    turn = np.array([0.0, 0.0, -7.5])
    for name, goal, chain in (
        ("L1-L4", "40 ms", chains.l1_l4_chain().with_loads(Load(2, moment=turn))),
        ("T12-S1", "100 ms", chains.t12_s1_chain().with_loads(Load(5, moment=turn))),
    ):
        ours = system(chain)
        program = Program.constant(ours.slots.loading(ours.case.steps[0].wrenches))
        built = opensim_peer.build(chain)
        yield Speed(
            f"run of 1.5 s, {name}",
            cpu_seconds(partial(settle, ours, program, SECONDS), 11).median,
            cpu_seconds(partial(opensim_peer.settle_of, built, SECONDS), 11).median,
            goal,
        )


def _bootstrap_fit() -> float:
    """Median CPU seconds of a fit from a sampled start, in the cohort's own joint poses."""
    settings, cohort = study_and_cohort(ROOT, STUDY)
    frames = specimen_inputs(ROOT, STUDY, SPECIMEN, cohort.digest).frames
    starts = [
        start for start, _ in bootstrap.sample_sets(settings, SPECIMEN, "start")[:BOOTSTRAP_FITS]
    ]
    seconds = [
        cpu_seconds(partial(fit, calibration_problem(ROOT, settings, SPECIMEN, frames, start)), 1)
        for start in starts
    ]
    return float(np.median([timed.median for timed in seconds]))

"""One joint under a pure moment: prints how far its equilibrium is from the closed form M/k.

It is fitted too, with regions, a spine that stands is tracked, and a trunk's muscles hold it
upright: what numba compiles for equilibria, fits, motions and muscles is then kept beside the code,
and no study waits for it (`make env` runs this file).
"""

from dataclasses import replace

import numpy as np

from spinepipe.calibration import Problem, fit
from spinepipe.effects import Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, MeasuredCase, ScopedEffect, SpineModel
from spinepipe.motion.objective import SHAPE, MotionObjective, sample_trial
from spinepipe.motion.points import marker_places
from spinepipe.motion.posture import postures
from spinepipe.motion.skeleton import BODIES as TRACKED
from spinepipe.motion.skeleton import MarkerSet, MarkerTrial, Masses, Skeleton
from spinepipe.motion.trajectory import solve
from spinepipe.muscles import pose
from spinepipe.muscles.masses import masses_of
from spinepipe.muscles.muscle_equilibrium import solve_task
from spinepipe.muscles.myo_sim import source_of_myo_sim
from spinepipe.muscles.passive_tissue import AXIAL_N_PER_M, CURVES, JointLaws, PassiveMuscle
from spinepipe.muscles.paths import Lines, Standoff
from spinepipe.muscles.person import Person
from spinepipe.muscles.scaling import DIAPHRAGM_M2
from spinepipe.muscles.subject import REFERENCE
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import BODIES, LEVELS
from spinepipe.muscles.upright import upright
from spinepipe.statics import System, follow, free_parameters
from spinepipe.world import Chain

MOMENT_NM = 7.5
STIFFER = 1.2
"""Times the joint's, where the fit starts."""

STIFFNESS = np.array([1e5, 1e6, 1e5, 50.0, 60.0, 70.0])
"""N/m and N m/rad."""


def relative_error() -> float:
    """Relative error of the extension angle under a moment about the joint's first axis.

    Or that of the stiffness fitted to this angle, if it is larger.
    """
    point = np.array([0.0, 0.03, 0.0])
    body = Body("L4", 0.1, point, np.eye(3) * 1e-5)
    bushing = ScopedEffect(create("linear_bushing"), (0,), STIFFNESS[None, :])
    frame = Pose(np.eye(3), np.zeros(3))
    weightless, damping = np.zeros(3), np.array([[1e3, 1e3, 1e3, 1.4, 1.4, 1.4]])
    model = SpineModel("doctor", ("L4L5",), (frame,), (body,), weightless, damping, (bushing,))
    wrench = Wrench(0, point, np.zeros(3), np.array([0.0, 0.0, MOMENT_NM]))
    case = LoadCase("extension", 1, (LoadStep(0, (wrench,)),))
    q = follow(System(Chain(model), model, case))[0].equilibrium.q
    expected = np.zeros(6)
    expected[3] = MOMENT_NM / STIFFNESS[3]
    solved = float(np.abs(q - expected).max() / expected[3])
    stiffer = replace(bushing, values=STIFFER * bushing.values)
    free = free_parameters(model, 0, ["extension_nm_per_rad"], "per_specimen")
    problem = Problem(
        replace(model, effects=(stiffer,)),
        (MeasuredCase(case, expected[None, None, :]),),
        *(free, np.ones(6), np.full(1, -1.0), np.full(1, 1.0)),
    )
    found = fit(problem, noise=np.full(6, 1e-3), profiled=True)
    return max(solved, float(np.abs(STIFFER * np.exp(found.x) - 1.0).max()))


def track_a_spine_that_stands() -> None:
    """Straight joints 30 mm apart, one marker on each body, which stay where they are."""
    bodies = len(TRACKED)
    steps = (Pose(np.eye(3), np.array([0.0, 0.03, 0.0])),) * (bodies - 1)
    masses = Masses(
        np.ones(bodies), np.zeros((bodies, 3)), np.tile(1e-3 * np.eye(3), (bodies, 1, 1))
    )
    empty = ("",) * bodies
    markers = MarkerSet(empty, np.arange(bodies), np.zeros((bodies, 3)), np.ones(bodies), empty)
    q = np.zeros((2, *SHAPE))
    places = marker_places(Skeleton(steps, masses), markers, q)
    trial = MarkerTrial(
        "", "", np.arange(2.0), places, np.ones(places.shape[:2], dtype=bool), "hanging"
    )
    seen = sample_trial(Skeleton(steps, masses), markers, trial, 1)
    postures(MotionObjective(loads=False), seen)
    solve(MotionObjective(force_cost="level_difference"), [seen], [seen.grid.through(q)])


def hold_a_trunk_upright() -> None:
    """The reference person stands, on joints of any shear stiffness."""
    trunk, unknown = source_of_myo_sim().trunk, np.zeros((len(BODIES), 3))
    axial = np.array([AXIAL_N_PER_M[level] for level in LEVELS])
    shear = np.full((len(LEVELS), 2), 1e6)
    laws = JointLaws(CURVES["mixed"], np.ones((len(LEVELS), 3)), axial, shear, True)
    chain, lines = pose.JointCentres.of(trunk, 0.004), Lines.of(trunk, Standoff())
    person = Person(
        *(REFERENCE, chain, lines, laws, PassiveMuscle(), masses_of(trunk, REFERENCE)),
        *(DIAPHRAGM_M2, unknown, *np.ones((2, len(trunk.muscles)))),
    )
    stood = upright(person, unknown[:, 0], np.radians(5.0))
    task = Task("standing", None, unknown, from_upright=True)
    solve_task(person.with_upright(stood.turned), task)


if __name__ == "__main__":
    track_a_spine_that_stands()
    hold_a_trunk_upright()
    print(relative_error())

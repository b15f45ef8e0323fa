"""One joint under a pure moment: prints how far its equilibrium is from the closed form M/k.

It is fitted too, with regions, and a trunk's muscles hold it upright: what numba compiles for
equilibria, fits and muscles is then kept beside the code, and no study waits for it (`make env`
runs this file).
"""

from dataclasses import replace

import numpy as np

from spinepipe.calibrate import Problem, fit
from spinepipe.effects import Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, MeasuredCase, ScopedEffect, SpineModel
from spinepipe.muscles.myo_sim import source_of_myo_sim
from spinepipe.muscles.regressions import packaged
from spinepipe.muscles.settle import held
from spinepipe.muscles.subject import REFERENCE
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import BODIES
from spinepipe.statics import System, follow, free_parameters
from spinepipe.studies.trunk_loads.persons import how_of, standing
from spinepipe.studies.trunk_loads.settings import TrunkLoads
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


def moment_left_over() -> float:
    """N m that the muscles of the reference person, standing, leave over."""
    settings = TrunkLoads(study="doctor", kind="trunk_loads", cohort="doctor")
    person = standing(settings, source_of_myo_sim().trunk, REFERENCE, packaged()).person
    task = Task("standing", None, np.zeros((len(BODIES), 3)), from_upright=True)
    found = held(person, task, how_of(settings)).found
    return float(np.abs(found.slack).max())


if __name__ == "__main__":
    print(max(relative_error(), moment_left_over()))

"""The phantom's true motion is OpenSim's: geometry, loads and truth give the same poses there.

Generator, peer and spinepipe share no mechanics; spinepipe is compared with the same motion too.

Catches a phantom whose motion is not that of its loads, or that is read wrongly.
"""

from functools import cache
from pathlib import Path

import numpy as np
from sweeps import sweep

from spinepipe.cohort import read
from spinepipe.cohort.specimen import joint_frames, load_cases, spine_model
from spinepipe.effects import create
from spinepipe.model import ScopedEffect
from spinepipe.statics import System, follow
from spinepipe.world import Chain as LoadedChain
from tests.generators.phantom import SEED, Phantom, phantom
from tests.reference.peers import opensim_peer as peer
from tests.reference.peers.chain import Array, Chain, Load

COHORT = Path(__file__).parents[2] / "config" / "cohorts" / "t12s1_phantom"
TESTS = ("flexion", "left_lateral_bending", "left_axial_rotation")
DAMPING = np.array([1000.0] * 3 + [2.3] * 3)

ROUND_OFF = 1e-12
"""m and rad. All solvers stop where the last step is 1e-12 or less and contract beyond it."""

SAMPLE = ((0, 0), (0, 5), (0, 10), (2, 10))
"""Cycle and step, both from 0: gravity alone, halfway, the peak, and the peak of another cycle."""


SOME = sweep("specimen, test", [(0, 0), (1, 2), (3, 1), (5, 2)])
"""Every step of every specimen and test is compared with spinepipe's below."""


@cache
def made(law: str = "linear") -> Phantom:
    return phantom(SEED, law=law)  # type: ignore[arg-type]


def chain(of: Phantom, specimen: int, stiffness: Array) -> Chain:
    bones = of.specimens[specimen]
    return Chain(
        origins=bones.origins,
        rotations=bones.rotations,
        masses=bones.masses,
        centres=bones.centres,
        inertias=bones.inertias,
        stiffness=stiffness,
        damping=np.tile(DAMPING, (6, 1)),
    )


def top_moment(of: Phantom, *state: int) -> Load:
    return Load(5, moment=of.moments[state])


@SOME
def test_opensim_finds_the_same_poses(specimen: int, test: int) -> None:
    of = made()
    unloaded = chain(of, specimen, of.stiffness[specimen])
    for cycle, step in SAMPLE:
        state = (specimen, test, cycle, step)
        expected = peer.equilibrium(unloaded.with_loads(top_moment(of, *state)))
        np.testing.assert_allclose(of.motion[state], expected, rtol=0, atol=ROUND_OFF)


def secant_stiffness(stiffness: Array, q: Array) -> Array:
    """(J, 6) load over coordinate of the stiffening law at q, written out for each rotation."""
    e, b, r = (q[:, 3:] / np.deg2rad([4.0, 4.0, 2.0])).T
    ke, kb, kr = stiffness[:, 3:].T
    secant = stiffness.copy()
    secant[:, 3] = ke * (1 + e**2) + 0.5 * np.sqrt(ke * kb) * b**2 + np.sqrt(ke * kr) / 4 * r**2
    secant[:, 4] = kb * (1 + b**2) + 0.5 * np.sqrt(kb * ke) * e**2 + np.sqrt(kb * kr) / 4 * r**2
    secant[:, 5] = kr * (1 + r**2) + np.sqrt(kr * ke) * e**2 + np.sqrt(kr * kb) * b**2
    return secant


@SOME
def test_opensim_agrees_on_the_stiffening_law(specimen: int, test: int) -> None:
    """Linear springs as stiff as the law is at the phantom's pose have that pose's equilibrium."""
    of = made("stiffening")
    state = (specimen, test, 1, 10)
    secant = secant_stiffness(of.stiffness[specimen], of.motion[state])
    springs = chain(of, specimen, secant).with_loads(top_moment(of, *state))
    np.testing.assert_allclose(of.motion[state], peer.equilibrium(springs), rtol=0, atol=ROUND_OFF)
    assert (secant[:, 3 + test] > 1.15 * of.stiffness[specimen, :, 3 + test]).all()


@sweep("specimen", range(6))
def test_spinepipe_finds_the_same_poses_from_the_files(specimen: int) -> None:
    """Every step of every cycle, with frames, loads and masses as spinepipe reads them."""
    cohort, of = read(COHORT), made()
    name = cohort.specimen_names[specimen]
    bushing = ScopedEffect(create("linear_bushing"), tuple(range(6)), of.stiffness[specimen])
    model = spine_model(cohort, name, joint_frames(cohort, name), (bushing,), DAMPING)
    cases = load_cases(cohort, name, cohort.tests, np.zeros(3))
    assert [(case.test, case.cycle) for case in cases] == [(t, c) for t in TESTS for c in (1, 2, 3)]
    loaded, expected = LoadedChain(model), of.motion[specimen].reshape(9, 11, 6, 6)
    for case, poses in zip(cases, expected, strict=True):
        solved = follow(System(loaded, model, case))
        assert all(step.usable for step in solved)
        found = np.stack([step.equilibrium.q.reshape(6, 6) for step in solved])
        np.testing.assert_allclose(found, poses, rtol=0, atol=ROUND_OFF)

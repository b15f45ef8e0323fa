"""Spines held in place: against a planar chain written down on its own, virtual work, mirrors.

Catches spines held in place that move, or whose holding loads are wrong.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest
from example_effects import scoped, spine
from scipy.optimize import minimize, root
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import Body, ScopedEffect, SpineModel
from spinepipe.statics.motion import ChainMotion
from spinepipe.statics.prescribed import PrescribedResult, hold_at
from spinepipe.statics.prescribed_chain import (
    NewtonTrial,
    PrescribedChain,
    PrescribedPlace,
    Prescription,
    Tilt,
    newton_steps,
)
from spinepipe.status import PrescribedStatus
from spinepipe.units import COORDINATES
from spinepipe.world import Chain

UP, RIGHT = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
BENDING = COORDINATES.index("right_bending")
COUNT = 7
JOINTS = np.array([[12.0 * np.sin(0.7 * j), 30.0 * j] for j in range(COUNT)]) / 1e3
"""(J, 2) to the right and up, m: a curved chain."""
TOP = np.array([0.008, 0.03 * COUNT])
LEAST = 1e-4
"""N m/rad, the least that a bushing may have in bending; the law carries the rest."""

STRETCH = np.linspace(4.0, 9.0, COUNT)
LOWER, UPPER = np.linspace(-0.12, -0.2, COUNT), np.linspace(0.22, 0.1, COUNT)


def model(mirrored: bool = False, aside: float = 1.0) -> SpineModel:
    """The chain, upright joint frames, springs in the other rotations and the law in bending.

    Parameters
    ----------
    aside : how stiff it is out of its plane.
    """
    side = -1.0 if mirrored else 1.0
    frames = tuple(Pose(np.eye(3), np.array([0.0, y, side * z])) for z, y in JOINTS)
    bodies = tuple(
        Body(f"v{j}", 1.0, frames[j].origin, np.diag([3e-4, 4e-4, 5e-4])) for j in range(COUNT)
    )
    springs = np.tile([1e5, 1e5, 1e5, 600.0 * aside, LEAST, 900.0 * aside], (COUNT, 1))
    ends = np.stack([-UPPER, -LOWER] if mirrored else [LOWER, UPPER], axis=1)
    law = np.column_stack([STRETCH, ends])
    joints = tuple(range(COUNT))
    return SpineModel(
        "planar",
        tuple(f"v{j}v{j - 1}" for j in range(COUNT)),
        frames,
        bodies,
        np.zeros(3),
        np.ones((COUNT, 6)),
        (
            ScopedEffect(create("linear_bushing", {}), joints, springs),
            ScopedEffect(create("bounded_tangent", {}), joints, law),
        ),
    )


def grips(side: float = 1.0) -> tuple[Prescription, ...]:
    point = np.array([0.0, TOP[1], side * TOP[0]])
    top = COUNT - 1
    return (
        PrescribedPlace(top, point, RIGHT),
        PrescribedPlace(top, point, UP),
        Tilt(top, UP, UP, RIGHT),
    )


def rotations(n: int = COUNT) -> Array:
    """Free: the three rotations of every joint."""
    return np.tile([False] * 3 + [True] * 3, n)


def chain(made: SpineModel, side: float = 1.0) -> PrescribedChain:
    return PrescribedChain(made, grips(side), rotations())


def held(wanted: Array, mirrored: bool = False) -> PrescribedResult:
    return hold_at(chain(model(mirrored), -1.0 if mirrored else 1.0), wanted)


class Planar:
    """The same chain in its plane, written down anew: angles, energy, place of its top."""

    def top(self, q: Array) -> Array:
        """(3,) to the right, up, tilt to the right."""
        points = np.vstack([JOINTS, TOP])
        at, turned = points[0].copy(), 0.0
        for link, angle in zip(np.diff(points, axis=0), q, strict=True):
            turned += angle
            c, s = np.cos(turned), np.sin(turned)
            at += [c * link[0] + s * link[1], c * link[1] - s * link[0]]
        return np.array([*at, turned])

    @cached_property
    def shape(self) -> tuple[Array, Array]:
        b = np.pi / (UPPER - LOWER)
        return b, -0.5 * b * (UPPER + LOWER)

    def energy(self, q: Array) -> float:
        """N m: the integral of A (tan(B q + C) - tan C) from zero."""
        b, c = self.shape
        stored = STRETCH * (np.log(np.cos(c) / np.cos(b * q + c)) / b - np.tan(c) * q)
        return float(np.sum(stored + 0.5 * LEAST * q**2))

    def moments(self, q: Array) -> Array:
        b, c = self.shape
        found: Array = STRETCH * (np.tan(b * q + c) - np.tan(c)) + LEAST * q
        return found

    def slopes(self, q: Array) -> Array:
        """(3, J) derivative of the top: a joint turns what lies beyond about itself."""
        points = np.vstack([JOINTS, TOP])
        placed, turned = [points[0]], 0.0
        for link, angle in zip(np.diff(points, axis=0), q, strict=True):
            turned += angle
            c, s = np.cos(turned), np.sin(turned)
            placed.append(placed[-1] + [c * link[0] + s * link[1], c * link[1] - s * link[0]])
        lever = placed[-1] - np.array(placed[:-1])
        return np.stack([lever[:, 1], -lever[:, 0], np.ones(COUNT)])

    def held(self, wanted: Array) -> tuple[Array, Array]:
        """Angles (J,) and pushes (3,) of least energy, by scipy's solver of equations."""

        rest, x = self.top(np.zeros(COUNT)), np.zeros(COUNT + 3)
        for share in np.linspace(0.1, 1.0, 10):
            goal = rest + share * (wanted - rest)
            found = root(self._equations, x, args=(goal,), tol=1e-14)
            x = found.x
        assert np.abs(found.fun).max() < 1e-9
        return x[:COUNT], x[COUNT:]

    def _equations(self, x: Array, goal: Array) -> Array:
        q, pushes = x[:COUNT], x[COUNT:]
        missing = self.moments(q) - self.slopes(q).T @ pushes
        return np.concatenate([missing, 1e3 * (self.top(q) - goal)])


def bent_by(share: float) -> Array:
    """What a pose well inside the ends has, so that it can be had."""
    return Planar().top(share * np.where(np.arange(COUNT) % 3 == 1, LOWER, UPPER))


@sweep("share", [0.1, 0.5, 0.8, -0.3])
def test_a_planar_chain_stands_where_its_energy_is_least(share: float) -> None:
    wanted = bent_by(share)
    found = held(wanted)
    assert found.status is PrescribedStatus.CONVERGED
    angles, pushes = Planar().held(wanted)
    np.testing.assert_allclose(found.q.reshape(-1, 6)[:, BENDING], angles, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.pushes, pushes, rtol=1e-7, atol=1e-7)
    others = np.delete(found.q.reshape(-1, 6), BENDING, axis=1)
    assert np.abs(others).max() < 1e-12
    assert np.abs(found.missed).max() < 1e-12


def test_from_its_own_end_nothing_is_left_to_do() -> None:
    """Newton has arrived at its first step; and is near it from a pose near by."""
    own, wanted = chain(model()), bent_by(0.5)
    there = hold_at(own, wanted)
    again = hold_at(own, wanted, there)
    near = hold_at(own, wanted + 1e-5, there)
    assert (again.status, again.iterations) == (PrescribedStatus.CONVERGED, 1)
    np.testing.assert_allclose(again.q, there.q, rtol=0, atol=1e-12)
    assert near.iterations < min(there.iterations, 5)


@sweep("axis", range(3))
def test_the_pushes_do_the_work_that_the_spine_stores(axis: int) -> None:
    """Castigliano: the stored energy grows by push times displacement."""
    wanted, step = bent_by(0.5), 1e-6 * np.eye(3)[axis]
    energies = [
        Planar().energy(held(wanted + sign * step).q.reshape(-1, 6)[:, BENDING])
        for sign in (1.0, -1.0)
    ]
    work = (energies[0] - energies[1]) / 2e-6
    assert held(wanted).pushes[axis] == pytest.approx(work, rel=1e-6, abs=1e-6)


def test_a_mirrored_spine_stands_mirrored() -> None:
    wanted = bent_by(0.6)
    side = np.array([-1.0, 1.0, -1.0])
    one, other = held(wanted), held(side * wanted, mirrored=True)
    angles = one.q.reshape(-1, 6)[:, BENDING], other.q.reshape(-1, 6)[:, BENDING]
    np.testing.assert_allclose(angles[1], -angles[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(other.pushes, side * one.pushes, rtol=1e-9, atol=1e-9)


def test_stretching_all_laws_moves_nothing() -> None:
    """With the top prescribed, only ratios of the stiffness decide where the rest stands."""
    wanted, plain = bent_by(0.6), model()
    bushing, law = plain.effects
    values, springs = law.values.copy(), bushing.values.copy()
    values[:, 0] *= 10.0
    springs[:, 3:] *= 10.0
    stiffer = plain.with_effects((bushing.with_values(springs), law.with_values(values)))
    found, before = hold_at(chain(stiffer), wanted), held(wanted)
    np.testing.assert_allclose(found.q, before.q, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.pushes, 10.0 * before.pushes, rtol=1e-6)


def test_a_chain_that_cannot_reach_misses_by_least() -> None:
    """Its top is wanted far above the highest place that it can have."""
    planar, unit = Planar(), np.array([1e-3, 1e-3, np.deg2rad(1.0)])
    wanted = planar.top(np.zeros(COUNT)) + np.array([0.0, 0.1, 0.0])
    found = held(wanted)
    assert found.status is PrescribedStatus.UNREACHABLE
    q = found.q.reshape(-1, 6)[:, BENDING]
    missed = wanted - planar.top(q)
    np.testing.assert_allclose(found.missed, missed, rtol=0, atol=1e-12)
    assert missed[1] > 0.08
    best = minimize(
        lambda x: float(np.sum(((wanted - planar.top(x)) / unit) ** 2)),
        0.5 * (LOWER + UPPER),
        bounds=list(zip(LOWER, UPPER, strict=True)),
        options={"ftol": 1e-15, "gtol": 1e-10},
    )
    assert np.sum((missed / unit) ** 2) == pytest.approx(best.fun, rel=1e-3)


def test_a_chain_that_buckles_out_of_its_plane_is_unstable() -> None:
    """Pushed down by more than a column of such springs carries, with its top free to swerve."""
    found = hold_at(chain(model(aside=0.05)), bent_by(0.8))
    assert found.status is PrescribedStatus.UNSTABLE
    assert "buckles" in found.message
    assert found.missed.any()


PRESCRIBED: tuple[Prescription, ...] = (
    PrescribedPlace(2, np.array([0.02, 0.12, -0.01]), np.array([0.6, 0.0, 0.8])),
    Tilt(2, np.array([0.2, 0.9, -0.1]), UP, RIGHT),
    Tilt(1, np.array([-0.3, 0.7, 0.4]), UP, RIGHT),
)


@pytest.mark.parametrize("prescription", PRESCRIBED)
def test_slopes_and_bends_are_those_of_the_value(prescription: Prescription) -> None:
    """Also PyBullet's, which knows nothing of twists."""
    plain, rng = spine(3, gravity=False), np.random.default_rng(3)
    own = PrescribedChain(plain, (prescription,), np.ones(18, dtype=bool))
    q, push = np.tile([2e-3] * 3 + [0.2] * 3, 3) * rng.normal(size=18), 300.0

    def matrix(at: Array, pushed: float) -> Array:
        (found,) = newton_steps([NewtonTrial(own, at, np.array([pushed]), np.zeros(1), 0.0)])
        assert found is not None
        return found.matrix

    slope = matrix(q, push)[18, :18]
    bend = (matrix(q, 0.0) - matrix(q, push))[:18, :18] / push
    for k in range(18):
        step = 1e-6 * np.eye(18)[k]
        by_value = (own.reached(q + step) - own.reached(q - step))[0] / 2e-6
        by_slope = (matrix(q + step, push) - matrix(q - step, push))[18, :18] / 2e-6
        assert slope[k] == pytest.approx(by_value, abs=1e-8)
        np.testing.assert_allclose(bend[:, k], by_slope, rtol=0, atol=1e-8)
    motion = ChainMotion(Chain(plain), q)
    if isinstance(prescription, PrescribedPlace):
        by_bullet = motion.velocities(prescription.body, prescription.point)
        np.testing.assert_allclose(slope, by_bullet @ prescription.direction, rtol=0, atol=1e-12)


def test_steps_that_stand_together_are_those_of_each_alone() -> None:
    """Chains of other frames, laws and grips; one beyond the ends of its law, one singular."""
    rng, wanted = np.random.default_rng(5), bent_by(0.4)
    chains = [chain(model()), chain(model(mirrored=True), -1.0), chain(model(aside=2.0))]
    place = grips()[0]
    assert isinstance(place, PrescribedPlace)
    nothing = (replace(place, direction=np.zeros(3)), *grips()[1:])  # asks for what no push moves
    poses = [0.01 * rng.normal(size=6 * COUNT) * rotations() for _ in range(4)]
    poses[1] += np.where(np.arange(6 * COUNT) % 6 == BENDING, 1.0, 0.0)
    pushes = rng.normal(size=(4, 3))
    trials = [
        NewtonTrial(one, q, push, wanted, 0.1 * number)
        for number, (one, q, push) in enumerate(zip(chains, poses, pushes, strict=False))
    ]
    together = newton_steps(trials)
    assert [one is None for one in together] == [False, True, False]
    for one, trial in zip(together, trials, strict=True):
        alone = newton_steps([trial])[0]
        assert (one is None) == (alone is None)
        if one is not None and alone is not None:
            np.testing.assert_allclose(one.step, alone.step, rtol=1e-9, atol=1e-12)
    singular = PrescribedChain(model(), nothing, rotations())
    none, one = newton_steps([NewtonTrial(singular, poses[3], pushes[3], wanted, 0.0), trials[0]])
    assert none is not None
    assert np.isnan(none.step).all()
    assert one is not None
    assert np.isfinite(one.step).all()


def test_effects_other_than_joint_laws_are_refused() -> None:
    moved = spine(3, effects=(scoped(create("joint_centre_offset", {}), (1,)),))
    with pytest.raises(ValueError, match="joint laws alone"):
        PrescribedChain(moved, PRESCRIBED, rotations(3))


def test_answers_are_the_derivatives_of_the_pose() -> None:
    """A change of the law's stretch at one joint, against solving again."""
    wanted, plain = bent_by(0.5), model()
    own = chain(plain)
    found = hold_at(own, wanted)
    assert found.answers is not None
    law = plain.effects[1]
    at = found.q.reshape(-1, 6)
    by_stretch = law.effect.by_parameter(at, law.values, np.zeros_like(at))[:, :, 0]
    changes = np.zeros((6 * COUNT, COUNT))
    for joint in range(COUNT):
        changes[6 * joint : 6 * joint + 6, joint] = by_stretch[joint]
    dq, dpushes = found.answers.to(changes)
    for joint in (0, 3):
        ends = []
        for sign in (1.0, -1.0):
            values = law.values.copy()
            values[joint, 0] += sign * 1e-4
            ends.append(hold_at(own.with_values((own.values[0], values)), wanted))
        by_q = (ends[0].q - ends[1].q) / 2e-4
        by_pushes = (ends[0].pushes - ends[1].pushes) / 2e-4
        np.testing.assert_allclose(dq[:, joint], by_q, rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(dpushes[:, joint], by_pushes, rtol=1e-5, atol=1e-6)


def test_answers_to_other_places_are_the_derivatives_of_the_pose() -> None:
    """Each prescription moved a little, against solving again."""
    wanted, plain = bent_by(0.5), model()
    own = chain(plain)
    found = hold_at(own, wanted)
    assert found.answers is not None
    moved = np.eye(len(wanted))
    dq, dpushes = found.answers.to(np.zeros((6 * COUNT, len(wanted))), moved)
    for number, step in enumerate(1e-6 * moved):
        ends = [hold_at(own, wanted + s * step) for s in (1.0, -1.0)]
        by_q = (ends[0].q - ends[1].q) / 2e-6
        by_pushes = (ends[0].pushes - ends[1].pushes) / 2e-6
        np.testing.assert_allclose(dq[:, number], by_q, rtol=1e-4, atol=1e-6)
        largest = float(np.abs(by_pushes).max())
        np.testing.assert_allclose(dpushes[:, number], by_pushes, rtol=1e-4, atol=1e-5 * largest)

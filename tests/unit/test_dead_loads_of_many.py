"""Dead loads of many tests at once are those of each alone, and slopes are differences.

Catches loads of one test that act in another, and a wrong tangent of dead loads.
"""

from typing import Any

import numpy as np
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.effects.contract import Neutral
from spinepipe.effects.dead_load import DeadLoad, Wrenches

TESTS, JOINTS = 4, 3
SCOPE = np.arange(JOINTS)
FIELDS = ("bodies", "points", "forces", "moments")

LOADS: list[tuple[str, dict[str, Any]]] = [
    ("load_gain", {}),
    ("load_misalignment", {"turns": "moments"}),
    ("load_misalignment", {"turns": "wrench"}),
    ("load_misalignment", {"turns": "forces"}),
    ("load_offset", {}),
    ("load_offset", {"applies": "force"}),
    ("load_offset", {"coordinate": "right"}),
    ("segment_weight", {"where": "each"}),
    ("segment_weight", {"where": "top"}),
]
EVERY = sweep("name, options", LOADS, str)


def of(name: str, options: dict[str, Any]) -> DeadLoad:
    effect = create(name, options)
    assert isinstance(effect, DeadLoad)
    return effect


def listed() -> Wrenches:
    """Two wrenches a test, whose moments are largest about another axis in each."""
    rng = np.random.default_rng(20041)
    points, forces, moments = rng.normal(size=(3, TESTS, 2, 3))
    moments[np.arange(TESTS), 0, np.arange(TESTS) % 3] += 20.0
    return Wrenches(rng.integers(0, JOINTS, (TESTS, 2)), points, forces, moments)


def neutral() -> Neutral:
    """Chains of their own; the first vertebra of each has no stated mass."""
    rng = np.random.default_rng(20042)
    rotations = np.linalg.qr(rng.normal(size=(TESTS, JOINTS, 3, 3)))[0]
    centres = rng.normal(size=(TESTS, JOINTS, 3))
    centres[:, 0] = 0.0
    return Neutral(rotations, rng.normal(size=(TESTS, JOINTS, 3)), centres)


def parameters(effect: Any) -> np.ndarray:
    size = np.array([one.default for one in effect.parameters])
    return size * np.random.default_rng(20043).uniform(0.5, 2.0, (TESTS, len(size)))


def one_of(wrenches: Wrenches, test: int) -> Wrenches:
    return Wrenches(*(getattr(wrenches, name)[test] for name in FIELDS))


def one_chain(chains: Neutral, test: int) -> Neutral:
    return Neutral(chains.rotations[test], chains.origins[test], chains.centres_of_mass[test])


@EVERY
def test_many_at_once_are_each_alone(name: str, options: dict[str, Any]) -> None:
    effect = of(name, options)
    given, chains, values = listed(), neutral(), parameters(effect)
    found = effect.wrenches(given, chains, SCOPE, values)
    slopes = effect.slopes(given, chains, SCOPE, values)
    for test in range(TESTS):
        here = (one_of(given, test), one_chain(chains, test), SCOPE, values[test])
        alone, by_value = effect.wrenches(*here), effect.slopes(*here)
        for field in FIELDS:
            there = np.broadcast_to(getattr(alone, field), getattr(found, field)[test].shape)
            np.testing.assert_allclose(getattr(found, field)[test], there, atol=1e-14)
        for field in ("forces", "moments"):
            there = np.broadcast_to(
                getattr(by_value, field), np.shape(getattr(slopes, field)[test])
            )
            np.testing.assert_allclose(getattr(slopes, field)[test], there, atol=1e-14)


@EVERY
def test_slopes_are_differences(name: str, options: dict[str, Any]) -> None:
    effect = of(name, options)
    given, chains, values = listed(), neutral(), parameters(effect)
    slopes, small = effect.slopes(given, chains, SCOPE, values), 1e-6
    for column in range(values.shape[1]):
        step = small * (np.arange(values.shape[1]) == column)
        up, down = (effect.wrenches(given, chains, SCOPE, values + s * step) for s in (1, -1))
        for field in ("forces", "moments"):
            apart = (getattr(up, field) - getattr(down, field)) / (2.0 * small)
            np.testing.assert_allclose(getattr(slopes, field)[..., column], apart, atol=1e-7)

"""How a person stands: what vertebrae lack, found a second way, and no better posture nearby."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from trunk_person import made_up, volunteer

from spinepipe.muscles import upright as module
from spinepipe.muscles.applied_loads import applied_loads
from spinepipe.muscles.passive_tissue import JointLaws
from spinepipe.muscles.person import Person
from spinepipe.muscles.pose import BodyPoses, place_bodies, rotations_of
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import BODIES, LEVELS, Mass
from spinepipe.muscles.upright import Upright, moment_deficit, upright

G = 9.81
REACH = np.deg2rad(5.0)
START = np.zeros(len(BODIES))
PERSONS = pytest.mark.parametrize("make", [made_up, volunteer], ids=["made up", "volunteer"])


def pressed(person: Person, angles: np.ndarray) -> tuple[BodyPoses, np.ndarray, Task]:
    """Bodies where the weight has moved them, and the compression of every joint.

    In three dimensions, by rounds: moves do not turn anything, so that two rounds are enough.
    """
    standing = Task("standing", None, np.outer(angles, [1.0, 0.0, 0.0]), from_upright=False)
    rotations = rotations_of(person.chain, standing.turned)
    pushes = np.zeros((len(LEVELS), 3))
    for _ in range(2):
        poses = place_bodies(person.chain, rotations, person.laws.translations(pushes))
        loads = applied_loads(person, standing, poses)
        for level in range(len(LEVELS)):
            above = loads.bodies > level
            pushes[level] = poses.discs[level].T @ loads.pushes[above].sum(axis=0)
    return poses, -pushes[:, 1], standing


def by_free_bodies(person: Person, angles: np.ndarray) -> np.ndarray:
    """(7,) N m about z: each vertebra by itself, about the joint below it.

    On it act what it carries, the weight of all above at the joint above, and both its joints;
    what this lacks to nought has to come from muscles.
    """
    poses, compression, standing = pressed(person, angles)
    loads = applied_loads(person, standing, poses)
    joints = person.laws.moments(poses.turned, compression)
    found = np.zeros(len(LEVELS))
    for level in range(len(LEVELS)):
        body, centre = level + 1, poses.centres[level]
        own = loads.bodies == body
        total = np.cross(loads.at[own] - centre, loads.pushes[own]).sum(axis=0)
        total += poses.discs[level] @ joints[level]
        if body < len(LEVELS):
            weight = loads.pushes[loads.bodies > body].sum(axis=0)
            total += np.cross(poses.centres[body] - centre, weight)
            total -= poses.discs[body] @ joints[body]
        found[level] = -total[2]
    return found


def found(person: Person, reach: float = REACH) -> Upright:
    return upright(person, START, reach)


@PERSONS
@pytest.mark.parametrize("seed", range(4))
def test_what_vertebrae_lack_is_that_of_free_bodies_in_space(make, seed: int) -> None:
    person = make()
    angles = np.random.default_rng(seed).uniform(-0.2, 0.2, len(BODIES))
    expected = by_free_bodies(person, angles)
    assert np.abs(expected).max() > 1.0
    # Sums of some forty moments of tens of N m.
    np.testing.assert_allclose(moment_deficit(person, angles), expected, rtol=0.0, atol=1e-11)


def test_many_postures_at_once_lack_what_each_lacks() -> None:
    person = volunteer()
    angles = np.random.default_rng(5).uniform(-0.1, 0.1, (6, len(BODIES)))
    each = np.array([moment_deficit(person, one) for one in angles])
    np.testing.assert_allclose(moment_deficit(person, angles), each, rtol=0.0, atol=1e-12)


def column(ahead_m: float) -> Person:
    """Nobody but 10 kg on T11, so far ahead of the joint T11T12; joints give no way."""
    person = made_up()
    rigid = JointLaws(
        person.laws.curves,
        person.laws.angular,
        np.full(len(LEVELS), 1e15),
        np.full((len(LEVELS), 2), 1e15),
        stiffens=False,
    )
    at = person.chain.centres[-1] + np.array([ahead_m, 0.2, 0.0])
    nobody = Subject("male", 40.0, 1.73, 1e-12)
    return replace(person, subject=nobody, laws=rigid, masses=(Mass("weight", 7, 10.0, at),))


def test_a_weight_ahead_has_to_be_held_from_behind() -> None:
    """Extension is positive. Each vertebra below lacks the weight times the step of the joints."""
    person = column(0.05)
    steps = np.diff(person.chain.centres[:, 0])
    expected = 10.0 * G * np.append(steps, 0.05)
    np.testing.assert_allclose(moment_deficit(person, START), expected, rtol=0.0, atol=1e-9)


@PERSONS
def test_no_posture_within_reach_asks_less(make) -> None:
    person = make()
    stands = found(person)
    least = np.abs(stands.after).sum()
    rng = np.random.default_rng(6)
    for size in (1e-4, 1e-3, 1e-2, 0.1):
        others = stands.angles + size * rng.normal(size=(20_000, len(BODIES)))
        others = np.clip(others, START - REACH, START + REACH)
        # The search ends where a programme gains less than a millionth of a newton metre.
        assert np.abs(moment_deficit(person, others)).sum(axis=1).min() > least - 2e-6


@PERSONS
def test_what_is_told_is_of_the_start_and_of_the_posture(make) -> None:
    person = make()
    stands = found(person)
    np.testing.assert_allclose(stands.before, moment_deficit(person, START), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(
        stands.after, moment_deficit(person, stands.angles), rtol=0.0, atol=1e-13
    )
    assert np.abs(stands.after).sum() < 0.9 * np.abs(stands.before).sum()
    assert np.abs(stands.angles).max() <= REACH + 1e-12
    at_bound = np.isclose(np.abs(stands.angles), REACH, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(stands.at_bound, at_bound)
    np.testing.assert_array_equal(stands.turned, np.outer(stands.angles, [1.0, 0.0, 0.0]))


def test_more_reach_never_asks_more() -> None:
    person = volunteer()
    sums = [np.abs(found(person, np.deg2rad(reach)).after).sum() for reach in (1.0, 3.0, 5.0, 8.0)]
    assert np.all(np.diff(sums) < 1e-6)
    assert sums[-1] < sums[0] - 0.1


def test_without_reach_a_person_stands_as_the_source() -> None:
    stands = found(volunteer(), 0.0)
    np.testing.assert_allclose(stands.angles, START, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(stands.after, stands.before, rtol=0.0, atol=1e-9)


def begun(monkeypatch: pytest.MonkeyPatch, sums: dict[int, float]) -> tuple[Any, np.ndarray]:
    """Where the search for the upright posture began; hollows lack 100 N m but for some."""
    begins: list[np.ndarray] = []

    def descended(person: Any, start: Any, reach: float, first: np.ndarray) -> Any:
        lacking = np.zeros(len(LEVELS))
        lacking[0] = -sums.get(len(begins), 100.0)
        begins.append(first)
        return np.full(len(BODIES), 0.01 * len(begins)), lacking

    monkeypatch.setattr(module, "_descend", descended)
    monkeypatch.setattr(module, "moment_deficit", lambda person, angles: np.zeros(len(LEVELS)))
    start = np.linspace(-0.1, 0.1, len(BODIES))
    nobody: Any = None
    return upright(nobody, start, 0.08), np.array(begins) - start


def test_the_search_begins_at_the_start_and_at_eleven_places_within_reach(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, away = begun(monkeypatch, {})
    assert away.shape == (12, len(BODIES))
    assert not away[0].any()
    assert np.abs(away).max() <= 0.08
    # drawn evenly: 88 draws have a mean within four SDs of nought, and come near both ends
    assert abs(away[1:].mean()) < 4.0 * 0.08 / np.sqrt(3.0 * 88)
    assert away.min() < -0.07
    assert away.max() > 0.07
    np.testing.assert_array_equal(begun(monkeypatch, {})[1], away)


@pytest.mark.parametrize(
    ("sums", "chosen"),
    [
        ({7: 3.0}, 7),
        ({0: 3.0, 7: 2.9996}, 0),  # the same to a thousandth of a N m: the earlier one
        ({0: 3.0, 7: 2.998}, 7),
        ({}, 0),
    ],
)
def test_the_lowest_hollow_counts_and_of_equal_ones_the_earlier(
    sums: dict[int, float], chosen: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = begun(monkeypatch, sums)
    np.testing.assert_allclose(found.angles, 0.01 * (chosen + 1))
    assert np.abs(found.after).sum() == sums.get(chosen, 100.0)


def test_who_stands_at_the_end_of_the_range_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Angles of 0.01 from a start of -0.1 to 0.1: 0.11 to -0.09 away, of 0.08 that are allowed."""
    found, _ = begun(monkeypatch, {0: 0.0})
    away = 0.01 - np.linspace(-0.1, 0.1, len(BODIES))
    np.testing.assert_array_equal(found.at_bound, np.abs(away) > 0.08)
    assert found.at_bound.any()
    assert not found.at_bound.all()

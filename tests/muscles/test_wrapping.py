"""Fascicles as strings: tight over bars, their lever arms the slopes of their length."""

import numpy as np
import pytest
from scipy.optimize import minimize
from trunk_person import held_task, tasks, volunteer

from spinepipe.muscles.muscle_equilibrium import angles_of
from spinepipe.muscles.pose import BodyPoses, place_bodies, rotation_of_vector, rotations_of
from spinepipe.muscles.trunk import LEVELS
from spinepipe.muscles.wrapping import wrap_paths

NO_MOVES = np.zeros((len(LEVELS), 3))


def string(ends: np.ndarray, bars: np.ndarray, along: np.ndarray, behind: np.ndarray) -> tuple:
    """Length and touched bars of one string from the first end to the second."""
    count = len(bars)
    found = wrap_paths(
        ends[None],
        np.array([[0, 1]]),
        np.array([0, count]),
        np.zeros(count, dtype=np.int64),
        np.zeros(count, dtype=np.int64),
        bars,
        along,
        behind,
        2,
    )
    return float(found[0][0]), int(found[3][0])


def shortest(ends: np.ndarray, bars: np.ndarray, along: np.ndarray, behind: np.ndarray) -> float:
    """Length of the shortest string that passes every bar behind it or on it.

    Where it passes a bar it may be anywhere along it and at or behind it: a convex problem.
    """
    count = len(bars)

    def length(x: np.ndarray) -> float:
        passing = bars + x[:count, None] * along + x[count:, None] * behind
        points = np.vstack([ends[:1], passing, ends[1:]])
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())

    limits = [(None, None)] * count + [(0.0, None)] * count
    options = {"ftol": 1e-16, "gtol": 1e-10, "maxiter": 10_000, "maxfun": 100_000}
    start = np.full(2 * count, 0.01)
    found = minimize(length, start, method="L-BFGS-B", bounds=limits, options=options)
    return float(found.fun)


def back_to_back(seed: int) -> tuple[np.ndarray, ...]:
    """A string up a bent back of three vertebrae whose bars lean each their own way."""
    rng = np.random.default_rng(seed)
    heights = np.array([0.1, 0.2, 0.3])
    bars = np.stack([-0.02 * np.sin(heights / 0.4 * np.pi), heights, np.zeros(3)], axis=1)
    bars[:, 0] += rng.uniform(-0.004, 0.004, 3)
    turns = [rotation_of_vector(rng.uniform(-0.15, 0.15, 3)) for _ in bars]
    along = np.array([turn[:, 2] for turn in turns])
    behind = np.array([-turn[:, 0] for turn in turns])
    ends = np.array([[0.0, 0.0, 0.03], [0.0, 0.4, 0.05]])
    return ends, bars, along, behind


@pytest.mark.parametrize("seed", range(12))
def test_a_string_is_as_long_as_the_shortest_behind_all_bars(seed: int) -> None:
    given = back_to_back(seed)
    length, touched = string(*given)
    assert length == pytest.approx(shortest(*given), abs=1e-8)
    assert touched >= 1


def test_a_string_in_front_of_no_bar_runs_straight() -> None:
    ends, bars, along, behind = back_to_back(0)
    length, touched = string(ends, bars + np.array([0.1, 0.0, 0.0]), along, behind)
    assert (length, touched) == (pytest.approx(np.linalg.norm(ends[1] - ends[0]), abs=1e-15), 0)


def at_flexion(degrees: float) -> BodyPoses:
    """The volunteer bent so far forwards, all bodies alike."""
    person = volunteer()
    share = degrees / 100.0
    angles = person.upright + share * tasks()["forward_100"].turned
    return place_bodies(person.chain, rotations_of(person.chain, angles), NO_MOVES)


def test_lengths_do_not_jump_while_the_trunk_bends() -> None:
    """In steps of 0.1 deg lengths change by 0.1 mm. What that changes by from step to step is a
    twentieth of a micrometre, however many vertebrae are touched on the way: a lever arm that
    jumped by 0.2 mm would show as 0.2 mm times 1.7e-3 rad."""
    lines = volunteer().lines
    sweep = np.array([lines.pulls(at_flexion(0.1 * k)).lengths for k in range(1001)])
    assert np.abs(np.diff(sweep, axis=0)).max() < 0.2e-3
    assert np.abs(np.diff(sweep, 2, axis=0)).max() < 2e-7
    wraps = lines.trunk.muscles.wraps
    first, last = lines.pulls(at_flexion(0.0)), lines.pulls(at_flexion(100.0))
    assert last.contacts[wraps].sum() > first.contacts[wraps].sum()


def any_posture(seed: int) -> BodyPoses:
    """Every body turned by up to 9 deg about each axis against the one below."""
    person = volunteer()
    drawn = np.random.default_rng(seed).uniform(-9.0, 9.0, (len(LEVELS) + 1, 3))
    angles = np.deg2rad(np.cumsum(drawn, axis=0))
    return place_bodies(person.chain, rotations_of(person.chain, angles), NO_MOVES)


def seen_from(poses: BodyPoses, muscle: int, bar: int, trace: np.ndarray) -> np.ndarray:
    """(Q, 3) m, a string as its bar's vertebra sees it: forwards of the bar, up, right."""
    bars = volunteer().lines.bars
    assert bars.first[muscle] <= bar < bars.first[muscle + 1]
    found: np.ndarray = (trace - poses.of(bars.body[bar], bars.at[bar])) @ poses.rotations[
        bars.body[bar]
    ]
    return found


@pytest.mark.parametrize("seed", range(6))
def test_strings_lie_on_bars_or_behind_and_push_them_forwards_alone(seed: int) -> None:
    """Behind all bars, pushing none sideways and pulling none backwards: of all ways round, the
    problem being convex, that is the shortest."""
    poses, lines = any_posture(seed), volunteer().lines
    pulls, touched = lines.pulls(poses), 0
    for m in np.flatnonzero(lines.trunk.muscles.wraps):
        trace = pulls.trace[m, : pulls.traced[m]]
        for bar in range(lines.bars.first[m], lines.bars.first[m + 1]):
            seen = seen_from(poses, m, bar, trace)
            apart = np.hypot(seen[:, 0], seen[:, 1])
            k = int(np.argmin(apart))
            if apart[k] < 1e-12:
                legs = seen[[k - 1, k + 1]] - seen[k]
                push = (legs / np.linalg.norm(legs, axis=1, keepdims=True)).sum(axis=0)
                assert push[0] > -1e-10
                assert push[2] == pytest.approx(0.0, abs=1e-10)
                touched += 1
                continue
            above = seen[:, 1] > 0.0
            (k,) = np.flatnonzero(np.diff(above))
            share = seen[k, 1] / (seen[k, 1] - seen[k + 1, 1])
            assert seen[k, 0] + share * (seen[k + 1, 0] - seen[k, 0]) < 1e-10
    assert touched == pulls.contacts.sum() > 100


def turned_above(poses: BodyPoses, level: int, by: np.ndarray) -> BodyPoses:
    """All that is above a joint, turned by a small vector (3,) about its centre."""
    turn, centre = rotation_of_vector(by), poses.centres[level]
    rotations, places = poses.rotations.copy(), poses.places.copy()
    for body in range(level + 1, len(rotations)):
        rotations[body] = turn @ rotations[body]
        places[body] = centre + turn @ (places[body] - centre)
    return BodyPoses(rotations, places, poses.origins, poses.centres, poses.discs, poses.turned)


@pytest.mark.parametrize("task", ["standing", "full_flexion", "side_20", "one_handed"])
def test_lever_arms_are_slopes_of_length(task: str) -> None:
    """Virtual work, of straight strings, through points and over bars alike; pulls along the rectus
    sheath are no string and left out. A central difference over 1e-5 rad of lengths good to some
    1e-16 m is good to 1e-11 m, and so is its own error."""
    person, found = volunteer(), held_task(task)
    free = ~person.lines.trunk.muscles.in_sheath
    assert found.pulls.contacts[free].sum() > 100
    step = 1e-5
    for level in range(len(LEVELS)):
        for axis, unit in enumerate(np.eye(3)):
            there, back = (
                person.lines.pulls(turned_above(found.poses, level, sign * step * unit)).lengths
                for sign in (1.0, -1.0)
            )
            slope = (there - back) / (2.0 * step)
            arm = found.demand.arms[3 * level + axis]
            np.testing.assert_allclose(-arm[free], slope[free], rtol=0.0, atol=2e-10)


def test_angles_of_a_task_are_counted_from_upright() -> None:
    person, task = volunteer(), tasks()["flexion_50"]
    assert angles_of(person, task) == pytest.approx(person.upright + task.turned)

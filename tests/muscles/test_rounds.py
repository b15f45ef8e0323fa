"""Rounds and beginnings: when they end, how far they step, which answer counts, worked by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spinepipe.muscles import muscle_equilibrium
from spinepipe.muscles import upright as standing
from spinepipe.muscles.forces import Forces
from spinepipe.muscles.muscle_equilibrium import SolverOptions, SolverRound, held
from spinepipe.muscles.trunk import BODIES, LEVELS
from spinepipe.status import Balanced

NOBODY: Any = None


def at_rest(forces: list[float], status: Balanced = Balanced.CONVERGED) -> Any:
    found = Forces(np.array(forces), np.zeros(21), True)
    return muscle_equilibrium.SolvedTask(status, "", *[NOBODY] * 4, found, *[NOBODY] * 4)


class Rounds:
    """Ends of rounds that are chosen beforehand, and what they were asked for."""

    def __init__(self, *ends: Any) -> None:
        self.ends, self.starts, self.tones = list(ends), list[Any](), list[float]()

    def __call__(self, person: Any, task: Any, how: SolverOptions, tone: float, start: Any) -> Any:
        self.starts.append(start)
        self.tones.append(tone)
        return self.ends.pop(0)


def asked_twice(
    monkeypatch: pytest.MonkeyPatch, how: SolverOptions, *ends: Any
) -> tuple[muscle_equilibrium.SolvedTask, Rounds]:
    rounds = Rounds(*ends)
    monkeypatch.setattr(muscle_equilibrium, "_rounds", rounds)
    task: Any = SimpleNamespace(tone_share=0.03, tone="least")
    return held(NOBODY, task, how), rounds


@pytest.mark.parametrize(
    ("apart", "status", "message"),
    [
        (0.0, Balanced.CONVERGED, ""),
        (0.019, Balanced.CONVERGED, ""),
        (0.021, Balanced.TWO_ANSWERS, "another start ends 2.1 % away"),
    ],
)
def test_a_second_answer_is_one_more_than_twice_the_change_away(
    apart: float, status: Balanced, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of forces whose size is that of the second answer; begun again pressed by 3 kN."""
    ends = at_rest([3.0, 4.0 - 5.0 * apart]), at_rest([3.0, 4.0])
    found, rounds = asked_twice(monkeypatch, SolverOptions(twice=True), *ends)
    assert (found.status, found.message) == (status, message)
    np.testing.assert_array_equal(found.found.forces, ends[0].found.forces)
    np.testing.assert_array_equal(rounds.starts, [np.zeros(7), np.full(7, 3000.0)])


@pytest.mark.parametrize(
    ("how", "status"),
    [
        (SolverOptions(), Balanced.CONVERGED),
        (SolverOptions(twice=True, feedback=False), Balanced.CONVERGED),
        (SolverOptions(twice=True), Balanced.BEYOND_STRENGTH),
        (SolverOptions(twice=True), Balanced.NOT_CONVERGED),
    ],
)
def test_once_is_enough_where_no_other_answer_is_looked_for(
    how: SolverOptions, status: Balanced, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, rounds = asked_twice(monkeypatch, how, at_rest([1.0], status))
    assert found.status is status
    assert len(rounds.starts) == 1


@pytest.mark.parametrize(
    ("tone", "kind", "least"),
    [(None, "stated", 0.03), (None, "least", 0.0), (0.1, "stated", 0.1), (0.0, "stated", 0.0)],
)
def test_the_tone_that_is_asked_for_comes_before_the_task_s(
    tone: float | None, kind: str, least: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = Rounds(at_rest([1.0]))
    monkeypatch.setattr(muscle_equilibrium, "_rounds", rounds)
    task: Any = SimpleNamespace(tone_share=0.03, tone=kind)
    held(NOBODY, task, SolverOptions(), tone)
    assert rounds.tones == [least]


def test_rounds_end_as_the_documentation_says_where_nothing_is_asked() -> None:
    how = SolverOptions()
    assert (how.change, how.residual_nm, how.slack_nm, how.most) == (0.01, 0.1, 0.5, 60)
    assert (how.feedback, how.translates, how.lowest_alone, how.twice) == (True, True, False, False)


@pytest.mark.parametrize(
    ("off", "last", "step"),
    [
        ([1.0, 0.0], [2.0, 0.0], 1.0),  # half of the way: as far again brings it to nought
        ([-1.0, 0.0], [2.0, 0.0], 1.0 / 3.0),  # swings: two thirds less
        ([1.9, 0.0], [2.0, 0.0], 5.0),  # creeps: 10 times, but 5 at most
        ([-9.0, 0.0], [1.0, 0.0], 0.1),
        ([-38.0, 0.0], [2.0, 0.0], 0.1),  # a twentieth, but a tenth at least
        ([3.0, 0.0], [2.0, 0.0], 0.1),  # away from it
        ([2.0, 1.0], [2.0, 1.0], 1.0),  # nothing is known of the way
        ([0.0, 0.0], [3.0, 4.0], 0.5),
    ],
)
def test_steps_follow_aitkens_rule(off: list[float], last: list[float], step: float) -> None:
    """The last step of 0.5: -0.5 last (off - last) / (off - last)^2."""
    assert muscle_equilibrium._step(0.5, np.array(off), np.array(last)) == pytest.approx(step)


def test_changes_are_told_over_the_size_of_what_is() -> None:
    now = np.array([3.0, 4.0])
    assert muscle_equilibrium._change(now, np.array([3.0, 3.0])) == pytest.approx(0.2)
    assert muscle_equilibrium._change(now, now) == 0.0
    assert muscle_equilibrium._change(np.zeros(2), now) == 0.0


def demanded(required: list[float], forces: list[float], enough: bool) -> Any:
    """Rows of one muscle each, arms 2 m."""
    demand = SimpleNamespace(required=np.array(required), arms=2.0 * np.eye(len(required)))
    return SimpleNamespace(
        demand=demand, found=SimpleNamespace(forces=np.array(forces), enough=enough)
    )


@pytest.mark.parametrize(
    ("enough", "alone", "residual"),
    [(True, False, 7.0), (True, True, 2.0), (False, False, 12.0), (False, True, 4.0)],
)
def test_what_the_round_before_misses(enough: bool, alone: bool, residual: float) -> None:
    """Of moments asked for; beyond strength of those of this round. L5S1 has three rows."""
    now = demanded([3.0, 2.0, 4.0, 9.0], [0.0, 0.0, 3.0, 7.0], enough)
    before = np.array([1.0, 2.0, 1.0, 1.0])
    assert muscle_equilibrium._residual(now, before, SolverOptions(lowest_alone=alone)) == residual


def trail(*sizes: float) -> list[np.ndarray]:
    return [np.array([size, 0.0]) for size in sizes]


@pytest.mark.parametrize(
    ("sizes", "change", "status"),
    [
        ((1.0, 2.0, 1.0, 2.0), 0.5, Balanced.CYCLING),
        ((1.0, 2.0, 1.06, 2.0), 0.5, Balanced.CYCLING),
        ((1.0, 1.91, 1.0, 2.0), 0.5, Balanced.CYCLING),  # 4.5 % since the last but one, of 5
        ((1.0, 1.89, 1.0, 2.0), 0.5, Balanced.NOT_CONVERGED),  # 5.5 %
        ((1.0, 2.0), 0.5, Balanced.NOT_CONVERGED),
        ((2.0,), None, Balanced.NOT_CONVERGED),
    ],
)
def test_rounds_that_go_to_and_fro_are_told(
    sizes: tuple[float, ...], change: float | None, status: Balanced
) -> None:
    rounds = [SolverRound(change, 1.0, 500.0)] * len(sizes)
    found, told = muscle_equilibrium._ended(
        NOBODY, SolverOptions(), rounds, trail(*sizes), settled=False
    )
    shown = "50.0" if change else "0.0"
    assert found is status
    assert told.startswith(f"after {len(sizes)} rounds forces still change by {shown} %")
    assert told.endswith(", to and fro") is (status is Balanced.CYCLING)


@pytest.mark.parametrize(
    ("slack", "status", "told"),
    [
        (0.51, Balanced.BEYOND_STRENGTH, "0.5 N m too much for the muscles at L3L4"),
        (-12.34, Balanced.BEYOND_STRENGTH, "12.3 N m too much for the muscles at L3L4"),
        (0.5, Balanced.CONVERGED, "0.50 N m left over at L3L4"),
        (-0.26, Balanced.CONVERGED, "0.26 N m left over at L3L4"),
    ],
)
def test_what_muscles_leave_over_is_told_where_it_is_most(
    slack: float, status: Balanced, told: str
) -> None:
    left = np.zeros((len(LEVELS), 3))
    left[4], left[LEVELS.index("L3L4"), 1] = 0.05, slack
    now: Any = SimpleNamespace(found=SimpleNamespace(enough=False, slack=left.ravel()))
    assert muscle_equilibrium._ended(now, SolverOptions(), [], [], settled=True) == (status, told)
    now.found.enough = True
    assert muscle_equilibrium._ended(now, SolverOptions(), [], [], settled=True) == (
        Balanced.CONVERGED,
        "",
    )


def begun(monkeypatch: pytest.MonkeyPatch, sums: dict[int, float]) -> tuple[Any, np.ndarray]:
    """Where the search for the upright posture began; hollows lack 100 N m but for some."""
    begins: list[np.ndarray] = []

    def descended(person: Any, start: Any, reach: float, first: np.ndarray) -> Any:
        lacking = np.zeros(len(LEVELS))
        lacking[0] = -sums.get(len(begins), 100.0)
        begins.append(first)
        return np.full(len(BODIES), 0.01 * len(begins)), lacking

    monkeypatch.setattr(standing, "_descended", descended)
    monkeypatch.setattr(standing, "lacking", lambda person, angles: np.zeros(len(LEVELS)))
    start = np.linspace(-0.1, 0.1, len(BODIES))
    return standing.upright(NOBODY, start, 0.08), np.array(begins) - start


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

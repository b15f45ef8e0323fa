"""Which test next: the promise against what the test then tells, and against dense algebra."""

from dataclasses import replace

import numpy as np
import pytest
from next_test_cases import (
    JOINTS,
    STIFFNESS,
    UP,
    fitted,
    grounds_of,
    readings,
    scaled_case,
    shared_form,
    tried,
)
from spring_chain_cases import THERE_AND_BACK, cases
from sweeps import sweep

from spinepipe.studies.discrepancy.design.advice import ADVISED, TELLS_NOTHING, advice
from spinepipe.studies.discrepancy.design.information import (
    Bench,
    ExpectedReadings,
    Information,
    noncentrality,
)
from spinepipe.studies.discrepancy.design.next_test import RivalFits, offers, remaining_chi2
from spinepipe.studies.discrepancy.design.plans import PlannedTest, at_times
from spinepipe.studies.discrepancy.design.runs import runs
from spinepipe.studies.discrepancy.rows import advice_csv, advice_rows
from spinepipe.studies.discrepancy.search.hypothesis import trials
from spinepipe.studies.discrepancy.search.outcome import outcome
from spinepipe.studies.discrepancy.search.search import search
from spinepipe.studies.discrepancy.search.search_state import Rules
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.tables import NEXT_TESTS
from spinepipe.studies.discrepancy.verdict import VerdictKind
from spinepipe.tables import from_rows
from spinepipe.units import ROTATIONS

TRUE = "nonlinear_stiffening"
LARGER = "flexion: loads 1.5 times as large"
TURNED_ROUND = "new test: flexion (moment about -z of ground)"


def pair(seed: int, rival: str):
    """Fits of the true effect and of a rival to the same readings, by the grounds they stand on."""
    grounds, known = grounds_of(readings(seed)), tried([TRUE, rival])
    options = {"coordinate": "extension"}
    true = fitted(grounds, shared_form(known[TRUE], **options, shape="exponential"))
    return grounds, true, fitted(grounds, shared_form(known[rival], **options))


def margin_after(seed: int, rival: str, case, noise_seed: int) -> float:
    """Log evidence between the two when the run has been made."""
    grounds, known = grounds_of(readings(seed, [case], noise_seed)), tried([TRUE, rival])
    options = {"coordinate": "extension"}
    true = shared_form(known[TRUE], **options, shape="exponential")
    other = shared_form(known[rival], **options)
    return fitted(grounds, true).log_evidence - fitted(grounds, other).log_evidence


@sweep(
    "rival, words, case",
    [
        (
            "facet_contact",
            TURNED_ROUND,
            replace(scaled_case("flexion", -1.0), test="added flexion"),
        ),
        ("neutral_zone", LARGER, scaled_case("flexion", 1.5)),
    ],
)
def test_an_advised_run_tells_about_what_was_promised(rival, words, case):
    """The run is made with the true law in closed form and new noise, both models fitted again."""
    promised, told = [], []
    for seed in range(3):
        grounds, true, other = pair(seed, rival)
        pattern = RivalFits(grounds, other.fit, true.fit)
        now, then = (remaining_chi2(pattern, Bench.of(grounds, None), one) for one in (None, words))
        promised.append(0.5 * (then - now))
        before = true.log_evidence - other.log_evidence
        told.append(margin_after(seed, rival, case, seed) - before)
    assert 0.5 < np.mean(told) / np.mean(promised) < 2.0
    assert np.mean(promised) > 2.0


def test_the_best_run_is_the_one_in_which_the_models_part():
    grounds, true, other = pair(0, "facet_contact")
    found = offers([RivalFits(grounds, other.fit, true.fit)], Bench.of(grounds, None))
    gains = {one.words: one.gain for one in found}
    assert found[0].words == TURNED_ROUND
    assert gains[TURNED_ROUND] > 10.0 * gains["flexion: once more"] > 0.0
    # neither model says anything of the other axes
    assert gains["bending: once more"] < 1e-3
    assert found[0].cycles == len(STIFFNESS)


def test_what_stays_between_two_models_is_a_least_squares_problem():
    """Readings, priors of nuisances and of unknowns as rows of one matrix, each with SD one."""
    rng = np.random.default_rng(0)
    keys = [("kind", "c", joint, "*") for joint in range(5)]
    old = ExpectedReadings(
        rng.normal(size=(30, 1)),
        rng.normal(size=(30, 3)),
        rng.normal(size=(30, 4)),
        tuple(keys[:4]),
    )
    new = ExpectedReadings(
        rng.normal(size=(12, 1)),
        rng.normal(size=(12, 3)),
        rng.normal(size=(12, 3)),
        tuple(keys[2:]),
    )
    sds = np.array([0.5, 3.0, 2.0])
    of_old, numbers = Information.of(old), {"a": np.arange(3)}
    found = noncentrality({"a": of_old.plus(Information.of(new))}, numbers, sds)
    rows = np.zeros((30 + 12 + 5 + 3, 3 + 5))
    rows[:30, :3], rows[:30, 3:7] = old.by_unknowns, old.moves
    rows[30:42, :3], rows[30:42, 5:] = new.by_unknowns, new.moves
    rows[42:47, 3:], rows[47:, :3] = np.eye(5), np.diag(1.0 / sds)
    target = np.concatenate([old.by_effects[:, 0], new.by_effects[:, 0], np.zeros(8)])
    best = np.linalg.solve(rows.T @ rows, rows.T @ target)
    assert found == pytest.approx(np.sum((target - rows @ best) ** 2), rel=1e-9)
    assert found > noncentrality({"a": of_old}, numbers, sds)


def planned(case, *, translations: bool = False, zeroed: bool = False) -> PlannedTest:
    count = np.ones((JOINTS, 6), dtype=np.int64)
    count[:, :3] = translations
    return PlannedTest(case, count, zeroed)


def offered(tests) -> set[str]:
    return {one.words for one in runs(tests)}


def test_nothing_is_offered_that_is_there():
    one_way = [planned(case) for case in cases(UP, JOINTS)]
    both_ways = [planned(case) for case in cases(THERE_AND_BACK, JOINTS)]
    there, there_and_back = offered(one_way), offered(both_ways)
    assert any("unloading" in words for words in there)
    assert not any("unloading" in words for words in there_and_back)
    assert sum(words.startswith("new test") for words in there) == 3  # the other side of each
    assert not any(words.startswith("new test") for words in there_and_back)
    timed = [replace(one, case=at_times(one.case, 10.0 * np.arange(4))) for one in one_way]
    assert any("time recorded, 10 s" in words for words in there)
    assert not any("time recorded, 10 s" in words for words in offered(timed))
    read = [planned(case, translations=True) for case in cases(UP, JOINTS)]
    assert any("translations read" in words for words in there)
    assert not any("translations read" in words for words in offered(read))
    assert not any("not zeroed" in words for words in there)
    zeroed = [planned(case, zeroed=True) for case in cases(UP, JOINTS)]
    assert any("not zeroed" in words for words in offered(zeroed))


def test_a_test_done_at_both_rates_needs_no_slower_one():
    fast = [planned(at_times(case, 1.0 * np.arange(4))) for case in cases(UP, JOINTS)]
    slow = [
        planned(replace(at_times(one.case, 10.0 * np.arange(4)), test=f"{one.case.test}, slow"))
        for one in fast
    ]
    assert "flexion: 10 times as slow, time recorded" in offered(fast)
    assert "flexion: 10 times as slow, time recorded" not in offered([*fast, *slow])


def test_a_set_gets_a_test_that_tells_its_names_apart():
    grounds = grounds_of(readings(0))
    effects = ["facet_contact", TRUE]
    rules = Rules(trials(effects, ROTATIONS, tuple(STIFFNESS), JOINTS), ROTATIONS, 3)
    found = search(grounds, rules, at_once)
    ended = outcome(found)
    assert ended.verdict is VerdictKind.SET
    told = advice(found, ended, Bench.of(grounds, None), at_once)
    (best,) = [one for one in told if one.status == ADVISED]
    assert set(best.subject.split(" or ")) == set(effects)
    assert best.test == TURNED_ROUND
    assert {one.status for one in told if one.test.startswith("bending")} == {TELLS_NOTHING}
    rows = advice_rows(told)
    from_rows(NEXT_TESTS, rows)
    lines = advice_csv(rows).splitlines()
    assert lines[0].split(",") == [column.name for column in NEXT_TESTS.columns]
    assert len(lines) == len(rows) + 1

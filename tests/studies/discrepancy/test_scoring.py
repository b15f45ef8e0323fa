"""Rates, goals and tables of the scored search, from rows made by hand."""

import json
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import beta

from tests.generators.hidden import KNOWN, Recipe, draw_hidden
from tests.validation.discrepancy import report, run, store, tables
from tests.validation.discrepancy.goals import goals
from tests.validation.discrepancy.judged import judged
from tests.validation.discrepancy.rates import Goal, median, share
from tests.validation.discrepancy.row import scored
from tests.validation.discrepancy.targets import FIRST_SEED, KINDS, Target, of_seeds, targets


def row(
    seed: int,
    truth: str = "",
    named: str = "",
    tied: str = "",
    verdict: str = "NAMED",
    gap: float = 0.5,
    kind: str = "single",
    **recipe: Any,
) -> dict[str, Any]:
    """A row as the store holds it."""
    names = truth.split()
    asked = Recipe(seed=seed, gap=gap, **recipe)
    hidden = [{"name": name, "coordinate": "extension"} for name in names]
    return {
        "target": {"kind": kind, "label": truth, "seed": seed, "gap": gap},
        "recipe": asked.as_dict() | {"hidden": hidden},
        "status": "scored",
        "message": "",
        "truth": {"names": names, "gap": gap if names else 0.0, "gaps": [gap] * len(names)},
        "verdict": verdict,
        "named": named.split(),
        "tied": tied.split(),
        "standing": [],
    }


ROWS = [
    row(1, "neutral_zone", "neutral_zone"),
    row(2, "neutral_zone", "neutral_zone", gap=0.48),
    row(3, "neutral_zone", "creep", gap=1.0),
    row(4, "neutral_zone", "", "creep neutral_zone", "SET", gap=1.0),
    row(5, "neutral_zone", "neutral_zone creep", gap=1.0),
    row(6, "creep", "", "", "NULL", gap=0.2),
    row(7, "creep", "creep", gap=0.19),
    row(8, "creep", "", "facet_contact hysteresis", "SET", gap=0.21),
    row(9, "creep", "", "", "UNKNOWN", gap=0.02),
    row(10, "", "", "", "NULL", kind="null_white"),
    row(11, "", "creep", kind="null_white"),
    row(12, "", "", "", "UNKNOWN", kind="null_dirty"),
    row(13, "creep load_offset", "creep load_offset", kind="pair"),
    row(14, "creep load_offset", "creep", kind="pair"),
    row(15, "angle_bump", "", "", "UNKNOWN", kind="foreign"),
    row(16, "angle_bump", "facet_contact", kind="foreign"),
    row(17, "preload_stiffening", "", "", "NULL"),
]


@pytest.mark.parametrize(
    ("what", "count", "n"),
    [
        ("null: NAMED or SET", 1, 3),
        ("null: not NULL", 2, 3),
        ("null: UNKNOWN", 1, 3),
        ("null_white: NAMED or SET", 1, 2),
        ("null_dirty: not NULL", 1, 1),
        ("one effect, gap >= 0.5, top-1; all designs", 2, 6),
        ("one effect, gap >= 0.5, truth named or in the set; all designs", 4, 6),
        ("one effect, gap >= 0.5, wrong name; all designs", 2, 6),
        ("one effect, gap >= 0.5, top-1; designs that show it by algebra", 2, 5),
        ("one effect, gap 0.2, top-1; all designs", 1, 3),
        ("one effect, gap 0.2, wrong name; all designs", 0, 3),
        ("two effects: both named and no extra", 1, 2),
        ("two effects: wrong name", 0, 2),
        ("out of library: not NAMED", 1, 2),
        ("out of library: UNKNOWN", 1, 2),
    ],
)
def test_goals_count_what_they_say(what: str, count: int, n: int) -> None:
    found = {one["what"]: one for one in goals([judged(one) for one in ROWS])}[what]
    assert (found["count"], found["n"]) == (count, n)


def test_judged_designs_and_the_detection_limit_are_those_of_the_row() -> None:
    told = {"testable": True, "why": "", "least_gap": 0.3}
    rows = [
        row(1, "creep", "", "", "NULL", gap=0.2) | {"testable": {"creep": told}},
        row(2, "creep", "creep", gap=0.2) | {"testable": {"creep": told | {"least_gap": 0.1}}},
        row(3, "creep", "", "", "NULL", gap=1.0)
        | {"testable": {"creep": {"testable": False, "why": "no time", "least_gap": None}}},
    ]
    found = {one["what"]: one for one in goals([judged(one) for one in rows])}
    below = found["one effect below the detection limit: NULL or SET"]
    assert (below["count"], below["n"]) == (2, 2)
    judged_able = found["one effect, gap >= 0.5, top-1; designs judged able to show it"]
    assert judged_able["n"] == 0
    assert judged_able["value"] is None


def test_intervals_are_those_of_clopper_and_pearson() -> None:
    found = share("", [True] * 2 + [False] * 98, Goal(high=0.02))
    low, high = beta.ppf(0.025, 2, 99), beta.ppf(0.975, 3, 98)
    assert (found["low"], found["high"]) == pytest.approx((low, high))
    assert (found["met"], found["reached"]) == ("yes", "undecided")


@pytest.mark.parametrize(
    ("right", "of", "reached"), [(200, 200, "yes"), (20, 200, "no"), (190, 200, "undecided")]
)
def test_a_goal_is_reached_by_the_whole_interval(right: int, of: int, reached: str) -> None:
    flags = [True] * right + [False] * (of - right)
    assert share("", flags, Goal(low=0.95))["reached"] == reached


def test_the_interval_of_a_median_is_of_its_order_statistics() -> None:
    """Of 20 values the 6th and the 15th: P(5 or fewer below) = 0.0207 on each side."""
    found = median("", [float(k) for k in range(1, 21)])
    assert (found["value"], found["low"], found["high"]) == (10.5, 6.0, 15.0)


def test_confusion_holds_every_row_once() -> None:
    found = tables.confusion([judged(one) for one in ROWS]).set_index(["truth", "gap"])
    assert found["n"].sum() == len(ROWS)
    large = found.loc[("neutral_zone", "1.0")]
    assert (large["creep"], large["SET with the truth"], large["several"]) == (1, 1, 1)
    assert found.loc[("neutral_zone", "0.5"), "neutral_zone"] == 2
    assert found.loc[("creep", "0.2"), "SET without it"] == 1
    assert found.loc[("creep", "none"), "UNKNOWN"] == 1
    assert tuple(found.loc[("NULL", "none"), ["creep", "NULL", "UNKNOWN"]]) == (1, 1, 1)
    assert found.loc[("pair", "0.5"), "several"] == 1


def test_by_effect_counts_single_effects_at_their_gap() -> None:
    found = tables.by_effect([judged(one) for one in ROWS]).set_index(["effect", "gap"])
    zone = found.loc[("neutral_zone", "1.0")]
    assert (zone["n"], zone["top1"], zone["truth_in_set"], zone["wrong_name"]) == (3, 0, 2, 2)
    creep = found.loc[("creep", "0.2")]
    assert (creep["n"], creep["top1"], creep["null"], creep["set"]) == (3, 1, 1, 1)
    preload = found.loc[("preload_stiffening", "0.5")]
    assert (preload["n"], preload["n_shown"]) == (1, 0)


def test_tables_are_written_with_what_made_them(tmp_path: Path, capsys: Any) -> None:
    failed = row(18, "creep") | {"status": "no data", "message": "it buckles"}
    report.write([*ROWS, failed], "a command", "0123456789ab", tmp_path)
    text = (tmp_path / "discrepancy.md").read_text()
    assert "18 cohorts of seeds 1 to 18: 17 scored, 1 no data." in text
    assert "`a command`, code 0123456789ab" in text
    assert len((tmp_path / "discrepancy_sets.csv").read_text().splitlines()) == 19
    assert capsys.readouterr().out.startswith("# Discrepancy")


def test_any_first_part_is_a_fair_sample() -> None:
    every = targets()
    assert len({target.seed for target in every}) == len(every)
    assert min(target.seed for target in every) == FIRST_SEED
    part = every[: len(every) // 4]
    for kind, (number, _) in KINDS.items():
        expected = 0.0 if kind == "full" else number / 4
        assert sum(target.kind == kind for target in part) == pytest.approx(expected, abs=1.5)
    singles = [target for target in part if target.kind == "single"]
    for name in KNOWN:
        gaps = [target.recipe.gap for target in singles if target.label == name]
        assert {gaps.count(gap) for gap in (0.1, 0.2, 0.5, 1.0)} <= {1, 2, 3}


def test_seeds_choose_the_first_of_each_kind() -> None:
    found = list(of_seeds(targets(), FIRST_SEED, FIRST_SEED + 2 * len(KINDS) - 1))
    assert sorted(target.kind for target in found) == sorted([*KINDS, *KINDS])


def test_values_that_json_cannot_hold_are_none() -> None:
    assert store.plain({"a": (float("inf"), 1.5), "b": {"c": float("nan")}}) == {
        "a": [None, 1.5],
        "b": {"c": None},
    }


def test_trouble_is_a_row_and_not_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = Recipe(seed=5, hidden=(draw_hidden("creep", Recipe(seed=5), strength=0.5),))
    monkeypatch.setattr("tests.validation.discrepancy.row.make", _broken)
    found = scored(recipe)
    assert (found["status"], found["message"]) == ("failed", "ZeroDivisionError: by nothing")


def _broken(*_: object) -> None:
    raise ZeroDivisionError("by nothing")


@pytest.mark.slow
def test_one_cohort_from_recipe_to_row(tmp_path: Path) -> None:
    """A strong asymmetry is named; the row is kept and not made again."""
    plain = Recipe(seed=3, n_specimens=2)
    hidden = draw_hidden(
        "flexion_extension_asymmetry", plain, coordinate="extension", joint=None, strength=0.4
    )
    recipe = Recipe(seed=3, n_specimens=2, hidden=(hidden,))
    target = Target("single", "flexion_extension_asymmetry", recipe)
    run.keep_one((target, store.path_of(target, tmp_path)))
    kept = store.kept([target], tmp_path)
    assert [one["status"] for one in kept] == ["scored"]
    assert judged(kept[0]).top1
    assert json.loads(store.path_of(target, tmp_path).read_text()) == kept[0]
    run.run([target], tmp_path, 1)  # would start a worker if it were not kept

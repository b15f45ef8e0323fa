"""Rates, goals and tables of the scored search, from rows made by hand.

Catches a rate that counts other rows than it says, and seeds that are scored twice.
"""

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import beta
from sweeps import sweep

from tests.generators.hidden import CATALOGUE, KNOWN, Recipe, draw_hidden
from tests.validation.discrepancy import report, run, seeds, store, tables, tune
from tests.validation.discrepancy.designs import DESIGNS, design_of
from tests.validation.discrepancy.goals import goals
from tests.validation.discrepancy.judged import formula_of, judged
from tests.validation.discrepancy.rates import Goal, median, percentile, share
from tests.validation.discrepancy.row import scored
from tests.validation.discrepancy.targets import COUNTS, DRAWN, NUMBER, Target, of_seeds, targets

FIRST = 30000


@cache
def every_target() -> list[Target]:
    return list(targets(FIRST))


def row(
    seed: int,
    truth: str = "",
    named: str = "",
    tied: str = "",
    verdict: str = "NAMED",
    gap: float = 0.6,
    kind: str = "one",
    formula: str = "",
    limit: float | None = 0.1,
    **recipe: Any,
) -> dict[str, Any]:
    """A row as the store holds it; every known effect is testable down to ``limit``."""
    names = truth.split()
    asked = Recipe(seed=seed, gap=gap, **recipe)
    shape = {"formula": formula} if formula else {}
    hidden = [
        {"name": name, "coordinate": "extension", "joint": None, "shape": shape} for name in names
    ]
    told = {"testable": True, "why": "", "least_gap": limit}
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
        "oracle": {"ahead": 3.0, "nameable": 0.5},
        "testable": {name: told for name in names if name in KNOWN},
    }


def placed(one: dict[str, Any], coordinate: str, closed: float | None) -> dict[str, Any]:
    """With the coordinate of what is left, and what a table closes of it."""
    return one | {"shape": {"coordinate": coordinate}, "table": {"held_out_closed": closed}}


ROWS = [
    row(1, "neutral_zone", "neutral_zone"),
    row(2, "neutral_zone", "neutral_zone", gap=0.48, formula="tanh"),
    row(3, "neutral_zone", "creep", gap=1.0, formula="tanh"),
    row(4, "neutral_zone", "", "creep neutral_zone", "SET", gap=1.0),
    row(5, "neutral_zone", "neutral_zone creep", gap=1.0),
    row(6, "neutral_zone", "neutral_zone", verdict="PART", formula="erf"),
    row(7, "creep", "creep", gap=0.3),
    row(8, "creep", "", "facet_contact hysteresis", "SET", gap=0.21),
    row(9, "creep", "hysteresis", gap=0.05),
    row(10, "", "", "", "NULL", kind="null"),
    row(11, "", "creep", kind="null"),
    row(12, "", "", "", "UNKNOWN", kind="dirty"),
    row(13, "creep load_offset", "creep load_offset", kind="two"),
    row(14, "creep load_offset", "creep", verdict="PART", kind="two"),
    placed(row(15, "angle_bump", "", "", "UNKNOWN", kind="alien"), "extension", 0.4),
    row(16, "angle_bump", "facet_contact", kind="alien"),
    placed(row(17, "angle_bump", "", "", "UNKNOWN", kind="alien"), "left_rotation", None),
    row(18, "preload_stiffening", "", "", "NULL"),
    row(19, "creep angle_bump", "creep", verdict="PART", kind="part"),
    row(20, "creep angle_bump", "creep", verdict="NAMED", kind="part"),
    row(21, "", "", "", "UNKNOWN", kind="mistake") | {"suspected": {"errors": [["a", "b", "c"]]}},
    row(22, "creep", "creep", kind="mistake") | {"suspected": {"errors": [["a", "b", "c"]]}},
    row(23, kind="mistake") | {"status": "refused"},
]


@cache
def goals_of_rows() -> dict[str, dict[str, Any]]:
    return {one["what"]: one for one in goals([judged(one) for one in ROWS])}


LARGE = "one effect, gap >= 0.5, above its limit"


@sweep(
    "what, count, n",
    [
        ("null and dirty null: NAMED, PART or SET", 1, 3),
        ("null and dirty null: not NULL", 2, 3),
        ("null: NAMED, PART or SET", 1, 2),
        (f"{LARGE}: named right", 3, 6),
        (f"{LARGE}: named right, as a share of what the oracle expects", 3, 6),
        (f"{LARGE}: NAMED alone", 2, 6),
        ("one effect, above its limit; same formula: named right", 2, 5),
        ("one effect, above its limit; other formula: named right", 2, 3),
        ("one effect, gap 0.2-0.5, above its limit: named right", 1, 2),
        ("one effect, above its limit: right or in the set", 6, 8),
        ("one effect, above its limit: wrong name", 2, 8),
        ("one effect, below its limit: wrong name", 1, 1),
        ("two effects, both above the limit: both named and no other", 1, 2),
        ("two effects, both above the limit: wrong name", 0, 2),
        ("out of library, gap >= 0.5: a known name", 1, 3),
        ("out of library, gap >= 0.5: place right", 1, 2),
        ("out of library, gap >= 0.5: gap shrunk by a tabulated law", 1, 2),
        ("a known effect beside one out of the library: it is named, as a part", 1, 2),
        ("mistake in the files: pointed to, nothing named", 2, 3),
    ],
)
def test_goals_count_what_they_say(what: str, count: int, n: int) -> None:
    found = goals_of_rows()[what]
    assert (found["count"], found["n"]) == (count, n)


def test_what_a_design_cannot_show_counts_nowhere() -> None:
    """No second preload; judged not testable; one joint alone where levels are to differ."""
    hidden = {"testable": False, "why": "no time", "least_gap": None}
    rows = [
        row(1, "preload_stiffening", "", "", "NULL"),
        row(2, "creep", "", "", "NULL") | {"testable": {"creep": hidden}},
        row(3, "level_dependence", "", "", "NULL", joints=1),
    ]
    found = {one["what"]: one for one in goals([judged(one) for one in rows])}
    assert found[f"{LARGE}: named right"]["n"] == 0
    assert found[f"{LARGE}: named right"]["value"] is None


def test_names_are_counted_beside_what_anybody_could_name() -> None:
    """Three of six named, where half is nameable: all of what can be asked."""
    found = goals_of_rows()[f"{LARGE}: named right, as a share of what the oracle expects"]
    assert found["value"] == pytest.approx(3 / 3.0)
    assert found["low"] < 1.0 < found["high"]


def test_said_probabilities_are_held_against_the_truth() -> None:
    rows = [
        row(1, "creep", "creep") | {"probabilities": {"creep": 0.97, "hysteresis": 0.6}},
        row(2, "creep", "") | {"probabilities": {"creep": 0.55, "something_else": 0.99}},
        row(3, "angle_bump", "", kind="alien") | {"probabilities": {"creep": 1.0}},
    ]
    found = {one["what"]: one for one in goals([judged(one) for one in rows])}
    for said, count, n in (("0.95 to 1", 1, 1), ("0.8 to 0.95", None, 0), ("0.5 to 0.8", 1, 2)):
        one = found[f"said with {said}: true"]
        assert (one["count"], one["n"]) == (count, n)


def test_intervals_are_those_of_clopper_and_pearson() -> None:
    found = share("", [True] * 2 + [False] * 98, Goal(high=0.02))
    low, high = beta.ppf(0.025, 2, 99), beta.ppf(0.975, 3, 98)
    assert (found["low"], found["high"]) == pytest.approx((low, high))
    assert (found["met"], found["reached"]) == ("yes", "undecided")


@sweep("right, of, reached", [(200, 200, "yes"), (20, 200, "no"), (190, 200, "undecided")])
def test_a_goal_is_reached_by_the_whole_interval(right: int, of: int, reached: str) -> None:
    flags = [True] * right + [False] * (of - right)
    assert share("", flags, Goal(low=0.95))["reached"] == reached


def test_the_interval_of_a_median_is_of_its_order_statistics() -> None:
    """Of 20 values the 6th and the 15th: P(5 or fewer below) = 0.0207 on each side."""
    found = median("", [float(k) for k in range(1, 21)])
    assert (found["value"], found["low"], found["high"]) == (10.5, 6.0, 15.0)


def test_a_percentile_is_numpys_with_an_interval() -> None:
    """Of 100 values the 90th percentile lies between the 84th and the 96th: binomial, 2.4 % off."""
    values = [float(k) for k in range(1, 101)]
    found = percentile("", values, 0.9)
    assert found["value"] == pytest.approx(float(np.quantile(values, 0.9)))
    assert 82.0 <= found["low"] <= 85.0
    assert 95.0 <= found["high"] <= 97.0


def test_confusion_holds_every_row_once() -> None:
    found = tables.confusion([judged(one) for one in ROWS]).set_index(["truth", "gap"])
    assert found["n"].sum() == len(ROWS)
    large = found.loc[("neutral_zone", ">= 0.5")]
    assert (large["creep"], large["SET with the truth"], large["several"]) == (1, 1, 1)
    assert large["neutral_zone"] == 3
    assert found.loc[("creep", "0.2-0.5"), "SET without it"] == 1
    assert tuple(found.loc[("NULL", "none"), ["creep", "NULL", "UNKNOWN"]]) == (1, 1, 1)
    assert found.loc[("two", ">= 0.5"), "several"] == 1


def test_by_effect_counts_single_effects_at_their_gap() -> None:
    found = tables.by_effect([judged(one) for one in ROWS])
    found = found.set_index(["effect", "formula", "gap"])
    zone = found.loc[("neutral_zone", "same", ">= 0.5")]
    assert (zone["n"], zone["top1"], zone["truth_in_set"], zone["wrong_name"]) == (3, 1, 3, 1)
    other = found.loc[("neutral_zone", "other", ">= 0.5")]
    assert (other["n"], other["top1"], other["part"]) == (3, 2, 1)
    preload = found.loc[("preload_stiffening", "same", ">= 0.5")]
    assert (preload["n"], preload["n_shown"]) == (1, 0)


def test_formulas_are_told_apart() -> None:
    found = tables.by_formula([judged(one) for one in ROWS]).set_index(["effect", "formula"])
    assert found.loc[("neutral_zone", "tanh"), "library"] == "other"
    assert found.loc[("neutral_zone", "tanh"), "n"] == 2


def test_tables_are_written_with_what_made_them(tmp_path: Path, capsys: Any) -> None:
    failed = row(24, "creep") | {"status": "no data", "message": "it buckles"}
    report.write([*ROWS, failed], "a command", "0123456789ab", tmp_path)
    text = (tmp_path / "discrepancy.md").read_text()
    assert "24 cohorts of seeds 1 to 24: 22 scored, 1 refused, 1 no data." in text
    assert "`a command`, code 0123456789ab" in text
    assert len((tmp_path / "discrepancy_sets.csv").read_text().splitlines()) == 25
    assert capsys.readouterr().out.startswith("# Discrepancy")


def test_any_first_part_is_a_fair_sample() -> None:
    every = every_target()
    assert [target.seed for target in every] == list(range(FIRST, FIRST + NUMBER))
    part = every[: len(every) // 4]
    for kind, number in COUNTS.items():
        assert sum(target.kind == kind for target in part) == pytest.approx(number / 4, abs=1.5)
    assert {design_of(target.recipe.as_dict()) for target in part} == set(DESIGNS)


def test_half_of_the_cohorts_hide_a_formula_that_the_library_lacks() -> None:
    rows = [
        {"target": {"kind": one.kind}, "recipe": one.recipe.as_dict()} for one in every_target()
    ]
    told = [formula_of(one) for one in rows if any(h["name"] in KNOWN for h in hidden(one))]
    assert np.mean([formula != "same" for formula in told]) >= 0.5


def hidden(one: dict[str, Any]) -> list[dict[str, Any]]:
    """Effects of a row's recipe."""
    found: list[dict[str, Any]] = one["recipe"]["hidden"]
    return found


def test_the_page_tells_every_formula() -> None:
    """docs/studies/discrepancy.md: which formulas are the library's and which are others."""
    page = (store.ROOT / "docs" / "studies" / "discrepancy.md").read_text(encoding="utf-8")
    lines = dict(re.findall(r"^\| `(\w+)` \|(.*)\|$", page, re.MULTILINE))
    for name in KNOWN:
        same, other = (set(re.findall(r"\w+", part)) for part in lines[name].split("|"))
        for formula, which in CATALOGUE[name].formulas.items():
            assert formula in (same if which == "same" else other), (name, formula)


def test_enough_cohorts_of_each_kind_for_its_goal() -> None:
    assert COUNTS["null"] + COUNTS["dirty"] >= 400
    assert COUNTS["one"] >= 500
    assert COUNTS["mistake"] >= 80
    assert COUNTS["alien"] >= 100
    assert NUMBER >= 1500


def test_seeds_and_kinds_choose_some() -> None:
    found = list(of_seeds(targets(FIRST, ("null",)), FIRST, FIRST + 99))
    assert found
    assert {target.kind for target in found} == {"null"}
    assert found == [one for one in every_target()[:100] if one.kind == "null"]


def test_seeds_are_scored_once(tmp_path: Path) -> None:
    listed = tmp_path / "scored.csv"
    listed.write_text(",".join(seeds.COLUMNS) + "\n")
    assert seeds.first_seed("aaa", listed) == FIRST
    seeds.claim("aaa", FIRST, FIRST + 9, listed)
    seeds.claim("aaa", FIRST, FIRST + 9, listed)
    assert seeds.first_seed("aaa", listed) == FIRST
    assert seeds.first_seed("bbb", listed) == FIRST + 10
    assert len(seeds.ranges(listed)) == 1


def test_ranges_that_were_scored_do_not_overlap() -> None:
    found = sorted((one.first, one.last) for one in seeds.ranges())
    ends = [end for one in found for end in one]
    assert ends == sorted(set(ends))
    assert not [one for one in found if one[0] < seeds.TUNING[1] and one[1] >= seeds.TUNING[0]]


def test_seeds_for_tuning_are_no_others() -> None:
    with pytest.raises(SystemExit, match="scored once"):
        tune.main(["--seed", str(FIRST)])


def test_words_about_code_do_not_change_its_digest(tmp_path: Path) -> None:
    one, other = tmp_path / "a.py", tmp_path / "b" / "a.py"
    other.parent.mkdir()
    one.write_text('"""Text."""\n\n\ndef f(x):\n    """More."""\n    return x + 1  # why\n')
    other.write_text("def f(x):\n    return x + 1\n")
    assert store.digest([one]) == store.digest([other])
    other.write_text("def f(x):\n    return x + 2\n")
    assert store.digest([one]) != store.digest([other])


@sweep("kind", DRAWN)
def test_targets_of_a_seed_are_the_same(kind: str) -> None:
    assert DRAWN[kind](3, 20003) == DRAWN[kind](3, 20003)


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


@pytest.mark.full
@pytest.mark.slow
def test_one_cohort_from_recipe_to_row(tmp_path: Path) -> None:
    """A strong asymmetry is named; the row is kept and not made again."""
    plain = Recipe(seed=3, n_specimens=2)
    hidden = draw_hidden(
        "flexion_extension_asymmetry", plain, coordinate="extension", joint=None, strength=0.4
    )
    recipe = Recipe(seed=3, n_specimens=2, hidden=(hidden,))
    target = Target("one", "flexion_extension_asymmetry", recipe)
    run.keep_one((target, store.path_of(target, tmp_path)))
    ((path, row),) = store.kept([target], tmp_path)
    assert path == store.path_of(target, tmp_path)
    assert row["status"] == "scored"
    assert judged(row).top1
    assert row["oracle"]["nameable"] > 0.9
    run.run([target], tmp_path, 1)  # would start a worker if it were not kept

"""Sentences at the numbers where they turn: exactly at a limit, and just beside it.

Would catch a comparison that includes its limit where it should not, or the other way round.
"""

from typing import Any

import pandas as pd
from scoliosis_cases import Size, paired_test, study_of, tables_of
from sweeps import sweep

from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.studies.scoliosis.findings import both_ways, findings
from spinepipe.studies.scoliosis.headline import (
    ModelRanking,
    _answer,
    _compared,
    above_noise,
    headline,
    p_of,
)

PAIR = ("tangent_fitted", "tangent")
SIZE = Size()


def told(size: Size = SIZE, **changed: pd.DataFrame) -> str:
    """All findings, plain spaces before percent signs."""
    made = ResultTables(tables_of(size, **changed), {}, {})
    return "\n".join(findings(study_of(size), made)).replace("\u00a0", " ")


def answer(size: Size = SIZE, **changed: pd.DataFrame) -> Headline:
    return headline(ResultTables(tables_of(size, **changed), {}, {}))


def of_pair(p: float, measure: str = "rotation") -> pd.DataFrame:
    return pd.DataFrame([paired_test("held_out", measure, PAIR, p)])


@sweep("p, significant", [(0.0499, True), (0.05, False), (0.0501, False)])
def test_five_per_cent_is_not_significant(p: float, significant: bool) -> None:
    found = answer(statistics=of_pair(p))
    assert ("reproduces rotations of segments best" in found.words) is significant
    assert ("cannot be told apart" in found.words) is not significant
    assert ("it is significant" in found.how_sure) is significant
    same = "not told apart from the first"
    assert (same in told(statistics=of_pair(p))) is not significant
    alike = "not told apart from tangent, as published"
    assert (alike in told(statistics=of_pair(p, "place"))) is not significant


def standing(errors: dict[str, float], noise: float | None) -> ModelRanking:
    rows = [
        {
            "films": "held_out",
            "measure": "rotation",
            "model": model,
            "rmse": rmse,
            "unit": "deg",
            "n_patients": 3,
            "reading_noise": noise,
        }
        for model, rmse in errors.items()
    ]
    return ModelRanking.of(pd.DataFrame(rows), "held_out", "rotation")


@sweep(
    "errors, words",
    [
        ((1.01, 2.0), "the error is above that"),
        ((1.0, 2.0), "1 model is not above that"),
        ((0.5, 1.0), "no model is above that"),
        ((0.5, 1.01), "1 model is not above that"),
        ((0.5, 0.9, 2.0), "2 models are not above that"),
    ],
)
def test_an_error_as_large_as_reading_makes_is_not_above_it(
    errors: tuple[float, ...], words: str
) -> None:
    assert words in above_noise(standing({f"m{n}": one for n, one in enumerate(errors)}, 1.0))


def test_models_are_ordered_by_error_and_held_against_one_another() -> None:
    found = standing({"a": 3.0, "b": 1.0, "c": 2.0}, None)
    assert found.models == ["b", "c", "a"]
    assert found.noise is None
    assert (found.error("c"), found.sized("c")) == (2.0, "2.00°")
    assert found.less("b", "c") == 0.5
    assert ModelRanking.of(pd.DataFrame(), "held_out", "rotation").models == []
    assert ModelRanking.of(pd.DataFrame(), "held_out", "rotation").noise is None


def compared(**errors: float) -> str:
    held_out = standing(errors, None)
    return _answer(held_out, dict.fromkeys(_compared(held_out)))


def test_the_reference_is_named_once_where_it_is_the_next() -> None:
    """And where it is later, beside the next; other models are not."""
    words = compared(tangent=0.3, linear_regions=0.35, uniform=0.8, linear_per_segment=0.9)
    assert words.count("% less than") == 1
    assert "the next, the model that is linear by region" in words
    later = compared(tangent=0.3, uniform=0.35, linear_per_segment=0.4, linear_regions=0.6)
    assert later.count("% less than") == 2
    assert "50 % less than the model that is linear by region (0.600°)." in later


@sweep("other, words", [(0.3, "as much as the next"), (0.4, "25 % less than")])
def test_models_with_one_error_are_as_good(other: float, words: str) -> None:
    assert words in compared(tangent=0.3, linear_regions=other)


def test_a_model_alone_is_compared_with_none() -> None:
    assert compared(tangent=0.4).endswith("There is no other model to compare it with.")


def test_p_is_that_of_the_pair_whichever_is_named_first() -> None:
    rows = pd.DataFrame(
        [
            paired_test("held_out", "rotation", ("a", "c"), 0.9),
            paired_test("held_out", "rotation", ("b", "a"), 0.2),
            paired_test("held_out", "place", ("a", "b"), 0.3),
            paired_test("fitted", "rotation", ("a", "b"), 0.4),
        ]
    )
    for pair in (("a", "b"), ("b", "a")):
        assert p_of(rows, "held_out", "rotation", *pair) == 0.2
    assert p_of(rows, "held_out", "rotation", "b", "c") is None
    assert p_of(rows.iloc[:0], "held_out", "rotation", "a", "b") is None


def lost(*places: int) -> pd.DataFrame:
    rows = tables_of(SIZE)["positions"]
    chosen = rows.index[list(places)]
    rows.loc[chosen, ["status", "message"]] = ["unstable", "x"]
    return rows


@sweep("count, more", [(6, ""), (7, "; and 1 more"), (9, "; and 3 more")])
def test_six_places_are_named_and_more_are_counted(count: int, more: str) -> None:
    first = told(positions=lost(*range(count))).splitlines()[0]
    assert first.startswith(f"{count} of 60 poses ended unstable: p01, right")
    assert first.count("(x)") == 6
    assert first.endswith(f"(x){more}.")


@sweep(
    "status, words",
    [("unstable", 1), ("not_converged", 1), ("unreachable", 0), ("converged", 0)],
)
def test_poses_that_were_not_found_are_warned_of(status: str, words: int) -> None:
    rows = tables_of(SIZE)["positions"]
    rows.loc[rows.index[:2], "status"] = status
    warnings = answer(positions=rows).warnings
    assert sum("2 of 60 poses were not found, in 1 patient;" in one for one in warnings) == words


def identifiable(patients: int) -> pd.DataFrame:
    """Of four patients so many whose films tell both ends of the ratio of one joint."""
    rows = [
        {
            "specimen": f"p{n}",
            "model": "tangent_fitted",
            "joint": joint,
            "opposite": False,
            "constrained": False,
            "fit_status": None,
            "n_optima": None,
            "identifiable": joint == "a" or n < patients,
            "open_below": not (joint == "a" or n < patients),
            "open_above": n == 3 and joint == "b",
        }
        for n in range(4)
        for joint in "ab"
    ]
    return pd.DataFrame(rows)


@sweep("patients, few", [(1, True), (2, False), (3, False)])
def test_half_of_the_patients_are_not_fewer_than_half(patients: int, few: bool) -> None:
    words = told(laws=identifiable(patients))
    assert ("At b films tell both ends in fewer than half" in words) is few
    ends = f"{4 + patients} of 8 ratios"
    assert ends in words
    assert f"one end of {3 - patients} and neither of 1" in words


@sweep("decided, told_of", [(40.8, True), (40.9, False), (43.0, False)])
def test_parameters_that_films_decide_are_told_where_they_are_fewer(
    decided: float, told_of: bool
) -> None:
    """Than 95 % of 43: 40.85."""
    rows = tables_of(SIZE)["positions"]
    rows.loc[rows["model"] == "tangent_fitted", "decided_parameters"] = decided
    assert ("of which the films decide" in told(positions=rows)) is told_of


@sweep("share, count", [(1.0, 0), (1.0001, 84)])
def test_a_rotation_at_its_end_is_not_beyond(share: float, count: int) -> None:
    rows = tables_of(SIZE)["displacements"].assign(share_of_range=share)
    assert f"{count} of 84 held-out rotations" in told(displacements=rows)


@sweep("scale, films", [(1.0 + 2e-9, 3), (1.0 - 2e-9, 3), (1.0 + 5e-10, 0)])
def test_a_film_is_brought_to_size_by_more_than_rounding(scale: float, films: int) -> None:
    rows = tables_of(SIZE)["positions"]
    rows.loc[rows["position"] == "traction", "film_scale"] = scale
    assert (f"{films} of 12 films were brought" in told(positions=rows)) is bool(films)


@sweep("error, words", [(0.6, "as much on fitted films"), (0.59, "less on"), (0.61, "more on")])
def test_the_tangent_beside_linear_regions_as_good_better_and_worse(
    error: float, words: str
) -> None:
    held_out = standing({"tangent": error, "linear_regions": 0.6}, None).rows
    made = ResultTables({"accuracy": held_out.assign(films="fitted")}, {}, {})
    (sentence,) = both_ways(study_of(SIZE), made)
    assert words in sentence


def test_held_out_errors_come_before_those_of_fitted_films() -> None:
    lines = [line for line in told().splitlines() if "least error first" in line]
    assert [line.split()[0] for line in lines] == ["Held-out", "Fitted"]


def test_without_tables_nothing_is_said() -> None:
    empty: Any = ResultTables({}, {}, {})
    assert findings(study_of(SIZE), empty) == []

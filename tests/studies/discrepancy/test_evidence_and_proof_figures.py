"""Figures of the rounds of a search, and of its proof on motion held out."""

from pathlib import Path

import numpy as np
import pandas as pd
from discrepancy_cases import frames
from matplotlib.figure import Figure
from matplotlib.text import Text
from sweeps import sweep
from test_discrepancy_page import drawn, said

from spinepipe.studies.discrepancy.figures.evidence_by_round import (
    MOST_ROUNDS,
    EvidenceRound,
    rounds,
    rounds_shown,
)


def looked(stage: str, beside: str, **evidence: float) -> pd.DataFrame:
    """Rows of one stage of the table candidates; the form that is named last is the worse one."""
    rows = [
        {"stage": stage, "beside": beside, "effect": name, "log_evidence": value - worse}
        for name, value in evidence.items()
        for worse in (0.0, 3.0)
    ]
    return pd.DataFrame(rows)


def search_of(*stages: pd.DataFrame) -> pd.DataFrame:
    return pd.concat([looked("design", "", creep=np.nan), *stages], ignore_index=True)


SEARCH = search_of(
    looked("screen 1", "", creep=20.0, neutral_zone=50.0, marker_bias=0.4),
    looked("refit 1", "", creep=22.0, neutral_zone=60.0),
    looked("screen 2", "neutral_zone", creep=9.0, neutral_zone=-1.0, marker_bias=-0.5),
    looked("refit 2", "neutral_zone", creep=8.0),
    looked("screen 3", "neutral_zone, creep", creep=-1.0, neutral_zone=0.0, marker_bias=0.1),
    looked("screen in place of neutral_zone (1)", "creep", hysteresis=41.0, neutral_zone=39.0),
    looked("refit in place of neutral_zone (1)", "creep", hysteresis=44.0, neutral_zone=39.5),
    looked("screen in place of creep (2)", "hysteresis", creep=2.0, neutral_zone=1.0),
)
"""A neutral zone and creep enter; hysteresis takes the zone's place; creep leaves."""


def test_the_best_form_of_an_effect_stands_for_it() -> None:
    first, *_ = rounds(SEARCH)
    assert first.evidence.loc["neutral_zone", "refit"] == 60.0
    assert first.evidence.loc["neutral_zone", "screen"] == 50.0
    assert np.isnan(first.evidence.loc["marker_bias", "refit"])
    assert first.shown["neutral_zone"] == 60.0  # of the refit
    assert first.shown["marker_bias"] == 0.4  # of the screen alone


def test_an_effect_whose_refits_all_failed_is_marked(root: Path) -> None:
    failed = looked("refit 1", "", marker_bias=np.nan)
    first, *_ = rounds(search_of(SEARCH.iloc[1:], failed))
    assert bool(first.evidence.loc["marker_bias", "no_fit"])
    assert not first.evidence.loc[["creep", "neutral_zone"], "no_fit"].any()
    candidates = frames("NAMED")["candidates"]
    screened = candidates[
        (candidates["stage"] == "screen 1") & (candidates["effect"] == "hysteresis")
    ]
    tried = screened.assign(stage="refit 1", log_evidence=np.nan, status="not_converged")
    words = said(
        drawn("evidence_by_round", root, "NAMED", candidates=pd.concat([candidates, tried]))
    )
    assert "(3.7)" in words
    assert "no refit of it has a result" in words


def test_rounds_say_what_they_were_and_led_to() -> None:
    found = rounds(SEARCH, ("hysteresis",))
    assert [one.words for one in found] == [
        "base alone",
        "beside neutral zone",
        "beside neutral zone, creep",
        "in place of neutral zone",
        "in place of creep",
    ]
    assert [one.events for one in found] == [
        {"neutral_zone": "entered"},
        {"creep": "entered"},
        {},
        {"hysteresis": "entered", "neutral_zone": "replaced"},
        {"creep": "left"},
    ]
    last = rounds(SEARCH)[-1]
    assert last.events == {}  # nobody says what came of it


def test_a_second_form_of_an_effect_enters_too() -> None:
    twice = search_of(
        looked("screen 1", "creep", creep=9.0),
        looked("screen 2", "creep, creep", creep=1.0),
    )
    first, second = rounds(twice)
    assert first.events == {"creep": "entered"}
    assert second.words == "beside creep × 2"


def test_a_trial_of_two_in_the_place_of_one_is_no_step_of_the_search() -> None:
    tried = search_of(
        looked("screen in place of creep (1)", "", hysteresis=9.0),
        looked("screen in place of creep, beside hysteresis (2)", "hysteresis", load_offset=8.0),
        looked("screen 2", "creep", hysteresis=1.0),
    )
    found = rounds(tried)
    assert [one.trial for one in found] == [False, True, False]
    assert all(one.events == {} for one in found)


def test_two_at_once_are_told_apart() -> None:
    (one,) = rounds(search_of(looked("screen in place of a_b and creep (1)", "", creep=1.0)))
    assert one.without == ("a_b", "creep")


def test_nothing_tried_is_no_round() -> None:
    assert rounds(search_of()) == []


@sweep("many", [3, 20])
def test_the_matrix_has_every_effect_with_evidence(many: int, root: Path) -> None:
    candidates = frames("NAMED")["candidates"]
    again = [
        candidates.assign(
            stage=candidates["stage"].str.replace(" 1", f" {n}"), beside="neutral_zone"
        )
        for n in range(2, many)
    ]
    quiet = candidates[candidates["stage"] == "screen 1"].iloc[:1]
    quiet = quiet.assign(effect="creep", log_evidence=0.0)
    words = said(
        drawn(
            "evidence_by_round",
            root,
            "NAMED",
            candidates=pd.concat([candidates, quiet, *again]),
        )
    )
    assert "88.0" in words
    assert "neutral zone" in words
    assert "creep" not in words
    assert "1 effect without a trace" in words
    assert "below the threshold 6.2" in words
    assert ("of 19 rounds" in words) == (many == 20)


def test_of_many_rounds_those_that_led_to_something_are_shown() -> None:
    empty = pd.DataFrame()
    many = [
        EvidenceRound(str(n), (), (), False, empty, {"creep": "entered"} if n in (13, 17) else {})
        for n in range(20)
    ]
    kept = [int(one.stage) for one in rounds_shown(many)]
    assert kept == sorted(kept)
    assert len(kept) == MOST_ROUNDS
    assert {0, 13, 17} <= set(kept)


def marked_worse(figure: Figure) -> list[Text]:
    return [text for axis in figure.axes for text in axis.texts if text.get_text() == "worse"]


def test_a_fold_that_became_worse_is_marked(root: Path) -> None:
    held = frames("NAMED")["held_out"]
    assert not marked_worse(drawn("held_out_by_test", root, "NAMED"))
    held.loc[0, "worse"] = True
    figure = drawn("held_out_by_test", root, "NAMED", held_out=held)
    (marked,) = marked_worse(figure)
    assert marked.get_fontweight() == "bold"
    assert "83 % of gap" in said(figure)


def test_a_fold_that_noise_explains_is_no_proof(root: Path) -> None:
    held = frames("NAMED")["held_out"]
    held["gap_base_low"] = 0.0
    words = said(drawn("held_out_by_test", root, "NAMED", held_out=held))
    assert "noise may be all" in words
    assert "of gap" not in words


def test_intervals_are_drawn_where_they_are(root: Path) -> None:
    held = frames("NAMED")["held_out"]
    figure = drawn("held_out_by_test", root, "NAMED", held_out=held)
    lines = [line.get_xdata() for axis in figure.axes for line in axis.lines]
    ends = held[["gap_base_low", "gap_base_high"]].iloc[0].to_list()
    assert any(np.allclose(x, ends) for x in lines if len(x) == 2)


def test_a_fold_without_a_result_tells_why(root: Path) -> None:
    held = frames("NAMED")["held_out"]
    gaps = [name for name in held.columns if name.startswith("gap_")]
    held.loc[0, [*gaps, "closed"]] = np.nan
    held.loc[0, ["status", "message"]] = ["unstable", "it tips over"]
    assert "no result: it tips over" in said(
        drawn("held_out_by_test", root, "NAMED", held_out=held)
    )

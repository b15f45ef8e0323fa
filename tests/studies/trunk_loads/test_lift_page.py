"""Page of recorded lifts: each sentence by numbers written here, and what is drawn."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from page_rules import all_verdicts, faults_of_chart, faults_of_told, verdicts
from test_lifts import STUDY, cohort, rows

from spinepipe.report.conclusions import Conclusion, sentences_of, told
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.viewer.scene import scenes_as_data
from spinepipe.studies.trunk_loads.charts_of_lifts import over_time
from spinepipe.studies.trunk_loads.conclusions_of_lifts import of_lifts
from spinepipe.studies.trunk_loads.lift_rows import GUIDELINE_N, largest_load, lift_off_s
from spinepipe.studies.trunk_loads.page import page
from spinepipe.studies.trunk_loads.scenes_of_lifts import lift_scenes
from spinepipe.studies.trunk_loads.tables import LIFT_BANDS, LIFT_FRAMES, LIFT_LOADS, LIFT_PATHS

PACKAGE = "spinepipe.studies.trunk_loads"
LEVELS = ("L5S1", "L4L5")
TIMES = (0.0, 0.5, 1.0, 1.5)
NAMED = {table.name: table for table in (LIFT_LOADS, LIFT_FRAMES, LIFT_BANDS, LIFT_PATHS)}


def tables(
    peak: float = 4000.0,
    trials: int = 1,
    lost: tuple[float, ...] = (),
    failed: int = 0,
    bands: bool = True,
    off: float = 0.5,
    above: bool = False,
) -> Mapping[str, pd.DataFrame]:
    """Lifts of four frames, the third of which loads most; the load is borne from `off` s on."""
    loads, frames, sampled = list[dict[str, Any]](), list[dict[str, Any]](), list[dict[str, Any]]()
    for trial in range(trials):
        for time, share in zip(TIMES, (0.2, 0.6, 1.0, 0.4), strict=True):
            known = {"specimen": "s01", "trial": f"lift{trial + 1}", "time_s": time}
            newtons = share * (peak - 50.0 * trial)
            weak = time in lost
            frames.append(known | {"load_n": 147.0 if time >= off else 0.0})
            for level in LEVELS:
                own = known | {"level": level}
                loads.append(
                    own
                    | {
                        "compression_n": newtons,
                        "shear_anterior_n": 0.1 * newtons,
                        "shear_right_n": 0.0,
                        "required_extension_nm": 0.05 * newtons,
                        "pressure_mpa": 1e-3 * newtons,
                        "inside_eq_6": newtons < 3700.0,
                        "least_stress_mpa": 0.3,
                        "status": "beyond_strength"
                        if weak
                        else "converged_above"
                        if above
                        else "converged",
                        "message": "3.0 N m too much for the muscles at L5S1" if weak else "",
                    }
                )
                told_of = {"low": 0.9 * newtons, "median": newtons, "high": 1.1 * newtons}
                if failed > 20:
                    told_of["high"] = None
                sampled.append(
                    own | told_of | {"n_samples": 100 - failed, "n_failed": failed, "n_above": 0}
                )
    made = {"lift_loads": loads, "lift_frames": frames, "lift_bands": sampled if bands else []}
    return {name: pd.DataFrame(of, columns=NAMED[name].names) for name, of in made.items()}


CASES: Mapping[str, tuple[Mapping[str, pd.DataFrame], bool]] = {
    "lift above|lift_limit above|lift_time after|lift_pressure beyond|lift_held ok|lift_bands ok"
    "|lift_methods alone_sampled": (tables(), True),
    "lift below|lift_limit below|lift_time before": (tables(3000.0, off=1.2), True),
    "lift open|lift_held stop": (tables(lost=(1.0,)), True),
    "lift none|lift_held stop": (tables(lost=TIMES), True),
    "lift above|lift_range all|lift_bands check": (tables(trials=3, failed=5), True),
    "lift_bands check_open": (tables(failed=40), True),
    "lift_too above|lift_methods sampled": (tables(), False),
    "lift_too below": (tables(3000.0), False),
    "lift_too open": (tables(lost=(1.0,)), False),
    "lift_too none": (tables(lost=TIMES), False),
    "lift above|lift_held check_above": (tables(above=True), True),
}


def few_lost() -> Mapping[str, pd.DataFrame]:
    """Of 40 lifts of four frames one frame is not held."""
    found = dict(tables(trials=40))
    loads = found["lift_loads"].copy()
    loads.loc[loads.index[:2], ["status", "message"]] = ["not_converged", ""]
    return found | {"lift_loads": loads}


def one_lift_lost() -> Mapping[str, pd.DataFrame]:
    found = dict(tables(trials=2))
    loads = found["lift_loads"].copy()
    third = tables(trials=3)["lift_loads"]
    third = third[third["trial"] == "lift3"].assign(status="beyond_strength", compression_n=10.0)
    frames = tables(trials=3)["lift_frames"]
    return found | {
        "lift_loads": pd.concat([loads, third], ignore_index=True),
        "lift_frames": frames,
    }


@cache
def concluded(expected: str) -> tuple[Conclusion, ...]:
    study = STUDY.model_copy(update={"motions": STUDY.motions.model_copy(update={"samples": 100})})
    made, alone = CASES[expected]
    return tuple(of_lifts(study, cohort(), made, alone))


@pytest.mark.parametrize("expected", list(CASES))
def test_numbers_decide_what_is_concluded(expected: str) -> None:
    found = concluded(expected)
    assert {tuple(one.split()) for one in expected.split("|")} <= verdicts(found)
    rules = [one.rule for one in found]
    assert len(rules) == len(set(rules))
    if CASES[expected][1]:
        assert not list(faults_of_told(told(found, sentences_of(PACKAGE))))


def test_every_sentence_of_lifts_is_said() -> None:
    said = set().union(*(verdicts(concluded(expected)) for expected in CASES))
    for made, alone in ((few_lost(), True), (one_lift_lost(), True)):
        said |= verdicts(of_lifts(STUDY, cohort(), made, alone))
    undrawn = STUDY.model_copy(update={"motions": STUDY.motions.model_copy(update={"samples": 0})})
    for alone in (True, False):
        said |= verdicts(of_lifts(undrawn, cohort(), tables(bands=False), alone))
    every = {one for one in all_verdicts(sentences_of(PACKAGE)) if one[0].startswith("lift")}
    assert {one for one in said if one[0].startswith("lift")} == every


def test_the_answer_has_the_interval_of_its_own_frame_and_its_distance_from_the_guideline() -> None:
    rows = told(concluded(next(iter(CASES))), sentences_of(PACKAGE))
    answer = next(one for one in rows if one.place == "answer")
    load = answer.values["load"]
    assert (load.number, load.low, load.high, load.n) == (4000.0, 3600.0, 4400.0, 100)
    assert answer.values["apart"].number == round(100.0 * (4000.0 / GUIDELINE_N - 1.0)) == 18.0
    assert "18 % above lifting guidelines" in answer.text


def test_the_load_is_borne_when_hands_bear_half_of_it() -> None:
    frames = tables()["lift_frames"]
    assert lift_off_s(frames) == 0.5
    assert lift_off_s(frames.assign(load_n=147.0)) is None
    assert lift_off_s(frames.assign(load_n=np.nan)) is None
    found = largest_load(tables(), "s01", "lift1")
    assert found is not None
    assert found.after_s == 0.5


@pytest.mark.parametrize("made", [tables(), tables(trials=3, lost=(1.0,)), tables(failed=40)])
def test_the_figure_keeps_the_rules(made: Mapping[str, pd.DataFrame]) -> None:
    chart = over_time(STUDY, cohort(), made)
    assert not list(faults_of_chart(chart))
    assert len(chart.panels) == 3


@cache
def solved() -> Mapping[str, pd.DataFrame]:
    """Tables of the recorded lift, few frames."""
    return {
        name: rows()[name].assign(specimen="s01", trial="lift1").reindex(columns=table.names)
        for name, table in NAMED.items()
    }


def test_the_view_plays_the_lift_over_the_course_of_the_load() -> None:
    (scene,) = lift_scenes(solved())
    assert [body.name for body in scene.bodies] == [
        "S1",
        "L5",
        "L4",
        "L3",
        "L2",
        "L1",
        "T12",
        "T11",
    ]
    assert all(step.muscles for step in scene.steps)
    data = scenes_as_data([scene])["scenes"][0]
    loads = solved()["lift_loads"]
    own = loads[loads["level"] == "L4L5"].sort_values("time_s")
    line, at = np.array(data["course"]["line"]), data["course"]["at"]
    assert len(line) == len(own)
    assert len(at) == len(scene.steps)
    assert (line[0, 0], line[-1, 0]) == (0.0, 100.0)
    assert line[:, 1].min() == 0.0
    assert int(line[:, 1].argmin()) == int(own["compression_n"].to_numpy(float).argmax())


def test_a_study_of_lifts_alone_has_a_page() -> None:
    made = page(STUDY, cohort(), ResultTables(solved()))
    html = made.html(STUDY, cohort(), ResultTables(solved()))
    assert made.chooser == "Lift"
    assert 'class="course' in html
    assert "L4–L5" in made.at("answer")[0].text
    assert len(html) < 2_000_000

"""The page of tracked motions: every verdict from numbers that make it, and from none else.

Tables are made up beside the cohort of `tracking_table_cases`, whose true motions are known. Seen
here: a claim that stays when the numbers turn, an end of a grid that rounding hides, two rules of
multiple testing, a prior told as data, a text or figure that does not fit.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from page_rules import (
    all_verdicts,
    faults_of_chart,
    faults_of_page,
    faults_of_sentences,
    faults_of_told,
    verdicts,
)
from scipy import stats
from scipy.spatial.transform import Rotation
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.power import TTestPower
from tracking_table_cases import COSTS, ERROR, Size, cohort_of, frame, study_of, tables_of

from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import BODIES, JOINTS, LUMBAR_JOINTS, body_poses
from spinepipe.report.conclusions import Told, sentences_of, told
from spinepipe.report.page.study_page import ResultTables
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking import charts, charts_of_stiffness
from spinepipe.studies.tracking.conclusions import conclusions
from spinepipe.studies.tracking.conclusions_of_stiffness import calibrated_values
from spinepipe.studies.tracking.page import page, shown_tables
from spinepipe.studies.tracking.persons import skeleton_in
from spinepipe.studies.tracking.ranking import paired_sample_size, rankings
from spinepipe.studies.tracking.sharing import similarity_rows
from spinepipe.studies.tracking.tables import ERRORS, SIMILARITY, STIFFNESS, WINDOW
from spinepipe.studies.tracking.trials import kinds_of_trials
from spinepipe.studies.tracking.true_motions import true_motions
from spinepipe.tables import StudyTables

PACKAGE = "spinepipe.studies.tracking"
GENERIC, BOTH, OWN = "optk_generic", "optk_from_both", "optk_calibrated"
FIGURES = (
    *(charts.approach_errors, charts.error_by_level, charts.motion_sharing, charts.kinematics),
    *(charts_of_stiffness.stiffness_profiles, charts_of_stiffness.stiffness_by_level),
)
Changed = Mapping[str, pd.DataFrame]


def errors(by: Mapping[str, tuple[float, ...]], trial: str = "flexion_extension") -> pd.DataFrame:
    """Errors by approach, one for each subject: centres in mm, angles a third of that in deg."""
    rows: list[dict[str, Any]] = []
    for approach, values in by.items():
        for k, value in enumerate(values):
            known = {"specimen": f"s0{k + 1}", "trial": trial, "approach": approach}
            for measure, level, share in (("centre_mm", "L3", 1.0), ("angle_deg", "L3L4", 0.35)):
                for far in (0.9, 1.1):
                    told = {"measure": measure, "level": level if far > 1.0 else "L2"}
                    size = far * share * value
                    rows.append(known | told | {"mean": size, "p95": size, "largest": size, "n": 9})
    return frame(ERRORS, rows)


def steady(value: float, spread: float = 1e-4) -> tuple[float, float, float]:
    """Three subjects who are nearly alike, so that any difference between approaches is shown."""
    return value, value * (1.0 + spread), value * (1.0 - 2.0 * spread)


WIDE = (1.0, 9.0, 5.2)
"""Three subjects who are not: no difference from a steady approach is shown."""


def changed(table: str, size: Size | None = None, **cells: Any) -> dict[str, pd.DataFrame]:
    """A table of made-up results with other cells in all rows, or with ``where`` in some."""
    rows = tables_of(size or Size())[table]
    where = cells.pop("where", slice(None))
    chosen = rows.query(where).index if isinstance(where, str) else where
    for name, value in cells.items():
        rows[name] = rows[name].astype(object) if isinstance(value, str) else rows[name]
        rows.loc[chosen, name] = value
    return {table: rows}


def ratios(share: float, beyond: float = 0.1) -> Changed:
    """Calibrated stiffness of 40 elements, that share of them far beyond what the prior gives."""
    rows = []
    for law, k in product((BOTH, "optk_from_flexion", "optk_from_bending"), range(40)):
        ratio = beyond if k < 40 * share else 1.02
        told = {"at_high_moment": 100.0 * ratio, "high_moment_nm": 5.0, "ratio_to_generic": ratio}
        place = {"joint": JOINTS[k % 17], "coordinate": "extension", "side": "positive"}
        place |= {"specimen": f"s{k // 17}", "law": law}
        rows.append(place | told | {"a": 1.0, "b": 10.0, "status": "converged", "message": ""})
    return {"stiffness": frame(STIFFNESS, rows)}


def similarity(cmc: float | None) -> Changed:
    """All approaches alike; undefined where there is no coefficient."""
    status = "undefined" if cmc is None else "done"
    return changed("similarity", cmc=np.nan if cmc is None else cmc, status=status)


def equal_shares() -> Changed:
    """What comes of motions in which all lumbar joints turn alike."""
    rows = similarity_rows(tables_of(Size())["tracked"], kinds_of_trials(cohort_of(Size())))
    return {"similarity": frame(SIMILARITY, list(rows))}


def differing() -> Cohort:
    """Persons whose true bends differ more than joints do: another joint does all of each."""
    cohort = cohort_of(Size())
    parts = []
    for number, name in enumerate(cohort.specimen_names):
        skeleton = skeleton_in(cohort, name, subject_of(cohort, name))
        q = np.zeros((21, len(BODIES), 6))
        q[:, 1 + 2 * number, 4] = np.sin(np.linspace(0.0, np.pi, 21))
        parts.append(true_rows(skeleton, name, "lateral_bending", q))
    return replace(cohort, further={**cohort.further, "truth_centres": pd.concat(parts)})


def true_rows(skeleton: Any, name: str, trial: str, q: np.ndarray) -> pd.DataFrame:
    """Rows of truth_centres.csv of bodies that are posed by coordinates."""
    turns = body_poses(skeleton, q)[0]
    rows = [
        (name, trial, 0.1 * f, body, 0.0, 0.0, 0.0, *angles)
        for f in range(len(q))
        for body, angles in zip(
            BODIES, Rotation.from_matrix(turns[f]).as_euler("ZXY", degrees=True), strict=True
        )
    ]
    names = ["specimen", "trial", "time_s", "vertebra", "x_mm", "y_mm", "z_mm"]
    names += ["extension_deg", "right_bending_deg", "left_rotation_deg"]
    return pd.DataFrame(rows, columns=names)


Case = tuple[set[tuple[str, str]], Size, Changed, Mapping[str, Any]]


def case(says: str, size: Size | None = None, tables: Changed | None = None, **asked: Any) -> Case:
    """What is said, of which study, with which tables changed and which settings."""
    pairs = {tuple(one.split(":")) for one in says.split()}
    return pairs, size or Size(), tables or {}, asked  # type: ignore[return-value]


def ranked(**by: tuple[float, ...]) -> Changed:
    return {"errors": errors(by)}


THREE = {"ik": steady(9.0), GENERIC: steady(4.0), "optk_zero": steady(8.0)}
SCATTERED = {"ik_smooth": (4.0, 9.0, 6.0)}
LOST, NOT_ALL = tuple(ERROR), "approach != 'ik' or specimen != 's02'"
UNUSABLE = changed("fits", where="approach == @GENERIC", status="not_converged")
NONE_AGAINST = changed("sharing", where="share < 0", share=0.0)

CASES: dict[str, Case] = {
    "as made": case(
        "vibration:check against:check sharing:tested_open likeness:lower closest:other markers:ok "
        "clusters:ok sizes:ok recordings:check assumed:check profiles:one_sided calibrations:ok "
        "methods_profiles:profiled fits:ok basis:markers methods:tracked methods_errors:compared"
    ),
    "shown": case(
        "nearest:best error:centre reference:kinematics angle:moving sample:ok by_level:largest "
        "stiffness_helps:better",
        tables=ranked(**THREE) | changed("ranges", joint="L3L4", range=6.0),
    ),
    "another": case(
        "nearest:best stiffness_helps:worse angle:alone",
        tables=ranked(**{**THREE, "optk_zero": steady(1.0)}) | changed("ranges", joint="T1T2"),
    ),
    "some": case("nearest:some sample:check needed:needed", tables=ranked(**THREE, **SCATTERED)),
    "not shown": case(
        "nearest:unsure needed:needed_both stiffness_helps:not_shown calibrated:not_shown",
        tables=ranked(ik=(9, 12, 8), optk_zero=(8, 14, 9), **{GENERIC: WIDE, OWN: (2, 9, 6)}),
    ),
    "hopeless": case("sample:check_many", tables=ranked(ik=(5, 6, 7), ik_smooth=(5.3, 5.71, 7))),
    "helps": case("calibrated:better", tables=ranked(**THREE, **{OWN: steady(2.0), BOTH: WIDE})),
    "harms": case("calibrated:worse", tables=ranked(**THREE, **{OWN: steady(6.0)})),
    "differ": case(
        "calibrated:split", tables=ranked(**THREE, **{OWN: steady(2.0), BOTH: steady(6.0)})
    ),
    "two subjects": case(
        "nearest:few sample:check_few calibrated:few stiffness_helps:few methods_errors:described",
        Size(2),
    ),
    "one approach": case("nearest:alone sample:ok_alone", tables=ranked(**{GENERIC: WIDE})),
    "angles": case("error:angle", tables={"errors": errors(THREE).query("measure < 'b'")}),
    "no truth": case(
        "nearest:no_truth basis:untested residual:closest sample:check_untested sharing:untested "
        "likeness:untested",
        Size(truth=False),
    ),
    "neither": case("likeness:untested_undefined", Size(truth=False), similarity(None)),
    "nothing found": case("fits:stop nearest:none", Size(1, failing=LOST)),
    "lacking": case("lacking:check", tables={"errors": errors(THREE).query(NOT_ALL)}),
    "farther": case("sharing:tested", tables=changed("sharing", share=0.9)),
    "equal": case("likeness:equal", tables=equal_shares()),
    "equal, no truth": case("likeness:equal", Size(truth=False), equal_shares()),
    "scatters": case("likeness:undefined use:stop_lost", tables=similarity(None) | UNUSABLE),
    "as alike": case("likeness:alike against:ok", tables=similarity(0.85) | NONE_AGAINST),
    "too alike": case("likeness:higher", tables=similarity(1.0)),
    "fixed": case("likeness:fixed", tables=ranked(ik_constrained_christophy_2012=WIDE)),
    "still": case("sharing:none", Size(moves=False)),
    "told": case("profiles:all_told profile_fits:ok", Size(verdict="told")),
    "flat": case("profiles:flat", Size(verdict="not_told")),
    "falls": case("profiles:edge_only", Size(verdict="falls")),
    "falls slowly": case("profiles:edge", Size(verdict="falls slowly")),
    "gap": case("profiles:gap", Size(verdict="gap")),
    "lost": case("profiles:lost profile_fits:check", Size(verdict="lost")),
    "within": case("prior:within between:prior", tables=ratios(0.05)),
    "beyond": case("prior:beyond between:moved", tables=ratios(0.1)),
    "no load": case("prior:unloaded", tables=changed("stiffness", ratio_to_generic=np.nan)),
    "poor": case(
        "clusters:check sizes:check recordings:ok calibrations:check fits:check markers:check",
        tables=changed("clusters", where=[0], status="not_rigid")
        | changed("sizes", where=[0], factor=1.2)
        | changed("stiffness", where="specimen == 's02'", status="not_converged")
        | changed("fits", where=[1], status="not_converged", largest_deviation_mm=77.0)
        | {"remarks": tables_of(Size())["remarks"].iloc[:0]},
    ),
    "unknown": case(
        "clusters:check_unknown sizes:check_unknown vibration:ok",
        tables=changed("clusters", status="too_few")
        | changed("sizes", status="not_told")
        | changed("fits", acceleration_rms_deg_per_s2=9.0),
    ),
    "scaled": case(
        "sizes:ok_scaled closest:same",
        tables=changed("fits", where="approach == @GENERIC", marker_rmse_mm=0.5),
        scaling="markers",
    ),
}


@dataclass(frozen=True, eq=False)
class Said:
    """What a made-up study comes to."""

    verdicts: set[tuple[str, str]]
    told: list[Told]

    def one(self, rule: str) -> Told:
        """The first sentence of a rule."""
        return next(one for one in self.told if one.rule == rule)


def said_of(one: Case, cohort: Cohort | None = None) -> Said:
    """All conclusions of a case, in words."""
    _, size, tables, asked = one
    study = study_of(size).model_copy(update=asked)
    results = ResultTables(StudyTables(tables_of(size, **tables)))
    found = list(conclusions(study, cohort or cohort_of(size), results))
    return Said(verdicts(found), told(found, sentences_of(PACKAGE)))


@cache
def said(name: str) -> Said:
    return said_of(CASES[name])


def test_sentences_of_the_table() -> None:
    assert not list(faults_of_sentences(PACKAGE))


@pytest.mark.parametrize("name", CASES)
def test_what_the_numbers_make_is_said(name: str) -> None:
    made = said(name)
    assert CASES[name][0] <= made.verdicts
    assert not list(faults_of_told(made.told))


def test_persons_who_truly_differ_are_told_as_such() -> None:
    made = said_of(CASES["scatters"], differing())
    assert ("likeness", "differ") in made.verdicts
    assert not list(faults_of_told(made.told))


def test_profiles_that_are_told_in_part_are_counted() -> None:
    parts = [tables_of(Size(verdict=name)) for name in ("told", "falls")]
    mixed = {
        name: pd.concat([parts[0][name].iloc[:n], parts[1][name].iloc[n:]], ignore_index=True)
        for name, n in (("profiles", 2), ("profile_points", 10))
    }
    one = said_of(case("", tables=mixed)).one("profiles")
    assert one.verdict == "told"
    assert "in 2 of 6 profiles" in one.text.replace("\u00a0", " ")


def plainly(one: Told) -> str:
    """Text and note without hard spaces."""
    return f"{one.text} {one.note}".replace("\u00a0", " ")


def test_values_that_left_the_prior_are_told_beside_those_that_did_not() -> None:
    """2 of 40 were moved by data, and the page said that data tell little."""
    text = plainly(said("within").one("prior"))
    assert "not shown to tell more than the prior: 38 of 40 values" in text
    assert "which data moved: 2." in text
    assert "Of 40 elements 2 lie outside" in plainly(said("within").one("between"))


def test_errors_of_sagittal_angles_stand_beside_sagittal_turns_of_the_same_joints() -> None:
    """Another axis and another joint turn further, and were the scale of the errors."""
    own = changed("ranges", joint="L3L4", range=6.0)["ranges"]
    other = [own.assign(coordinate="right_bending", range=40.0), own.assign(joint="L5S1", range=50)]
    tables = ranked(**THREE) | {"ranges": pd.concat([own, *other], ignore_index=True)}
    one = said_of(case("", tables=tables)).one("angle")
    assert one.values["range"].number == 6.0
    assert one.note.startswith("L3–L4 turn by 6° sagittally")
    whole = said_of(case("", tables=changed("ranges", range=5.0))).one("angle")
    assert whole.note.startswith("L4–L5 to T7–T8 turn by 5°")
    assert "(L3–L4)" in said("another").one("angle").text


def test_errors_that_do_not_add_up_from_the_pelvis_are_not_said_to() -> None:
    rows = errors(THREE)
    rows.loc[rows["level"] == "L2", "level"] = "L5"
    rows.loc[rows["level"] == "L5", "mean"] *= 2.0
    text = plainly(said_of(case("", tables={"errors": rows})).one("by_level"))
    assert "(L3) and" in text
    assert text.strip().endswith("(L5).")
    assert "pelvis" not in text


def test_a_cost_that_falls_to_an_end_is_not_said_to_bound_nothing() -> None:
    """All but the softest value is excluded: that is a bound from above."""
    for name in ("falls", "falls slowly"):
        text = plainly(said(name).one("profiles"))
        assert "in 6 of 6 the cost is least at the softest value tried" in text
        assert "bounded" not in text
    assert "all other values of these profiles are excluded" in plainly(
        said("falls").one("profiles")
    )


def test_the_worst_motion_is_not_told_alone() -> None:
    """Near the truth in one of two motions, far from it in the other."""
    truth = similarity_rows(true_motions(cohort_of(Size())), kinds_of_trials(cohort_of(Size())))
    true = {row["trial"]: row["cmc"] for row in truth if row["window"] == WINDOW and row["cmc"]}
    assert len(true) == 2
    trial, cmc = next(iter(true.items()))
    one = said_of(case("", tables=changed("similarity", where=f"trial == '{trial}'", cmc=cmc)))
    told_of = one.one("likeness")
    assert told_of.verdict == "lower"
    assert "In 1 of 2 motions it is within 0.1 of the true one." in plainly(told_of)
    assert "In 0 of 2 motions" in plainly(said("scatters").one("likeness"))


def test_nobody_is_said_to_scatter_whose_shares_are_flat() -> None:
    for name in ("equal", "scatters", "neither", "as made"):
        assert "scatters" not in plainly(said(name).one("likeness"))


def test_shares_as_far_off_as_equal_ones_are_not_told_as_worse_or_better() -> None:
    assert "not distinguishable (3 subjects)" in plainly(said("as made").one("sharing"))
    assert "distinguishable" not in plainly(said("farther").one("sharing"))
    assert ("sharing", "tested_open") in said("two subjects").verdicts


def test_what_is_counted_is_named() -> None:
    """Fits of motions, means over a part of the cycle, segments; postures without a spline."""
    made = said("as made")
    motions = tables_of(Size())["fits"].dropna(subset=["acceleration_rms_deg_per_s2"])
    assert f"of {len(motions)} fits of motions" in plainly(made.one("vibration"))
    assert "No fit of a motion" in plainly(said("unknown").one("vibration"))
    for name in ("as made", "as alike"):
        assert "over 20–80 % of the cycle" in plainly(said(name).one("against"))
    for name in ("as made", "poor", "scaled"):
        assert "segments of" in plainly(said(name).one("sizes")).lower()
    assert "frame by frame or as a spline with 101 nodes" in plainly(made.one("methods"))
    for name in ("some", "not shown"):
        assert "with these differences" in said(name).one("needed").text


def test_every_verdict_is_reached() -> None:
    found = set().union(*(said(name).verdicts for name in CASES))
    of_lifts = {"moment", "course", "peak", "before", "quasi_static", "other", "compared", "lifted"}
    every = {one for one in all_verdicts(sentences_of(PACKAGE)) if one[0] not in of_lifts}
    assert every - found == {
        ("likeness", "differ"),
        ("profiles", "told"),
    }, "seen by two tests above"


def test_the_end_of_a_grid_is_found_though_it_went_through_a_logarithm() -> None:
    """0.1 came back as 0.10000000000000002, and steep profiles were told as flat ones."""
    tried = np.array([0.1, 0.3, 1.0, 3.0, 10.0])
    rows = changed("profiles", Size(verdict="falls"), best_ratio=float(np.exp(np.log(0.1))))
    points = tables_of(Size(verdict="falls"))["profile_points"]
    points["ratio"] = tried[points["point"]]
    tables = rows | {"profile_points": points}
    one = said_of(case("", Size(verdict="falls"), tables)).one("profiles")
    assert one.verdict == "edge_only"
    assert one.values["edge"].number == 6
    assert one.values["most"].number == max(COSTS["falls"])


def test_one_correction_holds_for_all_that_is_said_of_differences() -> None:
    """Pairs of approaches, both measures, in motion and in stance: corrected by another library."""
    rows = tables_of(Size())["errors"]
    rows["mean"] *= 1.0 + 0.2 * np.random.default_rng(5).random(len(rows))
    found = rankings(cohort_of(Size()), rows)
    raw, named = [], []
    for k, one in enumerate(found):
        for first, other in combinations(one.approaches, 2):
            raw.append(stats.ttest_rel(one.values[first], one.values[other]).pvalue)
            named.append((k, first, other))
    assert len(raw) == 2 * (21 + 10)
    expected = multipletests(raw, method="holm")[1]
    for (k, *pair), p in zip(named, expected, strict=True):
        assert found[k].tests == len(raw)
        assert found[k].p[frozenset(pair)] == pytest.approx(p)
        assert (found[k].shown(*pair) != 0) == (p < 0.05)


def test_subjects_needed_are_those_of_the_power_of_the_test() -> None:
    """By the noncentral t distribution; the formula of the code is within two subjects of it."""
    for effect, level in ((0.5, 0.05), (1.2, 0.05 / 28), (2.0, 0.05 / 86), (0.3, 0.01)):
        exact = TTestPower().solve_power(effect, alpha=level, power=0.8)
        found = paired_sample_size(effect, 1.0, level)
        assert found is not None
        assert exact - 1.0 <= found <= exact + 2.0
    assert paired_sample_size(0.01, 1.0, 0.05) is None
    assert paired_sample_size(0.0, 1.0, 0.05) is None
    one = said("some").one("needed")
    by = errors({GENERIC: THREE[GENERIC], **SCATTERED})
    wide = by[by["measure"] == "centre_mm"].groupby(["specimen", "approach"])["mean"].mean()
    apart = np.diff(wide.unstack()[["ik_smooth", GENERIC]].to_numpy())[:, 0]
    exact = TTestPower().solve_power(
        abs(apart.mean()) / apart.std(ddof=1), alpha=0.05 / one.values["tests"].number, power=0.8
    )
    assert one.values["value"].number == pytest.approx(exact, abs=2.0)
    assert one.values["tests"].number == 2 * 6


def test_true_motions_are_those_that_the_truth_was_made_of() -> None:
    cohort = cohort_of(Size(1))
    skeleton = skeleton_in(cohort, "s01", subject_of(cohort, "s01"))
    q = np.zeros((15, len(BODIES), 6))
    q[:, 1:7, 3:] = 0.05 * np.random.default_rng(3).standard_normal((15, 6, 3))
    rows = true_rows(skeleton, "s01", "lateral_bending", q)
    made = replace(cohort, further={**cohort.further, "truth_centres": rows})
    found = true_motions(made).set_index(["frame", "joint"])
    for k, joint in enumerate(LUMBAR_JOINTS):
        own = found.xs(joint, level="joint")[["extension_deg", "right_bending_deg"]]
        np.testing.assert_allclose(own, np.rad2deg(q[:, 1 + k, 3:5]), atol=1e-6)
    few = replace(cohort, further={**cohort.further, "truth_centres": rows[rows["time_s"] < 0.5]})
    assert true_motions(few).empty, "a few X-rays are no course"


def test_shares_are_held_against_the_true_ones() -> None:
    """Shares that are the true ones are not off; one number for an approach, whatever it was."""
    size = Size()
    true = said("as made").one("sharing").values["even"].number
    rows = tables_of(size)["sharing"]
    rows["share"] = 1.0 / 6.0
    equal = said_of(case("", tables={"sharing": rows})).one("sharing")
    assert equal.values["off"].number == pytest.approx(true)
    assert equal.values["even"].number == pytest.approx(true)
    assert 1.0 < true < 20.0


def test_the_range_of_the_prior_is_that_of_its_draws() -> None:
    study, cohort = study_of(Size()), cohort_of(Size())
    values = calibrated_values(study, cohort, ratios(0.0)["stiffness"])
    random = np.random.default_rng(0)
    size, shape = np.exp(random.standard_normal((2, 200_000)) * [[0.7], [0.35]])
    law = pd.read_csv(Path(charts.__file__).parents[2] / "motion/passive.csv", comment="#")
    a = float(law.query("joint == 'L5S1' and coordinate == 'extension'")["a"].iloc[0])
    drawn = shape * (5.0 + a * size) / (5.0 + a)
    row = values[values["joint"] == "L5S1"].iloc[0]
    ends = np.percentile(drawn, [2.5, 97.5])
    assert row["prior_low"] == pytest.approx(ends[0], rel=0.15)
    assert row["prior_high"] == pytest.approx(ends[1], rel=0.15)


@pytest.mark.parametrize(
    "size",
    [
        Size(),
        Size(1, truth=False, verdict="falls", approaches=("ik", GENERIC, BOTH)),
        Size(1, ("stance",), approaches=(GENERIC,), verdict="lost"),
        Size(1, failing=LOST),
    ],
    ids=["three subjects", "one subject, no truth", "stance", "nothing found"],
)
def test_figures_fit_whatever_there_is(size: Size) -> None:
    made = tables_of(size)
    for draw in FIGURES:
        faults = list(faults_of_chart(draw(study_of(size), cohort_of(size), made)))
        assert not faults, draw.__name__


def test_what_vibrates_is_left_out_of_figures_and_named() -> None:
    rows = tables_of(Size())["tracked"]
    rows.loc[rows["approach"] == "ik", "extension_deg"] *= 30.0
    made = tables_of(Size(), tracked=rows)
    chart = charts.kinematics(study_of(Size()), cohort_of(Size()), made)
    assert "Not drawn, as it leaves the axis: inverse kinematics." in chart.caption
    assert {panel.title for panel in chart.panels} >= {"L5–S1", "T12–L1"}


def test_tables_of_the_page_have_what_a_reader_compares() -> None:
    found = {one.name: one for one in shown_tables(ResultTables(StudyTables(tables_of(Size()))))}
    assert list(found)[:3] == ["accuracy", "fits", "profiles"]
    assert "cpu s" not in [head.name for head in found["fits"].heads]
    assert not shown_tables(ResultTables(StudyTables({})))


def test_a_page_with_long_names_keeps_the_rules() -> None:
    long = {"s01": "s01" + "x" * 60, "lateral_bending": "lateral_bending" + "y" * 60}
    tables = {key: rows.replace(long) for key, rows in tables_of(Size()).items()}
    results = ResultTables(StudyTables(tables))
    made = page(study_of(Size()), cohort_of(Size()), results)
    assert not list(faults_of_page(made.html(study_of(Size()), cohort_of(Size()), results)))
    assert not list(faults_of_told(made.told))

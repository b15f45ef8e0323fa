"""What stiffness goes with, against statsmodels' mixed model, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chain_cases import STUDY, Chains
from scipy import stats
from statsmodels.regression.mixed_linear_model import MixedLM

from spinepipe.problems import InputError
from spinepipe.studies.cohort_stiffness.conclusions_of_claims import covariate_conclusions
from spinepipe.studies.cohort_stiffness.covariates import (
    BESIDE,
    covariate_rows,
    specimen_effects,
)
from spinepipe.studies.cohort_stiffness.settings import COVARIATES
from spinepipe.studies.cohort_stiffness.tables import COVARIATES_TABLE
from spinepipe.studies.read import check
from spinepipe.tables import from_rows

LEVELS = ("L5S1", "L4L5", "L3L4", "L2L3")
ASKED = ("age_years", "sex")


def people(n: int, rng: np.random.Generator, **changed: Any) -> pd.DataFrame:
    """Rows of specimens.csv; every second one is male."""
    rows = {
        "specimen": [f"s{number:02d}" for number in range(n)],
        "sex": [("female", "male")[number % 2] for number in range(n)],
        "age_years": rng.uniform(40.0, 90.0, n).round(),
        "degeneration_grade": rng.integers(1, 6, n).astype(float),
    }
    return pd.DataFrame(rows | changed)


def fitted(
    specimens: pd.DataFrame,
    rng: np.random.Generator,
    per_decade: float = 0.0,
    male: float = 0.0,
    between: float = 0.2,
    levels: tuple[str, ...] = LEVELS,
) -> pd.DataFrame:
    """Table ``stiffness`` of one coordinate whose logarithm is drawn as said."""
    rows = []
    for one in specimens.to_dict("records"):
        mean = np.log(60.0) + per_decade * one["age_years"] / 10.0 + male * (one["sex"] == "male")
        mean += between * rng.normal()
        for number, joint in enumerate(levels):
            row = {"specimen": one["specimen"], "joint": joint, "coordinate": "extension"}
            row |= {"representation": "per_joint", "fitted_to": "flexion", "source": "own"}
            value = float(np.exp(mean + 0.1 * number + 0.1 * rng.normal()))
            rows.append(row | {"stiffness": value, "identifiable": True})
    return pd.DataFrame(rows)


def table(rows: list[dict[str, Any]]) -> pd.DataFrame:
    return from_rows(COVARIATES_TABLE, rows).to_pandas().set_index("covariate")


def test_effects_and_errors_are_those_of_a_mixed_model() -> None:
    """All joints known: the restricted likelihood's effects of specimens are in closed form."""
    rng = np.random.default_rng(7)
    specimens = people(14, rng)
    values = fitted(specimens, rng, -0.15, 0.3)
    found = table(covariate_rows(values, specimens, ASKED, 0.05))
    data = values.merge(specimens, on="specimen")
    exog = pd.DataFrame({"one": 1.0, "age": data["age_years"] / 10.0})
    exog["male"] = (data["sex"] == "male").astype(float)
    for joint in LEVELS[1:]:
        exog[joint] = (data["joint"] == joint).astype(float)
    mixed = MixedLM(np.log(data["stiffness"]), exog, groups=data["specimen"]).fit(reml=True)
    for name, column in (("age_years", "age"), ("sex", "male")):
        assert found.loc[name, "log_effect"] == pytest.approx(mixed.params[column], rel=1e-4)
        assert found.loc[name, "standard_error"] == pytest.approx(mixed.bse[column], rel=1e-2)
    row = found.loc["age_years"]
    assert (row["specimens"], row["needed"], row["degrees_of_freedom"]) == (14, 6, 11.0)
    t = row["log_effect"] / row["standard_error"]
    assert row["p"] == pytest.approx(2.0 * stats.t.sf(abs(t), 11))
    reach = stats.t.ppf(0.975, 11) * row["standard_error"]
    assert np.log([row["low"], row["high"]]) == pytest.approx(row["log_effect"] + [-reach, reach])
    others = np.corrcoef(specimens["age_years"], specimens["sex"] == "male")[0, 1]
    assert row["inflation"] == pytest.approx(1.0 / (1.0 - others**2))


def test_few_of_many_cohorts_without_an_effect_are_told_of_one() -> None:
    """Of 100 cohorts 5 % at most, but for the binomial's 99.9 %: Holm keeps the whole table."""
    rng = np.random.default_rng(11)
    told = 0
    for _ in range(100):
        specimens = people(8, rng)
        rows = covariate_rows(fitted(specimens, rng, levels=LEVELS[:2]), specimens, ASKED, 0.05)
        told += any(row["holds"] == "yes" for row in rows)
    assert told <= stats.binom.ppf(0.999, 100, 0.05)


def test_an_effect_is_found_and_told() -> None:
    rng = np.random.default_rng(3)
    specimens = people(12, rng)
    rows = covariate_rows(fitted(specimens, rng, -0.25, between=0.1), specimens, ASKED, 0.05)
    found = table(rows)
    assert found["holds"].to_dict() == {"age_years": "yes", "sex": "undecided"}
    assert found.loc["age_years", "low"] < np.exp(-0.25) < found.loc["age_years", "high"]
    first, second = covariate_conclusions(found.reset_index())
    assert (first.verdict, first.names["covariate"]) == ("yes", "age")
    assert first.values["n"].number == 12
    assert (second.verdict, second.names["covariates"]) == ("others_not_shown", "sex")


@pytest.mark.parametrize(("n", "refused"), [(5, True), (6, False)])
def test_two_covariates_need_six_specimens(n: int, refused: bool) -> None:
    rng = np.random.default_rng(5)
    specimens = people(n, rng)
    found = table(covariate_rows(fitted(specimens, rng), specimens, ASKED, 0.05))
    assert set(found["needed"]) == {2 + BESIDE} == {6}
    assert (found["holds"] == "refused").all() == refused
    assert found["p"].isna().all() == refused
    if refused:
        assert set(found["message"]) == {"5 specimens, and 2 covariates together need 6"}
        (told,) = covariate_conclusions(found.reset_index())
        assert (told.rule, told.names["covariates"]) == ("asked", "age and sex")


def test_what_says_nothing_is_refused_by_itself() -> None:
    """One grade for all, and one male only: age is still asked, and needs fewer specimens."""
    rng = np.random.default_rng(5)
    sexes = ["male"] + ["female"] * 7
    specimens = people(8, rng, sex=sexes, degeneration_grade=3.0)
    names = ("age_years", "sex", "degeneration_grade")
    found = table(covariate_rows(fitted(specimens, rng), specimens, names, 0.05))
    assert found["holds"].to_dict() == {
        "age_years": "undecided",
        "sex": "refused",
        "degeneration_grade": "refused",
    }
    assert found.loc["age_years", "degrees_of_freedom"] == 6.0
    assert "one sex" in found.loc["sex", "message"]
    assert "the same in all" in found.loc["degeneration_grade", "message"]


def test_covariates_that_are_one_are_not_told_apart() -> None:
    rng = np.random.default_rng(5)
    specimens = people(9, rng)
    specimens["degeneration_grade"] = specimens["age_years"] / 20.0
    names = ("age_years", "degeneration_grade")
    found = table(covariate_rows(fitted(specimens, rng), specimens, names, 0.05))
    assert (found["holds"] == "refused").all()
    assert found["message"].str.contains("cannot be told apart").all()


def test_a_specimen_without_covariates_and_values_not_identifiable_are_named() -> None:
    rng = np.random.default_rng(5)
    specimens = people(9, rng)
    specimens.loc[2, "age_years"] = np.nan
    values = fitted(specimens.fillna(60.0), rng)
    values.loc[0, "identifiable"] = False
    row = table(covariate_rows(values, specimens, ASKED, 0.05)).loc["age_years"]
    assert row["specimens"] == 8
    assert "without 1 of 36 values that are not identifiable" in row["message"]
    assert "no covariates of s02" in row["message"]


def test_a_missing_level_biases_no_specimen() -> None:
    """Without noise specimens come out as made, whichever levels were read."""
    made = {"a": 0.0, "b": 0.3, "c": -0.2}
    read = {"a": LEVELS, "b": LEVELS[:2], "c": LEVELS[1:]}
    rows = [
        {"specimen": name, "joint": joint, "stiffness": np.exp(made[name] + LEVELS.index(joint))}
        for name, joints in read.items()
        for joint in joints
    ]
    alone = [{"specimen": "d", "joint": "T12L1", "stiffness": 9.0}]
    effects = specimen_effects(pd.DataFrame(rows + alone))
    assert list(effects.index) == ["a", "b", "c"]
    np.testing.assert_allclose(effects - effects["a"], list(made.values()), atol=1e-12)


def test_covariates_that_nobody_has_are_refused_when_the_study_is_read(tmp_path: Path) -> None:
    chains = Chains({"a": np.full((3, 3), 50.0)}, study="covariates: [age_years, sex]\n")
    root = chains.write(tmp_path).root
    people_file = root / "config/cohorts/chains/specimens.csv"
    people_file.write_text("specimen,sex\na,M\n")
    with pytest.raises(InputError) as caught:
        check(root, STUDY)
    told = [str(problem) for problem in caught.value.problems]
    assert len(told) == 2
    assert "covariates.0" in told[0]
    assert "'age_years', which chains/specimens.csv has of no specimen" in told[0]
    assert "'M' of specimen 'a'" in told[1]
    assert "one of female, male" in told[1]


def test_all_covariates_have_a_unit_to_be_told_in() -> None:
    rng = np.random.default_rng(1)
    specimens = people(12, rng, height_m=rng.normal(1.7, 0.1, 12), mass_kg=rng.normal(70, 9, 12))
    found = table(covariate_rows(fitted(specimens, rng), specimens, COVARIATES, 0.05))
    assert (found["step"] != "").all()
    assert found["p"].notna().all()

"""All analyses of whole cohort studies, also of those with hardly any data.

Seen here: an analysis that stops at a study of few data, a value without what it is of, a verdict
of one specimen, a fold that is compared over other readings than the rest.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import pandas as pd
import pytest
from cohort_analysis_cases import JOINTS, analysed, only, seen, study, without_rotations_in

from spinepipe.studies.cohort_stiffness.claims_of_errors import error_findings
from spinepipe.studies.cohort_stiffness.mae import mae_rows
from spinepipe.studies.cohort_stiffness.ranking import ranking_rows
from spinepipe.studies.cohort_stiffness.tables import MAE
from spinepipe.tables import from_rows

NUMBERS = ("bias", "mae", "rmse", "peak_error")


def test_one_load_case_leaves_none_out_and_is_no_failure() -> None:
    found = {
        row["finding"]: row
        for row in error_findings(without_one_test()["errors"], significance=0.05)
    }
    assert "without a result" not in found["optimised_beats_literature_left_out_case"]["message"]


def test_a_whole_study() -> None:
    found = analysed(study())
    assert found["ranking"]["rank"].notna().all()
    assert set(found["ranking"]["criterion"]) == {
        *("fitted", "left_out_specimen", "left_out_case", "aicc", "bic")
    }
    pooled = found["findings"]["finding"].str.startswith("partially_pooled")
    known = found["findings"]["value"].notna()
    assert (known != pooled).all()  # they alone were not computed, and say so
    assert (found["findings"].loc[pooled, "message"] != "").all()
    assert (found["statistics"]["status"] == "done").sum() > 100


TWO = ("per_specimen", "per_joint")


def without_cross_validation() -> dict[str, pd.DataFrame]:
    return study(held_out=False, representations=TWO)


def with_failures() -> dict[str, pd.DataFrame]:
    """Every fit of one specimen failed, every pose of one test was lost in another."""
    frames = study()
    errors, fits, stiffness = (frames[name] for name in ("errors", "fits", "stiffness"))
    errors = errors[(errors["specimen"] != "a") | (errors["stage"] == "literature")].copy()
    lost = (errors["specimen"] == "b") & (errors["test"] == "bend")
    errors.loc[lost, list(NUMBERS)] = None
    fits.loc[fits["specimen"] == "a", ["cost", "aicc", "bic"]] = None
    empty = stiffness["specimen"] == "a"
    stiffness.loc[empty, ["stiffness", "standard_error"]] = None
    stiffness["identifiable"] = stiffness["identifiable"].astype(object).mask(empty, None)
    return {"errors": errors, "fits": fits, "stiffness": stiffness}


def without_one_test() -> dict[str, pd.DataFrame]:
    """One specimen was tested in one load case only."""
    frames = study(representations=TWO)
    keep = {name: table["specimen"] != "a" for name, table in frames.items()}
    keep["errors"] |= (frames["errors"]["test"] == "twist") & frames["errors"]["fitted_to"].isin(
        ["twist", "all", "nothing"]
    )
    fits = frames["fits"]
    fits.loc[~keep["fits"] & (fits["fitted_to"] != "twist"), ["cost", "aicc", "bic"]] = None
    keep["fits"] |= True
    return {name: table[keep[name]] for name, table in frames.items()}


def literature_only() -> dict[str, pd.DataFrame]:
    """All fits were refused."""
    frames = study(representations=TWO)
    errors = frames["errors"]
    frames["stiffness"][["stiffness", "standard_error"]] = np.nan
    frames["fits"][["cost", "aicc", "bic"]] = np.nan
    return {**frames, "errors": errors[errors["stage"] == "literature"]}


ODD: dict[str, Callable[[], dict[str, pd.DataFrame]]] = {
    "one_specimen": lambda: study(specimens="a", representations=TWO),
    "two_specimens": lambda: study(specimens="ab", representations=TWO),
    "one_test": lambda: study(tests=("only test",)),
    "two_tests": lambda: study(tests=("x", "y"), representations=TWO),
    "one_representation": lambda: study(representations=("level_ratio",), levels=False),
    "without_cross_validation": without_cross_validation,
    "with_failures": with_failures,
    "without_one_test": without_one_test,
    "literature_only": literature_only,
}


@cache
def of_odd(name: str) -> dict[str, pd.DataFrame]:
    """All analyses of an odd study."""
    return analysed(ODD[name]())


@pytest.mark.parametrize("name", ODD)
def test_odd_studies_keep_the_schemas_and_say_what_is_missing(name: str) -> None:
    found = of_odd(name)
    unknown = found["findings"][found["findings"]["value"].isna()]
    assert unknown["holds"].isin(["undecided", "not_asked"]).all()
    assert (unknown["message"] != "").all()
    nothing = found["statistics"][found["statistics"]["p"].isna()]
    assert (nothing["message"] != "").all()
    unranked = found["ranking"][found["ranking"]["rank"].isna()]
    assert (unranked["message"] != "").all()


def test_one_specimen_decides_nothing_by_a_mean() -> None:
    found = of_odd("one_specimen")["findings"]
    row = only(found, finding="optimised_beats_literature")
    assert (row["holds"], row["message"][:17]) == ("undecided", "one specimen only")
    assert only(found, finding="cross_validation_beats_literature")["value"] is not None


def test_specimens_without_all_results_do_not_enter_the_ranking() -> None:
    frames = with_failures()
    ranking = pd.DataFrame(ranking_rows(frames["errors"], frames["fits"]))
    fitted = ranking[ranking["criterion"] == "fitted"]
    assert set(fitted["specimens"]) == {1}
    fits = "per_specimen, level_ratio, per_joint"
    every = f"literature, literature_levels, {fits}"
    assert fitted["message"].str.contains(f"a ({fits}), b ({every})", regex=False).all()
    assert set(ranking[ranking["criterion"] == "aicc"]["specimens"]) == {2}


def test_left_out_cases_of_two_tests_come_from_the_other_one() -> None:
    ranking = of_odd("two_tests")["ranking"]
    rows = ranking[ranking["criterion"] == "left_out_case"]
    assert rows["rank"].notna().all()


def test_without_cross_validation_nothing_is_ranked_by_it() -> None:
    ranking = of_odd("without_cross_validation")["ranking"]
    held_out = ranking[ranking["criterion"].isin(["left_out_specimen", "left_out_case"])]
    ranked_names = held_out.loc[held_out["rank"].notna(), "representation"]
    assert set(ranked_names) == {"literature", "literature_levels"}


def test_a_left_out_case_beside_one_read_in_translations_only() -> None:
    frames = without_rotations_in(
        "pull", tests=("flexion", "bend", "pull"), representations=("per_joint",), levels=False
    )
    found = analysed(frames)["statistics"]
    family = "between_specimens/per_joint/left_out_case"
    rows = found[(found["family"] == family) & (found["test"] == "Friedman")]
    assert set(rows["stratum"]) == {"flexion", "bend"}
    assert (rows.loc[rows["response"] == "rotation_error", "n"] == len(JOINTS)).all()


def test_of_two_load_cases_one_may_be_read_in_translations_only() -> None:
    frames = without_rotations_in("pull", tests=("flexion", "pull"), representations=TWO)
    found = analysed(frames)
    family = "between_specimens/per_joint/left_out_case"
    assert (found["statistics"]["family"] == family).any()
    ranking = found["ranking"]
    assert ranking.loc[ranking["criterion"] == "left_out_case", "rank"].notna().all()


def test_a_test_that_drives_two_coordinates_has_two_rows_of_errors() -> None:
    """Specimen b lay on its side: its main moment has another axis."""
    rows = [
        seen("a", "L5S1", 2.0, measured_peak=10.0),
        seen("a", "L5S1", 8.0, coordinate="right_bending", loaded=False),
        seen("b", "L5S1", 3.0, measured_peak=20.0, coordinate="right_bending"),
        seen("b", "L5S1", 9.0, loaded=False),
    ]
    found = from_rows(MAE, mae_rows(pd.DataFrame(rows))).to_pandas()
    peak = found[found["steps"] == "peak"].set_index("coordinate")
    assert peak["mae"].to_dict() == {"extension": 2.0, "right_bending": 3.0}
    assert peak["largest_motion"].to_dict() == {"extension": 10.0, "right_bending": 20.0}

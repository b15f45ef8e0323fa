"""Tests between models over patients: numbers worked by hand.

Would catch pairs of patients exchanged, a correction over other tests, and a p of too few.
"""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe.jobs.tested_rows import corrected_rows
from spinepipe.studies.scoliosis.errors import by_patient, squares
from spinepipe.studies.scoliosis.significance import all_tests, compared
from spinepipe.studies.scoliosis.tables import MEASURES, STATISTICS
from spinepipe.tables import from_rows

PATIENTS = tuple(f"p{number:02d}" for number in range(1, 7))
MODELS = ("tangent", "linear_regions", "uniform")
Sizes = dict[str, dict[str, float]]


def sizes(**shift: float) -> Sizes:
    """Errors of every patient in every model: 1, 2, ... and a shift of each model's own."""
    return {
        model: {name: 1.0 + number + shift.get(model, 0.0) for number, name in enumerate(PATIENTS)}
        for model in MODELS
    }


def tables(fitted: Sizes, held_out: Sizes) -> tuple[pd.DataFrame, ...]:
    """Positions, displacements and curves: one film of each group, the same error in all."""
    rows = pd.DataFrame(
        [
            {"specimen": name, "model": model, "fitted": group == 0, "error": size}
            for group, of_models in enumerate((fitted, held_out))
            for model, of_patients in of_models.items()
            for name, size in of_patients.items()
        ]
    )
    key, error = rows[["specimen", "model", "fitted"]], rows["error"]
    measured = {f"{name}_measured_deg": 40.0 for name in ("cobb", "ferguson")}
    simulated = {f"{name}_simulated_deg": 40.0 + error for name in ("cobb", "ferguson")}
    return (
        key.assign(place_rmse_mm=error, tilt_rmse_deg=error),
        key.assign(measured_deg=3.0, simulated_deg=3.0 - error),
        key.assign(**measured, **simulated),
    )


def statistics(fitted: Sizes, held_out: Sizes) -> pd.DataFrame:
    """The table that the job writes."""
    rows = list(corrected_rows(all_tests(*tables(fitted, held_out))))
    return from_rows(STATISTICS, rows).to_pandas()


def row(found: pd.DataFrame, family: str, one: str, other: str) -> "pd.Series[Any]":
    chosen = found["family"].eq(family) & found["response"].eq(one) & found["factor"].eq(other)
    (index,) = found.index[chosen]
    return found.loc[index]


def test_every_pair_of_models_is_tested_in_every_measure_and_group() -> None:
    found = statistics(sizes(uniform=1.0), sizes(tangent=0.5))
    assert len(found) == 2 * len(MEASURES) * 3
    assert set(found["family"]) == {f"{g}/{m}" for g in ("fitted", "held_out") for m in MEASURES}
    assert set(found["test"]) == {"Wilcoxon signed rank"}
    assert (found["stratum"] == found["family"].str.split("/").str[0]).all()


@sweep("measure", list(MEASURES))
def test_the_model_with_smaller_errors_is_named_with_by_how_much(measure: str) -> None:
    found = statistics(sizes(uniform=0.5), sizes(tangent=0.25))
    unit = MEASURES[measure][0]
    fitted = row(found, f"fitted/{measure}", "linear_regions", "uniform")
    # all six pairs below: V is 0, and 2 of 2^6 patterns of signs are as extreme
    assert (fitted["statistic"], fitted["effect"], fitted["n"]) == (0.0, -1.0, 6)
    assert fitted["p"] == pytest.approx(2 / 64)
    assert f"linear_regions has the smaller errors, by a median of 0.5 {unit}" in fitted["message"]
    held_out = row(found, f"held_out/{measure}", "tangent", "uniform")
    assert (held_out["statistic"], held_out["effect"]) == (21.0, 1.0)
    assert f"uniform has the smaller errors, by a median of 0.25 {unit}" in held_out["message"]


def test_p_is_corrected_for_the_pairs_of_a_family_alone() -> None:
    found = statistics(sizes(tangent=0.1, uniform=0.7), sizes())
    family = found[found["family"] == "fitted/rotation"]
    assert set(family["family_size"]) == {3}
    np.testing.assert_allclose(family["p"], 2 / 64)
    np.testing.assert_allclose(family["p_holm"], 6 / 64)


def test_a_patient_without_a_pose_is_left_out_of_that_pair_and_counted() -> None:
    lost = sizes(uniform=0.5)
    lost["tangent"]["p03"] = np.nan
    found = statistics(lost, sizes())
    without = row(found, "fitted/rotation", "tangent", "uniform")
    assert without["n"] == 5
    assert "1 of 6 patients left out, without a pose in one of the two" in without["message"]
    whole = row(found, "fitted/rotation", "linear_regions", "uniform")
    assert whole["n"] == 6
    assert "left out" not in whole["message"]
    assert row(found, "held_out/rotation", "tangent", "uniform")["n"] == 6


def test_models_that_are_the_same_are_told_so() -> None:
    found = row(statistics(sizes(), sizes()), "fitted/tilt", "tangent", "uniform")
    assert (found["status"], found["family_size"]) == ("constant", 0)
    assert np.isnan(found["p"])
    assert "median difference of tangent and uniform is 0 deg" in found["message"]


def test_of_three_patients_there_is_no_p() -> None:
    few = {name: dict(list(of.items())[:3]) for name, of in sizes(tangent=1.0).items()}
    found = row(statistics(few, few), "held_out/place", "tangent", "uniform")
    assert (found["status"], found["n"]) == ("too_few", 3)
    assert np.isnan(found["p"])
    assert "uniform has the smaller errors, by a median of 1 mm" in found["message"]


def test_a_patient_counts_by_the_root_mean_square_over_all_films() -> None:
    positions, displacements, curves = tables(sizes(), sizes())
    more = displacements.assign(simulated_deg=displacements["measured_deg"] + 7.0)
    values = by_patient(squares("rotation", positions, pd.concat([displacements, more]), curves))
    assert values.loc["p03", "tangent"] == pytest.approx(((9.0 + 49.0) / 2.0) ** 0.5)


def test_patients_in_another_order_are_the_same_pairs() -> None:
    one = pd.Series([1.0, 5.0, 2.0, 8.0, 3.0], index=list("abcde"), name="tangent")
    other = (one + 1.0).rename("uniform")[list("ecadb")]
    assert compared(one, other, "deg").statistic == 0.0

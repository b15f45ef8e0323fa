"""Errors by how near the films come to the published ends: classes, counts and roots by hand.

Would catch a rotation in the wrong class, and errors pooled over patients that lack a pose.
"""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe.studies.scoliosis.by_range import by_range_rows, classes
from spinepipe.studies.scoliosis.tables import BY_RANGE
from spinepipe.tables import from_rows

MODELS = ("tangent", "linear_regions")


def turned(
    specimen: str,
    model: str,
    share: float,
    error: float | None,
    fitted: bool = False,
    opposite: bool = False,
) -> dict[str, Any]:
    """One rotation of 2 deg."""
    return {
        "specimen": specimen,
        "model": model,
        "position": "right_bending" if fitted else "neutral",
        "fitted": fitted,
        "measured_deg": 2.0,
        "simulated_deg": np.nan if error is None else 2.0 + error,
        "share_of_range": share,
        "opposite": opposite,
    }


def table(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """The table, by its key."""
    found = from_rows(BY_RANGE, list(by_range_rows(pd.DataFrame(rows)))).to_pandas()
    return found.set_index(["films", "opposite", "range", "model"])


@sweep(
    "share, name",
    [
        (0.0, "below_0.2"),
        (0.199, "below_0.2"),
        (0.2, "0.2_to_0.8"),
        (0.6 / 3.0 - 1e-16, "0.2_to_0.8"),  # 0.6 of 3.0 deg but for rounding
        (0.799, "0.2_to_0.8"),
        (0.8, "0.8_to_1"),
        (1.0, "0.8_to_1"),
        (1.0 + 1e-12, "0.8_to_1"),
        (1.001, "beyond"),
        (11.0, "beyond"),
    ],
)
def test_a_class_begins_with_its_lower_end(share: float, name: str) -> None:
    assert classes(np.array([share])) == [name]


def test_errors_of_a_class_are_pooled_and_fitted_films_kept_apart() -> None:
    rows = [
        turned("p01", "tangent", 0.1, 3.0),
        turned("p02", "tangent", 0.1, -4.0),
        turned("p01", "linear_regions", 0.1, 5.0),
        turned("p02", "linear_regions", 0.1, 5.0),
        turned("p01", "tangent", 1.5, 1.0),
        turned("p01", "linear_regions", 1.5, 0.5),
        turned("p01", "tangent", 0.1, 100.0, fitted=True),
        turned("p01", "linear_regions", 0.1, 100.0, fitted=True),
        turned("p02", "tangent", 0.1, 7.0, opposite=True),
        turned("p02", "linear_regions", 0.1, 14.0, opposite=True),
    ]
    found = table(rows)
    counts = found["n"].unstack("range")
    assert (counts.drop(columns="all").sum(axis=1) == counts["all"]).all()
    near = found.loc[("held_out", False, "below_0.2", "tangent")]
    assert (near["n"], near["rmse_deg"]) == (2, pytest.approx(12.5**0.5))
    assert near["reduction_percent"] == pytest.approx(100.0 * (1.0 - 12.5**0.5 / 5.0))
    beyond = found.loc[("held_out", False, "beyond", "tangent")]
    assert (beyond["n"], beyond["rmse_deg"]) == (1, 1.0)
    assert beyond["reduction_percent"] == pytest.approx(-100.0)
    every = found.loc[("held_out", False, "all", "tangent")]
    assert (every["n"], every["rmse_deg"]) == (3, pytest.approx((26.0 / 3.0) ** 0.5))
    against = found.loc[("held_out", True, "all", "tangent")]
    assert (against["n"], against["reduction_percent"]) == (1, pytest.approx(50.0))
    assert found.loc[("fitted", False, "all", "tangent"), "rmse_deg"] == 100.0


def test_a_class_without_rotations_is_a_row_without_error() -> None:
    rows = [turned("p01", model, 0.5, 1.0) for model in MODELS]
    found = table(rows)
    assert len(found) == 2 * 2 * 5 * len(MODELS)
    empty = found.loc[("held_out", False, "beyond", "tangent")]
    assert empty["n"] == 0
    assert empty[["rmse_deg", "reduction_percent"]].isna().all()


def test_a_patient_without_a_pose_on_one_film_is_left_out_of_that_model() -> None:
    rows = [
        turned("p01", "tangent", 0.5, None),
        turned("p01", "tangent", 0.9, 9.0),
        turned("p02", "tangent", 0.9, 1.0),
        *(turned(one, "linear_regions", 0.9, 2.0) for one in ("p01", "p02")),
    ]
    found = table(rows)
    assert found.loc[("held_out", False, "all", "tangent"), "n"] == 1
    assert found.loc[("held_out", False, "0.8_to_1", "tangent"), "rmse_deg"] == 1.0
    assert found.loc[("held_out", False, "all", "linear_regions"), "n"] == 2


def test_without_the_reference_there_is_no_reduction() -> None:
    found = table([turned("p01", "tangent", 0.5, 1.0)])
    assert found["reduction_percent"].isna().all()

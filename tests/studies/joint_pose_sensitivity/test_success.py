"""Which fits count: the published filters, and what each way of fitting makes of the same poses."""

import numpy as np
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe.studies.joint_pose_sensitivity.filters import above_start, near_start
from spinepipe.studies.joint_pose_sensitivity.success import count_by_method

START = np.array([100.0, 40.0])


def test_near_the_start_is_within_the_percentage_either_way() -> None:
    values = np.array([[101.0, 39.6], [99.0, 40.5], [101.1, 39.5], [np.nan, 40.0]])
    expected = [[True, True], [True, False], [False, False], [False, True]]
    np.testing.assert_array_equal(near_start(values, START, 1.0), expected)


def test_far_above_the_start_is_from_so_many_times_on() -> None:
    values = np.array([[1000.0, 399.9], [999.0, 4000.0], [np.nan, 40.0]])
    expected = [[True, False], [False, True], [False, False]]
    np.testing.assert_array_equal(above_start(values, START, 10.0), expected)


def fits(method: str, costs: list[float | None], **columns: list[object]) -> pd.DataFrame:
    """Fits of poses 0, 1, ... that moved and claim success, unless told otherwise."""
    n = len(costs)
    rows = {
        "specimen": "a",
        "pose": range(n),
        "method": method,
        "cost": costs,
        "evaluations": 10,
        "derivative_error": np.nan,
        "near_start_any": [None if cost is None else False for cost in costs],
        "near_start_all": [None if cost is None else False for cost in costs],
        "claims_success": True,
    }
    rows["status"] = ["refused" if cost is None else "converged" for cost in costs]
    return pd.DataFrame({**rows, **columns})


def test_fits_are_counted_by_method() -> None:
    exact = fits("exact", [1.0, 2.0, 3.0, None], claims_success=[True, True, True, False])
    runs = fits(
        "runs",
        [1.005, 2.1, 50.0, 40.0],
        near_start_any=[False, True, True, True],
        near_start_all=[False, False, True, True],
        evaluations=[100, 200, 8, 12],
        derivative_error=[0.5, np.nan, 0.1, 2.0],
    )
    ours, theirs = count_by_method(pd.concat([exact, runs]), "all")
    counted = ("fits", "solved", "claimed", "near_start_any", "near_start_all", "successful")
    assert [ours[name] for name in counted] == [4, 3, 3, 0, 0, 3]
    assert [theirs[name] for name in counted] == [4, 4, 4, 3, 2, 2]
    # 1.005 is within 1 % of 1, 2.1 is not of 2; nobody else fitted the last pose
    assert (ours["arrived"], theirs["arrived"]) == (3, 2)
    assert (theirs["evaluations_median"], theirs["evaluations_largest"]) == (56.0, 200)
    assert (theirs["derivative_error_median"], theirs["derivative_error_largest"]) == (0.5, 2.0)
    assert ours["derivative_error_median"] is None
    _, strict = count_by_method(pd.concat([exact, runs]), "any")
    assert strict["successful"] == 1
    stopped = runs.assign(status=["not_converged", "converged", "converged", "converged"])
    _, fewer = count_by_method(pd.concat([exact, stopped]), "all")
    assert (fewer["solved"], fewer["successful"], fewer["arrived"]) == (3, 1, 2)


@sweep(
    "successes, of, low, high",
    [(81, 263, 0.2553, 0.3662), (1, 29, 0.0061, 0.1718), (0, 20, 0.0, 0.1611)],
)
def test_shares_have_the_published_intervals(
    successes: int, of: int, low: float, high: float
) -> None:
    """Newcombe 1998, Statistics in Medicine 17:857-872, table I, method 3 (Wilson)."""
    stayed = [number >= successes for number in range(of)]
    (row,) = count_by_method(fits("runs", [1.0] * of, near_start_all=stayed), "all")
    assert row["success"] == successes / of
    assert (row["success_low"], row["success_high"]) == pytest.approx((low, high), abs=5e-5)

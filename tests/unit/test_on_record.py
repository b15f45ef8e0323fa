"""Final poses against the engine of record: rounding passes, an error is told, a snap is a snap.

Catches an end that differs from the engine's and is not told.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from example_effects import loaded, spine

from spinepipe.calibration.fit import Optimum, _on_record
from spinepipe.calibration.solvers import Disagreement, by_record, on_record
from spinepipe.status import Status


def poses() -> tuple[object, list[object], list[np.ndarray]]:
    model = spine(2)
    cases = [loaded(model)]
    record = by_record(model, cases)
    assert record is not None
    return model, cases, [q.copy() for q in record]


def test_what_agrees_is_handed_back_as_recorded() -> None:
    model, cases, own = poses()
    own[0] += 1e-15
    record = on_record(model, cases, own, same=1e-7)  # type: ignore[arg-type]
    assert record is not None
    assert (record[0] != own[0]).any()


def test_a_small_difference_is_an_error_with_both_numbers() -> None:
    model, cases, own = poses()
    right = own[0][1, 9]
    own[0][1, 9] += 2e-8
    with pytest.raises(Disagreement) as told:
        on_record(model, cases, own, same=1e-7)  # type: ignore[arg-type]
    assert f"{right:.17g}" in str(told.value)
    assert f"{own[0][1, 9]:.17g}" in str(told.value)


def test_a_large_difference_is_another_pose() -> None:
    model, cases, own = poses()
    own[0][1, 9] += 1e-3
    assert on_record(model, cases, own, same=1e-7) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("away", "costs", "asked"),
    [
        (0.9e-3, (1.0, 1.0), 1),
        (1.1e-3, (1.0, 1.0), 2),
        (0.0, (1.0 + 0.9e-6, 1.0), 1),
        (0.0, (1.0 + 1.1e-6, 1.0), 2),
    ],
)
def test_the_engine_is_asked_once_of_optima_that_are_one(
    away: float, costs: tuple[float, float], asked: int
) -> None:
    """One they are within a thousandth of a logarithm, the first no worse by a millionth."""
    seen = list[float]()
    evaluator: Any = SimpleNamespace(
        problem=SimpleNamespace(scale=np.array([1.0, 2.0])),
        on_record=lambda x: seen.append(x[0]) or "recorded",
    )
    optima = [
        Optimum(np.array([x, 0.0]), np.zeros(2), cost, "own", Status.CONVERGED, "", 1, 0)  # type: ignore[arg-type]
        for x, cost in zip((0.0, away), costs, strict=True)
    ]
    found = _on_record(evaluator, optima)
    assert len(seen) == asked
    assert [one.evaluation for one in found] == ["recorded", "own" if asked == 1 else "recorded"]

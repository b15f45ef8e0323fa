"""Numbers of clinics on films whose shape is known: a bend of two halves, by hand.

Would catch a side, a sign and a percentage over the wrong film.
"""

import numpy as np
import pytest
from scoliosis_cases import shipped

from spinepipe.studies.scoliosis.clinical import aside, clinical_rows


def test_a_point_to_the_right_of_a_leaning_line_counts_across_it() -> None:
    low, high = np.array([1.0, 1.0]), np.array([4.0, 5.0])  # 3 to the right, 4 up
    point = low + 0.5 * (high - low) + 2.0 * np.array([0.8, -0.6])
    assert aside(point, low, high) == pytest.approx(2.0)


def test_rows_of_films_as_they_are_defined() -> None:
    rows = [row for row in clinical_rows(shipped(1)) if row["curve"] == 0]
    found = {row["position"]: row for row in rows}
    erect = found["erect"]
    assert erect["flexibility_percent"] is None
    assert erect["coronal_balance_mm"] == pytest.approx(0.0, abs=1e-9)
    for name, row in found.items():
        if name != "erect":
            share = (erect["cobb_deg"] - row["cobb_deg"]) / erect["cobb_deg"]
            assert row["flexibility_percent"] == pytest.approx(100.0 * share)
    # a pull straightens, and a bend to a side takes the top there
    assert 0.0 < found["traction"]["flexibility_percent"] < 100.0
    assert found["traction"]["apical_translation_mm"] < erect["apical_translation_mm"]
    assert found["left_bending"]["coronal_balance_mm"] < 0.0
    assert found["right_bending"]["coronal_balance_mm"] > 0.0

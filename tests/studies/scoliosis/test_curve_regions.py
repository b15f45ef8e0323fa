"""Curves are named by where their apex is, as Lenke 2001 names them.

Would catch an apex at the border of two regions that is counted to the other.
"""

import numpy as np
from sweeps import sweep

from spinepipe.studies.scoliosis.curve_angles import curves, region
from spinepipe.studies.scoliosis.films import Film


@sweep(
    "apex, named",
    [
        *(("C7", "PT"), ("T1", "PT"), ("T3", "PT"), ("T5", "PT")),
        *(("T6", "MT"), ("T9", "MT"), ("T10", "MT"), ("T11", "MT")),
        *(("T12", "TL/L"), ("L1", "TL/L"), ("L2", "TL/L"), ("S1", "TL/L")),
    ],
)
def test_a_curve_is_named_by_its_apex(apex: str, named: str) -> None:
    assert region(apex) == named


def test_a_spine_that_turns_back_at_its_second_vertebra_has_its_curve_from_there() -> None:
    tilt = np.deg2rad([0.0, 10.0, 0.0, -10.0, -20.0])
    right = np.concatenate([[0.0], np.cumsum(np.sin((tilt[1:] + tilt[:-1]) / 2.0))])
    up = np.concatenate([[0.0], np.cumsum(np.cos((tilt[1:] + tilt[:-1]) / 2.0))])
    assert [(one.lower, one.upper) for one in curves(Film(right, up, tilt))][-1] == (1, 4)

"""Curves are named by where their apex is, as Lenke 2001 names them."""

import pytest

from spinepipe.studies.scoliosis.curve_angles import region


@pytest.mark.parametrize(
    ("apex", "named"),
    [
        *(("C7", "PT"), ("T1", "PT"), ("T3", "PT"), ("T5", "PT")),
        *(("T6", "MT"), ("T9", "MT"), ("T10", "MT"), ("T11", "MT")),
        *(("T12", "TL/L"), ("L1", "TL/L"), ("L2", "TL/L"), ("S1", "TL/L")),
    ],
)
def test_a_curve_is_named_by_its_apex(apex: str, named: str) -> None:
    assert region(apex) == named

"""Bars that keep fascicles off vertebrae: which they pass, and how far behind each is kept."""

from dataclasses import replace

import numpy as np
import pytest
from trunk_to_scale import made_up_trunk

from spinepipe.muscles.paths import Lines, Standoff
from spinepipe.muscles.trunk import BODIES, SLICES, Trunk

LUMBAR = ["L5", "L4", "L3", "L2", "L1"]
THORACIC = ["T11", "T10", "T9", "T8"]
WRAPS = 1
"""Longissimus: from S1 by T12, at 185 mm, to the ribs, at 325 mm."""


def trunk() -> Trunk:
    found = made_up_trunk()
    point = found.muscles.point.copy()
    point[WRAPS, 2, 1] = 0.325  # between the centres of T8 and T7
    return replace(found, muscles=replace(found.muscles, point=point))


def test_a_leg_passes_the_vertebrae_between_its_ends() -> None:
    """Not those that an end is fixed to, but of the ribs' those below the point."""
    bars = Lines.of(trunk(), Standoff()).bars
    np.testing.assert_array_equal(bars.first, [0, 0, 9, 9, 9, 9])
    heights = dict(zip(SLICES, trunk().vertebrae[:, 1], strict=True))
    passed = [min(heights, key=lambda name: abs(heights[name] - y)) for y in bars.at[:, 1]]
    # where the spine leans a bar behind a centre stands lower or higher than it: 8 mm at most
    assert passed == [*LUMBAR, *THORACIC]
    np.testing.assert_array_equal(bars.leg, [0] * 5 + [1] * 4)
    on = [BODIES.index(name) if name in BODIES else BODIES.index("T11") for name in passed]
    np.testing.assert_array_equal(bars.body, on)


@pytest.mark.parametrize(("share", "least_m"), [(0.9, 0.04), (0.5, 0.0), (1.0, 0.2)])
def test_bars_stand_behind_their_vertebra_across_the_spine(share: float, least_m: float) -> None:
    """A share of how far behind the source's own line is there, but no less than told."""
    whole = trunk()
    bars = Lines.of(whole, Standoff(share, least_m)).bars
    legs = [whole.muscles.point[WRAPS, :2], whole.muscles.point[WRAPS, 1:]]
    for name, leg, at in zip([*LUMBAR, *THORACIC], bars.leg, bars.at, strict=True):
        k = SLICES.index(name)
        centre, (low, high) = whole.vertebrae[k], legs[leg]
        above, below = whole.vertebrae[k - 1], whole.vertebrae[min(k + 1, 16)]
        up = (above - below)[:2] / np.linalg.norm((above - below)[:2])
        back = np.array([-up[1], up[0]])
        line = low + (centre[1] - low[1]) / (high[1] - low[1]) * (high - low)
        behind = max(share * float((line - centre)[:2] @ back), least_m)
        np.testing.assert_allclose(at[:2], centre[:2] + behind * back, atol=1e-15)


def test_without_wrapping_there_are_no_bars() -> None:
    found = Lines.of(trunk(), Standoff(), wrapping=False).bars
    assert len(found.at) == 0
    assert not found.first.any()

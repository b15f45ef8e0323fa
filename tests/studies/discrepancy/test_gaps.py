"""Gaps pooled by place."""

import numpy as np
import pandas as pd

from spinepipe.studies.discrepancy.search.gaps import KEYS, Gap, GapPlace, _spread, places, worst
from spinepipe.units import ROTATIONS


def frame() -> pd.DataFrame:
    """Two specimens, one test, two steps, one joint, two coordinates; chi2 1, 2, 3 ..."""
    where = [
        (specimen, "flexion", step, "L4L5", coordinate)
        for specimen in "ab"
        for step in (0, 1)
        for coordinate in ROTATIONS[:2]
    ]
    rows = [(*place, float(number), 0.5) for number, place in enumerate(where, start=1)]
    return pd.DataFrame(rows, columns=[*KEYS, "chi2", "freedom"])


def test_gaps_are_pooled_by_each_place_once() -> None:
    found = {(one.by, *one.at.values()): one.gap for one in places(frame())}
    assert found["all",] == Gap(36.0, 4.0, 8)
    assert found["specimen", "a"] == Gap(1.0 + 2.0 + 3.0 + 4.0, 2.0, 4)
    assert found["step", 1] == Gap(3.0 + 4.0 + 7.0 + 8.0, 2.0, 4)
    assert found["coordinate", "right_bending"] == Gap(2.0 + 4.0 + 6.0 + 8.0, 2.0, 4)
    assert found["joint", "L4L5"] == found["test", "flexion"] == found["all",]
    place = "joint x coordinate x test", "L4L5", "extension", "flexion"
    assert found[place] == Gap(1.0 + 3.0 + 5.0 + 7.0, 2.0, 4)
    assert len(found) == 1 + 2 + 1 + 2 + 1 + 2 + 2


def test_the_worst_places_are_those_above_the_noise_largest_first() -> None:
    by = "joint x coordinate x test"
    clear, clearer = Gap(300.0, 100.0, 100), Gap(400.0, 100.0, 100)
    made = [
        GapPlace(by, {}, clear),
        GapPlace(by, {}, Gap(101.0, 100.0, 100)),
        GapPlace(by, {}, clearer),
    ]
    made.append(GapPlace("joint", {}, Gap(900.0, 100.0, 100)))
    assert [one.gap for one in worst(made, 5)] == [clearer, clear]
    assert [one.gap for one in worst(made, 1)] == [clearer]


def test_without_freedom_there_is_no_gap() -> None:
    nothing = Gap(4.0, 0.0, 4)
    assert (nothing.rms, nothing.gap, nothing.interval) == (0.0, 0.0, (0.0, 0.0))


def test_values_are_spread_over_what_was_read_test_by_test() -> None:
    used = np.zeros((2, 2, 1, 6), dtype=bool)
    used[0, 1, 0, 3], used[1, 0, 0, 3], used[1, 0, 0, 5] = True, True, True
    first, second = _spread(np.array([7.0, 8.0, 9.0]), tuple(used))
    assert first[1, 0, 3] == 7.0
    assert (second[0, 0, 3], second[0, 0, 5]) == (8.0, 9.0)
    assert np.isnan(first).sum() + np.isnan(second).sum() == 2 * 12 - 3

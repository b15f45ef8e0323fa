"""Shares of joints in a rotation: the published set entered again, locking, a cohort's own."""

import numpy as np
import pandas as pd
import pytest

from spinepipe.motion.joint_tables import RATIOS_FILE, packaged_rows, ratio_sets
from spinepipe.motion.skeleton import JOINTS
from spinepipe.problems import InputError

CHRISTOPHY = np.array(
    [
        (0.125, 0.185, 0.204, 0.231, 0.255),
        (0.1356, 0.1811, 0.2453, 0.2501, 0.188),
        (0.2078, 0.2208, 0.2208, 0.1818, 0.1688),
    ]
)
"""Extension, right bending and left rotation of L5S1 to L1L2."""

FLEXION = np.array((17, 16, 15, 14, 12, 12, 12, 9, 6, 6, 6, 5, 4, 4, 4, 4, 4))
"""White and Panjabi 1990, deg."""


def test_the_sets_are_as_published_and_what_they_do_not_name_is_locked() -> None:
    sets, rows = ratio_sets(), packaged_rows(RATIOS_FILE, ("ratio",))
    lumbar, whole = sets["christophy_2012"], sets["white_panjabi_1990"]
    np.testing.assert_array_equal(lumbar[:5].T, CHRISTOPHY)
    assert not lumbar[5:].any()
    np.testing.assert_allclose(whole[:, 0], FLEXION / FLEXION.sum(), atol=5e-5)
    assert whole.any(axis=1).all()
    told = {name: set(own["status"]) for name, own in rows.groupby("set")}
    assert told == {
        "christophy_2012": {"confirmed"},
        "ghezelbash_2016": {"confirmed", "choice"},
        "white_panjabi_1990": {"from_memory"},
    }
    for shares in sets.values():
        # four digits each: half a unit of the last in up to seventeen joints
        np.testing.assert_allclose(shares.sum(axis=0), 1.0, atol=17 * 5e-5)


def own(*ratios: float, name: str = "bruno_2015") -> pd.DataFrame:
    lines = [
        {"set": name, "joint": joint, "coordinate": "extension", "ratio": ratio, "source": "print"}
        for joint, ratio in zip(JOINTS, ratios, strict=False)
    ]
    return pd.DataFrame(lines, index=range(2, 2 + len(lines)))


def test_a_cohort_s_own_set_is_added_or_takes_the_place_of_one_of_its_name() -> None:
    found = ratio_sets(own(0.6, 0.4))
    assert set(found) == {*ratio_sets(), "bruno_2015"}
    np.testing.assert_array_equal(found["bruno_2015"][:2, 0], [0.6, 0.4])
    other = ratio_sets(own(0.6, 0.4, name="christophy_2012"))["christophy_2012"]
    assert np.count_nonzero(other) == 2


@pytest.mark.parametrize("ratios", [(0.6, 0.4, 0.0), (0.6, 0.4019), (0.6, 0.3981)])
def test_a_share_may_be_nothing_and_a_sum_may_be_rounded(ratios: tuple[float, ...]) -> None:
    assert ratio_sets(own(*ratios))["bruno_2015"][1, 0] == ratios[1]


@pytest.mark.parametrize(("second", "total"), [(0.4021, 1.002), (0.3979, 0.9979), (0.5, 1.1)])
def test_a_sum_off_by_more_is_told_at_the_first_row_of_its_coordinate(
    second: float, total: float
) -> None:
    rows = pd.concat([own(1.0, name="christophy_2012"), own(0.6, second).set_axis([3, 4])])
    with pytest.raises(InputError) as caught:
        ratio_sets(rows, "mine.csv")
    (problem,) = caught.value.problems
    assert (problem.file, problem.row, problem.column) == ("mine.csv", 3, "ratio")
    assert problem.found.endswith(f"sum to {total:g}")


def test_shares_of_one_coordinate_are_no_shares_of_another() -> None:
    rows = own(0.6, 0.4)
    turned = rows.assign(coordinate="left_rotation", ratio=[0.3, 0.7]).set_axis([4, 5])
    found = ratio_sets(pd.concat([rows, turned]))["bruno_2015"]
    np.testing.assert_array_equal(found[:2], [[0.6, 0.0, 0.3], [0.4, 0.0, 0.7]])

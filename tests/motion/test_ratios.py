"""Shares of joints in a rotation: the published set entered again, locking, a cohort's own."""

import numpy as np
import pandas as pd
import pytest

from spinepipe.motion.ratios import ratio_sets
from spinepipe.motion.skeleton import JOINTS
from spinepipe.problems import InputError
from spinepipe.units import COORDINATES, ROTATIONS

CHRISTOPHY = {
    "extension": (0.125, 0.185, 0.204, 0.231, 0.255),
    "right_bending": (0.1356, 0.1811, 0.2453, 0.2501, 0.188),
    "left_rotation": (0.2078, 0.2208, 0.2208, 0.1818, 0.1688),
}
"""L5S1 to L1L2."""


def test_the_set_of_christophy_is_as_published() -> None:
    found = ratio_sets()["christophy_2012"]
    for k, name in enumerate(ROTATIONS):
        np.testing.assert_array_equal(found.shares[:5, k], CHRISTOPHY[name])
    assert found.status == ("confirmed",)


def test_what_a_lumbar_set_does_not_name_is_locked() -> None:
    locked = ratio_sets()["christophy_2012"].locked
    assert [joint for joint, held in zip(JOINTS, locked, strict=True) if not held] == [
        *("L5S1", "L4L5", "L3L4", "L2L3", "L1L2")
    ]


@pytest.mark.parametrize("name", sorted(ratio_sets()))
def test_shares_sum_to_one(name: str) -> None:
    # four digits each: half a unit of the last in up to seventeen joints
    np.testing.assert_allclose(ratio_sets()[name].shares.sum(axis=0), 1.0, atol=17 * 5e-5)


def test_shares_by_ranges_of_motion_follow_white_and_panjabi() -> None:
    found = ratio_sets()["white_panjabi_1990"]
    flexion = (17, 16, 15, 14, 12, 12, 12, 9, 6, 6, 6, 5, 4, 4, 4, 4, 4)
    np.testing.assert_allclose(found.shares[:, 0], np.array(flexion) / sum(flexion), atol=5e-5)
    assert not found.locked.any()
    assert found.status == ("from_memory",)


def test_driving_rotations_are_shared_out() -> None:
    found = ratio_sets()["christophy_2012"]
    driving = np.array([[0.5, -0.2, 0.1], [0.0, 0.3, 0.0]])
    q = found.coordinates(driving)
    assert q.shape == (2, 17, 6)
    np.testing.assert_array_equal(q[..., :3], 0.0)
    # shares of lateral bending sum to 1.0001 as printed
    np.testing.assert_allclose(q[..., 3:].sum(axis=1), driving, rtol=2e-4, atol=1e-15)
    l2l3 = JOINTS.index("L2L3")
    assert q[0, l2l3, COORDINATES.index("right_bending")] == pytest.approx(-0.2 * 0.2501)
    np.testing.assert_array_equal(q[:, found.locked], 0.0)


def own(*ratios: float, name: str = "bruno_2015") -> pd.DataFrame:
    lines = [
        {"set": name, "joint": joint, "coordinate": "extension", "ratio": ratio, "source": "print"}
        for joint, ratio in zip(JOINTS, ratios, strict=False)
    ]
    return pd.DataFrame(lines, index=range(2, 2 + len(lines)))


def test_a_cohort_s_own_set_is_added() -> None:
    found = ratio_sets(own(0.6, 0.4))
    assert set(found) == {*ratio_sets(), "bruno_2015"}
    np.testing.assert_array_equal(found["bruno_2015"].shares[:2, 0], [0.6, 0.4])
    assert found["bruno_2015"].source == ("print",)


def test_a_cohort_s_own_set_takes_the_place_of_one_of_its_name() -> None:
    found = ratio_sets(own(0.6, 0.4, name="christophy_2012"))["christophy_2012"]
    assert np.count_nonzero(found.shares) == 2


@pytest.mark.parametrize("ratios", [(0.6, 0.4, 0.0), (0.6, 0.4019), (0.6, 0.3981)])
def test_a_share_may_be_nothing_and_a_sum_may_be_rounded(ratios: tuple[float, ...]) -> None:
    assert ratio_sets(own(*ratios))["bruno_2015"].shares[1, 0] == ratios[1]


@pytest.mark.parametrize("second", [0.4021, 0.3979])
def test_a_sum_off_by_more_is_told_at_the_first_row_of_its_coordinate(second: float) -> None:
    rows = pd.concat([own(1.0, name="christophy_2012"), own(0.6, second).set_axis([3, 4])])
    with pytest.raises(InputError) as caught:
        ratio_sets(rows, "mine.csv")
    (problem,) = caught.value.problems
    assert (problem.file, problem.row, problem.column) == ("mine.csv", 3, "ratio")


def test_shares_of_one_coordinate_are_no_shares_of_another() -> None:
    rows = own(0.6, 0.4)
    turned = rows.assign(coordinate="left_rotation", ratio=[0.3, 0.7]).set_axis([4, 5])
    found = ratio_sets(pd.concat([rows, turned]))["bruno_2015"]
    np.testing.assert_array_equal(found.shares[:2], [[0.6, 0.0, 0.3], [0.4, 0.0, 0.7]])
    assert not found.shares.flags.writeable


def test_a_sum_that_is_not_the_whole_is_told() -> None:
    with pytest.raises(InputError, match=r"sum to 1\.1"):
        ratio_sets(own(0.6, 0.5))

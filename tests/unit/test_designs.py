"""Designs: a Latin hypercube of normals hits every stratum once, reproducibly.

Catches strata left empty, and draws that change though the seed does not.
"""

import numpy as np
import pytest
from scipy.stats import norm

from spinepipe.designs import latin_hypercube_normal, sample_landmarks, specimen_seed

MEANS, SDS = np.array([1.0, -20.0, 300.0, 4.0]), np.array([0.5, 2.0, 0.0, 10.0])


def test_every_stratum_is_hit_exactly_once() -> None:
    n = 50
    points = latin_hypercube_normal(MEANS, SDS, n, seed=3)
    free = SDS > 0.0
    strata = np.floor(n * norm.cdf((points[:, free] - MEANS[free]) / SDS[free])).astype(int)
    np.testing.assert_array_equal(np.sort(strata, axis=0), np.tile(np.arange(n)[:, None], 3))


def test_means_and_sds_are_those_asked_for() -> None:
    n = 2000
    points = latin_hypercube_normal(MEANS, SDS, n, seed=4)
    free = SDS > 0.0
    # stratified: errors fall like n^-1.5 in the mean; the tails' scatter leaves 1 % in the SD
    np.testing.assert_allclose((points.mean(axis=0) - MEANS)[free] / SDS[free], 0, atol=1e-3)
    np.testing.assert_allclose(points.std(axis=0)[free], SDS[free], rtol=0.01)
    correlation = np.corrcoef(points[:, free].T) - np.eye(3)
    assert np.abs(correlation).max() < 4.0 / np.sqrt(n)


def test_a_coordinate_without_sd_stays() -> None:
    assert (latin_hypercube_normal(MEANS, SDS, 10, seed=1)[:, 2] == 300.0).all()
    still = latin_hypercube_normal(MEANS, np.zeros(4), 5, seed=1)
    np.testing.assert_array_equal(still, np.tile(MEANS, (5, 1)))


def test_same_seed_same_bytes_and_another_seed_others() -> None:
    one, same, other = (latin_hypercube_normal(MEANS, SDS, 20, seed) for seed in (7, 7, 8))
    assert one.tobytes() == same.tobytes()
    assert (one[:, 0] != other[:, 0]).all()


def test_seed_zero_is_a_seed() -> None:
    one, same = (latin_hypercube_normal(MEANS, SDS, 5, 0) for _ in range(2))
    assert one.tobytes() == same.tobytes()


def test_the_arguments_are_left_alone() -> None:
    means, sds = MEANS.copy(), SDS.copy()
    latin_hypercube_normal(means, sds, 5, 1)
    np.testing.assert_array_equal(means, MEANS)
    np.testing.assert_array_equal(sds, SDS)


@pytest.mark.parametrize(("sds", "n"), [(-SDS, 10), (SDS, 1)])
def test_what_is_no_design_is_refused(sds, n) -> None:
    with pytest.raises(ValueError, match="Latin hypercube"):
        latin_hypercube_normal(MEANS, sds, n, 1)


def test_an_sd_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValueError, match="SD"):
        latin_hypercube_normal(MEANS, np.array([1.0, np.nan, 1.0, 1.0]), 10, 1)


def test_each_specimen_has_its_own_draws_whoever_else_is_in_the_cohort() -> None:
    points, sds = np.arange(12.0).reshape(4, 3), np.array([1.0, 0.0, 2.0, 1.0])
    names = ["a", "b", "ab", "ba", "A", "a1"]
    seeds = {name: specimen_seed(5, name) for name in names}
    assert len(set(seeds.values())) == len(names)
    assert specimen_seed(6, "a") != seeds["a"]
    drawn = {name: sample_landmarks(points, sds, 8, 5, name)[0] for name in names}
    again = {name: sample_landmarks(points, sds, 8, 5, name)[0] for name in reversed(names[:3])}
    for name, sets in again.items():
        assert sets.tobytes() == drawn[name].tobytes()
    assert not np.array_equal(drawn["a"], drawn["b"])


def test_landmarks_move_per_axis_with_their_own_sd() -> None:
    points, sds = np.arange(12.0).reshape(4, 3), np.array([1.0, 0.0, 2.0, 0.1])
    sets, poses = sample_landmarks(points, sds, 400, 1, "a")
    assert (sets.shape, list(poses)) == ((400, 4, 3), list(range(400)))
    np.testing.assert_allclose(sets.std(axis=0), np.tile(sds[:, None], 3), rtol=0.03)
    np.testing.assert_allclose(sets.mean(axis=0), points, rtol=0, atol=0.02)

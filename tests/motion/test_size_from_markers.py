"""A skeleton of known size found again from its markers; masses; what cannot be told."""

from itertools import combinations

import numpy as np
import pytest
from moving_spine import CLUSTERS, markers, spine

from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.motion.points import marker_places
from spinepipe.motion.scaling import SEGMENTS, fit_scaling, scale_skeleton, segment_of
from spinepipe.motion.skeleton import BODIES, MarkerTrial

FACTORS = np.array([1.12, 0.93, 1.05])
"""Pelvis, lumbar, thoracic."""

PAIRS = [
    (one, other)
    for one, other in combinations(range(len(markers())), 2)
    if not markers().cluster[one] or markers().cluster[one] != markers().cluster[other]
]
"""All but those within a cluster."""


def standing(places: Array, frames: int = 3, seen: tuple[str, ...] | None = None) -> MarkerTrial:
    """A trial at rest; seen : markers that are, None for all."""
    there = np.array([seen is None or name in seen for name in markers().names])
    time, whole = np.arange(frames) / 100.0, np.tile(places, (frames, 1, 1))
    return MarkerTrial("stance", "stance", time, whole, np.tile(there, (frames, 1)), "hanging")


def moved_by_hand(factors: Array) -> Array:
    """(K, 3) m of markers on the spine of that size, put together body by body."""
    turn, origin = np.eye(3), np.zeros(3)
    poses = [(turn, origin)]
    for k, step in enumerate(spine().steps):
        size = factors[0 if k == 0 else 1 if k <= 5 else 2]
        origin = origin + turn @ (size * step.origin)
        turn = turn @ step.rotation
        poses.append((turn, origin))
    found, on = [], markers()
    for k, body in enumerate(on.body):
        size = factors[0 if body == 0 else 1 if body <= 5 else 2]
        plate = [j for j, name in enumerate(on.cluster) if name and name == on.cluster[k]]
        middle = on.at[plate].mean(axis=0) if plate else on.at[k]
        turn, origin = poses[body]
        found.append(origin + turn @ (size * middle + on.at[k] - middle))
    return np.array(found)


def test_a_known_size_is_found_again_wherever_the_subject_stands() -> None:
    places = moved_by_hand(FACTORS)
    turned = places @ rotation_zxy(0.1, -0.2, 2.0).T + [0.4, 0.9, -2.0]
    for each in (places, turned):
        fit = fit_scaling(spine(), markers(), standing(each))
        # distances to 1e-16 m, of a problem whose factors each move centimetres
        np.testing.assert_allclose(fit.factors, FACTORS, rtol=1e-9)
        assert fit.rms_mm == pytest.approx(0.0, abs=1e-6)
        assert fit.n_pairs == len(PAIRS)


def test_the_scaled_model_wears_its_markers_where_the_subject_does() -> None:
    skeleton, worn = scale_skeleton(spine(), markers(), FACTORS, 60.0)
    found = marker_places(skeleton, worn, np.zeros((1, 18, 6)))[0]
    np.testing.assert_allclose(found, moved_by_hand(FACTORS), atol=1e-15)


def test_one_wrong_marker_is_named_with_what_it_costs() -> None:
    """50 mm off in two directions: distances to it are up to 71 mm wrong, others fit."""
    places = moved_by_hand(FACTORS)
    places[markers().names.index("T5")] += [-0.05, 0.0, 0.05]
    fit = fit_scaling(spine(), markers(), standing(places))
    assert "T5" in fit.largest_pair
    assert 10.0 < fit.largest_mm < 1e3 * np.hypot(0.05, 0.05)
    assert fit.rms_mm < fit.largest_mm
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=0.1)


def test_what_is_left_is_told_in_millimetres_over_pairs() -> None:
    """Distances again from a spine put together by hand, of the size that was found.

    Of two readings with 1 mm along the line each, so root 2; three factors of hundreds of pairs.
    """
    places = moved_by_hand(FACTORS)
    places = places + 1e-3 * np.random.default_rng(8).normal(size=places.shape)
    fit = fit_scaling(spine(), markers(), standing(places, frames=1))
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=0.03)
    again = moved_by_hand(fit.factors)
    left = []
    for one, other in PAIRS:
        apart = [np.linalg.norm(at[other] - at[one]) for at in (again, places)]
        left.append(1e3 * abs(apart[0] - apart[1]))
    assert fit.rms_mm == pytest.approx(np.sqrt(np.mean(np.square(left))), rel=1e-6)
    assert fit.rms_mm == pytest.approx(np.sqrt(2.0), rel=0.3)
    assert fit.largest_mm == pytest.approx(max(left), rel=1e-6)
    worst = PAIRS[int(np.argmax(left))]
    assert fit.largest_pair == tuple(markers().names[k] for k in worst)


@pytest.mark.parametrize(
    ("part", "size", "told"),
    [
        *(("lumbar", 0.42, ""), ("thoracic", 2.4, "")),
        *(("lumbar", 0.38, r"0\.40"), ("thoracic", 2.6, r"2\.50")),
    ],
)
def test_parts_from_two_fifths_to_two_and_a_half_times_the_generic_ones_are_people_s(
    part: str, size: float, told: str
) -> None:
    factors = np.where(np.array(SEGMENTS) == part, size, 1.0)
    trial = standing(moved_by_hand(factors))
    if told:
        with pytest.raises(ValueError, match=f"the {part} part would be {told} times"):
            fit_scaling(spine(), markers(), trial)
    else:
        found = fit_scaling(spine(), markers(), trial).factors
        np.testing.assert_allclose(found, factors, rtol=1e-6)


def test_distances_are_means_over_frames_with_both_in_sight() -> None:
    trial = standing(moved_by_hand(FACTORS))
    lost, gone = markers().names.index("L4_0"), markers().names.index("L4_1")
    trial.places[0, lost], trial.seen[0, lost] = 0.0, False
    trial.seen[:, gone] = False
    fit = fit_scaling(spine(), markers(), trial)
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=1e-9)
    assert fit.n_pairs == sum(gone not in pair for pair in PAIRS)


def test_masses_become_the_subject_s_and_inertias_grow_with_size() -> None:
    before = spine().masses
    after = scale_skeleton(spine(), markers(), FACTORS, 55.0)[0].masses
    assert after.kg.sum() == pytest.approx(55.0)
    np.testing.assert_allclose(after.kg / after.kg[0], before.kg / before.kg[0], rtol=1e-14)
    l3, t8 = BODIES.index("L3"), BODIES.index("T8")
    np.testing.assert_allclose(after.com[l3], 0.93 * before.com[l3], rtol=1e-14)
    grown = 55.0 / before.kg.sum() * 1.05**2
    np.testing.assert_allclose(after.about_com[t8], grown * before.about_com[t8], rtol=1e-14)


def test_bodies_belong_to_their_parts() -> None:
    parts = [SEGMENTS[segment_of(k)] for k in range(len(BODIES))]
    assert parts == ["pelvis", *["lumbar"] * 5, *["thoracic"] * 12]


@pytest.mark.parametrize(
    ("seen", "told"),
    [
        (("LASI", "RASI", "LPSI"), "lumbar"),
        (("LASI", "T1_0"), "do not tell the sizes of the three parts apart"),
        (("L2_0", "L2_1", "L2_2"), "no pair of markers is in sight in stance"),
        ((), "no pair of markers is in sight in stance"),
    ],
)
def test_what_pairs_cannot_tell_is_refused(seen: tuple[str, ...], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        fit_scaling(spine(), markers(), standing(moved_by_hand(FACTORS), seen=seen))


def test_millimetres_taken_for_metres_are_refused() -> None:
    with pytest.raises(ValueError, match="units"):
        fit_scaling(spine(), markers(), standing(1e3 * moved_by_hand(FACTORS)))


def test_plates_keep_their_distances() -> None:
    """A cluster is a plate that no body scales."""
    worn = scale_skeleton(spine(), markers(), FACTORS, 60.0)[1]
    for name in CLUSTERS:
        at = [k for k, cluster in enumerate(markers().cluster) if cluster == name]
        kept = np.diff(worn.at[at], axis=0)
        np.testing.assert_allclose(kept, np.diff(markers().at[at], axis=0), atol=1e-15)

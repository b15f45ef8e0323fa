"""A skeleton of known size found again from its markers; masses; what cannot be told."""

import numpy as np
import pytest

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.motion.scaling import SEGMENTS, fitted, scaled, segment_of
from spinepipe.motion.skeleton import (
    BODIES,
    MarkerSet,
    MarkerTrial,
    Masses,
    Skeleton,
    body_poses,
    skeleton_of,
)

FACTORS = np.array([1.12, 0.93, 1.05])
"""Pelvis, lumbar, thoracic."""

CLUSTERS = ("T1", "T3", "T7", "T11", "L2", "L4")
SINGLES = ("T5", "T9", "T12", "L3")
PELVIS_MM = {
    **{"LASI": (90, 30, -120), "RASI": (90, 30, 120), "LPSI": (-70, 20, -45)},
    **{"RPSI": (-70, 20, 45), "SACR": (-75, 0, 0)},
}


def generic() -> Skeleton:
    """A curved spine of 0.5 m whose bodies weigh 1 to 2 kg, the pelvis 10."""
    rng = np.random.default_rng(5)
    lean = 0.35 * np.sin(np.linspace(0.0, 2.0 * np.pi, 17))
    heights = np.concatenate([[0.0], np.cumsum(np.linspace(0.036, 0.021, 16))])
    forwards = 0.02 * np.sin(np.linspace(0.0, 2.0 * np.pi, 17))
    joints = [
        Pose(rotation_zxy(a, 0.01, -0.02), np.array([x, y, 0.0]))
        for a, x, y in zip(lean, forwards, heights, strict=True)
    ]
    kg = np.array([10.0, *np.linspace(2.0, 1.0, 17)])
    about = kg[:, None, None] * np.diag([0.006, 0.01, 0.004])
    return skeleton_of(joints, Masses(kg, rng.normal(0.0, 0.02, (18, 3)), about))


def marker_set() -> MarkerSet:
    """The protocol of the paper: plates on six vertebrae, singles on four, five on the pelvis."""
    names, body, at, cluster = [], [], [], []
    for name, place in PELVIS_MM.items():
        names.append(name)
        body.append(0)
        at.append(np.array(place) / 1e3)
        cluster.append("")
    plate = np.array([[-0.09, 0.02, 0.0], [-0.09, -0.01, 0.03], [-0.09, -0.01, -0.03]])
    for vertebra in CLUSTERS:
        for k, place in enumerate(plate, start=1):
            names.append(f"{vertebra}_{k}")
            body.append(BODIES.index(vertebra))
            at.append(place)
            cluster.append(vertebra)
    for vertebra in SINGLES:
        names.append(vertebra)
        body.append(BODIES.index(vertebra))
        at.append(np.array([-0.06, 0.0, 0.0]))
        cluster.append("")
    k = len(names)
    bodies = np.array(body, dtype=np.int64)
    return MarkerSet(tuple(names), bodies, np.array(at), np.ones(k), tuple(cluster))


def worn(skeleton: Skeleton, markers: MarkerSet, q: Array | None = None) -> Array:
    """(K, 3) m, where markers are in a pose."""
    turns, origins = body_poses(skeleton, np.zeros((18, 6)) if q is None else q)
    moved = np.einsum("kij,kj->ki", turns[markers.body], markers.at)
    found: Array = origins[markers.body] + moved
    return found


def standing(places: Array, frames: int = 3) -> MarkerTrial:
    seen = np.ones((frames, len(places)), dtype=bool)
    time = np.arange(frames) / 100.0
    return MarkerTrial("stance", "stance", time, np.tile(places, (frames, 1, 1)), seen, "hanging")


def moved_by_hand(factors: Array) -> Array:
    """(K, 3) m of markers on the spine of that size, put together body by body."""
    skeleton, markers = generic(), marker_set()
    turn, origin = np.eye(3), np.zeros(3)
    poses = [(turn, origin)]
    for k, step in enumerate(skeleton.steps):
        size = factors[0 if k == 0 else 1 if k <= 5 else 2]
        origin = origin + turn @ (size * step.origin)
        turn = turn @ step.rotation
        poses.append((turn, origin))
    found = []
    for k, body in enumerate(markers.body):
        size = factors[0 if body == 0 else 1 if body <= 5 else 2]
        plate = [j for j, name in enumerate(markers.cluster) if name and name == markers.cluster[k]]
        middle = markers.at[plate].mean(axis=0) if plate else markers.at[k]
        turn, origin = poses[body]
        found.append(origin + turn @ (size * middle + markers.at[k] - middle))
    return np.array(found)


def test_a_known_size_is_found_again() -> None:
    fit = fitted(generic(), marker_set(), standing(moved_by_hand(FACTORS)))
    # distances to 1e-16 m, of a problem whose factors each move centimetres
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=1e-9)
    assert fit.rms_mm == pytest.approx(0.0, abs=1e-6)
    k = len(marker_set())
    assert fit.n_pairs == k * (k - 1) // 2 - 3 * len(CLUSTERS)


def test_where_the_subject_stands_and_faces_changes_nothing() -> None:
    places = moved_by_hand(FACTORS)
    turned = places @ rotation_zxy(0.1, -0.2, 2.0).T + [0.4, 0.9, -2.0]
    here, there = (fitted(generic(), marker_set(), standing(each)) for each in (places, turned))
    np.testing.assert_allclose(there.factors, here.factors, rtol=1e-9)


def test_the_scaled_model_wears_its_markers_where_the_subject_does() -> None:
    skeleton, markers = scaled(generic(), marker_set(), FACTORS, 60.0)
    np.testing.assert_allclose(worn(skeleton, markers), moved_by_hand(FACTORS), atol=1e-15)


def test_one_wrong_marker_is_named_with_what_it_costs() -> None:
    """50 mm off at one of 23 markers: distances to it are up to 50 mm wrong, others fit."""
    places = moved_by_hand(FACTORS)
    wrong = marker_set().names.index("T5")
    places[wrong] += [0.0, 0.0, 0.05]
    places[wrong] += [-0.05, 0.0, 0.0]
    fit = fitted(generic(), marker_set(), standing(places))
    assert "T5" in fit.largest_pair
    assert 10.0 < fit.largest_mm < 1e3 * np.hypot(0.05, 0.05)
    assert fit.rms_mm < fit.largest_mm
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=0.1)


def test_what_is_left_is_told_in_millimetres_over_pairs() -> None:
    """Distances again from a spine put together by hand, of the size that was found."""
    places = moved_by_hand(FACTORS)
    places += 2e-3 * np.random.default_rng(20011).normal(size=places.shape)
    names = marker_set().names
    pairs = [("LASI", "RASI"), ("L2_1", "L4_1"), ("L3", "L4_2"), ("T1_1", "T11_1"), ("T5", "T9")]
    fit = fitted(generic(), marker_set(), standing(places), pairs)
    again = moved_by_hand(fit.factors)
    left = []
    for pair in pairs:
        one, other = (names.index(name) for name in pair)
        apart = [np.linalg.norm(at[other] - at[one]) for at in (again, places)]
        left.append(1e3 * abs(apart[0] - apart[1]))
    assert fit.rms_mm == pytest.approx(np.sqrt(np.mean(np.square(left))), rel=1e-6)
    assert fit.largest_mm == pytest.approx(max(left), rel=1e-6)
    assert fit.largest_pair == pairs[int(np.argmax(left))]


@pytest.mark.parametrize(("part", "size"), [("lumbar", 0.42), ("thoracic", 2.4)])
def test_parts_from_two_fifths_to_two_and_a_half_times_the_generic_ones_are_people_s(
    part: str, size: float
) -> None:
    factors = np.where(np.array(SEGMENTS) == part, size, 1.0)
    fit = fitted(generic(), marker_set(), standing(moved_by_hand(factors)))
    np.testing.assert_allclose(fit.factors, factors, rtol=1e-6)


@pytest.mark.parametrize(
    ("part", "size", "told"), [("lumbar", 0.38, r"0\.40"), ("thoracic", 2.6, r"2\.50")]
)
def test_parts_beyond_are_not(part: str, size: float, told: str) -> None:
    factors = np.where(np.array(SEGMENTS) == part, size, 1.0)
    with pytest.raises(ValueError, match=f"the {part} part would be {told} times"):
        fitted(generic(), marker_set(), standing(moved_by_hand(factors)))


def test_pairs_within_a_cluster_tell_nothing_also_where_they_are_named() -> None:
    pairs = [("L2_1", "L2_2"), ("T1_1", "T1_3")]
    with pytest.raises(ValueError, match="no pair of markers is in sight in stance"):
        fitted(generic(), marker_set(), standing(moved_by_hand(FACTORS)), pairs)


def test_noise_of_a_millimetre_is_what_is_left() -> None:
    """Distances of two readings: 1 mm each along the line, so root 2; three factors of 235."""
    places = moved_by_hand(FACTORS)
    noisy = places + 1e-3 * np.random.default_rng(8).normal(size=places.shape)
    fit = fitted(generic(), marker_set(), standing(noisy, frames=1))
    assert fit.rms_mm == pytest.approx(np.sqrt(2.0), rel=0.3)
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=0.03)


def test_distances_are_means_over_frames_with_both_in_sight() -> None:
    trial = standing(moved_by_hand(FACTORS))
    places, seen = trial.places.copy(), trial.seen.copy()
    places[0, 3], seen[0, 3] = 0.0, False
    seen[:, 5] = False
    lost = MarkerTrial("stance", "stance", trial.time_s, places, seen, "hanging")
    fit = fitted(generic(), marker_set(), lost)
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=1e-9)
    k = len(marker_set()) - 1
    assert fit.n_pairs == k * (k - 1) // 2 - 3 * len(CLUSTERS) + 2


def test_pairs_may_be_named() -> None:
    pairs = [("LASI", "RASI"), ("L2_1", "L4_1"), ("L3", "L4_2"), ("T1_1", "T11_1"), ("T5", "T9")]
    fit = fitted(generic(), marker_set(), standing(moved_by_hand(FACTORS)), pairs)
    np.testing.assert_allclose(fit.factors, FACTORS, rtol=1e-9)
    assert fit.n_pairs == len(pairs)


def test_masses_become_the_subject_s_and_inertias_grow_with_size() -> None:
    before = generic().masses
    after = scaled(generic(), marker_set(), FACTORS, 55.0)[0].masses
    assert after.kg.sum() == pytest.approx(55.0)
    np.testing.assert_allclose(after.kg / after.kg[0], before.kg / before.kg[0], rtol=1e-14)
    l3, t8 = BODIES.index("L3"), BODIES.index("T8")
    np.testing.assert_allclose(after.com[l3], 0.93 * before.com[l3], rtol=1e-14)
    heavier = 55.0 / before.kg.sum()
    np.testing.assert_allclose(
        after.about_com[t8], heavier * 1.05**2 * before.about_com[t8], rtol=1e-14
    )


def test_bodies_belong_to_their_parts() -> None:
    parts = [SEGMENTS[segment_of(k)] for k in range(len(BODIES))]
    assert parts == ["pelvis", *["lumbar"] * 5, *["thoracic"] * 12]


@pytest.mark.parametrize(
    ("pairs", "told"),
    [
        ([("LASI", "RASI"), ("T1_1", "T11_1"), ("T5", "T9")], "lumbar"),
        ([("SACR", "T1_1"), ("SACR", "T3_1")], "apart"),
        ([("LASI", "C7")], "C7"),
    ],
)
def test_what_pairs_cannot_tell_is_refused(pairs: list[tuple[str, str]], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        fitted(generic(), marker_set(), standing(moved_by_hand(FACTORS)), pairs)


def test_a_pair_that_was_never_in_sight_is_told() -> None:
    trial = standing(moved_by_hand(FACTORS))
    trial.seen[:, 0] = False
    with pytest.raises(ValueError, match="LASI and RASI"):
        fitted(generic(), marker_set(), trial, [("LASI", "RASI")])


def test_millimetres_taken_for_metres_are_refused() -> None:
    with pytest.raises(ValueError, match="units"):
        fitted(generic(), marker_set(), standing(1e3 * moved_by_hand(FACTORS)))

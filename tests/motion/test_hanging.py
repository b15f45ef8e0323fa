"""Head and arms on T1: sums of points, de Leva's numbers again, arms where tasks have them."""

from dataclasses import replace

import numpy as np
import pytest

from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.motion.body_segments import (
    ARMS,
    T1,
    Arms,
    RigidPart,
    combine,
    elbow_between,
    head_and_arm_parts,
    in_frame,
    with_head_and_arms,
)
from spinepipe.motion.skeleton import Masses, Skeleton, body_poses, skeleton_of
from spinepipe.muscles.subject import Subject

MAN = Subject("male", 30.0, 1.741, 73.0)
WOMAN = Subject("female", 30.0, 1.735, 61.9)
"""Persons of the height and mass of de Leva's means."""

TALLER = replace(MAN, height_m=1.2 * MAN.height_m, mass_kg=1.5 * MAN.mass_kg)

ANYWHERE = np.array([-0.05, 1.4, 0.0])


def made_up() -> Skeleton:
    """A curved chain whose vertebrae are small tilted bodies."""
    rng = np.random.default_rng(2)
    joints = [
        Pose(
            rotation_zxy(*(0.3 * np.sin(0.4 * k), 0.02, -0.01)), np.array([-0.01 * k, 0.03 * k, 0])
        )
        for k in range(17)
    ]
    arms = rng.normal(0.0, 0.1, (18, 3, 3))
    about = 1e-3 * np.eye(3) + 1e-2 * arms @ arms.transpose(0, 2, 1)
    masses = Masses(rng.uniform(0.5, 2.0, 18), rng.normal(0.0, 0.02, (18, 3)), about)
    return skeleton_of(joints, masses)


def cloud(part: RigidPart) -> tuple[Array, Array]:
    """Six equal points with the part's mass, centre and inertia: kg (6,) and places (6, 3)."""
    sizes, axes = eigh(part.about_com)
    squares = 0.5 * sizes.sum() - sizes  # second moments of mass along the principal axes
    arms = np.sqrt(3.0 * squares / part.kg)
    points = [
        part.com + s * arm * axis for arm, axis in zip(arms, axes.T, strict=True) for s in (1, -1)
    ]
    return np.full(6, part.kg / 6.0), np.array(points)


def moments(kg: Array, points: Array) -> tuple[float, Array, Array]:
    """Mass, centre and inertia of points, by plain sums."""
    total = float(kg.sum())
    centre = np.array(
        [sum(m * p[i] for m, p in zip(kg, points, strict=True)) / total for i in range(3)]
    )
    about = np.zeros((3, 3))
    for m, point in zip(kg, points, strict=True):
        x, y, z = point - centre
        about += m * np.array(
            [
                [y * y + z * z, -x * y, -x * z],
                [-x * y, x * x + z * z, -y * z],
                [-x * z, -y * z, x * x + y * y],
            ]
        )
    return total, centre, about


@pytest.mark.parametrize("arms", ARMS)
@pytest.mark.parametrize("person", [MAN, WOMAN], ids=lambda person: person.sex)
def test_t1_carries_the_sum_of_all_its_points(person: Subject, arms: str) -> None:
    """Every part as six points in ground, summed there, seen from T1's tilted frame."""
    skeleton = made_up()
    turns, places = body_poses(skeleton, np.zeros((18, 6)))
    given = skeleton.masses
    own = RigidPart("T1", given.kg[T1], given.com[T1], given.about_com[T1])
    own = in_frame(own, turns[T1].T, -turns[T1].T @ places[T1])
    clouds = [cloud(part) for part in (own, *head_and_arm_parts(arms, person, places[T1]))]
    kg, centre, about = moments(*(np.concatenate(one) for one in zip(*clouds, strict=True)))
    found = with_head_and_arms(skeleton, arms, person)
    np.testing.assert_array_equal(found.kg[:T1], given.kg[:T1])
    np.testing.assert_array_equal(found.com[:T1], given.com[:T1])
    np.testing.assert_array_equal(found.about_com[:T1], given.about_com[:T1])
    assert found.kg[T1] == pytest.approx(kg, rel=1e-13)
    np.testing.assert_allclose(found.com[T1], turns[T1].T @ (centre - places[T1]), atol=1e-13)
    # some kg m2, summed from squares of distances of up to a metre
    np.testing.assert_allclose(found.about_com[T1], turns[T1].T @ about @ turns[T1], atol=1e-12)


DE_LEVA = {
    "male": {
        "head": (0.0694, 0.2429, 0.303, 0.315, 0.261),
        "upper_arm": (0.0271, 0.2817, 0.285, 0.269, 0.158),
        "forearm": (0.0162, 0.2689, 0.276, 0.265, 0.121),
        "hand": (0.0061, 0.1879, 0.288, 0.235, 0.184),
    },
    "female": {
        "head": (0.0668, 0.2437, 0.271, 0.295, 0.261),
        "upper_arm": (0.0255, 0.2751, 0.278, 0.260, 0.148),
        "forearm": (0.0138, 0.2643, 0.261, 0.257, 0.094),
        "hand": (0.0056, 0.1701, 0.244, 0.208, 0.154),
    },
}
"""Entered again from Table 4: share of mass, length m, radii over length (sagittal, transverse,
longitudinal)."""


@pytest.mark.parametrize("person", [MAN, WOMAN], ids=lambda person: person.sex)
def test_every_segment_has_the_moments_of_inertia_of_its_row(person: Subject) -> None:
    """Moments do not hang on axes: those of the head are its three, an arm's across are alike."""
    for part in head_and_arm_parts("crossed", person, ANYWHERE):
        row = part.name.removeprefix("right_").removeprefix("left_")
        share, length, sagittal, transverse, along = DE_LEVA[person.sex][row]
        across = (sagittal**2 + transverse**2) / 2.0
        squares = [along**2, across, across]
        if row == "head":
            squares = [along**2, sagittal**2, transverse**2]
        kg = share * person.mass_kg
        assert part.kg == pytest.approx(kg, rel=1e-14)
        found = eigh(part.about_com)[0]
        np.testing.assert_allclose(found, kg * length**2 * np.sort(squares), rtol=1e-12)
        if row == "head":  # forwards, up, to the right
            axes = kg * (length * np.array([sagittal, along, transverse])) ** 2
            np.testing.assert_allclose(part.about_com, np.diag(axes), rtol=1e-14)


def test_arms_reach_where_lengths_of_the_table_take_them() -> None:
    """Straight pieces from the shoulder: their centres are as far along as the table says."""
    for person, centres in ((MAN, (0.5772, 0.4574)), (WOMAN, (0.5754, 0.4559))):
        table = DE_LEVA[person.sex]
        parts = {
            part.name: part.com for part in head_and_arm_parts("behind_head", person, ANYWHERE)
        }
        tall = person.height_m / 1.730
        shoulder = ANYWHERE + tall * np.array([0.0325, -0.012, 0.17])
        np.testing.assert_allclose(
            parts["head"], ANYWHERE + tall * np.array([0.0173, 0.155, 0.0]), atol=1e-14
        )
        upper = parts["right_upper_arm"] - shoulder
        assert np.linalg.norm(upper) == pytest.approx(centres[0] * table["upper_arm"][1])
        elbow = shoulder + upper / centres[0]
        fore = np.linalg.norm(parts["right_forearm"] - elbow)
        assert fore == pytest.approx(centres[1] * table["forearm"][1])


def test_hanging_arms_hang() -> None:
    parts = {part.name: part for part in head_and_arm_parts("hanging", MAN, ANYWHERE)}
    shoulder = ANYWHERE + 1.741 / 1.730 * np.array([0.0325, -0.012, 0.17])
    below = {
        "right_upper_arm": 0.5772 * 0.2817,
        "right_forearm": 0.2817 + 0.4574 * 0.2689,
        "right_hand": 0.2817 + 0.2689 + 0.3624 * 0.1879,
    }
    for name, depth in below.items():
        np.testing.assert_allclose(parts[name].com, shoulder - [0.0, depth, 0.0], atol=1e-14)
    kg, across = 0.0271 * 73.0, (0.285**2 + 0.269**2) / 2
    upper = kg * 0.2817**2 * np.array([across, 0.158**2, across])
    np.testing.assert_allclose(parts["left_upper_arm"].about_com, np.diag(upper), rtol=1e-14)


@pytest.mark.parametrize("arms", ARMS)
def test_arms_are_mirrored(arms: str) -> None:
    parts = {part.name: part for part in head_and_arm_parts(arms, WOMAN, ANYWHERE)}
    flip = np.diag([1.0, 1.0, -1.0])
    for segment in ("upper_arm", "forearm", "hand"):
        right, left = parts[f"right_{segment}"], parts[f"left_{segment}"]
        np.testing.assert_allclose(left.com, flip @ right.com, atol=1e-14)
        np.testing.assert_allclose(left.about_com, flip @ right.about_com @ flip, atol=1e-15)
    whole = combine("all", list(parts.values()))
    assert whole.com[2] == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(
    ("arms", "towards"), [("behind_head", [0.3, 0.3, 1.0]), ("crossed", [0.3, -1.0, 0.3])]
)
def test_hands_and_elbows_are_where_the_task_has_them(arms: Arms, towards: list[float]) -> None:
    """The hand behind the head, or ahead of the other shoulder, 60 mm, and 30 mm below it.

    The elbow outwards and a little ahead and up, or down and a little ahead and outwards.
    """
    parts = {part.name: part.com for part in head_and_arm_parts(arms, MAN, ANYWHERE)}
    tall = 1.741 / 1.730
    shoulder = ANYWHERE + tall * np.array([0.0325, -0.012, 0.17])
    expected = parts["head"] + tall * np.array([-0.1, 0.0, 0.03])
    if arms == "crossed":
        expected = shoulder * [1.0, 1.0, -1.0] + tall * np.array([0.06, -0.03, 0.0])
    np.testing.assert_allclose(parts["right_hand"], expected, atol=1e-14)
    elbow = shoulder + (parts["right_upper_arm"] - shoulder) / 0.5772
    line = parts["right_hand"] - shoulder
    assert abs((elbow - shoulder) @ np.cross(line, towards)) < 1e-14
    off = (elbow - shoulder) - ((elbow - shoulder) @ line) / (line @ line) * line
    assert off @ towards > 0.0


@pytest.mark.parametrize("arms", ARMS)
def test_size_scales_places_by_height_and_inertia_by_mass_and_its_square(arms: str) -> None:
    small, large = (combine("all", head_and_arm_parts(arms, p, np.zeros(3))) for p in (MAN, TALLER))
    np.testing.assert_allclose(large.com, 1.2 * small.com, atol=1e-14)
    np.testing.assert_allclose(
        large.about_com, 1.5 * 1.44 * small.about_com, rtol=1e-12, atol=1e-14
    )


def test_the_elbow_is_at_both_lengths_on_the_side_asked_for() -> None:
    shoulder, hand = np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.1, 0.2])
    towards = np.array([0.0, 0.0, 1.0])
    elbow = elbow_between(shoulder, hand, 0.28, 0.33, towards)
    assert np.linalg.norm(elbow - shoulder) == pytest.approx(0.28, rel=1e-14)
    assert np.linalg.norm(elbow - hand) == pytest.approx(0.33, rel=1e-14)
    along = (hand - shoulder) / np.linalg.norm(hand - shoulder)
    off = elbow - shoulder - ((elbow - shoulder) @ along) * along
    assert off @ towards > 0.0
    assert np.linalg.norm(np.cross(off, towards - (towards @ along) * along)) < 1e-14


@pytest.mark.parametrize("apart", [0.25, 0.75, 0.05, 0.8])
def test_an_arm_that_is_quite_stretched_or_folded_has_no_side_to_bend_to(apart: float) -> None:
    with pytest.raises(ValueError, match=f"no arm of 500 and 250 mm .* {1e3 * apart:.0f} mm apart"):
        elbow_between(np.zeros(3), np.array([apart, 0.0, 0.0]), 0.5, 0.25, np.ones(3))
    for near in (0.2501, 0.7499):
        elbow_between(np.zeros(3), np.array([near, 0.0, 0.0]), 0.5, 0.25, np.ones(3))


def test_unknown_arms_are_refused() -> None:
    with pytest.raises(ValueError, match="behind_head"):
        with_head_and_arms(made_up(), "waving", MAN)  # type: ignore[arg-type]

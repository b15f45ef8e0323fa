"""Characterisation of tangent laws: the published equations and what is known of them.

Would catch a wrong law, forces whose ratio or size is not that of the films, and bounds untold.
"""

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.studies.scoliosis.tangent_laws import LinearShape, Pairs, characterise, ends_of

SEGMENTS = 14


def pairs(rng: np.random.Generator) -> Pairs:
    """Films of segments that all turn with the bend."""
    right = np.deg2rad(rng.uniform(1.0, 9.0, SEGMENTS))
    left = -np.deg2rad(rng.uniform(1.0, 9.0, SEGMENTS))
    arm = np.linspace(0.40, 0.02, SEGMENTS)
    return Pairs(right, left, arm, 0.95 * arm, 2)


def made_by_laws(ratio: float) -> tuple[Pairs, Array]:
    """Films of a spine whose laws are tangents, bent by forces of one ratio; and its A."""
    rng = np.random.default_rng(2)
    arm_right, arm_left = np.linspace(0.4, 0.02, SEGMENTS), np.linspace(0.38, 0.03, SEGMENTS)
    # with the ends at 1.2 r, tau(r) / A follows from r_left / r_right alone
    right = np.deg2rad(rng.uniform(3.0, 9.0, SEGMENTS))
    wanted = ratio * arm_left / arm_right  # moments, left over right
    left = np.array([_left_for(*one) for one in zip(right, wanted, strict=True)])
    made = Pairs(right, left, arm_right, arm_left, 2)
    stretch = arm_right / ends_of(made, 1.2).load(right)
    return made, stretch


def _left_for(right: float, moment_ratio: float) -> float:
    """r_left at which -tau(r_left) / tau(r_right) is so, found by halving."""
    low, high = 1e-6 * right, 1e3 * right
    for _ in range(200):
        middle = np.sqrt(low * high)
        one = Pairs(np.array([right]), -np.array([middle]), np.ones(1), np.ones(1), 0)
        ends = ends_of(one, 1.2)
        ratio = float(-ends.load(one.left)[0] / ends.load(one.right)[0])
        low, high = (middle, high) if ratio < moment_ratio else (low, middle)
    return -float(np.sqrt(low * high))


def test_films_are_at_five_sixths_of_the_ends() -> None:
    """Consistency check J5."""
    films = pairs(np.random.default_rng(1))
    ends = ends_of(films, 1.2)
    np.testing.assert_allclose(films.right / ends.upper, 0.8333, atol=1e-4)
    np.testing.assert_allclose(films.left / ends.lower, 0.8333, atol=1e-4)


def test_b_and_c_solve_equation_2_and_d_equation_3() -> None:
    ends = ends_of(pairs(np.random.default_rng(1)), 1.2)
    b, c = ends.shape
    np.testing.assert_allclose(b * ends.lower + c, -np.pi / 2, atol=1e-12)
    np.testing.assert_allclose(b * ends.upper + c, np.pi / 2, atol=1e-12)
    assert not ends.load(np.zeros(SEGMENTS)).any()


def test_a_segment_that_turns_against_the_bend_has_its_larger_rotation_on_both_sides() -> None:
    right, left = np.deg2rad([3.0, -1.0, 2.0, 0.0]), np.deg2rad([-2.0, -4.0, 0.5, -1.0])
    films = Pairs(right, left, np.ones(4), np.ones(4), 2)
    ends = ends_of(films, 1.2)
    assert films.opposite.tolist() == [False, True, True, True]
    np.testing.assert_allclose(np.rad2deg(ends.upper), [3.6, 4.8, 2.4, 1.2], rtol=1e-12)
    np.testing.assert_allclose(np.rad2deg(ends.lower), [-2.4, -4.8, -2.4, -1.2], rtol=1e-12)


@sweep("ratio", [0.6, 1.0, 1.7])
def test_films_of_tangent_laws_give_the_laws_back(ratio: float) -> None:
    films, stretch = made_by_laws(ratio)
    found = characterise(films, ends_of(films, 1.2), apical_nm=63.0)
    assert found.ratio == pytest.approx(ratio, rel=1e-5)
    np.testing.assert_allclose(found.stretch / found.stretch[0], stretch / stretch[0], rtol=1e-5)
    assert np.abs(found.errors).max() < 1e-7
    assert not found.constrained.any()


def test_stated_moment_scales_all_laws_and_changes_no_rotation() -> None:
    """Consistency check J7: the films hold the ratio of the forces alone."""
    films = pairs(np.random.default_rng(3))
    one, other = (characterise(films, ends_of(films, 1.2), moment) for moment in (63.0, 6.3))
    np.testing.assert_allclose(one.stretch, 10.0 * other.stretch, rtol=1e-9)
    np.testing.assert_allclose(one.errors, other.errors, rtol=0, atol=1e-12)
    assert one.ratio == pytest.approx(other.ratio, rel=1e-12)
    moments = one.force_right_n * films.arm_right[2], one.force_left_n * films.arm_left[2]
    assert max(moments) == pytest.approx(63.0, rel=1e-12)


def test_mirrored_films_give_mirrored_laws() -> None:
    films = pairs(np.random.default_rng(4))
    mirrored = Pairs(-films.left, -films.right, films.arm_left, films.arm_right, 2)
    one, other = (characterise(x, ends_of(x, 1.2), 63.0) for x in (films, mirrored))
    assert other.ratio == pytest.approx(1.0 / one.ratio, rel=1e-6)
    np.testing.assert_allclose(other.stretch, one.stretch, rtol=1e-6)
    upper, lower = ends_of(mirrored, 1.2).upper, ends_of(films, 1.2).lower
    np.testing.assert_allclose(upper, -lower, rtol=1e-12)


def test_a_negative_stretch_is_held_at_the_least_and_told() -> None:
    """A segment that turns to the left in both bends, more so in the right one."""
    films = pairs(np.random.default_rng(5))
    right, left = films.right.copy(), films.left.copy()
    right[4], left[4] = np.deg2rad(-5.0), np.deg2rad(-0.5)
    turned = Pairs(right, left, films.arm_right, films.arm_left, 2)
    found = characterise(turned, ends_of(turned, 1.2), 63.0)
    assert found.constrained.tolist() == [number == 4 for number in range(SEGMENTS)]
    assert found.stretch.min() > 0.0


def test_without_enlargement_moments_have_no_meaning_and_rotations_do() -> None:
    """Consistency check J8: at 0 % the films are at the ends; just above, r is still told."""
    films = pairs(np.random.default_rng(6))
    near = characterise(films, ends_of(films, 1.0 + 1e-6), 63.0)
    assert np.isfinite(near.rmse)
    assert np.abs(near.errors).max() < np.deg2rad(0.01)


def test_films_of_springs_give_the_springs_back() -> None:
    """Linear laws from the same pairs: Eq 4 with r in the place of tan(B r + C) + D."""
    stiffness, arm = np.linspace(50.0, 120.0, SEGMENTS), np.linspace(0.4, 0.02, SEGMENTS)
    right, left = 90.0 * arm / stiffness, -1.4 * 90.0 * 0.9 * arm / stiffness
    found = characterise(Pairs(right, left, arm, 0.9 * arm, 2), LinearShape(), 63.0)
    assert found.ratio == pytest.approx(1.4, rel=1e-6)
    np.testing.assert_allclose(found.stretch / found.stretch[0], stretch_of(stiffness), rtol=1e-6)
    assert np.abs(found.errors).max() < 1e-9


def stretch_of(stiffness: Array) -> Array:
    found: Array = stiffness / stiffness[0]
    return found

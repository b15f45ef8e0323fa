"""The generic basis: its terms worked by hand, its sizes on springs, its evidence by dense sums."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import spring_chain_cases as chains
from sweeps import sweep
from test_discrepancy_core import made_up_fit, problem_of

from spinepipe.effects import PlaceSpread, create
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.studies.discrepancy.search import lack_of_fit as basis
from spinepipe.studies.discrepancy.search.lack_of_fit import (
    FAMILIES,
    GenericColumns,
    LackOfFitTest,
    Term,
    generic_columns,
)
from spinepipe.studies.discrepancy.search.prediction import bushing_stiffness
from spinepipe.studies.discrepancy.search.screen import Group
from spinepipe.units import COORDINATES, ROTATIONS

JOINTS = 3
FLEXION, BENDING, ROTATION = chains.cases((0.0, -4.0, 2.0, 6.0), JOINTS)
EXTENSION = COORDINATES.index("extension")
AT_LARGEST = 3


def columns(
    of: GenericColumns, family: str, coordinate: str, joint: int, number: int = 0, test: int = 0
) -> Array:
    """(T, J, 6) of one term in one test."""
    (at,) = [
        n for n, t in enumerate(of.terms) if t == Term(family, coordinate, number, joint)
    ]  # fmt: skip
    return of.moved[test][..., at]


def chain(*more: ScopedEffect) -> SpineModel:
    model = chains.model("a", chains.STIFFNESS, JOINTS)
    return model.with_effects((*model.effects, *more))


def turned(k: float = chains.STIFFNESS[0]) -> Array:
    """(T,) rad of each joint in flexion as listed: moment over stiffness."""
    return np.array([0.0, -4.0, 2.0, 6.0]) / k


# Terms, by hand


@pytest.fixture
def loads() -> Array:
    """(K,) terms in extension at the middle of three joints, in parts of the largest motion."""
    u = np.zeros((1, JOINTS, 6))
    u[0, :, 3] = 0.3, -0.5, 0.7
    u[0, 1, 4:] = 0.4, -0.2
    return basis._loads(u, EXTENSION, ROTATIONS)[0, 1]


def test_terms_of_the_own_motion(loads: Array) -> None:
    assert loads[:3] == pytest.approx([0.25, -0.125, -0.25])
    # bumps about -0.6, -0.2, 0.2 and 0.6, a quarter wide: 0.1, 0.3, 0.7 and 1.1 away
    away = np.array([0.1, 0.3, 0.7, 1.1]) / 0.25
    assert loads[3:7] == pytest.approx(np.exp(-(away**2)))


def test_terms_of_other_motions(loads: Array) -> None:
    for x, found in ((0.4, loads[7:11]), (-0.2, loads[11:15])):
        assert found == pytest.approx([x, x**2, -0.5 * x, -0.5 * x**2])
    assert loads[15] == pytest.approx(0.4 * -0.2)
    assert loads[16:] == pytest.approx([0.7, 0.3])  # of the joints above and below


def test_no_joint_is_above_the_last_or_below_the_first() -> None:
    u = np.ones((1, JOINTS, 6))
    above, below = np.moveaxis(basis._loads(u, EXTENSION, ROTATIONS)[0, :, -2:], -1, 0)
    assert above.tolist() == [1.0, 1.0, 0.0]
    assert below.tolist() == [0.0, 1.0, 1.0]


@sweep("read", [("extension",), ROTATIONS[:2], ROTATIONS, COORDINATES])
def test_each_family_counts_its_terms(read: tuple[str, ...]) -> None:
    counts = basis._counts(len(read), 0)
    found = basis._loads(np.ones((1, JOINTS, 6)), EXTENSION, read).shape[-1]
    assert found == counts["own"] + counts["cross"] + counts["neighbour"]
    assert (counts["drift"], counts["shift"]) == (1, 0)
    assert set(counts) == set(FAMILIES)


# Sizes and places, on springs


def test_a_term_loads_a_joint_by_a_tenth_of_its_springs_at_the_largest_motion() -> None:
    """Springs yield by load / k to the other side; k is of all bushings of a joint together."""
    bushing = ScopedEffect(create("linear_bushing"), (1,), np.full((1, 6), 40.0))
    found = generic_columns(chain(bushing), [FLEXION], False, ROTATIONS)
    for joint, k in enumerate([60.0, 100.0, 60.0]):
        own = columns(found, "own", "extension", joint)[..., EXTENSION]
        largest = turned(k)[AT_LARGEST]
        expected = np.zeros((4, JOINTS))
        expected[:, joint] = -0.1 * largest * (turned(k) / largest) ** 2
        np.testing.assert_allclose(own, expected, rtol=1e-6, atol=1e-12)
    above = columns(found, "neighbour", "extension", 0)[..., EXTENSION]
    np.testing.assert_allclose(above[:, 0], -0.1 * turned(), rtol=1e-6)
    np.testing.assert_allclose(above[:, 1:], 0.0, atol=1e-12)


@sweep("zeroed", [False, True])
def test_readings_drift_to_a_tenth_of_the_largest_motion(zeroed: bool) -> None:
    found = generic_columns(chain(), [FLEXION, BENDING], zeroed, COORDINATES)
    largest = {"extension": 0.1, "right_bending": 6.0 / 70.0, "left_rotation": np.deg2rad(0.2)}
    largest |= dict.fromkeys(COORDINATES[:3], 5e-5)  # what moves less has no shape
    for at, name in enumerate(COORDINATES):
        for test in range(2):
            drift = columns(found, "drift", name, 1, test=test)
            expected = np.zeros((4, JOINTS, 6))
            expected[:, 1, at] = 0.1 * largest[name] * np.arange(4) / 3.0
            np.testing.assert_allclose(drift, expected, rtol=1e-6, atol=1e-12)


def test_a_shift_is_of_one_test() -> None:
    cases = [FLEXION, BENDING]
    shifted = tuple("".join(name) for name in (["flex", "ion"], ["bend", "ing"]))  # as read
    found = generic_columns(chain(), cases, False, ROTATIONS, shifted=shifted)
    for number in range(2):
        for test in range(2):
            shift = columns(found, "shift", "extension", 0, number, test)
            assert shift[:, 0, EXTENSION] == pytest.approx(0.01 * (number == test))
            assert np.count_nonzero(shift) == 4 * (number == test)


def test_zeroed_columns_begin_with_nought() -> None:
    back = chains.cases((-4.0, 2.0, 6.0), JOINTS)[:1]
    plain, zeroed = (generic_columns(chain(), back, z, ROTATIONS) for z in (False, True))
    assert plain.terms == zeroed.terms
    (one,), (other,) = plain.moved, zeroed.moved
    assert np.abs(one[0]).max() > 0.0
    np.testing.assert_allclose(other, one - one[:1], atol=1e-15)


def test_a_joint_is_as_stiff_as_its_bushings() -> None:
    bare = chain().with_effects(())
    assert not bushing_stiffness(bare).any()
    np.testing.assert_array_equal(bushing_stiffness(chain())[1, 3:], chains.STIFFNESS)


# Evidence


@sweep("spread", basis.SPREADS)
def test_the_evidence_of_a_family_is_that_of_its_columns_summed(spread: PlaceSpread) -> None:
    """Two numbers at three joints each, and another family that is none of its business."""
    rng = np.random.default_rng(20001)
    members = {"a": (0, 2), "b": (2, 1)}
    fit = made_up_fit({name: rng.normal(size=(50, 2)) for name in members}, members)
    terms = [Term("drift", "extension", 0, 0)]
    terms += [Term("own", "extension", number, joint) for number in range(2) for joint in range(3)]
    signatures = {name: rng.normal(size=(50, len(terms))) for name in members}
    problem = problem_of(fit, signatures)
    found = basis._part(problem, terms, "own", "extension", spread)

    a, b = (signatures[name][:, 1:] for name in members)
    if spread is PlaceSpread.SHARED:
        a, b = (one.reshape(50, 2, 3).sum(axis=-1) for one in (a, b))
    none = np.zeros_like(a)
    dense = np.block([[a, none], [none, b]]) if spread is PlaceSpread.EACH else np.vstack([a, b])
    taken = np.zeros((100, 3))
    taken[:50, [0, 2]], taken[50:, [2, 1]] = fit.jacobians["a"], fit.jacobians["b"]
    left = dense - taken @ np.linalg.lstsq(taken, dense)[0]
    gram, group = left.T @ left, Group.of(left.T @ left, np.zeros(left.shape[1]))
    moment = left.T @ -np.concatenate([fit.residuals["a"], fit.residuals["b"]])
    assert found.log_evidence == pytest.approx(group.log_evidence(moment), rel=1e-9)
    estimate = group.estimate(moment)
    explained = 2.0 * estimate @ moment - estimate @ gram @ estimate
    assert found.explained == pytest.approx(explained, rel=1e-9)
    assert (found.family, found.coordinate, found.spread) == ("own", "extension", spread)


def part(family: str, coordinate: str, spread: PlaceSpread, ratio: float) -> Any:
    return basis._FamilyEvidence(family, coordinate, spread, np.log(ratio), 10.0 * ratio)


def test_evidence_is_averaged_over_families_and_ways_to_differ() -> None:
    parts = [
        part("own", "extension", PlaceSpread.SHARED, 8.0),
        part("own", "extension", PlaceSpread.EACH, 2.0),
        part("drift", "extension", PlaceSpread.SHARED, 9.0),
        part("drift", "extension", PlaceSpread.EACH, 1.0),
    ]
    lack = basis._lack(parts)
    assert np.exp(lack.log_evidence) == pytest.approx(20.0 / 4.0)
    assert (lack.family, lack.spread, lack.explained) == ("drift", PlaceSpread.SHARED, 90.0)
    assert {name: np.exp(one) for name, one in lack.by_family.items()} == pytest.approx(
        {"own": 10.0 / 4.0, "drift": 10.0 / 4.0}
    )


def test_a_shape_is_told_in_words() -> None:
    lack = LackOfFitTest(0.0, "cross", "right_bending", PlaceSpread.SHARED, 0.0, {})
    assert lack.shape == "load in right bending over the joint's other motions, shared"


@pytest.mark.parametrize("specimens", [("a",), ("a", "b")])
def test_one_specimen_differs_from_no_other(
    specimens: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each coordinate by itself and all together; best is what explains most anywhere."""
    terms = [Term(f, c, 0, 0) for c in ("extension", "right_bending") for f in ("own", "drift")]
    ratio = {"extension": 3.0, "right_bending": 5.0}
    monkeypatch.setattr(basis, "_problem", lambda *_: (terms, None))
    monkeypatch.setattr(basis, "_part", lambda _p, _t, f, c, s: part(f, c, s, ratio[c]))
    grounds: Any = SimpleNamespace(readings=dict.fromkeys(specimens))
    found = basis.lack_of_fit(grounds, tuple(ratio))
    assert np.exp(found.log_evidence) == pytest.approx(4.0)
    assert found.coordinate == "right_bending"
    for name, one in found.at.items():
        assert np.exp(one.log_evidence) == pytest.approx(ratio[name])
        assert one.coordinate == name
    monkeypatch.setattr(
        basis, "_part", lambda _p, _t, f, c, s: part(f, c, s, 4.0 if s is PlaceSpread.EACH else 1.0)
    )
    each = basis.lack_of_fit(grounds, tuple(ratio))
    assert np.exp(each.log_evidence) == pytest.approx(1.0 if len(specimens) == 1 else 2.0)

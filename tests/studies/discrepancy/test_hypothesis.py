"""What is tried of effects, and what a hypothesis leaves open of them and of the base."""

from collections.abc import Mapping

import numpy as np
import pytest
import spring_chain_cases as chains
from sweeps import sweep

from spinepipe.effects import Parameter, PlaceSpread, registered
from spinepipe.model import SpineModel
from spinepipe.statics import free_parameters
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    CandidateForm,
    Hypothesis,
    Trials,
    Unknown,
    Variant,
    hypothesis,
    shape_at,
    shape_grid,
    trials,
    usual_shapes,
)
from spinepipe.units import COORDINATES, ROTATIONS

JOINTS = 3
TESTS = ("flexion", "bending")
LAXITY = Variant("local_laxity", (("coordinate", "extension"),))
ZONE = Variant("neutral_zone", (("coordinate", "extension"),))
LEVELS = Variant("level_dependence", (("coordinate", "extension"),))
OFFSET = Variant("load_offset", ())


# What is tried


def only(name: str, read: tuple[str, ...] = ROTATIONS, specimens: str = "ab") -> Trials:
    (one,) = trials([name], read, list(specimens), JOINTS)
    return one


def test_all_that_declare_how_are_tried_by_name() -> None:
    names = [one.effect for one in trials(None, COORDINATES, ["a"], JOINTS)]
    assert set(names) == {name for name, cls in registered().items() if hasattr(cls, "trial")}
    assert names == sorted(names)
    asked = trials(["neutral_zone", "creep"], ROTATIONS, ["a"], 1)
    assert [one.effect for one in asked] == ["creep", "neutral_zone"]


def test_what_acts_on_nothing_that_was_read_is_not_tried() -> None:
    """Nor is a pair of a rotation and a translation where one of the two is hidden."""
    assert {v.acts_on for v in only("neutral_zone", ("anterior",)).variants} == {("anterior",)}
    for read in (("anterior",), ("extension",)):
        pairs = [set(v.acts_on) for v in only("bending_rotation_coupling", read).variants]
        assert pairs
        assert all(pair <= set(ROTATIONS) or not pair & set(ROTATIONS) for pair in pairs)


def places(specimens: str) -> dict[PlaceSpread, list[tuple[int | None, str | None]]]:
    found: dict[PlaceSpread, list[tuple[int | None, str | None]]] = {}
    for form in only("neutral_zone", ("extension",), specimens).forms:
        if form.variant == ZONE:
            found.setdefault(form.spread, []).append((form.joint, form.specimen))
    return found


def test_each_way_to_differ_is_tried_at_each_place() -> None:
    everywhere, joints = [(None, None)], range(JOINTS)
    whole = (PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN, PlaceSpread.EACH)
    assert places("ab") == {
        **dict.fromkeys(whole, everywhere),
        PlaceSpread.ONE_JOINT: [(joint, None) for joint in joints],
        PlaceSpread.ONE: [(joint, specimen) for specimen in "ab" for joint in joints],
    }


def test_of_one_specimen_no_other_differs() -> None:
    assert places("a") == {
        PlaceSpread.SHARED: [(None, None)],
        PlaceSpread.BY_JOINT: [(None, None)],
        PlaceSpread.ONE_JOINT: [(joint, None) for joint in range(JOINTS)],
    }
    (spread,) = {form.spread for form in only("local_laxity", specimens="a").forms}
    assert spread is PlaceSpread.ONE_JOINT


def test_shares_of_an_effect_are_equal_by_variant_way_and_place() -> None:
    tried = only("neutral_zone")
    shares = {form: np.exp(tried.log_share(form)) for form in tried.forms}
    assert sum(shares.values()) == pytest.approx(1.0)
    ways = len(tried.variants) * 6
    assert shares[CandidateForm(ZONE, PlaceSpread.SHARED)] == pytest.approx(1.0 / ways)
    assert shares[CandidateForm(ZONE, PlaceSpread.ONE_JOINT, 1)] == pytest.approx(1.0 / (3 * ways))
    assert shares[CandidateForm(ZONE, PlaceSpread.ONE, 2, "b")] == pytest.approx(1.0 / (6 * ways))


# Shapes


def test_shapes_are_moved_in_prior_sds_inside_their_bounds() -> None:
    plain, logarithmic = (
        Parameter("width", "rad", 0.5, 4.0, 2.0, 0.3, is_logarithmic, "")
        for is_logarithmic in (False, True)
    )
    assert shape_at(plain, 2.0) == pytest.approx(2.6)
    assert shape_at(logarithmic, 2.0) == pytest.approx(2.0 * np.exp(0.6))
    assert [shape_at(plain, sds) for sds in (-9.0, 0.0, 9.0)] == [0.5, 2.0, 4.0]


def test_an_effect_that_is_off_has_the_shapes_of_the_grid() -> None:
    ratio, width, sharpness = ZONE.create().parameters
    grid = shape_grid(ZONE)
    assert grid == [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)]
    assert usual_shapes(ZONE) == (0.0, 0.0)
    assert (ZONE.strengths, ZONE.shapes) == ((0,), (1, 2))
    expected = [ratio.off, width.default * np.exp(width.prior_scale), sharpness.default]
    assert ZONE.off(grid[2]) == pytest.approx(expected)
    assert shape_grid(LAXITY) == [()]


def test_coordinates_are_those_of_the_options_or_all() -> None:
    pair = Variant("bending_rotation_coupling", (("pair", ("extension", "left_rotation")),))
    assert pair.acts_on == ("extension", "left_rotation")
    assert pair.coordinates(ROTATIONS[:2]) == ("extension",)
    assert ZONE.coordinates(ROTATIONS) == ("extension",)
    assert (OFFSET.acts_on, OFFSET.coordinates(ROTATIONS)) == ((), ROTATIONS)


# Unknowns


def supposed(*forms: CandidateForm, start: Mapping[str, float] | None = None) -> Hypothesis:
    models = {name: chains.model(name, chains.STIFFNESS, JOINTS) for name in "ab"}
    base = {
        name: free_parameters(model, 0, ["extension_nm_per_rad"], "per_specimen")
        for name, model in models.items()
    }
    ones = []
    for form in forms:
        parameters = form.variant.create().parameters
        values = [(start or {}).get(p.name, p.default) for p in parameters]
        ones.append(ActiveTerm(form, np.array(values)))
    return hypothesis(models, base, ones, TESTS, 100.0)


def of_effects(found: Hypothesis) -> list[Unknown]:
    return [one for one in found.unknowns if one.supposed is not None]


def effects_in(found: Hypothesis, specimen: str) -> list[str]:
    model: SpineModel = found.members[specimen].model
    return [one.effect.name for one in model.effects]


def test_base_stiffness_is_open_within_a_factor() -> None:
    found = supposed()
    assert [one.place[0] for one in found.unknowns] == ["a", "b"]
    assert [member.numbers for member in found.members.values()] == [(0,), (1,)]
    for one in found.unknowns:
        assert (one.low, one.high) == pytest.approx((-np.log(100.0), np.log(100.0)))
        assert (one.mean, one.sd, one.is_strength) == (0.0, 3.0, False)
        assert one.step == 1.0


@sweep(
    "form, expected",
    [
        (CandidateForm(ZONE, PlaceSpread.SHARED), [()]),
        (CandidateForm(ZONE, PlaceSpread.BY_JOINT), [("L5S1",), ("L4L5",), ("L3L4",)]),
        (CandidateForm(ZONE, PlaceSpread.BY_SPECIMEN), [("a",), ("b",)]),
        (
            CandidateForm(ZONE, PlaceSpread.EACH),
            [(s, j) for s in "ab" for j in ("L5S1", "L4L5", "L3L4")],
        ),
        (CandidateForm(ZONE, PlaceSpread.ONE_JOINT, 1), [("L4L5",)]),
        (CandidateForm(ZONE, PlaceSpread.ONE, 2, "b"), [("b", "L3L4")]),
        (CandidateForm(OFFSET, PlaceSpread.BY_TEST), [("flexion",), ("bending",)]),
    ],
)
def test_strengths_are_of_their_places(
    form: CandidateForm, expected: list[tuple[str, ...]]
) -> None:
    found = of_effects(supposed(form))
    first = form.variant.strengths[0]
    assert {one.place for one in found if one.column == first} == set(expected)
    assert len({one.label for one in found}) == len(found)
    assert {one.column for one in found} == set(range(len(form.variant.create().parameters)))


def test_shapes_are_the_same_at_all_places() -> None:
    found = supposed(CandidateForm(ZONE, PlaceSpread.EACH))
    shapes = [one for one in of_effects(found) if not one.is_strength]
    assert [one.column for one in shapes] == [1, 2]
    for one in shapes:
        number = found.unknowns.index(one)
        assert all(number in member.numbers for member in found.members.values())
    for name, member in found.members.items():
        own = [found.unknowns[n] for n in member.numbers if found.unknowns[n].is_strength]
        assert [one.place[0] for one in own] == [name] * JOINTS


def test_an_effect_of_one_place_stands_in_its_specimen_alone() -> None:
    found = supposed(CandidateForm(ZONE, PlaceSpread.ONE, 2, "b"))
    assert effects_in(found, "a") == ["linear_bushing"]
    assert len(found.members["a"].numbers) == 1
    scoped = found.members["b"].model.effects[1]
    assert (scoped.joints, scoped.values.shape) == ((2,), (1, 3))


def test_what_differs_by_test_acts_once_in_each() -> None:
    for member in supposed(CandidateForm(OFFSET, PlaceSpread.BY_TEST)).members.values():
        scoped = member.model.effects[1:]
        assert [one.tests for one in scoped] == [("flexion",), ("bending",)]
        assert [one.values.shape for one in scoped] == [(1, 3)] * 2
        assert len(member.numbers) == len(member.free) == 1 + 2 * 3


@sweep("variant", [ZONE, LAXITY, OFFSET, LEVELS])
def test_moves_are_bounded_as_declared_and_have_the_declared_prior(variant: Variant) -> None:
    """Of strengths five times as wide, about off; of shapes about the default."""
    start = {p.name: float(np.clip(0.7, p.low, p.high)) for p in variant.create().parameters}
    for one in of_effects(supposed(CandidateForm(variant, PlaceSpread.SHARED), start=start)):
        p = variant.create().parameters[one.column]
        assert one.is_strength == (p.off is not None)
        assert one.sd == pytest.approx(p.prior_scale * (5.0 if one.is_strength else 1.0))
        assert one.step == pytest.approx(p.prior_scale)

        def at(move: float, p: Parameter = p) -> float:
            return start[p.name] * np.exp(move) if p.logarithmic else start[p.name] + move

        assert at(one.mean) == pytest.approx(p.default if p.off is None else p.off)
        assert (at(one.low), at(one.high)) == pytest.approx((p.low, p.high))


def test_effects_are_numbered_as_they_are_supposed() -> None:
    found = supposed(
        CandidateForm(ZONE, PlaceSpread.SHARED), CandidateForm(LAXITY, PlaceSpread.ONE, 0, "a")
    )
    assert [one.supposed for one in found.unknowns].count(1) == 1
    assert effects_in(found, "a") == ["linear_bushing", "neutral_zone", "local_laxity"]
    assert effects_in(found, "b") == ["linear_bushing", "neutral_zone"]
    for member in found.members.values():
        for free, number in zip(member.free, member.numbers, strict=True):
            assert found.unknowns[number].column == (free.column if free.effect else 0)

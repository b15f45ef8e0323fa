"""Which forms of the screen are refitted, and where their fits start."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.search import refit as refits_of
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    CandidateForm,
    Trials,
    Variant,
)
from spinepipe.studies.discrepancy.search.refit import (
    Refit,
    leading,
    refit,
    standing,
    starting_term,
    weaker,
)
from spinepipe.studies.discrepancy.search.screen import Screen, Screened, ScreenedVariant


def variant(name: str, coordinate: str = "extension") -> Variant:
    return Variant(name, (("coordinate", coordinate),))


ZONE, LAXITY, LEVELS = map(variant, ("neutral_zone", "local_laxity", "level_dependence"))
OFFSET = Variant("load_offset", ())


def tried(
    form: CandidateForm,
    log_evidence: float = 0.0,
    estimate: Sequence[float] = (),
    strengths: Sequence[int] = (),
    sds: tuple[float, ...] = (),
) -> ScreenedVariant:
    return ScreenedVariant(form, sds, tuple(strengths), log_evidence, np.array(estimate), 0.0)


def of(name: str, *evidence: float) -> Screened:
    """An effect whose variants, one for each evidence, act on different coordinates."""
    forms = [
        tried(CandidateForm(variant(name, f"c{number}"), PlaceSpread.SHARED), one)
        for number, one in enumerate(evidence)
    ]
    return Screened(name, max(evidence), np.zeros(1), tuple(forms))


def leaders(*effects: Screened) -> list[ScreenedVariant]:
    return list(leading(Screen(effects, 5.0, 1)))


def refitted(*effects: Screened) -> list[tuple[str, float]]:
    return [(one.form.name, one.log_evidence) for one in leaders(*effects)]


# Which


def test_the_first_two_effects_have_three_variants_refitted_the_next_two_one() -> None:
    effects = [of(name, 100.0, 99.0, 98.0, 97.0) for name in "abcde"]
    assert refitted(*effects) == [
        *[(name, 100.0 - n) for name in "ab" for n in range(3)],
        *[(name, 100.0) for name in "cd"],
    ]


@sweep("best, least", [(100.0, 19.0), (40.0, 4.0), (24.0, 0.0), (8.0, 0.0)])
def test_an_effect_may_trail_by_three_quarters_and_six(best: float, least: float) -> None:
    """The screen is linear, a refit is not; without evidence none is worth it."""
    assert refitted(of("a", best), of("b", least + 0.1)) == [("a", best), ("b", least + 0.1)]
    assert refitted(of("a", best), of("b", least - 0.1)) == [("a", best)]
    assert refitted(of("a", best, least + 0.1)) == [("a", best), ("a", least + 0.1)]
    assert refitted(of("a", best, least - 0.1)) == [("a", best)]


def test_the_form_of_equal_values_is_refitted_beside_the_best_of_its_variant() -> None:
    each, shared, joint = (
        CandidateForm(ZONE, s) for s in (PlaceSpread.EACH, PlaceSpread.SHARED, PlaceSpread.BY_JOINT)
    )
    other = CandidateForm(variant("neutral_zone", "right_bending"), PlaceSpread.SHARED)
    first = tried(each, 50.0), tried(joint, 45.0), tried(other, 42.0)
    for evidence, expected in ((40.0, [each, other, shared]), (6.0, [each, other])):
        forms = (*first, tried(shared, evidence))
        found = leaders(Screened("neutral_zone", 50.0, np.zeros(1), forms))
        assert [one.form for one in found] == expected  # three quarters and six behind 50 is 6.5


# Where from


def test_a_fit_starts_at_the_mean_strength_and_the_shapes_of_the_screen() -> None:
    """Ratio of stiffness 1 when off, 0.5 less for a prior SD; the width one SD of its logarithm."""
    _, width, sharpness = ZONE.create().parameters
    found = starting_term(
        tried(CandidateForm(ZONE, PlaceSpread.BY_JOINT), 0.0, [-0.6, -1.0], [0, 0], (1.0, 0.0))
    )
    expected = [1.0 - 0.8 * 0.5, width.default * np.exp(0.7), sharpness.default]
    assert found.start == pytest.approx(expected)


def test_strengths_of_several_columns_start_each_at_its_own() -> None:
    estimate, columns = [1.0, -2.0, 0.5, 2.0, -4.0, 0.7], [0, 1, 2, 0, 1, 2]
    found = starting_term(
        tried(CandidateForm(OFFSET, PlaceSpread.BY_SPECIMEN), 0.0, estimate, columns)
    )
    scales = np.array([p.prior_scale for p in OFFSET.create().parameters])
    assert found.start == pytest.approx(np.array([1.5, -3.0, 0.6]) * scales)


@sweep(
    "of_variant, sds, value",
    [
        (LAXITY, 0.5, 0.15),
        (LAXITY, -0.5, 0.15),  # a fraction is lost, never gained
        (LAXITY, 0.0, 0.02 * 0.3),  # a little at least
        (LAXITY, 50.0, 0.95 - 0.95e-3),  # not quite at its bound
        (LEVELS, 2.0, np.exp(1.0)),
        (LEVELS, -2.0, np.exp(-1.0)),
        (LEVELS, 0.001, np.exp(0.02 * 0.5)),
        (LEVELS, -0.001, np.exp(-0.02 * 0.5)),
        (LEVELS, 0.0, np.exp(0.02 * 0.5)),
        (LEVELS, 90.0, 100.0 - 0.02 * 0.5),
        (LEVELS, -90.0, 0.01),
    ],
)
def test_a_strength_starts_on_its_side_and_inside_its_bounds(
    of_variant: Variant, sds: float, value: float
) -> None:
    """A fraction has SD 0.3 from 0 to 0.95, a ratio 0.5 in its logarithm from 0.01 to 100."""
    found = starting_term(tried(CandidateForm(of_variant, PlaceSpread.SHARED), 0.0, [sds], [0]))
    assert found.start[0] == pytest.approx(value, rel=1e-9)


def test_a_moment_starts_off_both_its_bounds_by_a_fiftieth_of_its_prior_sd() -> None:
    """0.3 N m, of 10 N m to either side: a thousandth of the whole way is 0.02 N m."""
    for sds, value in ((90.0, 9.994), (-90.0, -9.994)):
        found = starting_term(
            tried(CandidateForm(OFFSET, PlaceSpread.SHARED), 0.0, [sds] * 3, [0, 1, 2])
        )
        assert found.start == pytest.approx([value] * 3)


def test_weaker_is_a_share_of_the_way_from_off() -> None:
    """Of a ratio the share of its logarithm; shapes stay."""
    ratio = ActiveTerm(CandidateForm(LEVELS, PlaceSpread.SHARED), np.array([4.0]))
    zone = ActiveTerm(CandidateForm(ZONE, PlaceSpread.SHARED), np.array([0.2, 0.03, 9.0]))
    assert weaker(ratio, 0.5).start == pytest.approx([2.0])
    assert weaker(zone, 0.25).start == pytest.approx([0.8, 0.03, 9.0])
    assert weaker(zone, 1.0).start == pytest.approx(zone.start)
    assert zone.start.tolist() == [0.2, 0.03, 9.0]  # itself is left alone


def fit_of(moves: Sequence[tuple[int, int, float]], *supposed: ActiveTerm) -> Any:
    """A fit that moved unknowns: number of the effect, column, by how much."""
    unknowns = [SimpleNamespace(supposed=number, column=column) for number, column, _ in moves]
    hypothesis = SimpleNamespace(unknowns=unknowns, supposed=supposed)
    return SimpleNamespace(hypothesis=hypothesis, x=np.array([move for *_, move in moves]))


def test_what_stands_starts_again_where_it_ended() -> None:
    zone = ActiveTerm(CandidateForm(ZONE, PlaceSpread.BY_JOINT), np.array([0.6, 0.02, 9.0]))
    levels = ActiveTerm(CandidateForm(LEVELS, PlaceSpread.SHARED), np.array([2.0]))
    moves = [(0, 0, -0.1), (0, 0, -0.3), (0, 1, np.log(2.0)), (1, 0, np.log(1.5))]
    first, second = standing(fit_of(moves, zone, levels))
    assert first.start == pytest.approx([0.4, 0.04, 9.0])  # the mean of two places
    assert second.start == pytest.approx([3.0])
    (ended,) = standing(fit_of([(0, 0, 9.0)], zone))
    assert ended.start[0] == 1.0  # its bound


# A refit


class Fits:
    """Fits that end as they are told, one after the other."""

    def __init__(self, *usable: bool) -> None:
        self.usable, self.starts = list(usable), list[float]()

    def __call__(self, supposed: Any, *_: Any) -> Any:
        self.starts.append(float(supposed[-1].start[0]))
        return SimpleNamespace(usable=self.usable.pop(0), chi2=60.0)


def test_a_form_adds_the_unknowns_of_its_own() -> None:
    form = CandidateForm(ZONE, PlaceSpread.SHARED)
    fit = fit_of([(0, 0, 0.0), (1, 0, 0.0), (1, 1, 0.0), (2, 0, 0.0)], *[None] * 2)  # type: ignore[list-item]
    assert Refit(form, fit, 0.0, 0.0).unknowns == 2  # of the last, the second


def refit_with(fits: Fits, monkeypatch: pytest.MonkeyPatch, degenerate: bool = False) -> Any:
    monkeypatch.setattr(refits_of, "_degenerate", lambda fit, number: degenerate)
    monkeypatch.setattr(refits_of, "laplace", lambda fit, number, gain: 0.5 * gain)
    form = CandidateForm(LEVELS, PlaceSpread.SHARED)
    before = fit_of([])
    before.chi2, before.poses = 100.0, None
    grounds: Any = SimpleNamespace(fit=before, setting=None, suppose=lambda supposed: supposed)
    trials = Trials("", (LEVELS, ZONE), (form,))
    monkeypatch.setattr(refits_of, "joint_fit", fits)
    return refit(grounds, ActiveTerm(form, np.array([32.0])), trials)


@pytest.mark.parametrize("failures", [0, 1, 2])
def test_what_tips_over_is_tried_again_closer_to_off(
    failures: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    fits = Fits(*[False] * failures, True)
    found = refit_with(fits, monkeypatch)
    assert fits.starts == pytest.approx([32.0, 32.0**0.5, 32.0**0.2][: failures + 1])
    assert (found.gain, found.log_evidence) == pytest.approx((40.0, 20.0 - np.log(2.0)))


def test_without_a_fit_there_is_no_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    for fits, degenerate in ((Fits(False, False, False), False), (Fits(True), True)):
        found = refit_with(fits, monkeypatch, degenerate)
        assert (found.gain, found.log_evidence) == (-np.inf, -np.inf)


def test_the_two_that_lead_are_refitted_with_equal_values_too() -> None:
    """Where the screen has that form and it was not tried yet."""
    spreads = PlaceSpread.EACH, PlaceSpread.BY_JOINT, PlaceSpread.SHARED
    effects = [
        Screened(v.effect, 9.0, np.zeros(1), tuple(tried(CandidateForm(v, s)) for s in spreads))
        for v in (ZONE, LEVELS, LAXITY)
    ]
    screen = Screen(tuple(effects), 5.0, 1)

    def found(v: Variant, log_evidence: float, spread: PlaceSpread = PlaceSpread.EACH) -> Any:
        start = ActiveTerm(CandidateForm(v, spread), v.off((0.0,) * len(v.shapes)))
        fit = fit_of([(0, 0, -0.25)], start)
        return SimpleNamespace(name=v.effect, form=start.form, log_evidence=log_evidence, fit=fit)

    ranked = [found(LAXITY, 5.0), found(LEVELS, 7.0), found(ZONE, 8.0)]
    simple = list(refits_of._simpler(ranked, screen, ()))
    assert [one.form for one in simple] == [
        CandidateForm(v, PlaceSpread.SHARED) for v in (ZONE, LEVELS)
    ]
    assert simple[0].start[0] == pytest.approx(0.75)  # from where the other form ended
    known = [found(ZONE, 8.0), found(ZONE, 3.0, PlaceSpread.SHARED), found(LEVELS, -np.inf)]
    assert list(refits_of._simpler(known, screen, ())) == []

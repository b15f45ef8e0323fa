"""Where fits of a form start, and what a fit that is none comes to."""

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
    Variant,
)
from spinepipe.studies.discrepancy.search.refit import (
    refit,
    standing,
    starting_term,
    weaker,
)
from spinepipe.studies.discrepancy.search.screen import ScreenedVariant


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


def refit_with(fits: Fits, monkeypatch: pytest.MonkeyPatch, degenerate: bool = False) -> Any:
    monkeypatch.setattr(refits_of, "_degenerate", lambda fit, number: degenerate)
    monkeypatch.setattr(refits_of, "joint_log_evidence", lambda base, fit: base - fit.chi2)
    monkeypatch.setattr(refits_of, "formula_error", lambda baseline: 3.0)
    monkeypatch.setattr(refits_of, "joint_fit", fits)
    before = fit_of([])
    before.chi2, before.poses = 100.0, None
    beside: Any = SimpleNamespace(fit=before, setting=None, suppose=tuple, at=lambda fit: fit)
    form = CandidateForm(LEVELS, PlaceSpread.SHARED)
    base: Any = 95.0
    return refit(base, beside, ActiveTerm(form, np.array([32.0])))


@pytest.mark.parametrize("failures", [0, 1, 2])
def test_what_tips_over_is_tried_again_closer_to_off(
    failures: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its evidence is that of all effects over the base; chi2 has fallen from the fit before."""
    fits = Fits(*[False] * failures, True)
    found = refit_with(fits, monkeypatch)
    assert fits.starts == pytest.approx([32.0, 32.0**0.5, 32.0**0.2][: failures + 1])
    assert (found.gain, found.log_evidence) == pytest.approx((40.0, 35.0 + 3.0))


def test_without_a_fit_there_is_no_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    for fits, degenerate in ((Fits(False, False, False), False), (Fits(True), True)):
        found = refit_with(fits, monkeypatch, degenerate)
        assert (found.gain, found.log_evidence) == (-np.inf, -np.inf)

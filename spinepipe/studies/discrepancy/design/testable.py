"""Which effects a design of tests can show, before residuals are looked at.

Everything is linear in the strengths at the base fit, with normal noise: an effect of s times its
typical strength f has moments s G f + N(0, G) on the screen, G the products of its signatures with
base and nuisances taken out. f are the declared defaults; strengths whose bounds allow both sides
of off are independent with mean off, so that several of them neither add up nor cancel by a
convention of signs.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.design.signatures import CohortSignatures
from spinepipe.studies.discrepancy.search.hypothesis import (
    CandidateForm,
    Trials,
    Variant,
    shape_grid,
    usual_shapes,
)
from spinepipe.studies.discrepancy.search.screen import Group, Places, sides

NO_TRACE = 1e-6
"""A typical effect whose squared signature sums to less, in noise SD, leaves no trace at all."""

ABSORBED = 0.98
"""Effects of which the base takes up more than this share are no effects beside it."""

OFTEN = 0.9
"""Probability with which an effect that counts as detectable is found."""

LARGEST = 3.0
"""Effects that only show beyond this many times their typical strength count as not testable."""

SPREADS = (PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN)
"""How a typical effect may differ between places; one place only if a trial knows none of these."""

WEAKEST, STRONGEST = 1e-6, 1e3
"""Times the typical strength, between which the weakest is sought that is found."""

LEAD = 3.0
"""Log evidence of odds of 20 to 1: a lead from which one effect is told from another."""


@dataclass(frozen=True)
class Typical:
    """A form at its default shape, k strengths.

    Attributes
    ----------
    mean : (k,) prior SDs, of strengths that have one side. sd : (k,) of those that have two.
    signs : (k,) side of off that bounds allow, 0 for both.
    raw, refitted, left : (k, k) products of the strengths' signatures, `CohortSignatures.products`.
    """

    form: CandidateForm
    places: Places
    mean: Array
    sd: Array
    signs: Array
    raw: Array
    refitted: Array
    left: Array

    def squared(self, gram: Array) -> float:
        """Expected squared signature at typical strength."""
        return float(self.mean @ gram @ self.mean + self.sd**2 @ np.diagonal(gram))

    @property
    def seen(self) -> bool:
        """Whether it leaves any trace in the readings."""
        return self.squared(self.raw) > NO_TRACE

    @property
    def absorbed(self) -> float:
        """Share of the squared signature that base and nuisances take up; 1 without a trace."""
        return self._taken(self.left)

    @property
    def absorbed_by_base(self) -> float:
        """Share that the base alone takes up."""
        return self._taken(self.refitted)

    def _taken(self, gram: Array) -> float:
        if not self.seen:
            return 1.0
        return float(np.clip(1.0 - self.squared(gram) / self.squared(self.raw), 0.0, 1.0))

    @property
    def group(self) -> Group:
        """Its strengths as a group on the screen."""
        return Group.of(self.left, self.signs)

    def log_evidence(self, times: Array) -> Array:
        """(S,) expected, that many times as strong as usual; the form's share not taken off."""
        moments = self.left @ self.directions
        return expected_log_evidence(self.group, moments[None], times[None])[0]

    @property
    def directions(self) -> Array:
        """(k, d) strengths whose squares add up to the expected one."""
        both = np.column_stack([self.mean, np.diag(self.sd)])
        return both[:, np.any(both != 0.0, axis=0)]


def expected_log_evidence(group: Group, moments: Array, times: Array) -> Array:
    """(A, S) log evidence of a group of strengths for effects A, times (A, S) as strong as usual.

    ``moments`` : (A, k, d) of each, squares of its directions add up; the first gives the side.
    """
    onto = group.vectors.T @ moments
    sizes = np.sqrt(np.sum(onto**2, axis=-1))
    found = np.where(onto[..., 0] < 0.0, -sizes, sizes) @ group.vectors.T
    result: Array = group.log_evidence(times[..., None] * found[:, None, :])
    return result


@dataclass(frozen=True)
class Detectable:
    """The weakest effect of a form that would be found with probability `OFTEN`.

    Attributes
    ----------
    times : its typical strength. gap : that it makes after the base is refitted, in noise SD.
    """

    times: float
    gap: float


@dataclass(frozen=True)
class Judgement:
    """What a design could tell of one effect.

    Attributes
    ----------
    testable : whether the tests can show it. why : they cannot, in words; empty where they can.
    best : its form that shows best.
    detectable : the smallest over variants; None where nothing is ever found.
    """

    effect: str
    testable: bool
    why: str
    best: Typical
    detectable: Detectable | None


def judgements(design: CohortSignatures, needed: float) -> tuple[Judgement, ...]:
    """What the tests could tell of each effect.

    Parameters
    ----------
    needed : log evidence, that of a sure effect and a lead over others.
    """
    judged = []
    for number, one in enumerate(design.those.trials):
        # of each effect by the variant that shows best
        best_forms = [best_spread(design, number, variant) for variant in one.variants]
        found = [(form, _detectable(form, one, design.freedom, needed)) for form in best_forms]
        # shown before not shown, then by how little is absorbed; a trace before none
        best, weakest = min(
            found,
            key=lambda pair: (not _shown(*pair), pair[0].absorbed, -pair[0].squared(pair[0].raw)),
        )
        shown = _shown(best, weakest)
        gaps = [gap for form, gap in found if gap is not None and _shown(form, gap) == shown]
        least = min(gaps, key=lambda detectable: detectable.gap, default=None)
        why = "" if shown else _why(best, weakest)
        judged.append(Judgement(one.effect, shown, why, best, least))
    return tuple(judged)


def best_spread(design: CohortSignatures, number: int, variant: Variant) -> Typical:
    """The form of a variant of which least is absorbed (to 1 %, then as declared first); of places,
    the one that shows most.
    """
    forms = [form for form in design.those.trials[number].forms if form.variant == variant]
    usual = [form for form in forms if form.spread in SPREADS]
    ones = [typical_form(design, number, form) for form in usual or forms]
    if usual:
        return min(ones, key=lambda one: round(one.absorbed, 2))
    return max(ones, key=lambda one: one.squared(one.left))


def _detectable(one: Typical, trials: Trials, freedom: int, needed: float) -> Detectable | None:
    times = _least(one, needed - log_share(one.form, trials)) if one.seen else None
    if times is None:
        return None
    return Detectable(times, times * float(np.sqrt(one.squared(one.refitted) / freedom)))


def log_share(form: CandidateForm, trials: Trials) -> float:
    """Of a form at one shape, of the evidence of its effect."""
    return trials.log_share(form) - float(np.log(len(shape_grid(form.variant))))


def _least(one: Typical, needed: float) -> float | None:
    """Times the typical strength at which all but a few data sets have the evidence needed."""
    if (squared := one.squared(one.left)) <= NO_TRACE:
        return None
    size = float(np.sqrt(squared))

    def beyond(log_times: float) -> float:
        return float(one.log_evidence(np.exp([log_times]))[0]) - needed

    ends = float(np.log(WEAKEST)), float(np.log(STRONGEST))
    if beyond(ends[1]) <= 0.0:
        return None
    # noise moves the effect by a normal number of SD one along its own direction, whose length is
    # its size in noise SD: that much stronger than what has the evidence needed
    evident = float(np.exp(brentq(beyond, *ends, xtol=1e-3)))
    return evident + float(norm.ppf(OFTEN)) / size


def _shown(one: Typical, least: Detectable | None) -> bool:
    return one.absorbed_by_base <= ABSORBED and least is not None and least.times <= LARGEST


def _why(one: Typical, least: Detectable | None) -> str:
    if not one.seen:
        return "it leaves no trace in these readings"
    if one.absorbed_by_base > ABSORBED:
        return f"the base takes up {100.0 * one.absorbed_by_base:.1f} % of what it would do"
    taken = f"base and nuisances take up {100.0 * one.absorbed:.1f} % of what it would do"
    if least is None:
        return f"{taken}, and the rest is never evident"
    return f"{taken}; it would be found only at {least.times:.1f} times its typical strength"


def typical_form(design: CohortSignatures, number: int, form: CandidateForm) -> Typical:
    """A form of effect ``number`` under a design."""
    places, strengths = design.places(number, form, usual_shapes(form.variant))
    signs = sides(form, strengths)
    sizes = {}  # default of each strength, in prior SDs from off
    for column in form.variant.strengths:
        p = form.variant.create().parameters[column]
        assert p.off is not None
        off = np.log(p.default / p.off) if p.logarithmic else p.default - p.off
        sizes[column] = float(off) / p.prior_scale
    away = np.array([sizes[column] for column in strengths])
    one_sided = signs != 0.0
    mean, sd = np.where(one_sided, away, 0.0), np.where(one_sided, 0.0, away)
    return Typical(form, places, mean, sd, signs, *design.summed(places, len(strengths)))

"""Which effects a design of tests can show, before residuals are looked at.

Everything is linear in the strengths at the base fit, with normal noise: an effect of s times its
typical strength f has moments s G f + N(0, G) on the screen, G the products of its signatures with
base and nuisances taken out. f are the declared defaults; strengths whose bounds allow both sides
of off are independent with mean off, so that several of them neither add up nor cancel by a
convention of signs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array, Indices
from spinepipe.studies.discrepancy.design.fisher_information import (
    CohortSignatures,
    SpecimenSignatures,
    candidates,
)
from spinepipe.studies.discrepancy.search.hypothesis import (
    CandidateForm,
    Trials,
    Variant,
    shape_grid,
    usual_shapes,
)
from spinepipe.studies.discrepancy.search.model_files import display_value
from spinepipe.studies.discrepancy.search.screen import Group, Places, sides

NO_TRACE = 1e-6
"""A typical effect whose squared signature sums to less, in noise SD, leaves no trace at all."""

ABSORBED = 0.98
"""Effects of which the base takes up more than this share are no effects beside it."""

CLEAR = 0.9
"""A test is worth doing for an effect if the base takes up no more than this share of it there."""

OFTEN = 0.9
"""Probability with which an effect that counts as detectable is found."""

LARGEST = 3.0
"""Effects that only show beyond this many times their typical strength count as not testable."""

SPREADS = (PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN)
"""How a typical effect may differ between places; one place only if a trial knows none of these."""

DRAWS = 200
WEAKEST, STRONGEST = 1e-6, 1e3
"""Times the typical strength, between which the weakest is sought that is found."""


@dataclass(frozen=True)
class Typical:
    """A form at its default shape, k strengths.

    Attributes
    ----------
    mean : (k,) prior SDs, of strengths that have one side. sd : (k,) of those that have two.
    signs : (k,) side of off that bounds allow, 0 for both.
    raw, refitted, left : (k, k) products of the strengths' signatures; see `SpecimenSignatures`.
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

    @property
    def directions(self) -> Array:
        """(k, d) strengths whose squares add up to the expected one."""
        both = np.column_stack([self.mean, np.diag(self.sd)])
        return both[:, np.any(both != 0.0, axis=0)]


@dataclass(frozen=True)
class Detectable:
    """The weakest effect of a form that would be found with probability `OFTEN`.

    Attributes
    ----------
    times : its typical strength. gap : that it makes after the base is refitted, in noise SD.
    strengths : (parameter, value, unit) of its strengths, in the units of tables.
    """

    times: float
    gap: float
    strengths: tuple[tuple[str, float, str], ...]


@dataclass(frozen=True)
class Judgement:
    """What a design could tell of one effect.

    Attributes
    ----------
    testable : whether the tests can show it. why : they cannot, in words; empty where they can.
    best : its form that shows best. absorbed, absorbed_by_base : shares of its squared signature
        taken up by base and nuisances, and by the base alone.
    detectable : the smallest over variants; None where nothing is ever found.
    """

    effect: str
    testable: bool
    why: str
    best: Typical
    absorbed: float
    absorbed_by_base: float
    detectable: Detectable | None

    @property
    def clear(self) -> bool:
        """Whether the tests show it at its typical strength, and much of it beside the base."""
        typical = self.detectable is not None and self.detectable.times <= 1.0
        return self.testable and typical and self.absorbed_by_base <= CLEAR


def judgements(
    trials: Sequence[Trials],
    of: Mapping[str, SpecimenSignatures],
    joints: int,
    tests: Sequence[str],
    needed: float,
    seed: int,
) -> tuple[Judgement, ...]:
    """What the tests could tell of each effect.

    Parameters
    ----------
    of : what each specimen's tests see. needed : log evidence, the screen's threshold and margin.
    """
    design = CohortSignatures(candidates(trials, joints, tests), of)
    judged = []
    for number, one in enumerate(trials):
        # of each effect by the variant that shows best
        best_forms = [_best_spread(design, number, variant) for variant in one.variants]
        found = [
            (form, _detectable(form, one, design.freedom, needed, seed)) for form in best_forms
        ]
        # shown before not shown, then by how little is absorbed; a trace before none
        best, weakest = min(
            found,
            key=lambda pair: (not _shown(*pair), pair[0].absorbed, -pair[0].squared(pair[0].raw)),
        )
        shown = _shown(best, weakest)
        gaps = [gap for form, gap in found if gap is not None and _shown(form, gap) == shown]
        least = min(gaps, key=lambda detectable: detectable.gap, default=None)
        why = "" if shown else _why(best, weakest)
        absorbed = best.absorbed, best.absorbed_by_base
        judged.append(Judgement(one.effect, shown, why, best, *absorbed, least))
    return tuple(judged)


def _best_spread(design: CohortSignatures, number: int, variant: Variant) -> Typical:
    """The form of a variant of which least is absorbed (to 1 %, then as declared first); of places,
    the one that shows most.
    """
    forms = [form for form in design.those.trials[number].forms if form.variant == variant]
    usual = [form for form in forms if form.spread in SPREADS]
    ones = [typical_form(design, number, form) for form in usual or forms]
    if usual:
        return min(ones, key=lambda one: round(one.absorbed, 2))
    return max(ones, key=lambda one: one.squared(one.left))


def _detectable(
    one: Typical, trials: Trials, freedom: int, needed: float, seed: int
) -> Detectable | None:
    share = trials.log_share(one.form) - float(np.log(len(shape_grid(one.form.variant))))
    times = _least(one, needed - share, seed) if one.seen else None
    if times is None:
        return None
    gap = times * float(np.sqrt(one.squared(one.refitted) / freedom))
    return Detectable(times, gap, _strengths(one.form.variant, times))


def _strengths(variant: Variant, times: float) -> tuple[tuple[str, float, str], ...]:
    """Strengths that many times as far from off as their defaults, in the units of tables."""
    found = []
    for column in variant.strengths:
        p = variant.create().parameters[column]
        assert p.off is not None
        if p.logarithmic:
            value = p.off * (p.default / p.off) ** times
        else:
            value = p.off + times * (p.default - p.off)
        outside, unit = display_value(p.unit, float(value))
        found.append((p.name, outside, unit))
    return tuple(found)


def _least(one: Typical, needed: float, seed: int) -> float | None:
    """Times the typical strength at which all but a few draws have the evidence needed."""
    rng, count = np.random.default_rng(seed), len(one.mean)
    if one.squared(one.left) <= NO_TRACE:
        return None
    # strengths (k, D) in random proportion, each of the squared size that is expected
    patterns = one.mean[:, None] + one.sd[:, None] * rng.standard_normal((count, DRAWS))
    squares = np.einsum("id,ij,jd->d", patterns, one.left, patterns)
    patterns = patterns * np.sqrt(one.squared(one.left) / np.maximum(squares, NO_TRACE))
    moved = one.left @ patterns
    group = one.group
    # noise of the moments is N(0, G), drawn by the eigenvectors of G
    noise = np.sqrt(group.eigenvalues)[:, None] * rng.standard_normal((count, DRAWS))
    noise = group.vectors @ noise

    def short(log_times: float) -> float:
        evidence = group.log_evidence((np.exp(log_times) * moved + noise).T)
        return float(np.quantile(evidence, 1.0 - OFTEN)) - needed

    # the same draws at every size (common random numbers): evidence rises with it, one root
    ends = float(np.log(WEAKEST)), float(np.log(STRONGEST))
    if short(ends[1]) <= 0.0:
        return None
    return float(np.exp(brentq(short, *ends, xtol=1e-3))) if short(ends[0]) < 0.0 else 0.0


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
    index, start = design.those.indices[number], design.those.starts[number]
    middle = usual_shapes(form.variant)
    places, strengths = index.places(form, middle, tuple(design.of), design.those.tests)
    count = len(strengths)
    signs = sides(form, strengths)
    sizes = {}  # default of each strength, in prior SDs from off
    for column in form.variant.strengths:
        p = form.variant.create().parameters[column]
        assert p.off is not None
        off = np.log(p.default / p.off) if p.logarithmic else p.default - p.off
        sizes[column] = float(off) / p.prior_scale
    away = np.array([sizes[column] for column in strengths])
    raw, refitted, left = (np.zeros((count, count)) for _ in range(3))
    for specimen, columns, owners in places:
        part, here, onto = design.of[specimen], np.ix_(columns, columns), summation(owners, count)
        among_all = np.ix_(start + columns, start + columns)
        raw += onto @ part.raw[number][here] @ onto.T
        refitted += onto @ part.refitted[number][here] @ onto.T
        left += onto @ part.left[among_all] @ onto.T
    one_sided = signs != 0.0
    mean, sd = np.where(one_sided, away, 0.0), np.where(one_sided, 0.0, away)
    return Typical(form, places, mean, sd, signs, raw, refitted, left)


def summation(owners: Indices, count: int) -> Array:
    """(k, c) sums columns onto the strengths that own them."""
    onto = np.zeros((count, len(owners)))
    onto[owners, np.arange(len(owners))] = 1.0
    return onto

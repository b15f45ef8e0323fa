"""The screen: evidence of every effect in the linearised problem, and what the null would show.

An effect's evidence is averaged over its variants, shapes and ways to differ, each with an equal
share, so that no effect is favoured by its place or by its number of variants.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from spinepipe.discrepancy.forms import Form, Trials, shape_grid
from spinepipe.discrepancy.groups import Index, Summed, summed
from spinepipe.discrepancy.projected import Linearised
from spinepipe.effects.contract import Array

LEAST_THRESHOLD = 5.0
"""Less is not very strong (Kass and Raftery 1995, doi 10.2307/2291091), whatever the draws say."""


@dataclass(frozen=True)
class Tried:
    """One form of an effect on the screen, at its best shape.

    Attributes
    ----------
    log_evidence : at that shape, the form's share of its effect taken off.
    estimate : (k,) strengths in prior SDs from off. strengths : (k,) which of the effect's values.
    explained : drop of chi2 with its strengths free.
    """

    form: Form
    sds: tuple[float, ...]
    strengths: tuple[int, ...]
    log_evidence: float
    estimate: Array
    explained: float


@dataclass(frozen=True)
class Screened:
    """An effect on the screen: its evidence, of each draw of the null too, and its forms.

    ``forms`` : best first.
    """

    effect: str
    log_evidence: float
    null: Array
    forms: tuple[Tried, ...]


@dataclass(frozen=True)
class Screen:
    """All effects, best first, and the evidence that the null exceeds as often as is allowed."""

    effects: tuple[Screened, ...]
    threshold: float
    draws: int


def screened(
    trials: Trials,
    index: Index,
    problem: Linearised,
    specimens: Sequence[str],
    tests: Sequence[str],
) -> Screened:
    """Evidence of one effect."""
    totals, tried = [], []
    for form in trials.forms:
        grid = shape_grid(form.variant)
        found = [summed(index, problem, form, sds, specimens, tests) for sds in grid]
        logs = np.stack([one.group.log_evidence(one.moments) for one in found])
        share = trials.log_share(form)
        totals.append(logsumexp(logs, axis=0) - np.log(len(grid)) + share)
        best = int(np.argmax(logs[:, 0]))
        tried.append(_tried(found[best], float(logs[best, 0]) + share))
    whole = logsumexp(np.stack(totals), axis=0)
    order = sorted(tried, key=lambda one: -one.log_evidence)
    return Screened(trials.effect, float(whole[0]), whole[1:], tuple(order))


def _tried(one: Summed, log_evidence: float) -> Tried:
    moments = one.moments[:, 0]
    estimate = one.group.estimate(moments)
    explained = float(2.0 * estimate @ moments - estimate @ one.gram @ estimate)
    return Tried(one.form, one.sds, one.strengths, log_evidence, estimate, explained)


def screen(
    effects: Sequence[Screened], false_alarm: float, threshold: float | None = None
) -> Screen:
    """Effects ranked; the threshold is that of the largest evidence of each draw of the null."""
    largest = np.max(np.stack([one.null for one in effects]), axis=0)
    if threshold is None:
        threshold = max(LEAST_THRESHOLD, exceeded(largest, false_alarm))
    ranked = sorted(effects, key=lambda one: (-one.log_evidence, one.effect))
    return Screen(tuple(ranked), threshold, len(largest))


def exceeded(values: Array, share: float) -> float:
    """The value exceeded by that share: of the draws, or of a Gumbel fit where these are few."""
    if len(values) * share >= 5.0:
        return float(np.quantile(values, 1.0 - share))
    scale = float(np.std(values)) * np.sqrt(6.0) / np.pi
    place = float(np.mean(values)) - np.euler_gamma * scale
    return place - scale * float(np.log(-np.log1p(-share)))

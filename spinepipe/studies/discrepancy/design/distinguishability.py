"""Which effects a cohort's tests can tell apart, before residuals are looked at.

Of what base and nuisances leave of a typical effect A, the share that another effect B explains:
``1 - min_x (|a - F x|^2 + |x|^2 / t^2) / |a|^2``, F the signatures of B, x its strengths with prior
SD t. B has one variant and shape at a time, the best; its strengths may differ between joints, or
it is where A is alone.

By how much log evidence A is expected to lead over B, m, is that of A's strengths for what A makes
less that of B's; noise scatters it by the root of 2 m. From it follows the gap at which A has its
own name.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import norm

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.design.information import Bench
from spinepipe.studies.discrepancy.design.signatures import (
    CohortSignatures,
    cohort_signatures,
    with_each_run,
)
from spinepipe.studies.discrepancy.design.testable import (
    LEAD,
    OFTEN,
    Judgement,
    Typical,
    expected_log_evidence,
    judgements,
    log_share,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, shape_grid
from spinepipe.studies.discrepancy.search.screen import SIZES, Group, sides, summation
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import NotTestable, SmallestDetectable

TIMES = np.geomspace(0.02, 20.0, 13)
"""Times as strong as usual at which leads are known."""

ENOUGH = 0.5 * (float(norm.ppf(OFTEN)) + float(np.sqrt(norm.ppf(OFTEN) ** 2 + 2.0 * LEAD))) ** 2
"""Expected lead of which noise leaves more than `LEAD` with probability `OFTEN`."""

FREE = (PlaceSpread.SHARED, PlaceSpread.BY_JOINT)
"""How the strengths of the explaining effect may differ, if its trial knows one of these."""

NONE_SHOWS_IT = "no single run that was tried shows it"
"""Said instead of advice: what an effect takes in general these tests may have already."""


@dataclass(frozen=True)
class Confusion:
    """Share (0..1) of what ``effect`` would do that ``other`` can explain.

    ``gap`` : noise SD from which the effect would lead by `LEAD` in nine data sets of ten, to
    first order and with B's shapes on a grid; None where it would not at `TIMES` as usual.
    """

    effect: str
    other: str
    share: float
    gap: float | None = None


@dataclass(frozen=True)
class Target:
    """A typical effect of one form, and what it makes in each specimen (M, d).

    Attributes
    ----------
    times : (S,) as strong as usual. own : (S,) its expected log evidence at these.
    shares, rivals : of each other effect, the share that it explains, and its (S,) log evidence for
        what this one makes.
    """

    number: int
    typical: Typical
    made: Mapping[str, Array]
    times: Array
    own: Array
    shares: dict[str, float] = field(default_factory=dict)
    rivals: dict[str, Array] = field(default_factory=dict)

    def told_from(self, other: str) -> float | None:
        """Times as strong as usual from which it leads over another effect, see `Confusion`."""
        lead = self.own - self.rivals[other]
        reached = np.flatnonzero(lead >= ENOUGH)
        if not len(reached):
            return None
        near = slice(max(0, reached[0] - 1), reached[0] + 1)
        # the root of the lead rises evenly with strength
        return float(np.interp(ENOUGH**0.5, np.maximum(lead[near], 0.0) ** 0.5, self.times[near]))

    def leads(self) -> list[tuple[float, str]]:
        """Expected log evidence over its nearest rival at each of `times`, and which that is.

        The rival is nothing, named "", or the effect that explains it best.
        """
        rivals = {"": np.zeros(len(self.times))} | self.rivals
        ahead = {name: self.own - rival for name, rival in rivals.items()}
        return [min((float(ahead[n][k]), n) for n in ahead) for k in range(len(self.times))]


@dataclass(frozen=True)
class Distinguishability:
    """What the tests could tell."""

    judgements: tuple[Judgement, ...]
    confusions: tuple[Confusion, ...]
    not_testable: tuple[NotTestable, ...]

    @property
    def smallest_detectable(self) -> tuple[SmallestDetectable, ...]:
        """Of all effects that the tests can show: found at all, and by their own name."""
        found = []
        for one in self.judgements:
            if one.testable and one.detectable is not None:
                # by name: from where no other effect is as good; None where one always is
                gaps = [pair.gap for pair in self.confusions if pair.effect == one.effect]
                known = [gap for gap in gaps if gap is not None]
                by_name = max([one.detectable.gap, *known]) if len(known) == len(gaps) else None
                found.append(SmallestDetectable(one.effect, one.detectable.gap, by_name))
        return tuple(found)


def distinguishability(
    grounds: BaselineFit,
    trials: Sequence[Trials],
    needed: float,
    declared: Array | None,
    run: PieceRunner,
) -> Distinguishability:
    """What the tests could tell at the base fit, which ``grounds`` stand on.

    Parameters
    ----------
    needed : log evidence that an effect must have: that of a sure one, and a lead over others.
    declared : (6,) m and rad, SD of a single reading, for coordinates that were not read; or None.
    """
    found, pairs = run(_told, grounds, trials, needed)
    missing = run(not_testable, Bench.of(grounds, declared), trials, found, needed)
    return Distinguishability(found, pairs, missing)


def _told(
    grounds: BaselineFit, trials: Sequence[Trials], needed: float
) -> tuple[tuple[Judgement, ...], tuple[Confusion, ...]]:
    design = cohort_signatures(grounds, trials)
    found = judgements(design, needed)
    return found, confusions(design, usual_targets(design, found))


def not_testable(
    place: Bench, trials: Sequence[Trials], found: Sequence[Judgement], needed: float
) -> tuple[NotTestable, ...]:
    """Effects that the tests cannot show, each with the run of the menu that shows it best.

    Parameters
    ----------
    found : what the tests could tell of each effect of ``trials``. needed : log evidence.
    """
    hidden = {one.effect: one.why for one in found if not one.testable}
    best: dict[str, tuple[float, str]] = {}
    tried = [one for one in trials if one.effect in hidden]
    for run, design in with_each_run(place, tried) if tried else ():
        for one in judgements(design, needed):
            if one.testable and one.detectable is not None:
                known = best.get(one.effect, (np.inf, ""))
                best[one.effect] = min(known, (one.detectable.times, run.words))
    return tuple(
        NotTestable(name, why, best[name][1])
        if name in best
        else NotTestable(name, f"{why}; {NONE_SHOWS_IT}", "")
        for name, why in hidden.items()
    )


def usual_targets(design: CohortSignatures, judged: Sequence[Judgement]) -> list[Target]:
    """Each effect that the tests can show, in its best form, at `TIMES` as strong as usual.

    Parameters
    ----------
    judged : of all effects of the design, in their order.
    """
    shown = [(number, one.best) for number, one in enumerate(judged) if one.testable]
    return targets(design, judged, shown, [TIMES] * len(shown))


def targets(
    design: CohortSignatures,
    judged: Sequence[Judgement],
    chosen: Sequence[tuple[int, Typical]],
    times: Sequence[Array],
) -> list[Target]:
    """Forms of effects of these numbers beside all others that the tests can show.

    Parameters
    ----------
    times : (S,) as strong as usual, of each.
    """
    found = [
        _target(design, number, one, some)
        for (number, one), some in zip(chosen, times, strict=True)
    ]
    for other, rival in enumerate(judged):
        others = [one for one in found if one.number != other]
        if rival.testable and others:
            shares, evidence = _told_by(design, other, others)
            for one, share, curve in zip(others, shares, evidence, strict=True):
                one.shares[rival.effect], one.rivals[rival.effect] = float(share), curve
    return found


def confusions(design: CohortSignatures, found: Sequence[Target]) -> tuple[Confusion, ...]:
    """All ordered pairs of different effects that the tests can show."""
    pairs = []
    for one in found:
        typical, name = one.typical, one.typical.form.name
        gap = float(np.sqrt(typical.squared(typical.refitted) / design.freedom))
        for other, share in one.shares.items():
            times = one.told_from(other)
            pairs.append(Confusion(name, other, share, None if times is None else gap * times))
    return tuple(sorted(pairs, key=lambda pair: (pair.other, pair.effect)))


def _target(design: CohortSignatures, number: int, one: Typical, times: Array) -> Target:
    made = {}
    for specimen, columns, owners in one.places:
        onto = summation(owners, len(one.mean))
        made[specimen] = design.left(specimen)[:, columns] @ onto.T @ one.directions
    own = one.log_evidence(times) + log_share(one.form, design.those.trials[number])
    return Target(number, one, made, times, own)


def _told_by(
    design: CohortSignatures, other: int, targets: Sequence[Target]
) -> tuple[Array, Array]:
    """(A,) share of each target that effect ``other`` explains, and (A, S) its log evidence."""
    trials = design.those.trials[other]
    shares = np.zeros(len(targets))
    evidence = np.full((len(targets), len(targets[0].times)), -np.inf)
    for form in trials.forms:
        # a form of one place competes only with targets of that very place
        usual = form.spread in FREE or not any(one.spread in FREE for one in trials.forms)
        at = [n for n, o in enumerate(targets) if usual or _place(o.typical.form) == _place(form)]
        for sds in shape_grid(form.variant) if at else ():
            told, logs = _explained(design, other, form, sds, [targets[number] for number in at])
            shares[at] = np.maximum(shares[at], told)
            evidence[at] = np.maximum(evidence[at], logs + log_share(form, trials))
    return np.clip(shares, 0.0, 1.0), evidence


def _place(form: CandidateForm) -> tuple[PlaceSpread, int | None, str | None]:
    return form.spread, form.joint, form.specimen


def _explained(
    design: CohortSignatures,
    other: int,
    form: CandidateForm,
    sds: tuple[float, ...],
    targets: Sequence[Target],
) -> tuple[Array, Array]:
    """(A,) share of each target that a form of effect ``other`` explains, by ridge regression on
    it, and (A, S) log evidence of its strengths at the targets' times.
    """
    places, strengths = design.places(other, form, sds)
    count = len(strengths)
    group = Group.of(design.summed(places, count)[2], sides(form, strengths))
    # F'a (k, d) of each target
    width = max(next(iter(target.made.values())).shape[1] for target in targets)
    moments = np.zeros((len(targets), count, width))
    for specimen, columns, owners in places:
        onto = summation(owners, count)
        for moment, target in zip(moments, targets, strict=True):
            if specimen in target.made:
                made = target.made[specimen][columns]
                moment[:, : made.shape[1]] += onto @ made
    inverse = 1.0 / (group.eigenvalues + SIZES[-1] ** -2.0)
    explained = np.einsum("k,akd->a", inverse, (group.vectors.T @ moments) ** 2)
    sizes = np.array([one.typical.squared(one.typical.left) for one in targets])
    times = np.stack([one.times for one in targets])
    # of what leaves nothing there is nothing to explain
    shares = np.divide(explained, sizes, out=np.zeros_like(explained), where=sizes > 0.0)
    return shares, expected_log_evidence(group, moments, times)

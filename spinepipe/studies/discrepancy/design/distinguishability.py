"""Which effects a cohort's tests can tell apart, before residuals are looked at.

Of what base and nuisances leave of a typical effect A, the share that another effect B explains:
``1 - min_x (|a - F x|^2 + |x|^2 / t^2) / |a|^2``, F the signatures of B, x its strengths with prior
SD t. B has one variant and shape at a time, the best; its strengths may differ between joints, or
it is where A is alone.

An effect that makes G of chi2 is expected to lead over B by m = G (1 - share) / 2 of log evidence,
which noise scatters by the root of 2 m. From it follows the gap at which A has its own name.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.design.information import Bench
from spinepipe.studies.discrepancy.design.signatures import (
    CohortSignatures,
    cohort_signatures,
    summation,
    with_each_run,
)
from spinepipe.studies.discrepancy.design.testable import (
    LEAD,
    NO_TRACE,
    OFTEN,
    Judgement,
    Typical,
    judgements,
    log_share,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, shape_grid
from spinepipe.studies.discrepancy.search.screen import SIZES
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import NotTestable, SmallestDetectable

FREE = (PlaceSpread.SHARED, PlaceSpread.BY_JOINT)
"""How the strengths of the explaining effect may differ, if its trial knows one of these."""

NONE_SHOWS_IT = "no single run that was tried shows it"
"""Said instead of advice: what an effect takes in general these tests may have already."""


@dataclass(frozen=True)
class Confusion:
    """Share (0..1) of what ``effect`` would do that ``other`` can explain.

    ``gap`` : noise SD from which the effect would lead by `LEAD` in nine data sets of ten, to
    first order and with B's shapes on a grid; None where the other explains all of it.
    """

    effect: str
    other: str
    share: float
    gap: float | None = None


@dataclass(frozen=True)
class Target:
    """A typical effect: what it makes in each specimen (M, d), its squared size, and its gap.

    ``shares`` : of it, that each other effect explains.
    """

    typical: Typical
    log_share: float
    made: Mapping[str, Array]
    gap: float
    shares: Mapping[str, float]

    @property
    def size(self) -> float:
        """Squared, of what base and nuisances leave."""
        return self.typical.squared(self.typical.left)

    def leading_gap(self, share: float) -> float | None:
        """Gap from which it leads over an effect that explains a share of it."""
        left = self.size * (1.0 - share)
        if left <= NO_TRACE:
            return None
        # s times this target leads by a normal number of mean s^2 L / 2 and SD s sqrt(L), L = left:
        # with probability OFTEN beyond the lead from s sqrt(L) = z + sqrt(z^2 + 2 lead) on
        often = float(norm.ppf(OFTEN))
        return self.gap * (often + float(np.sqrt(often**2 + 2.0 * LEAD))) / float(np.sqrt(left))

    def lead(self, times: float) -> tuple[float, str]:
        """Expected log evidence over its nearest rival when so many times as strong, and which.

        The rival is nothing, named "", or the effect that explains most of it.
        """
        leads = [(self.typical.log_evidence(times) + self.log_share, "")]
        leads += [
            (0.5 * times**2 * self.size * (1.0 - share), name)
            for name, share in self.shares.items()
        ]
        return min(leads)


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
    return found, confusions(targets(design, found))


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


def targets(design: CohortSignatures, judged: Sequence[Judgement]) -> dict[str, Target]:
    """Each effect that the tests can show, as strong as usual.

    Parameters
    ----------
    judged : of all effects of the design, in their order.
    """
    shown = [number for number, one in enumerate(judged) if one.testable]
    alone = {number: _target(design, number, judged[number].best) for number in shown}
    shares: dict[int, dict[str, float]] = {number: {} for number in shown}
    for other in shown:
        others = [number for number in shown if number != other]
        told = _shares(design, other, [alone[number] for number in others])
        for number, share in zip(others, told, strict=True):
            shares[number][judged[other].effect] = share
    return {
        judged[number].effect: Target(one.typical, one.log_share, one.made, one.gap, shares[number])
        for number, one in alone.items()
    }


def confusions(of: Mapping[str, Target]) -> tuple[Confusion, ...]:
    """All ordered pairs of different effects that the tests can show."""
    return tuple(
        Confusion(name, other, of[name].shares[other], of[name].leading_gap(of[name].shares[other]))
        for other in of
        for name in of
        if name != other
    )


def _target(design: CohortSignatures, number: int, one: Typical) -> Target:
    made = {}
    for specimen, columns, owners in one.places:
        onto = summation(owners, len(one.mean))
        made[specimen] = design.left(specimen)[:, columns] @ onto.T @ one.directions
    gap = float(np.sqrt(one.squared(one.refitted) / design.freedom))
    return Target(one, log_share(one.form, design.those.trials[number]), made, gap, {})


def _shares(design: CohortSignatures, other: int, targets: Sequence[Target]) -> list[float]:
    """Share of each target that effect ``other`` explains at its best."""
    forms = design.those.trials[other].forms
    best = np.zeros(len(targets))
    for form in forms:
        # a form of one place competes only with targets of that very place
        usual = form.spread in FREE or not any(one.spread in FREE for one in forms)
        at = [n for n, o in enumerate(targets) if usual or _place(o.typical.form) == _place(form)]
        for sds in shape_grid(form.variant) if at else ():
            told = _explained(design, other, form, sds, [targets[number] for number in at])
            best[at] = np.maximum(best[at], told)
    return [float(share) for share in np.clip(best, 0.0, 1.0)]


def _place(form: CandidateForm) -> tuple[PlaceSpread, int | None, str | None]:
    return form.spread, form.joint, form.specimen


def _explained(
    design: CohortSignatures,
    other: int,
    form: CandidateForm,
    sds: tuple[float, ...],
    targets: Sequence[Target],
) -> Array:
    """Share of each target that a form of effect ``other`` explains: ridge regression on it."""
    places, strengths = design.places(other, form, sds)
    count = len(strengths)

    # F'F (k, k), and F'a (k, d) of each target
    gram = np.zeros((count, count))
    widths = [next(iter(target.made.values())).shape[1] for target in targets]
    moments = [np.zeros((count, width)) for width in widths]
    for specimen, columns, owners in places:
        onto = summation(owners, count)
        gram += onto @ design.left(specimen)[np.ix_(columns, columns)] @ onto.T
        for moment, target in zip(moments, targets, strict=True):
            if specimen in target.made:
                moment += onto @ target.made[specimen][columns]

    prior = np.eye(len(gram)) / SIZES[-1] ** 2
    solution = np.linalg.solve(gram + prior, np.concatenate(moments, axis=1))
    ends = np.cumsum(widths)[:-1]
    return np.array(
        [
            float(np.sum(m * x)) / target.size
            for target, m, x in zip(targets, moments, np.split(solution, ends, axis=1), strict=True)
        ]
    )

"""Which effects a cohort's tests can tell apart, before residuals are looked at.

Of what base and nuisances leave of a typical effect A, the share that another effect B explains:
``1 - min_x (|a - F x|^2 + |x|^2 / t^2) / |a|^2``, F the signatures of B, x its strengths with prior
SD t. B has one variant and shape at a time, the best; its strengths may differ between joints, or
it is where A is alone.

An effect that makes G of chi2 leads over B by G (1 - share) / 2 of log evidence or so, give or take
the root of G (1 - share). From it follows the gap at which A has its own name.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.stats import norm

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.design.extra_tests import bench, not_testable
from spinepipe.studies.discrepancy.design.fisher_information import (
    CohortSignatures,
    candidates,
    specimen_signatures,
)
from spinepipe.studies.discrepancy.design.testable import (
    NO_TRACE,
    OFTEN,
    Judgement,
    Typical,
    judgements,
    summation,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, shape_grid
from spinepipe.studies.discrepancy.search.screen import SIZES
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import NotTestable, SmallestDetectable

ALIKE = 0.95
"""Effects that explain more than this share of each other cannot be told apart."""

FREE = (PlaceSpread.SHARED, PlaceSpread.BY_JOINT)
"""How the strengths of the explaining effect may differ, if its trial knows one of these."""


@dataclass(frozen=True)
class Confusion:
    """Share (0..1) of what ``effect`` would do that ``other`` can explain.

    ``gap`` : noise SD from which the effect would lead by the margin in nine data sets of ten, to
    first order and with B's shapes on a grid; None where the other explains all of it.
    """

    effect: str
    other: str
    share: float
    gap: float | None = None


@dataclass(frozen=True)
class _Target:
    """A typical effect: what it makes in each specimen (M, d), its squared size, and its gap."""

    form: CandidateForm
    made: Mapping[str, Array]
    size: float
    gap: float

    def leading_gap(self, share: float, margin: float) -> float | None:
        """Gap from which it leads over an effect that explains a share of it."""
        left = self.size * (1.0 - share)
        if left <= NO_TRACE:
            return None
        # s times this target leads by a normal number of mean s^2 L / 2 and SD s sqrt(L), L = left:
        # with probability OFTEN beyond the margin from s sqrt(L) = z + sqrt(z^2 + 2 margin) on
        often = float(norm.ppf(OFTEN))
        return self.gap * (often + float(np.sqrt(often**2 + 2.0 * margin))) / float(np.sqrt(left))


@dataclass(frozen=True)
class Distinguishability:
    """What the tests could tell.

    Attributes
    ----------
    families : sets of effects that cannot be told apart.
    """

    judgements: tuple[Judgement, ...]
    confusions: tuple[Confusion, ...]
    families: tuple[tuple[str, ...], ...]
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
    margin: float,
    declared: Array | None,
    seed: int,
    run: PieceRunner,
) -> Distinguishability:
    """What the tests could tell at the base fit, which ``grounds`` stand on.

    Parameters
    ----------
    needed : log evidence that an effect must have: the screen's threshold and margin.
    margin : log evidence over a rival.
    declared : (6,) m and rad, SD of a single reading, for coordinates that were not read; or None.
    """
    joints = next(iter(grounds.fit.models.values())).n_joints
    names = list(grounds.readings)
    each = run.map(specimen_signatures, [(grounds, name, trials) for name in names])
    of = dict(zip(names, each, strict=True))
    design = CohortSignatures(candidates(trials, joints, grounds.tests), of)
    found = judgements(trials, of, joints, grounds.tests, needed, seed)
    pairs = confusions(design, found, margin)
    missing = run(not_testable, bench(grounds, declared), trials, found, needed, seed)
    return Distinguishability(found, pairs, families(pairs), missing)


def confusions(
    design: CohortSignatures, judged: Sequence[Judgement], margin: float
) -> tuple[Confusion, ...]:
    """All ordered pairs of different effects that the tests can show.

    Parameters
    ----------
    judged : of all effects of the design, in their order. margin : log evidence over a rival.
    """
    shown = [number for number, one in enumerate(judged) if one.testable]
    if len(shown) < 2:
        return ()
    targets = {number: _target(design, number, judged[number].best) for number in shown}
    found = []
    for other in shown:
        others = [targets[number] for number in shown if number != other]
        for target, share in zip(others, _shares(design, other, others), strict=True):
            gap = target.leading_gap(share, margin)
            found.append(Confusion(target.form.name, judged[other].effect, share, gap))
    return tuple(found)


def _target(design: CohortSignatures, number: int, one: Typical) -> _Target:
    start, directions = design.those.starts[number], one.directions
    made = {}
    for specimen, columns, owners in one.places:
        onto = summation(owners, len(one.mean))
        made[specimen] = design.of[specimen].left[:, start + columns] @ onto.T @ directions
    gap = float(np.sqrt(one.squared(one.refitted) / design.freedom))
    return _Target(one.form, made, one.squared(one.left), gap)


def _shares(design: CohortSignatures, other: int, targets: Sequence[_Target]) -> list[float]:
    """Share of each target that effect ``other`` explains at its best."""
    forms = design.those.trials[other].forms
    best = np.zeros(len(targets))
    for form in forms:
        # a form of one place competes only with targets of that very place
        usual = form.spread in FREE or not any(one.spread in FREE for one in forms)
        at = [n for n, one in enumerate(targets) if usual or _place(one.form) == _place(form)]
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
    targets: Sequence[_Target],
) -> Array:
    """Share of each target that a form of effect ``other`` explains: ridge regression on it."""
    index, start = design.those.indices[other], design.those.starts[other]
    places, strengths = index.places(form, sds, tuple(design.of), design.those.tests)
    count = len(strengths)

    # F'F (k, k), and F'a (k, d) of each target
    gram = np.zeros((count, count))
    widths = [next(iter(target.made.values())).shape[1] for target in targets]
    moments = [np.zeros((count, width)) for width in widths]
    for specimen, columns, owners in places:
        onto, mine = summation(owners, count), start + columns
        gram += onto @ design.of[specimen].left[np.ix_(mine, mine)] @ onto.T
        for moment, target in zip(moments, targets, strict=True):
            if specimen in target.made:
                moment += onto @ target.made[specimen][mine]

    prior = np.eye(len(gram)) / SIZES[-1] ** 2
    solution = np.linalg.solve(gram + prior, np.concatenate(moments, axis=1))
    ends = np.cumsum(widths)[:-1]
    return np.array(
        [
            float(np.sum(m * x)) / target.size
            for target, m, x in zip(targets, moments, np.split(solution, ends, axis=1), strict=True)
        ]
    )


def families(found: Sequence[Confusion]) -> tuple[tuple[str, ...], ...]:
    """Sets of effects that explain each other, alphabetical; effects alone are not listed."""
    names = sorted({one.effect for one in found})
    share = np.zeros((len(names), len(names)))
    for one in found:
        share[names.index(one.effect), names.index(one.other)] = one.share
    mutual = np.minimum(share, share.T) > ALIKE
    _, labels = connected_components(mutual, directed=False)
    sets = [
        tuple(name for name, label in zip(names, labels, strict=True) if label == number)
        for number in sorted(set(labels.tolist()))
    ]
    return tuple(one for one in sets if len(one) > 1)

"""The search: effects enter while they are evident, stand against rivals, and leave if they can.

The order of events and what decides: a screen of all effects in the linearised problem; nonlinear
refits of those that lead; the best enters if its evidence exceeds what the null would show and it
closes a real share of the gap; then again beside it. At the end each effect, and each two, are
taken away once and all others are tried in their place.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from spinepipe.effects import Spread
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.gaps import Gap, whole_gap
from spinepipe.studies.discrepancy.search.grounds import Grounds
from spinepipe.studies.discrepancy.search.hypothesis import Form, Supposed, Variant
from spinepipe.studies.discrepancy.search.inquiry import (
    Found,
    Inquiry,
    Rival,
    Rules,
    Stage,
    Standing,
)
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit
from spinepipe.studies.discrepancy.search.refit import Refit, standing
from spinepipe.studies.discrepancy.search.screen import Screen, exceeded
from spinepipe.studies.discrepancy.store import Run
from spinepipe.units import ROTATIONS

HOPELESS = (4.0, 2.5, 1.5)
"""Times the evidence of the first, second and further effect that the generic basis may have.

With more, no known effect is what is missing, and adding them up would only imitate it.
"""

REAL_SHARE = 0.01
"""Of the base's excess chi2: a further effect that closes less is not worth a name."""

MOST_FORMS_NAMED = 4
MOST_SWAPS = 3

IMITATED = 0.3
"""Share of an effect's evidence that a simpler one must have, to be tried beside a second."""

ANOTHER_FORM = 1.0
"""Log evidence by which another form of an effect must be better than the one that stands."""

LEVELS = "level_dependence"
"""The effect by which joints differ in stiffness."""


def search(base: Grounds, rules: Rules, run: Run, progress: Progress | None = None) -> Found:
    """Effects that the base lacks; none where rivals keep taking each other's place."""
    inquiry = Inquiry(base, rules, run, progress or Progress())
    base_gap = whole_gap(base, base.fit)
    lack_of_base = inquiry.lack(base)
    current = _forward(base, inquiry, base_gap)
    stood: tuple[Standing, ...] = ()
    for _ in range(MOST_SWAPS):
        current, found = _examined(current, inquiry)
        if found is not None:
            stood = found
            break
        current = _forward(current, inquiry, base_gap)
    final = current if stood else base
    lack = inquiry.lack(final) if stood else lack_of_base
    return Found(
        base,
        final,
        stood,
        tuple(inquiry.stages),
        lack,
        exceeded(lack.null, rules.false_alarm),
        base_gap,
        whole_gap(final, final.fit),
    )


def _forward(current: Grounds, inquiry: Inquiry, base_gap: Gap) -> Grounds:
    """Let effects enter; the grounds that are left."""
    while (number := len(current.fit.hypothesis.supposed)) < MOST_FORMS_NAMED:
        best = _admitted(current, inquiry.stage(current), inquiry.rules, base_gap)
        if best is None or _hopeless(best, number, inquiry.lack(current)):
            break
        current = current.at(best.fit)
    return current


def _admitted(current: Grounds, stage: Stage, rules: Rules, base_gap: Gap) -> Refit | None:
    """The best refit, if it may enter."""
    supposed = current.fit.hypothesis.supposed
    names = {one.form.name for one in supposed}
    for one in stage.refits:
        if not one.log_evidence > stage.screen.threshold:
            return None
        enough = not supposed or one.gain >= REAL_SHARE * base_gap.excess
        if enough and (one.name in names or len(names) < rules.most_effects):
            return one
    return None


def _hopeless(best: Refit, number: int, lack: LackOfFit) -> bool:
    """Whether the generic basis has so much more evidence that no known effect is the one."""
    times = HOPELESS[min(number, len(HOPELESS) - 1)]
    return lack.log_evidence > times * best.log_evidence


def _examined(current: Grounds, inquiry: Inquiry) -> tuple[Grounds, tuple[Standing, ...] | None]:
    """The effects of a fit with their rivals; other grounds and None if one left or gave way."""
    stood: list[Standing] = []
    supposed = standing(current.fit)
    for number, one in enumerate(supposed):
        without, stage = _tried_without(current, (number,), inquiry)
        screen, tried = stage.screen, stage.refits
        own = _own(without, one, tried, inquiry)
        if not own.log_evidence > screen.threshold:
            return without, None
        best = max(tried, key=lambda other: other.log_evidence, default=own)
        needed = ANOTHER_FORM if best.name == one.form.name else 0.0
        if best.form != one.form and best.log_evidence > own.log_evidence + needed:
            return without.at(best.fit), None
        by_two = _two_simpler(without, own, tried, inquiry)
        if by_two is not None:
            return by_two, None
        stood.append(_standing(without, one, own, _rivals(own, tried, screen), inquiry))
    for pair in combinations(range(len(supposed)), 2):
        given, with_rivals = _against_one(current, pair, stood, inquiry)
        if given is not None:
            return given, None
        stood = with_rivals
    return current, tuple(stood)


def _tried_without(
    current: Grounds, left_out: tuple[int, ...], inquiry: Inquiry
) -> tuple[Grounds, Stage]:
    """The grounds without some of the effects, and all effects tried there."""
    supposed = standing(current.fit)
    others = tuple(one for number, one in enumerate(supposed) if number not in left_out)
    without = inquiry.beside(current, others)
    names = " and ".join(supposed[number].form.name for number in left_out)
    return without, inquiry.stage(without, in_place_of=names)


def _against_one(
    current: Grounds,
    pair: tuple[int, ...],
    stood: Sequence[Standing],
    inquiry: Inquiry,
) -> tuple[Grounds | None, list[Standing]]:
    """Two effects against each single one in their place: together two may imitate a third.

    Returns the grounds with the single one if it has more evidence than both together, and the
    effects, that one among their rivals.
    """
    without, stage = _tried_without(current, pair, inquiry)
    tried = stage.refits
    first, second = (stood[number] for number in pair)
    alone = _own(without, first.supposed, tried, inquiry)
    both = second.log_evidence + max(alone.log_evidence, 0.0)
    singles = [one for one in tried if one.name not in (first.name, second.name)]
    best = max(singles, key=lambda one: one.log_evidence, default=None)
    if best is None or not np.isfinite(best.log_evidence):
        return None, list(stood)
    if best.log_evidence > both:
        return without.at(best.fit), list(stood)
    rival = Rival(best.name, both - best.log_evidence)
    return None, [
        _with_rival(one, rival) if number in pair else one for number, one in enumerate(stood)
    ]


def _two_simpler(
    without: Grounds, own: Refit, tried: Sequence[Refit], inquiry: Inquiry
) -> Grounds | None:
    """Two effects in the place of one with more unknowns, if they have more evidence together.

    An effect that is another at each place imitates sums of effects that are the same everywhere.
    """
    simpler = [
        one
        for one in tried
        if one.name != own.name
        and one.unknowns < own.unknowns
        and one.log_evidence > IMITATED * own.log_evidence
    ]
    if not simpler:
        return None
    first = max(simpler, key=lambda one: one.log_evidence)
    beside = without.at(first.fit)
    stage = inquiry.stage(beside, in_place_of=f"{own.name}, beside {first.name}")
    few = own.unknowns - first.unknowns
    others = [one for one in stage.refits if one.name != own.name and one.unknowns <= few]
    second = max(others, key=lambda one: one.log_evidence, default=None)
    if second is not None and first.log_evidence + second.log_evidence > own.log_evidence:
        return beside.at(second.fit)
    return None


def _with_rival(one: Standing, rival: Rival) -> Standing:
    """An effect with one more rival, each by its smallest margin."""
    margins = {other.name: other.margin for other in one.rivals}
    margins[rival.name] = min(rival.margin, margins.get(rival.name, np.inf))
    ranked = sorted(margins.items(), key=lambda item: item[1])
    return replace(one, rivals=tuple(Rival(name, margin) for name, margin in ranked))


def _standing(
    without: Grounds, one: Supposed, own: Refit, rivals: tuple[Rival, ...], inquiry: Inquiry
) -> Standing:
    effects = inquiry.first.screen.effects
    alone = next(e.log_evidence for e in effects if e.effect == one.form.name)
    over = _over_stiffness(without, own, inquiry)
    return Standing(one, own.log_evidence, alone, own.gain, rivals, over)


def _own(without: Grounds, one: Supposed, tried: Sequence[Refit], inquiry: Inquiry) -> Refit:
    """The effect itself beside the others: as tried already, or refitted from where it stands."""
    same = [other for other in tried if other.form == one.form]
    return same[0] if same else inquiry.refit(without, one)


def _over_stiffness(without: Grounds, own: Refit, inquiry: Inquiry) -> float | None:
    """Evidence above that of plain stiffness, joint by joint and specimen by specimen.

    Forms that differ between joints can imitate it by their many strengths.
    """
    many = own.form.spread in (Spread.BY_JOINT, Spread.EACH)
    known = any(t.effect == LEVELS for t in inquiry.rules.trials)
    coordinate = dict(own.form.variant.options).get("coordinate")
    if not many or own.name == LEVELS or not known or coordinate not in ROTATIONS:
        return None
    variant = Variant(LEVELS, (("coordinate", coordinate),))
    start = variant.off(()) * np.exp(0.01)
    plain = inquiry.refit(without, Supposed(Form(variant, Spread.EACH), start))
    return own.log_evidence - plain.log_evidence if np.isfinite(plain.log_evidence) else None


def _rivals(own: Refit, tried: Sequence[Refit], screen: Screen) -> tuple[Rival, ...]:
    """Other effects by their evidence: of the best refit, else of the screen.

    Effects whose every refit was impossible are none.
    """
    evidence = {one.effect: one.log_evidence for one in screen.effects}
    refitted: dict[str, float] = {}
    for other in tried:
        refitted[other.name] = max(refitted.get(other.name, -np.inf), other.log_evidence)
    evidence |= refitted
    possible = [(n, v) for n, v in evidence.items() if n != own.name and np.isfinite(v)]
    ranked = sorted(possible, key=lambda item: -item[1])
    return tuple(Rival(name, own.log_evidence - value) for name, value in ranked)

"""Each effect, and each two, against their rivals: taken away, with all others tried in place."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from spinepipe.discrepancy.forms import Form, Variant
from spinepipe.discrepancy.found import Rival, Stage, Standing
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.hypothesis import Supposed
from spinepipe.discrepancy.inquiry import Inquiry
from spinepipe.discrepancy.refit import Refit, standing
from spinepipe.discrepancy.screen import Screen
from spinepipe.effects import Spread
from spinepipe.units import ROTATIONS

IMITATED = 0.3
"""Share of an effect's evidence that a simpler one must have, to be tried beside a second."""

ANOTHER_FORM = 1.0
"""Log evidence by which another form of an effect must be better than the one that stands."""

LEVELS = "level_dependence"
"""The effect by which joints differ in stiffness."""


def examined(
    base: Grounds, current: Grounds, inquiry: Inquiry
) -> tuple[Grounds, tuple[Standing, ...] | None]:
    """The effects of a fit with their rivals; other grounds and None if one left or gave way."""
    stood: list[Standing] = []
    supposed = standing(current.fit)
    for number, one in enumerate(supposed):
        without, screen, tried = _tried_without(base, current, (number,), inquiry)
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
        given, with_rivals = _against_one(base, current, pair, stood, inquiry)
        if given is not None:
            return given, None
        stood = with_rivals
    return current, tuple(stood)


def _tried_without(
    base: Grounds, current: Grounds, left_out: tuple[int, ...], inquiry: Inquiry
) -> tuple[Grounds, Screen, tuple[Refit, ...]]:
    """The grounds without some of the effects, and all effects tried there."""
    supposed = standing(current.fit)
    others = tuple(one for number, one in enumerate(supposed) if number not in left_out)
    without = inquiry.beside(base, current, others)
    screen, tried = inquiry.first.screen, inquiry.first.refits
    if without is not base:
        screen = inquiry.look(without)
        tried = inquiry.refits(without, screen)
    names = " and ".join(supposed[number].form.name for number in left_out)
    inquiry.stages.append(Stage(f"in place of {names} ({inquiry.rivalries + 1})", screen, tried))
    return without, screen, tried


def _against_one(
    base: Grounds,
    current: Grounds,
    pair: tuple[int, ...],
    stood: Sequence[Standing],
    inquiry: Inquiry,
) -> tuple[Grounds | None, list[Standing]]:
    """Two effects against each single one in their place: together two may imitate a third.

    Returns the grounds with the single one if it has more evidence than both together, and the
    effects, that one among their rivals.
    """
    without, _, tried = _tried_without(base, current, pair, inquiry)
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
    screen = inquiry.look(beside)
    tried = inquiry.refits(beside, screen)
    name = f"in place of {own.name}, beside {first.name} ({inquiry.rivalries + 1})"
    inquiry.stages.append(Stage(name, screen, tried))
    few = own.unknowns - first.unknowns
    others = [one for one in tried if one.name != own.name and one.unknowns <= few]
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

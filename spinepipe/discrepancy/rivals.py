"""Each effect against its rivals: taken away once, with all others tried in its place."""

from collections.abc import Sequence

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

LEVELS = "level_dependence"
"""The effect by which joints differ in stiffness."""


def examined(
    base: Grounds, current: Grounds, inquiry: Inquiry
) -> tuple[Grounds, tuple[Standing, ...] | None]:
    """The effects of a fit with their rivals; other grounds and None if one left or gave way."""
    stood: list[Standing] = []
    supposed = standing(current.fit)
    for number, one in enumerate(supposed):
        others = tuple(other for k, other in enumerate(supposed) if k != number)
        without = inquiry.beside(base, current, others)
        screen, tried = inquiry.first.screen, inquiry.first.refits
        if without is not base:
            screen = inquiry.look(without)
            tried = inquiry.refits(without, screen)
        own = _own(without, one, tried, inquiry)
        inquiry.stages.append(Stage(f"in the place of {one.form.name}", screen, tried))
        if not own.log_evidence > screen.threshold:
            return without, None
        best = max(tried, key=lambda other: other.log_evidence, default=own)
        if best.name != one.form.name and best.log_evidence > own.log_evidence:
            return without.at(best.fit), None
        stood.append(_standing(without, one, own, _rivals(own, tried, screen), inquiry))
    return current, tuple(stood)


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

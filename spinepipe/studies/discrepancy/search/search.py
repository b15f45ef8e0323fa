"""The search: effects enter while they are evident, stand against rivals, and leave if they can.

The order of events and what decides: a screen of all effects in the linearised problem; nonlinear
refits of those that lead; the best enters if its evidence exceeds what the null would show and it
closes a real share of the gap; then again beside it. At the end each effect is taken away once and
all others are tried in its place.
"""

from collections.abc import Sequence

from spinepipe.discrepancy.found import Found, Rules, Stage, Standing
from spinepipe.discrepancy.gaps import Gap, whole_gap
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.inquiry import Inquiry
from spinepipe.discrepancy.lack_of_fit import LackOfFit
from spinepipe.discrepancy.refit import Refit
from spinepipe.discrepancy.rivals import examined
from spinepipe.discrepancy.screen import Screen, exceeded
from spinepipe.discrepancy.tasks import Run

HOPELESS = (4.0, 2.5, 1.5)
"""Times the evidence of the first, second and further effect that the generic basis may have.

With more, no known effect is what is missing, and adding them up would only imitate it.
"""

REAL_SHARE = 0.01
"""Of the base's excess chi2: a further effect that closes less is not worth a name."""

MOST_FORMS_NAMED = 4
MOST_SWAPS = 3


def search(base: Grounds, rules: Rules, run: Run) -> Found:
    """Effects that the base lacks; none where rivals keep taking each other's place."""
    inquiry = Inquiry(rules, run)
    base_gap = whole_gap(base, base.fit)
    lack_of_base = inquiry.lack(base)
    current = _forward(base, inquiry, base_gap)
    stood: tuple[Standing, ...] = ()
    for _ in range(MOST_SWAPS):
        current, found = examined(base, current, inquiry)
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
        screen = inquiry.look(current)
        name = str(inquiry.rounds + 1)
        if screen.effects[0].log_evidence <= screen.threshold:
            inquiry.stages.append(Stage(name, screen))
            break
        tried = inquiry.refits(current, screen)
        inquiry.stages.append(Stage(name, screen, tried))
        best = _admitted(current, tried, screen, inquiry.rules, base_gap)
        if best is None or _hopeless(best, number, inquiry.lack(current)):
            break
        current = current.at(best.fit)
    return current


def _admitted(
    current: Grounds, tried: Sequence[Refit], screen: Screen, rules: Rules, base_gap: Gap
) -> Refit | None:
    """The best refit, if it may enter."""
    supposed = current.fit.hypothesis.supposed
    names = {one.form.name for one in supposed}
    for one in tried:
        if not one.log_evidence > screen.threshold:
            return None
        enough = not supposed or one.gain >= REAL_SHARE * base_gap.excess
        if enough and (one.name in names or len(names) < rules.most_effects):
            return one
    return None


def _hopeless(best: Refit, number: int, lack: LackOfFit) -> bool:
    """Whether the generic basis has so much more evidence that no known effect is the one."""
    times = HOPELESS[min(number, len(HOPELESS) - 1)]
    return lack.log_evidence > times * best.log_evidence

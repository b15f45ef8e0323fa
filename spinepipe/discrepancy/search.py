"""The search: effects enter while they are evident, stand against rivals, and leave if they can.

The order of events and what decides: a screen of all effects in the linearised problem; nonlinear
refits of those that lead; the best enters if its evidence exceeds what the null would show and it
closes a real share of the gap; then again beside it. At the end each effect is taken away once and
all others are tried in its place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from spinepipe.discrepancy.forms import Form, Trials, Variant
from spinepipe.discrepancy.gaps import Gap, whole_gap
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.hypothesis import Supposed
from spinepipe.discrepancy.joint_fit import JointFit, joint_fit
from spinepipe.discrepancy.lack_of_fit import LackOfFit, lack_of_fit
from spinepipe.discrepancy.refit import Refit, refit, refits, standing
from spinepipe.discrepancy.rounds import look
from spinepipe.discrepancy.screen import Screen, exceeded
from spinepipe.discrepancy.tasks import Run
from spinepipe.effects import Spread
from spinepipe.units import ROTATIONS

HOPELESS = (4.0, 2.5, 1.5)
"""Times the evidence of the first, second and further effect that the generic basis may have.

With more, no known effect is what is missing, and adding them up would only imitate it.
"""

REAL_SHARE = 0.03
"""Of the base's excess chi2: a further effect that closes less is not worth a name."""

LEVELS = "level_dependence"
"""The effect by which joints differ in stiffness."""

MOST_FORMS_NAMED = 4
MOST_SWAPS = 2


@dataclass(frozen=True)
class Rules:
    """What a search may do. ``draws`` of the null; ``margin`` of log evidence over a rival."""

    trials: tuple[Trials, ...]
    coordinates: tuple[str, ...]
    false_alarm: float
    draws: int
    margin: float
    most_effects: int
    seed: int


@dataclass(frozen=True)
class Rival:
    """Another effect in the place of a named one, and by how much evidence it is behind."""

    name: str
    margin: float


@dataclass(frozen=True)
class Standing:
    """A form that stands in the final model.

    Attributes
    ----------
    log_evidence : beside the others. alone : of its effect on the first screen, beside none.
    over_stiffness : how far its evidence is above that of a stiffness of its own for each joint of
        each specimen, where the form differs between joints as well; None elsewhere.
    """

    supposed: Supposed
    log_evidence: float
    alone: float
    gain: float
    rivals: tuple[Rival, ...]
    over_stiffness: float | None

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.supposed.form.name


@dataclass(frozen=True)
class Stage:
    """One look at the effects, with the refits that followed."""

    name: str
    screen: Screen
    refits: tuple[Refit, ...] = ()


@dataclass(frozen=True)
class Found:
    """Where a search ended.

    Attributes
    ----------
    base, final : the grounds with the base alone and with what stands. standing : what stands.
    lack_of_base, lack : the generic basis beside the base, and beside the final model.
    generic_threshold : evidence of the generic basis that the null seldom exceeds.
    """

    base: Grounds
    final: Grounds
    standing: tuple[Standing, ...]
    stages: tuple[Stage, ...]
    lack_of_base: LackOfFit
    lack: LackOfFit
    generic_threshold: float
    base_gap: Gap
    final_gap: Gap


@dataclass
class _Log:
    stages: list[Stage] = field(default_factory=list)


def search(base: Grounds, rules: Rules, run: Run) -> Found:
    """Effects that the base lacks."""
    log = _Log()
    base_gap = whole_gap(base, base.fit)
    lack_of_base = _lack(base, rules, run)
    current = _forward(base, rules, run, log, base_gap)
    standing_now: tuple[Standing, ...] = ()
    for _ in range(MOST_SWAPS):
        current, standing_now, changed = _examined(base, current, rules, run, log)
        if not changed:
            break
        current = _forward(current, rules, run, log, base_gap)
    lack = lack_of_base
    if standing_now:
        lack = _lack(current, rules, run)
    return Found(
        base,
        current,
        standing_now,
        tuple(log.stages),
        lack_of_base,
        lack,
        exceeded(lack.null, rules.false_alarm),
        base_gap,
        whole_gap(current, current.fit),
    )


def _look(grounds: Grounds, rules: Rules, run: Run, log: _Log) -> Screen:
    """A screen; the null's draws are those of the first, beside the base alone."""
    threshold = log.stages[0].screen.threshold if log.stages else None
    draws = (rules.draws, rules.false_alarm, rules.seed)
    return run(look, grounds, rules.trials, *draws, threshold)


def _lack(grounds: Grounds, rules: Rules, run: Run) -> LackOfFit:
    return run(lack_of_fit, grounds, rules.coordinates, rules.draws, rules.seed)


def _forward(current: Grounds, rules: Rules, run: Run, log: _Log, base_gap: Gap) -> Grounds:
    """Let effects enter; the grounds that are left."""
    while (number := len(current.fit.hypothesis.supposed)) < MOST_FORMS_NAMED:
        screen = _look(current, rules, run, log)
        name = f"round {number + 1}"
        if screen.effects[0].log_evidence <= screen.threshold:
            log.stages.append(Stage(name, screen))
            break
        tried = refits(current, screen, rules.trials, run)
        log.stages.append(Stage(name, screen, tried))
        best = _admitted(current, tried, screen, rules, base_gap)
        if best is None or _hopeless(best, number, _lack(current, rules, run)):
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


def _examined(
    base: Grounds, current: Grounds, rules: Rules, run: Run, log: _Log
) -> tuple[Grounds, tuple[Standing, ...], bool]:
    """Each effect against its rivals; whether one left or gave way to a better one."""
    stood: list[Standing] = []
    supposed = standing(current.fit)
    for number, one in enumerate(supposed):
        others = tuple(other for k, other in enumerate(supposed) if k != number)
        without = _without(base, others, run)
        screen, tried = log.stages[0].screen, log.stages[0].refits
        if others:
            screen = _look(without, rules, run, log)
            tried = refits(without, screen, rules.trials, run)
        own = _own(without, one, tried, rules, run)
        log.stages.append(Stage(f"in the place of {one.form.name}", screen, tried))
        if not own.log_evidence > screen.threshold:
            return without, (), True
        best = max(tried, key=lambda other: other.log_evidence, default=own)
        if best.name != one.form.name and best.log_evidence > own.log_evidence:
            return without.at(best.fit), (), True
        alone = next(e for e in log.stages[0].screen.effects if e.effect == one.form.name)
        over = _over_stiffness(without, own, rules, run)
        rivals = _rivals(own, tried, screen)
        found = (own.log_evidence, alone.log_evidence, own.gain, rivals, over)
        stood.append(Standing(one, *found))
    return current, tuple(stood), False


def _without(base: Grounds, others: Sequence[Supposed], run: Run) -> Grounds:
    """Grounds with the other effects alone."""
    if not others:
        return base
    fit: JointFit = run(joint_fit, base.suppose(others), base.setting)
    return base.at(fit)


def _own(without: Grounds, one: Supposed, tried: Sequence[Refit], rules: Rules, run: Run) -> Refit:
    """The effect itself beside the others: as tried already, or refitted from where it stands."""
    same = [other for other in tried if other.form == one.form]
    if same:
        return same[0]
    trials = next(t for t in rules.trials if t.effect == one.form.name)
    return refit(without, one, trials, run)


def _over_stiffness(without: Grounds, own: Refit, rules: Rules, run: Run) -> float | None:
    """Evidence above that of plain stiffness, joint by joint and specimen by specimen.

    Forms that differ between joints can imitate it by their many strengths.
    """
    many = own.form.spread in (Spread.BY_JOINT, Spread.EACH)
    levels = [t for t in rules.trials if t.effect == LEVELS]
    coordinate = dict(own.form.variant.options).get("coordinate")
    if not many or own.name == LEVELS or not levels or coordinate not in ROTATIONS:
        return None
    variant = Variant(LEVELS, (("coordinate", coordinate),))
    start = variant.off(()) * np.exp(0.01)
    plain = refit(without, Supposed(Form(variant, Spread.EACH), start), levels[0], run)
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


__all__ = ["Found", "Rival", "Rules", "Stage", "Standing", "search"]

"""The search: effects enter while they are evident, stand against rivals, and leave if they can.

The order of events and what decides: a screen of all effects in the linearised problem; nonlinear
refits of those that lead; the best enters if its evidence exceeds what the null would show and it
closes a real share of the gap; then again beside it.

At the end each effect is taken away once and all others are tried in its place. It leaves where
nothing speaks for it beside the others. Another takes its place if it has more evidence by a clear
margin; with less, both stand as rivals. Two effects are held against each single one as well, and
one with many unknowns against two with few.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from spinepipe.effects import PlaceSpread
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap, gaps_at, whole_gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit
from spinepipe.studies.discrepancy.search.refit import (
    ANOTHER_FORM,
    Refit,
    in_place,
    standing,
)
from spinepipe.studies.discrepancy.search.screen import Screen, exceeded
from spinepipe.studies.discrepancy.search.search_state import (
    Rival,
    Rules,
    SearchResult,
    SearchStage,
    SearchState,
    SelectedTerm,
)
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.units import COORDINATES

OUTSIDE_LIBRARY = (4.0, 2.5, 1.5)
"""Times the evidence of the first, second and further effect that the generic basis may have.

With more, no known effect is what is missing, and adding them up would only imitate it.
"""

REAL_SHARE = 0.01
"""Of the base's excess chi2 on its coordinates: a further effect that closes less has no name."""

MOST_FORMS_NAMED = 4

MOST_CHANGES = 6
"""Times that an effect may leave or give way; then what stands is kept and nothing gives way."""

IMITATED = 0.3
"""Share of an effect's evidence that a simpler one must have, to be tried beside a second."""

LEVELS = "level_dependence"
"""The effect by which joints differ in stiffness."""


def search(
    base: BaselineFit, rules: Rules, run: PieceRunner, progress: Progress | None = None
) -> SearchResult:
    """Effects that the base lacks, each with its rivals."""
    state = SearchState(base, rules, run, progress or Progress())
    base_at, base_lack = gaps_at(base, base.fit), state.lack(base)
    current, stood = _settled(_forward(base, state, base_at), state, base_at)
    lack = state.lack(current)
    single = rules.false_alarm / len(rules.coordinates)
    return SearchResult(
        base,
        current,
        stood,
        tuple(state.stages),
        lack,
        exceeded(lack.null, rules.false_alarm),
        whole_gap(base, base.fit),
        whole_gap(current, current.fit),
        base_at,
        gaps_at(current, current.fit),
        {name: exceeded(one.null, single) for name, one in lack.at.items()},
        base_lack,
    )


def _settled(
    current: BaselineFit, state: SearchState, base_at: Mapping[str, Gap]
) -> tuple[BaselineFit, tuple[SelectedTerm, ...]]:
    """The effects that stand after all changes; what took turns ends up among the rivals."""
    for _ in range(MOST_CHANGES):
        after, stands = examine(current, state)
        if stands is not None:
            return current, stands
        current = _forward(after, state, base_at)
    return current, examine(current, state, settled=True)[1] or ()


def _forward(current: BaselineFit, state: SearchState, base_at: Mapping[str, Gap]) -> BaselineFit:
    """Let effects enter; the fit that is left."""
    while (number := len(current.fit.hypothesis.supposed)) < MOST_FORMS_NAMED:
        best = _admitted(current, state.stage(current), state, base_at)
        if best is None or _outside_library(best, number, state.lack(current), state.rules):
            break
        current = current.at(best.fit)
    return current


def _admitted(
    current: BaselineFit, stage: SearchStage, state: SearchState, base_at: Mapping[str, Gap]
) -> Refit | None:
    """The best refit, if it may enter."""
    rules, supposed = state.rules, current.fit.hypothesis.supposed
    names = {one.form.name for one in supposed}
    for one in stage.refits:
        if not one.log_evidence > stage.screen.threshold:
            continue
        coordinates = one.form.variant.coordinates(rules.coordinates)
        excess = sum(base_at[name].excess for name in coordinates)
        enough = not supposed or one.gain >= REAL_SHARE * excess
        if enough and (one.name in names or len(names) < rules.most_effects):
            return one
    return None


def _outside_library(best: Refit, number: int, lack: LackOfFit, rules: Rules) -> bool:
    """Whether the generic basis has so much more evidence that no known effect is the one.

    On the coordinates that the effect loads: what is missing elsewhere says nothing against it.
    """
    coordinates = best.form.variant.coordinates(rules.coordinates)
    where: Sequence[float] = [lack.log_evidence]
    if len(coordinates) < len(rules.coordinates):
        where = [lack.at[name].log_evidence for name in coordinates]
    times = OUTSIDE_LIBRARY[min(number, len(OUTSIDE_LIBRARY) - 1)]
    return max(where) > times * best.log_evidence


def examine(
    current: BaselineFit, state: SearchState, *, settled: bool = False
) -> tuple[BaselineFit, tuple[SelectedTerm, ...] | None]:
    """The effects of a fit with their rivals; None, and the fit after, where one left or gave way.

    Parameters
    ----------
    settled : nothing leaves or gives way any more; what is better is a rival like the others.
    """
    stood: list[SelectedTerm] = []
    supposed = standing(current.fit)
    for number, one in enumerate(supposed):
        found = _one(current, number, one, state, settled)
        if not isinstance(found, SelectedTerm):
            return found, None
        stood.append(found)
    for pair in combinations(range(len(supposed)), 2):
        given, stood = _against_one(current, pair, stood, state)
        if given is not None and not settled:
            return given, None
    return current, tuple(stood)


def _one(
    current: BaselineFit, number: int, one: ActiveTerm, state: SearchState, settled: bool
) -> BaselineFit | SelectedTerm:
    """One effect with its rivals, or the fit after, where it left or gave way."""
    without, stage = _tried_without(current, (number,), state)
    if without is None or stage is None:
        # the others have no fit without it: nothing could be tried in its place
        trials = next(t for t in state.rules.trials if t.effect == one.form.name)
        gain, log_evidence = in_place(current.fit, number)
        log_evidence += trials.log_share(one.form)
        alone = _alone(one, state)
        return SelectedTerm(one, log_evidence, alone, gain, (), None, rivals_known=False)
    tried = stage.refits
    own = _own(without, one, tried, state)
    if not settled:
        if not own.log_evidence > stage.screen.threshold:
            return without
        given = _better(one.form, own, tried, state.rules.margin)
        if given is not None:
            return without.at(given.fit)
    rivals = _rivals(own, tried, stage.screen)
    two = _two_simpler(without, own, tried, state)
    if two is not None:
        if two.lead > state.rules.margin and not settled:
            return two.baseline
        for form in two.forms:
            rivals = _nearest(rivals, Rival(form.name, -two.lead, form.variant.acts_on))
    over = _over_stiffness(without, own, state)
    alone = _alone(one, state)
    return SelectedTerm(one, own.log_evidence, alone, own.gain, rivals, over)


def _better(form: CandidateForm, own: Refit, tried: Sequence[Refit], margin: float) -> Refit | None:
    """What takes the place of a form: another effect, or clearly a better form of the same."""
    best = max(tried, key=lambda other: other.log_evidence, default=own)
    if best.form == form:
        return None
    if best.name == form.name:
        return best if best.log_evidence > own.log_evidence + ANOTHER_FORM else None
    return best if best.log_evidence > _of_effect(own, tried) + margin else None


def _of_effect(own: Refit, tried: Sequence[Refit]) -> float:
    """Evidence of an effect whose plainest form stands: that of its best form, if that is near."""
    same = [other.log_evidence for other in tried if other.name == own.name]
    return min(max([own.log_evidence, *same]), own.log_evidence + ANOTHER_FORM)


def _alone(one: ActiveTerm, state: SearchState) -> float:
    """Evidence of its effect on the first screen, beside none."""
    effects = state.first.screen.effects
    return next(e.log_evidence for e in effects if e.effect == one.form.name)


def _tried_without(
    current: BaselineFit, left_out: tuple[int, ...], state: SearchState
) -> tuple[BaselineFit | None, SearchStage | None]:
    """The fit without some of the effects, and all effects tried there; None without a fit."""
    supposed = standing(current.fit)
    others = tuple(one for number, one in enumerate(supposed) if number not in left_out)
    without = state.beside(current, others)
    if without is None:
        return None, None
    names = " and ".join(supposed[number].form.name for number in left_out)
    return without, state.stage(without, in_place_of=names)


def _against_one(
    current: BaselineFit,
    pair: tuple[int, ...],
    stood: Sequence[SelectedTerm],
    state: SearchState,
) -> tuple[BaselineFit | None, list[SelectedTerm]]:
    """Two effects against each single one in their place: together two may imitate a third.

    Returns the baseline with the single one if it has clearly more evidence than both together, and
    the effects, that one among their rivals.
    """
    without, stage = _tried_without(current, pair, state)
    if without is None or stage is None:
        known = [replace(o, rivals_known=False) if k in pair else o for k, o in enumerate(stood)]
        return None, known
    tried = stage.refits
    first, second = (stood[number] for number in pair)
    alone = _own(without, first.supposed, tried, state)
    both = second.log_evidence + max(alone.log_evidence, 0.0)
    singles = [one for one in tried if one.name not in (first.name, second.name)]
    best = max(singles, key=lambda one: one.log_evidence, default=None)
    if best is None or not np.isfinite(best.log_evidence):
        return None, list(stood)
    clearly = best.log_evidence > both + state.rules.margin
    rival = Rival(best.name, both - best.log_evidence, best.form.variant.acts_on)
    return without.at(best.fit) if clearly else None, [
        replace(one, rivals=_nearest(one.rivals, rival)) if number in pair else one
        for number, one in enumerate(stood)
    ]


@dataclass(frozen=True)
class _Two:
    """Two effects in the place of one, and the evidence by which they are ahead of it."""

    baseline: BaselineFit
    forms: tuple[CandidateForm, CandidateForm]
    lead: float


def _two_simpler(
    without: BaselineFit, own: Refit, tried: Sequence[Refit], state: SearchState
) -> _Two | None:
    """The best two effects in the place of one with more unknowns; None where none comes near.

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
    stage = state.stage(beside, in_place_of=f"{own.name}, beside {first.name}")
    few = own.unknowns - first.unknowns
    others = [one for one in stage.refits if one.name != own.name and one.unknowns <= few]
    second = max(others, key=lambda one: one.log_evidence, default=None)
    if second is None or not second.log_evidence > stage.screen.threshold:
        return None
    lead = first.log_evidence + second.log_evidence - own.log_evidence
    if lead < -state.rules.margin:
        return None
    return _Two(beside.at(second.fit), (first.form, second.form), lead)


def _nearest(rivals: Sequence[Rival], further: Rival) -> tuple[Rival, ...]:
    """Rivals with one more, each by its smallest margin; nearest first."""
    nearest = {other.name: other for other in rivals}
    known = nearest.setdefault(further.name, further)
    if further.margin < known.margin:
        nearest[further.name] = further
    return tuple(sorted(nearest.values(), key=lambda one: one.margin))


def _own(
    without: BaselineFit, one: ActiveTerm, tried: Sequence[Refit], state: SearchState
) -> Refit:
    """The effect itself beside the others: as tried already, or refitted from where it stands."""
    same = [other for other in tried if other.form == one.form]
    return same[0] if same else state.refit(without, one)


def _over_stiffness(without: BaselineFit, own: Refit, state: SearchState) -> float | None:
    """Evidence above that of plain stiffness, joint by joint and specimen by specimen.

    Forms that differ between joints can imitate it by their many strengths.
    """
    many = own.form.spread in (PlaceSpread.BY_JOINT, PlaceSpread.EACH)
    known = any(t.effect == LEVELS for t in state.rules.trials)
    coordinate = dict(own.form.variant.options).get("coordinate")
    if not many or own.name == LEVELS or not known or coordinate not in COORDINATES:
        return None
    variant = Variant(LEVELS, (("coordinate", coordinate),))
    start = variant.off(()) * np.exp(0.01)
    plain = state.refit(without, ActiveTerm(CandidateForm(variant, PlaceSpread.EACH), start))
    return own.log_evidence - plain.log_evidence if np.isfinite(plain.log_evidence) else None


def _rivals(own: Refit, tried: Sequence[Refit], screen: Screen) -> tuple[Rival, ...]:
    """Other effects by their evidence: of the best refit, else of the screen.

    Effects whose every refit was impossible are none.
    """
    best: dict[str, tuple[float, CandidateForm]] = {}
    for other in tried:
        if other.log_evidence > best.get(other.name, (-np.inf,))[0] or other.name not in best:
            best[other.name] = (other.log_evidence, other.form)
    for effect in screen.effects:
        best.setdefault(effect.effect, (effect.log_evidence, effect.forms[0].form))
    mine = _of_effect(own, tried)
    found = [
        Rival(name, mine - evidence, form.variant.acts_on)
        for name, (evidence, form) in best.items()
        if name != own.name and np.isfinite(evidence)
    ]
    return tuple(sorted(found, key=lambda one: one.margin))

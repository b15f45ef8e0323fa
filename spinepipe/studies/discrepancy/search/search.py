"""The search: effects enter while they are evident, stand against rivals, and leave if they can.

The order of events and what decides: a screen of all effects in the linearised problem; nonlinear
refits of those that lead; the best enters if its evidence exceeds what the null would show and it
closes a real share of the gap; then again beside it. At the end each is examined.
"""

from collections.abc import Mapping, Sequence

from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.examination import examined
from spinepipe.studies.discrepancy.search.gaps import Gap, gaps_at, whole_gap
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit
from spinepipe.studies.discrepancy.search.refit import Refit
from spinepipe.studies.discrepancy.search.screen import exceeded
from spinepipe.studies.discrepancy.search.search_state import (
    Rules,
    SearchResult,
    SearchStage,
    SearchState,
    SelectedTerm,
)
from spinepipe.studies.discrepancy.store import PieceRunner

OUTSIDE_LIBRARY = (4.0, 2.5, 1.5)
"""Times the evidence of the first, second and further effect that the generic basis may have.

With more, no known effect is what is missing, and adding them up would only imitate it.
"""

REAL_SHARE = 0.01
"""Of the base's excess chi2 on its coordinates: a further effect that closes less has no name."""

MOST_FORMS_NAMED = 4

MOST_CHANGES = 6
"""Times that an effect may leave or give way; then what stands is kept and nothing gives way."""


def search(
    base: BaselineFit, rules: Rules, run: PieceRunner, progress: Progress | None = None
) -> SearchResult:
    """Effects that the base lacks, each with its rivals."""
    inquiry = SearchState(base, rules, run, progress or Progress())
    base_at, base_lack = gaps_at(base, base.fit), inquiry.lack(base)
    current, stood = _settled(_forward(base, inquiry, base_at), inquiry, base_at)
    lack = inquiry.lack(current)
    single = rules.false_alarm / len(rules.coordinates)
    return SearchResult(
        base,
        current,
        stood,
        tuple(inquiry.stages),
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
    current: BaselineFit, inquiry: SearchState, base_at: Mapping[str, Gap]
) -> tuple[BaselineFit, tuple[SelectedTerm, ...]]:
    """The effects that stand after all changes; what took turns ends up among the rivals."""
    for _ in range(MOST_CHANGES):
        found = examined(current, inquiry)
        if found.standing is not None:
            return current, found.standing
        current = _forward(found.grounds, inquiry, base_at)
    return current, examined(current, inquiry, settled=True).standing or ()


def _forward(current: BaselineFit, inquiry: SearchState, base_at: Mapping[str, Gap]) -> BaselineFit:
    """Let effects enter; the grounds that are left."""
    while (number := len(current.fit.hypothesis.supposed)) < MOST_FORMS_NAMED:
        best = _admitted(current, inquiry.stage(current), inquiry, base_at)
        if best is None or _hopeless(best, number, inquiry.lack(current), inquiry.rules):
            break
        current = current.at(best.fit)
    return current


def _admitted(
    current: BaselineFit, stage: SearchStage, inquiry: SearchState, base_at: Mapping[str, Gap]
) -> Refit | None:
    """The best refit, if it may enter."""
    rules, supposed = inquiry.rules, current.fit.hypothesis.supposed
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


def _hopeless(best: Refit, number: int, lack: LackOfFit, rules: Rules) -> bool:
    """Whether the generic basis has so much more evidence that no known effect is the one.

    On the coordinates that the effect loads: what is missing elsewhere says nothing against it.
    """
    coordinates = best.form.variant.coordinates(rules.coordinates)
    where: Sequence[float] = [lack.log_evidence]
    if len(coordinates) < len(rules.coordinates):
        where = [lack.at[name].log_evidence for name in coordinates]
    times = OUTSIDE_LIBRARY[min(number, len(OUTSIDE_LIBRARY) - 1)]
    return max(where) > times * best.log_evidence

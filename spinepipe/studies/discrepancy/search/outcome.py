"""The verdict of a search: named, a set, nothing, or something no known effect is."""

from collections.abc import Sequence
from dataclasses import dataclass

from spinepipe.studies.discrepancy.proof.folds import TEST
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.inquiry import Found, Standing
from spinepipe.studies.discrepancy.search.screen import LEAST_THRESHOLD
from spinepipe.studies.discrepancy.verdict import Answer, Reason, SuspectedError

UNEXPLAINED_SHARE = 0.1
"""Of what effects and generic basis explain together: more left to the basis is unknown."""

GAP_LEFT, LEAST_LEFT = 0.5, 0.3
"""Share of the discrepancy that named effects may leave, unless that may be a gap below this."""

WORSE_SHARE, WORSE = 0.05, 30.0
"""An unseen test may be predicted worse by this share of the base's excess chi2, or so much."""

ALONE = 0.25
"""Share of its evidence that an effect must have without the others.

One that has less only mends what another gets wrong: together they imitate something else.
"""


@dataclass(frozen=True)
class Outcome:
    """A verdict, and why in one sentence.

    Attributes
    ----------
    named : effects that are sure. tied : names that cannot be told apart here.
    reason : why nothing is named though something is missing; None elsewhere.
    """

    verdict: Answer
    why: str
    named: tuple[Standing, ...] = ()
    tied: tuple[str, ...] = ()
    reason: Reason | None = None


_NoName = tuple[Reason, str]
"""Why nothing is named, for programs and in one sentence."""


def outcome(
    found: Found,
    margin: float,
    proof: HeldOut | None = None,
    errors: Sequence[SuspectedError] = (),
) -> Outcome:
    """What a search's end means.

    Parameters
    ----------
    proof : on data held out; None where none was asked for. errors : suspected in the data.
    """
    unexplained = (
        _mistaken(errors)
        or _unexplained(found)
        or _stiffness_of_each(found.standing, margin)
        or _unproven(found, proof)
    )
    if unexplained:
        reason, why = unexplained
        return Outcome(Answer.UNKNOWN, why, reason=reason)
    if not found.standing:
        why = "no effect has evidence above what noise alone would show on these tests"
        return Outcome(Answer.NULL, why)
    tied = _tied(found.standing, margin)
    sure = tuple(one for one in found.standing if one.name not in tied)
    if tied:
        why = f"something is missing, but these tests cannot tell which: {_listed(tied, 'or')}"
        return Outcome(Answer.SET, why, sure, tied)
    names = _listed(list(dict.fromkeys(one.name for one in found.standing)), "and")
    why = (
        f"{names}: more evidence than noise alone would show, and at least {margin:g} more than "
        "any other effect has"
    )
    return Outcome(Answer.NAMED, why, sure)


def _without_place(found: Found) -> _NoName | None:
    """Whether effects had evidence and none kept its place."""
    evident = [
        one
        for stage in found.stages[:1]
        for one in stage.refits
        if one.log_evidence > stage.screen.threshold
    ]
    if not evident:
        return None
    names = _listed(list(dict.fromkeys(one.name for one in evident)), "and")
    why = f"there is evidence for {names}, but none keeps its place beside the others"
    return Reason.NONE_KEEPS_ITS_PLACE, why


def _mistaken(errors: Sequence[SuspectedError]) -> _NoName | None:
    """Data errors are not physics: nothing is named before they are looked at."""
    if not errors:
        return None
    places = "; ".join(f"{one.what} ({one.where})" for one in errors[:3])
    return Reason.DATA_ERRORS, f"the data look wrong, so nothing is named: {places}"


def _stiffness_of_each(standing: Sequence[Standing], margin: float) -> _NoName | None:
    """Whether plain stiffness, another in each joint of each specimen, does as well."""
    for one in standing:
        if one.over_stiffness is not None and one.over_stiffness < margin:
            why = (
                f"{one.name} explains no more than a stiffness of its own for each joint of each "
                "specimen: try base per_joint"
            )
            return Reason.STIFFNESS_OF_EACH_JOINT, why
    return None


def _unproven(found: Found, proof: HeldOut | None) -> _NoName | None:
    """What is named must predict better than the base what it has not seen."""
    if not found.standing or proof is None or proof.over_base is None:
        return None
    if not proof.tells or (proof.beats_base and not _worse_on_tests(proof)):
        return None
    names = _listed(list(dict.fromkeys(one.name for one in found.standing)), "and")
    return (
        Reason.NOT_PROVEN,
        f"{names} would explain these readings, but predicts held-out ones no better than the base",
    )


def _worse_on_tests(proof: HeldOut) -> bool:
    """Whether tests that no fit has seen are clearly worse with the effects than without."""
    rows = [row for row in proof.folds if row.kind == TEST]
    pairs = [(row.base, row.with_effects, row.expected) for row in rows]
    drops = sum(b.chi2 - e.chi2 for b, e, _ in pairs if b is not None and e is not None)
    excess = sum(b.chi2 - expected for b, _, expected in pairs if b is not None)
    return drops < -max(WORSE, WORSE_SHARE * max(excess, 0.0))


def _tied(standing: Sequence[Standing], margin: float) -> tuple[str, ...]:
    """Effects with a rival that is not clearly behind, and these rivals."""
    names = {one.name for one in standing}
    tied: dict[str, None] = {}
    for one in standing:
        close = [r.name for r in one.rivals if r.margin < margin and r.name not in names]
        if close:
            tied |= dict.fromkeys([one.name, *close])
    return tuple(tied)


def _unexplained(found: Found) -> _NoName | None:
    """Why something is missing that no known effect is, if so."""
    threshold = max(LEAST_THRESHOLD, found.generic_threshold)
    lack = found.lack
    if not found.standing:
        if lack.log_evidence <= threshold:
            return _without_place(found)
        why = f"a discrepancy that no known effect explains: {lack.shape}"
        return Reason.NO_KNOWN_EFFECT, why
    gain = found.base.fit.chi2 - found.final.fit.chi2
    left = 2.0 * max(lack.log_evidence, 0.0)
    if lack.log_evidence > threshold and left > UNEXPLAINED_SHARE * (gain + left):
        names = _listed([one.name for one in found.standing], "and")
        why = f"{names} would explain a part, but {100 * left / (gain + left):.0f} % stays"
        return Reason.A_PART_STAYS, why
    props = [one.name for one in found.standing if one.alone < ALONE * one.log_evidence]
    if props and len(found.standing) > 1:
        names = _listed([one.name for one in found.standing], "and")
        alone = _listed(list(dict.fromkeys(props)), "and")
        why = f"{names} imitate it together, but by itself nothing speaks for {alone}"
        return Reason.IMITATED_TOGETHER, why
    excess = found.final_gap.excess
    if found.final_gap.interval[0] > LEAST_LEFT and excess > GAP_LEFT * (gain + excess):
        return Reason.MOST_STAYS, "most of the discrepancy stays whatever known effect is added"
    return None


def _listed(names: Sequence[str], word: str) -> str:
    return f" {word} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)

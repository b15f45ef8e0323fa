"""The verdict of a search: named, a set, nothing, or something that is none of the known effects."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from spinepipe.discrepancy.screen import LEAST_THRESHOLD
from spinepipe.discrepancy.search import Found, Standing

UNEXPLAINED_SHARE = 0.1
"""Of what effects and generic basis explain together: more than this left to the basis is unknown."""

GAP_LEFT = 0.5
"""Share of the base's excess chi2 that named effects may leave, if it is above the noise."""


class Verdict(StrEnum):
    """What a study of kind discrepancy says."""

    NAMED = "NAMED"
    SET = "SET"
    NULL = "NULL"
    UNKNOWN = "UNKNOWN"


@dataclass(frozen=True)
class Outcome:
    """A verdict, and why in one sentence.

    Attributes
    ----------
    named : effects that are sure. tied : names that cannot be told apart here.
    """

    verdict: Verdict
    why: str
    named: tuple[Standing, ...]
    tied: tuple[str, ...]


def outcome(found: Found, margin: float) -> Outcome:
    """What a search's end means."""
    unexplained = _unexplained(found)
    if unexplained:
        return Outcome(Verdict.UNKNOWN, unexplained, (), ())
    if not found.standing:
        why = "no effect has evidence above what noise alone would show on these tests"
        return Outcome(Verdict.NULL, why, (), ())
    tied = _tied(found.standing, margin)
    sure = tuple(one for one in found.standing if one.name not in tied)
    if tied:
        why = f"something is missing, but these tests cannot tell which: {_listed(tied, 'or')}"
        return Outcome(Verdict.SET, why, sure, tied)
    names = _listed(list(dict.fromkeys(one.name for one in found.standing)), "and")
    why = f"{names}: evidence above the null's and {margin:g} above every rival's"
    return Outcome(Verdict.NAMED, why, sure, ())


def _tied(standing: Sequence[Standing], margin: float) -> tuple[str, ...]:
    """Effects with a rival that is not clearly behind, and these rivals."""
    names = {one.name for one in standing}
    tied: dict[str, None] = {}
    for one in standing:
        close = [r.name for r in one.rivals if r.margin < margin and r.name not in names]
        if close:
            tied |= dict.fromkeys([one.name, *close])
    return tuple(tied)


def _unexplained(found: Found) -> str:
    """Why something is missing that no known effect is, or nothing."""
    threshold = max(LEAST_THRESHOLD, found.generic_threshold)
    lack = found.lack
    if not found.standing:
        if lack.log_evidence <= threshold:
            return ""
        return f"a discrepancy that no known effect explains: {lack.shape}"
    gain = found.base.fit.chi2 - found.final.fit.chi2
    left = 2.0 * max(lack.log_evidence, 0.0)
    if lack.log_evidence > threshold and left > UNEXPLAINED_SHARE * (gain + left):
        names = _listed([one.name for one in found.standing], "and")
        return f"{names} would explain a part, but {100 * left / (gain + left):.0f} % stays"
    excess = found.final_gap.excess
    if found.final_gap.interval[0] > 0.0 and excess > GAP_LEFT * found.base_gap.excess:
        return "most of the discrepancy stays whatever known effect is added"
    return ""


def _listed(names: Sequence[str], word: str) -> str:
    return f" {word} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)

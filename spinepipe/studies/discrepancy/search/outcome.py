"""The verdict of a search: named, a part of it, a set, nothing, or something no known effect is.

Each effect that stands is doubted by itself, on the coordinates that it loads: what stays elsewhere
says nothing against it, but forbids to say that it is all that is missing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from types import MappingProxyType

import numpy as np
from scipy.special import logsumexp

from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.proof.folds import TEST
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.lack_of_fit import FAMILIES, OWN
from spinepipe.studies.discrepancy.search.screen import LEAST_THRESHOLD
from spinepipe.studies.discrepancy.search.search_state import Rival, SearchResult, SelectedTerm
from spinepipe.studies.discrepancy.verdict import SuspectedError, VerdictKind, share_of_gap
from spinepipe.studies.discrepancy.verdict_unnamed import Reason

UNEXPLAINED_SHARE = 0.1
"""Of what effects and generic basis explain together: more left to the basis is unknown."""

TRIFLE = 0.02
"""Of all that the effects explain: less than this left at a coordinate is no part of it."""

GAP_LEFT, LEAST_LEFT = 0.5, 0.3
"""Share of the discrepancy that named effects may leave, unless that may be a gap below this."""

WORSE_SHARE, WORSE = 0.05, 30.0
"""Unseen tests together may be predicted worse by this share of the base's excess, or so much."""

CLOSED = 0.5
"""Of the excess misfit (chi2) of held-out readings: effects that take away less are not all."""

ALONE = 0.25
"""Share of its evidence that an effect must have without the others.

One that has less only mends what another gets wrong: together they imitate something else.
"""


NEARLY_ALL = 0.9
"""Share of the standing effects' evidence that a generic shape must have to be the truer one."""

SAME = 0.05
"""Share of the largest listed force by which tests that compress alike may differ."""

AS_NEAR = 1.0
"""Log evidence within which one rival is as near as another."""

EVERYWHERE = ""
"""In the place of a coordinate: all of them."""


@dataclass(frozen=True)
class Outcome:
    """A verdict, and why in one sentence.

    Attributes
    ----------
    named : effects that are sure. tied : names that cannot be told apart here.
    reason : why nothing is named though something is missing; None elsewhere.
    left : why what is named is not all, a sentence each.
    """

    verdict: VerdictKind
    why: str
    named: tuple[SelectedTerm, ...] = ()
    tied: tuple[str, ...] = ()
    reason: Reason | None = None
    left: tuple[str, ...] = ()


_NoName = tuple[Reason, str]
"""Why nothing is named, for programs and in one sentence."""

Cases = Mapping[str, Sequence[LoadCase]]
"""Load histories by specimen."""


def outcome(
    found: SearchResult,
    margin: float,
    proof: HeldOut | None = None,
    errors: Sequence[SuspectedError] = (),
    not_excluded: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Outcome:
    """What a search's end means.

    Parameters
    ----------
    proof : on data held out; None where none was asked for. errors : suspected in the data.
    not_excluded : by effect, others that nothing recorded speaks for or against.
    """
    doubted = [(one, _doubt(found, one, margin)) for one in found.standing]
    kept = [one for one, doubt in doubted if doubt is None]
    doubts = [doubt for _, doubt in doubted if doubt is not None]
    close = [_close(one, found, margin, not_excluded) for one in kept]
    tied = tuple(
        dict.fromkeys(
            name
            for one, names in zip(kept, close, strict=True)
            if names
            for name in (one.name, *names)
        )
    )
    named = tuple(one for one, names in zip(kept, close, strict=True) if not names)
    unexplained: _NoName | None = None
    if errors:  # data errors are not physics: nothing is named before they are looked at
        places = "; ".join(f"{one.what} ({one.where})" for one in errors[:3])
        why = f"the data look wrong, so nothing is named: {places}"
        unexplained = Reason.DATA_ERRORS, why
    elif not found.standing and found.lack.log_evidence > max(
        LEAST_THRESHOLD, found.generic_threshold
    ):
        why = f"a discrepancy that no known effect explains: {found.lack.shape}"
        unexplained = Reason.NO_KNOWN_EFFECT, why
    else:
        unexplained = doubts[0] if doubts and not kept else _unproven(found, proof)
    if unexplained:
        reason, why = unexplained
        return Outcome(VerdictKind.UNKNOWN, why, reason=reason)
    if not found.standing:
        why = "no effect has evidence above what noise alone would show on these tests"
        return Outcome(VerdictKind.NULL, why)
    left = _left(found, doubts, proof)
    if tied:
        why = f"something is missing, but these tests cannot tell which: {_listed(tied, 'or')}"
        return Outcome(VerdictKind.SET, why, named, tied, left=left)
    names = _listed(list(dict.fromkeys(one.name for one in named)), "and")
    why = (
        f"{names}: more evidence than noise alone would show, and at least {margin:g} more than "
        "any other effect has"
    )
    if left:
        why = f"{why}; but more stays: {'; '.join(left)}"
        return Outcome(VerdictKind.PART, why, named, left=left)
    return Outcome(VerdictKind.NAMED, why, named)


def _doubt(found: SearchResult, one: SelectedTerm, margin: float) -> _NoName | None:
    """Why an effect that stands is not sure, if so."""
    if one.over_stiffness is not None and one.over_stiffness < margin:
        why = (
            f"{one.name} explains no more than a stiffness of its own for each joint of each "
            "specimen: try base per_joint"
        )
        return Reason.STIFFNESS_OF_EACH_JOINT, why
    if not one.rivals_known:
        why = f"without {one.name} the other effects have no fit, so its rivals are not known"
        return Reason.RIVALS_UNKNOWN, why
    return _most_stays(found, one) or _imitated(found, one) or _other_shape(found, one, margin)


def _most_stays(found: SearchResult, one: SelectedTerm) -> _NoName | None:
    """Whether too much stays on the coordinates that an effect loads."""
    at = one.supposed.form.variant.coordinates(tuple(found.base_at))
    for coordinate in at if len(at) < len(found.base_at) else (EVERYWHERE,):
        share = _share_left(found, coordinate)
        if share > UNEXPLAINED_SHARE:
            why = f"{one.name} would explain a part, but {100 * share:.0f} % stays"
            return Reason.A_PART_STAYS, f"{why}{_in(coordinate)}"
        gain = _gain(found, coordinate)
        gap = found.final_at[coordinate] if coordinate else found.final_gap
        if gap.interval[0] > LEAST_LEFT and gap.excess > GAP_LEFT * (gain + gap.excess):
            why = "most of the discrepancy stays whatever known effect is added"
            return Reason.MOST_STAYS, f"{why}{_in(coordinate)}"
    return None


def _in(coordinate: str) -> str:
    return f" in {coordinate.replace('_', ' ')}" if coordinate else ""


def _gain(found: SearchResult, coordinate: str) -> float:
    """Drop of chi2 by the effects."""
    if not coordinate:
        return found.base.fit.chi2 - found.final.fit.chi2
    return found.base_at[coordinate].chi2 - found.final_at[coordinate].chi2


def _share_left(found: SearchResult, coordinate: str) -> float:
    """Share of what effects and generic basis explain that is left to the basis; 0 if not evident.

    Evidence e is a drop of chi2 of 2 e or so.
    """
    lack = found.lack.at[coordinate] if coordinate else found.lack
    needed = found.generic_threshold_at[coordinate] if coordinate else found.generic_threshold
    if lack.log_evidence <= max(LEAST_THRESHOLD, needed):
        return 0.0
    left, gain = 2.0 * lack.log_evidence, max(_gain(found, coordinate), 0.0)
    if left < TRIFLE * _gain(found, EVERYWHERE):
        return 0.0
    return left / (gain + left)


def _imitated(found: SearchResult, one: SelectedTerm) -> _NoName | None:
    """Whether effects on the same coordinates stand only together.

    A prop, for which by itself nothing speaks, is never sure. What it props is not either, unless
    it explains nearly all by itself.
    """
    here = _loaded(found, one)
    beside = [other for other in found.standing if _loaded(found, other) & here]
    props = [other for other in beside if other.alone < ALONE * other.log_evidence]
    if not props or len(beside) < 2:  # two forms of one effect prop each other as well
        return None
    propped = sum(prop.gain for prop in props)
    is_prop = any(one is prop for prop in props)
    if not is_prop and propped <= UNEXPLAINED_SHARE * (one.gain + propped):
        return None
    different = sorted({other.name for other in beside})
    names = _listed(different, "and") if len(different) > 1 else f"forms of {different[0]}"
    alone = _listed(sorted({other.name for other in props}), "and")
    why = f"{names} imitate it together, but by itself nothing speaks for {alone}"
    return Reason.IMITATED_TOGETHER, why


def _other_shape(found: SearchResult, one: SelectedTerm, margin: float) -> _NoName | None:
    """Whether what the base lacks follows what no known effect follows.

    Beside the base alone, and to first order for all alike: where a load over what the neighbouring
    joints or the other coordinates do, a drift or a shift, has more evidence than one over the
    joint's own motion and than any effect of that coordinate, and nearly as much as all that stand
    there together, these imitate it. An effect of no coordinate must have more by itself.
    """
    variant = one.supposed.form.variant
    for coordinate in variant.coordinates(tuple(found.base_at)):
        shapes = found.base_lack.at[coordinate].by_family
        family = max(shapes, key=lambda name: shapes[name])
        if family == OWN:
            continue
        # log evidence of the best effect of the coordinate, and of all that stand on it
        forms = (form for effect in found.stages[0].screen.effects for form in effect.forms)
        of_it = (f.log_evidence for f in forms if coordinate in f.form.variant.acts_on)
        best = max(of_it, default=0.0)
        on_it = (other for other in found.standing if coordinate in _loaded(found, other))
        together = sum(other.log_evidence for other in on_it)
        rival = max(shapes.get(OWN, 0.0), best, 0.0 if variant.acts_on else one.log_evidence)
        if shapes[family] > max(rival + margin, NEARLY_ALL * together):
            shape = FAMILIES[family].format(coordinate=coordinate.replace("_", " "))
            why = f"{one.name} would imitate what no known effect is: {shape}"
            return Reason.NO_KNOWN_EFFECT, why
    return None


def _loaded(found: SearchResult, one: SelectedTerm) -> set[str]:
    """Coordinates that an effect loads, of those that were read."""
    return set(one.supposed.form.variant.coordinates(tuple(found.base_at)))


def _unproven(found: SearchResult, proof: HeldOut | None) -> _NoName | None:
    """What is named must predict better than the base what it has not seen."""
    if not found.standing or proof is None or proof.over_base is None:
        return None
    # whether tests that no fit has seen are together clearly worse with the effects
    rows = [row for row in proof.folds if row.kind == TEST]
    pairs = [(row.base, row.with_effects, row.expected) for row in rows]
    drops = sum(b.chi2 - e.chi2 for b, e, _ in pairs if b is not None and e is not None)
    excess = sum(b.chi2 - expected for b, _, expected in pairs if b is not None)
    worse = drops < -max(WORSE, WORSE_SHARE * max(excess, 0.0))
    if not proof.tells or (proof.beats_base and not worse):
        return None
    names = _listed(list(dict.fromkeys(one.name for one in found.standing)), "and")
    return (
        Reason.NOT_PROVEN,
        f"{names} would explain these readings, but predicts held-out ones no better than the base",
    )


def _left(found: SearchResult, doubts: Sequence[_NoName], proof: HeldOut | None) -> tuple[str, ...]:
    """Why what is sure is not all that is missing, a sentence each."""
    said = [why for _, why in doubts]
    for coordinate, gap in found.final_at.items():
        share = _share_left(found, coordinate)
        if share > UNEXPLAINED_SHARE:
            shape = found.lack.at[coordinate].shape
            said.append(f"a gap of {gap.gap:.1f} noise SD{_in(coordinate)} ({shape})")
    if proof is not None and proof.tells:
        said += [
            f"{row.kind} {row.name}, held out, is predicted worse than by the base"
            for row in proof.folds
            if row.worse
        ]
        if proof.closed is not None and proof.closed < CLOSED:
            said.append(
                f"held-out readings: only {100 * proof.closed:.0f} % of the excess misfit (chi "
                f"squared) goes, {100 * share_of_gap(proof.closed):.0f} % of the gap"
            )
    return tuple(dict.fromkeys(said))


def _close(
    one: SelectedTerm, found: SearchResult, margin: float, not_excluded: Mapping[str, Sequence[str]]
) -> tuple[str, ...]:
    """Rivals of an effect that are not clearly behind, or not excluded.

    What stands beside it on the same coordinates is no rival; what stands on others alone is one.
    """
    here = _loaded(found, one)
    beside = {
        other.name for other in found.standing if other is one or here & _loaded(found, other)
    }
    others = [rival for rival in one.rivals if rival.name not in beside]
    names = (*_near(others, margin), *not_excluded.get(one.name, ()))
    return tuple(dict.fromkeys(name for name in names if name not in beside))


def _near(rivals: Sequence[Rival], margin: float) -> list[str]:
    """Names that are less than the margin behind, one by one or all together (log of the odds).

    The odds of a name are against all others: several that are a little more than the margin behind
    are together less; then those are told that are as near as the nearest.
    """
    behind = np.array([rival.margin for rival in rivals])
    if not len(behind):
        return []
    together = -float(logsumexp(-behind))
    reach = margin if together >= margin else max(margin, behind.min() + AS_NEAR)
    return [rival.name for rival in rivals if rival.margin < reach]


def cannot_be_excluded(name: str, cases_by_specimen: Cases) -> tuple[str, ...]:
    """Other effects that these tests cannot tell from the named one, whatever was read in them.

    An effect that needs what the files do not have cannot be fitted, so the evidence never speaks
    for it, and not against it either. A loop of loading and unloading, or a zero that has moved on
    at the end of a test, is friction (hysteresis) or, had time passed, creep: only recorded times
    tell. Joints that differ in stiffness differ by level or, where all tests compress them alike,
    by how much each is compressed: only a second compression tells.

    Parameters
    ----------
    name : of an effect that would be named. cases_by_specimen : the tests as they were recorded.
    """
    every = list(chain.from_iterable(cases_by_specimen.values()))
    if name in ("hysteresis", "neutral_pose_drift"):
        several = [[step.time for step in case.steps] for case in every if len(case.steps) > 1]
        timed = bool(several) and all(
            None not in times and times[-1] > times[0]  # type: ignore[operator]
            for times in several
        )
        return () if timed else ("creep",)
    # N: of each test all listed forces of each step by their sizes (T,), and the one that stays
    sizes = [
        np.array([sum(float(np.linalg.norm(w.force)) for w in s.wrenches) for s in case.steps])
        for case in every
    ]
    stay = [float(of_test.min()) for of_test in sizes]
    smallest, largest = min(stay, default=0.0), max(stay, default=0.0)
    if name == "level_dependence":
        alike = largest > 0.0 and largest - smallest <= SAME * largest
        return ("preload_stiffening",) if alike else ()
    if name == "preload_stiffening":
        differ = largest - smallest > SAME * largest
        change = any(one.max() - one.min() > SAME * one.max() for one in sizes)
        return () if differ or change else ("level_dependence",)
    return ()


def _listed(names: Sequence[str], word: str) -> str:
    return f" {word} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)

"""The verdict of a search, read off its probabilities: named, a part, a set, nothing, unknown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from types import MappingProxyType

import numpy as np

from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.gaps import whole_gap
from spinepipe.studies.discrepancy.search.search_state import (
    SearchResult,
    SelectedTerm,
)
from spinepipe.studies.discrepancy.search.something_else import TABLE
from spinepipe.studies.discrepancy.verdict import (
    EVEN,
    NOT_LISTED,
    NOTHING,
    SOMETHING_ELSE,
    SURE,
    SuspectedError,
    VerdictKind,
    likeliest_beside,
)
from spinepipe.studies.discrepancy.verdict_unnamed import Reason

MOST = 0.8
"""Share of what is explained that names must explain by themselves."""

HARDLY = 0.02
"""Probability below which a name is in no set."""

MUCH = 3.0
"""Noise SDs that may stay in a model of the right shape."""

SAME = 0.05
"""Share of the largest listed force by which tests that compress alike may differ."""


@dataclass(frozen=True)
class Outcome:
    """A verdict, and why in one sentence.

    Attributes
    ----------
    named : effects that are sure. tied : names that cannot be told apart here.
    reason : why nothing is named though something is missing; None elsewhere.
    stays : noise SD (RMS) that stay whatever is added, where that is why; else None.
    left : why what is named is not all, a sentence each.
    """

    verdict: VerdictKind
    why: str
    named: tuple[SelectedTerm, ...] = ()
    tied: tuple[str, ...] = ()
    reason: Reason | None = None
    left: tuple[str, ...] = ()
    stays: float | None = None


Cases = Mapping[str, Sequence[LoadCase]]
"""Load histories by specimen."""


def outcome(
    found: SearchResult,
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
    p = found.probabilities
    if errors:  # data errors are not physics: nothing is named before they are looked at
        places = "; ".join(f"{one.what} ({one.where})" for one in errors[:3])
        why = f"the data look wrong, so nothing is named: {places}"
        return Outcome(VerdictKind.UNKNOWN, why, reason=Reason.DATA_ERRORS)
    if p[NOTHING] > 1.0 - SURE:
        why = f"nothing is sure to be missing: with probability {p[NOTHING]:.2f} nothing is"
        return Outcome(VerdictKind.NULL, why)
    # what rests on looks alone may yet hold a rival
    done = found.unfitted < EVEN
    sure = [one for one in found.standing if done and p[one.name] >= SURE]
    other = p[SOMETHING_ELSE] >= EVEN
    shape = f"something else, with probability {p[SOMETHING_ELSE]:.2f} ({found.lack.shape})"
    if (rms := left_of(found)) > MUCH:
        why = f"the model's shape is wrong here: {rms:.1f} noise SD stay whatever is added"
        return Outcome(VerdictKind.UNKNOWN, why, reason=Reason.MOST_STAYS, stays=rms)
    names = {one.name for one in sure}
    further = _further(found, names)
    if other or not (sure or further):
        # beside something else on the same coordinates a name may only mend what that gets wrong,
        # unless it explains most by itself: then it is its formula that is not nature's
        elsewhere, most = _places_of_else(found), _explain_most(found)
        names_apart = {
            one.name
            for one in sure
            if (acts_on := set(one.supposed.form.variant.acts_on))
            and (most or not acts_on <= elsewhere)
        }
        apart = [one for one in sure if one.name in names_apart]
        if not apart:
            reason = Reason.A_PART_STAYS if sure else Reason.NO_KNOWN_EFFECT
            beside = (
                f"; {_listed([o.name for o in sure], 'and')} would explain a part" if sure else ""
            )
            return Outcome(VerdictKind.UNKNOWN, f"{shape}{beside}", reason=reason)
        why = f"{_probably(apart, p)}; but more stays: {shape}"
        return Outcome(VerdictKind.PART, why, tuple(apart), left=(shape,))
    open_ones = {name for one in sure for name in not_excluded.get(one.name, ())} - names
    tied = further
    if open_ones:
        doubted = [one for one in sure if not_excluded.get(one.name)]
        tied = [*(one.name for one in doubted), *sorted(open_ones), *tied]
        sure = [one for one in sure if one not in doubted]
    tied = list(dict.fromkeys(tied))
    if tied:
        why = f"something is missing, but these tests cannot tell which: {_listed(tied, 'or')}"
        if len(tied) == 1:  # what holds the rest is no name of a set
            rest, q = likeliest_beside(p, {*names, *tied})
            rest = NOT_LISTED if rest == SOMETHING_ELSE else rest
            why = f"{tied[0]} or {rest} ({p[tied[0]]:.2f}; {q:.2f})"
        if not done:
            why += f"; what was not fitted holds {found.unfitted:.2f} of the probability"
        return Outcome(VerdictKind.SET, why, tuple(sure), tuple(tied))
    unproven = _unproven(found, proof)
    if unproven:
        return Outcome(VerdictKind.UNKNOWN, unproven, reason=Reason.NOT_PROVEN)
    return Outcome(VerdictKind.NAMED, _probably(sure, p), tuple(sure))


def _explain_most(found: SearchResult) -> bool:
    """Whether names explain most of what they do together with something else."""
    if found.with_tables is None:
        return False
    base = found.base.fit.chi2
    return base - found.final.fit.chi2 > MOST * (base - found.with_tables.fit.chi2)


def left_of(found: SearchResult) -> float:
    """Noise SDs (rms of all readings) that stay beside all that is probable, tables included."""
    likely = found.probabilities[SOMETHING_ELSE] >= EVEN
    at = found.with_tables if likely else None
    gap = found.final_gap if at is None else whole_gap(at, at.fit)
    return float(np.sqrt(gap.chi2 / max(gap.readings, 1)))


def _probably(sure: Sequence[SelectedTerm], p: Mapping[str, float]) -> str:
    """Names with their probabilities."""
    return _listed([f"{n} ({p[n]:.2f})" for n in dict.fromkeys(o.name for o in sure)], "and")


def _places_of_else(found: SearchResult) -> set[str]:
    """Coordinates that something else loads: those of its tables, or of the first-order look."""
    if found.with_tables is None:
        return {found.lack.coordinate}
    supposed = found.with_tables.fit.hypothesis.supposed
    tables = [one.form.variant for one in supposed if one.form.name == TABLE]
    return {name for table in tables for name in table.acts_on}


def _further(found: SearchResult, sure: set[str]) -> list[str]:
    """Names that hold what probability is left, likeliest first, until they hold most of it."""
    further: dict[frozenset[str], float] = {}
    for names, _, probability in found.sets:
        rest = names - sure
        further[rest] = further.get(rest, 0.0) + probability
    none = further.pop(frozenset(), 0.0)
    whole = sum(further.values())
    if none >= EVEN or not whole:
        return []
    told, held = list[str](), 0.0
    for names, probability in sorted(further.items(), key=lambda one: (-one[1], sorted(one[0]))):
        if held >= SURE * whole or (told and probability < HARDLY):
            break
        told += [name for name in sorted(names) if name not in told]
        held += probability
    return told


def _unproven(found: SearchResult, proof: HeldOut | None) -> str | None:
    """What is named must predict better than the base what it has not seen."""
    if proof is None or proof.over_base is None or not proof.tells or proof.beats_base:
        return None
    names = _listed(list(dict.fromkeys(one.name for one in found.standing)), "and")
    return (
        f"{names} would explain these readings, but predicts held-out ones no better than the base"
    )


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

"""Errors against X-rays in stance, by approach, and the order that they are in: W3, W8, W9."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Run, exactly
from spinepipe.studies.tracking.settings import CONSTRAINED
from spinepipe.studies.tracking.wang_2021.found import (
    LEARNT,
    SETS,
    STANCE,
    numbers,
    of_kind,
    over_persons,
)
from spinepipe.studies.tracking.wang_2021.paper import (
    YES_NO,
    Value,
    contradicted,
    not_comparable,
    recomputed,
    yes_no,
)

CENTRE, ANGLE = "centre_mm", "angle_deg"
UNIT = {CENTRE: "mm", ANGLE: "deg"}
WORDS = {CENTRE: "vertebral centres", ANGLE: "sagittal angles"}
SHORT = {CENTRE: "cog", ANGLE: "angle"}


@dataclass(frozen=True)
class Printed:
    """Mean errors of an approach in stance, mm and deg.

    Attributes
    ----------
    ours : approaches that stand for it. least : whether the best of them does, else the worst.
    """

    name: str
    words: str
    centre: float
    angle: float
    ours: tuple[str, ...]
    least: bool = True

    def error(self, measure: str) -> float:
        """The printed error."""
        return self.centre if measure == CENTRE else self.angle


IK = Printed("IK", "inverse kinematics", 15.2, 4.04, ("ik",))
CONS = Printed("IK_cons", "inverse kinematics with ratios", 24.3, 6.08, SETS)
ZERO = Printed("OptK_PE_0", "dynamics without passive elements", 15.4, 5.68, ("optk_zero",))
GENERIC = Printed("OptK_PE_generic", "dynamics, generic", 12.1, 3.50, ("optk_generic",))
BOTH = Printed("OptK_PE_FE_plus_LB", "dynamics, from both", 8.5, 3.29, ("optk_from_both",))
LOWEST = Printed("OptK_PE_calibrated_lowest", "the best calibrated", 8.5, 3.29, LEARNT)
HIGHEST = Printed("OptK_PE_calibrated_highest", "the worst calibrated", 10.1, 3.38, LEARNT, False)

PRINTED = (IK, CONS, ZERO, GENERIC, BOTH, LOWEST, HIGHEST)
ORDER = (BOTH, HIGHEST, GENERIC, IK, ZERO, CONS)
"""From the smallest error to the largest, centres and angles alike."""

CHECK = {CENTRE: "W8", ANGLE: "W9"}
_ITS_SETS = "those of Christophy 2012, Bruno 2015 and Shojaei 2017, and it does not say whose error"


def claims_of_errors() -> Iterator[Claim]:
    """Errors as printed, then their order."""
    for printed in PRINTED:
        for measure in (CENTRE, ANGLE):
            yield not_comparable(
                f"accuracy.{printed.name}.{SHORT[measure]}",
                "Results",
                f"mean error of {WORDS[measure]} in stance, {printed.words}",
                UNIT[measure],
                printed.error(measure),
                _ours(printed, measure),
            )
    for measure in (CENTRE, ANGLE):
        yield _range(measure)
        yield _as_printed(measure)
        for better, worse in pairwise(ORDER):
            yield _order(measure, better, worse)
    yield from _without_passive_elements()


def error_of(run: Run, printed: Printed, measure: str) -> tuple[float, str]:
    """Our error of what stands for an approach, and whose it is.

    Means over persons and stances; the best or the worst where several stand for it. Where the run
    has none of the paper's sets of ratios, others stand for them.
    """
    rows = of_kind(run, "accuracy", STANCE, measure=measure)
    there = {
        str(name): float(numbers(own, "mean").mean())
        for name, own in rows.groupby("approach", observed=True)
    }
    named = [name for name in there if name in printed.ours]
    if printed is CONS and not named:
        named = [name for name in there if name.startswith(CONSTRAINED)]
    if not named:
        raise NotComputed(f"this run has no {printed.words} in stance with a truth")
    chosen = (min if printed.least else max)(named, key=lambda name: there[name])
    return there[chosen], chosen


def note_of_ratios(name: str) -> str:
    """How a set of ratios stands to the paper's; nothing of an approach without."""
    if not name.startswith(CONSTRAINED):
        return ""
    ratios = name.removeprefix(CONSTRAINED)
    which = "one of" if name in SETS else "another than"
    return f"the ratios {ratios} are {which} the paper's three, {_ITS_SETS} it prints"


def _ours(printed: Printed, measure: str) -> Value:
    def ours(run: Run) -> Ours:
        value, name = error_of(run, printed, measure)
        return Ours(value, note="; ".join(part for part in (name, note_of_ratios(name)) if part))

    return ours


def _range(measure: str) -> Claim:
    """How far apart the calibrated approaches are."""

    def ours(run: Run) -> Ours:
        low, high = (error_of(run, one, measure)[0] for one in (LOWEST, HIGHEST))
        return Ours(high - low)

    return not_comparable(
        f"results.error_range_calibrated_{SHORT[measure]}",
        "Results",
        f"error of {WORDS[measure]}, the worst calibrated less the best",
        UNIT[measure],
        round(HIGHEST.error(measure) - LOWEST.error(measure), 2),
        ours,
    )


def _as_printed(measure: str) -> Claim:
    values = [printed.error(measure) for printed in ORDER]
    in_order = all(one < other for one, other in pairwise(values))
    return recomputed(
        f"closed_form.{CHECK[measure]}",
        "Results",
        f"errors of {WORDS[measure]} grow from both motions over generic to fixed ratios",
        YES_NO,
        1.0,
        exactly(1.0),
        float(in_order),
        f"{CHECK[measure]}: {', '.join(f'{value:g}' for value in values)} {UNIT[measure]}",
    )


def _order(measure: str, better: Printed, worse: Printed) -> Claim:
    check = CHECK[measure]
    return yes_no(
        f"order.{check}.{better.name}.{worse.name}",
        "Results",
        f"error of {WORDS[measure]} in stance: {better.words} smaller than {worse.words}",
        _smaller(measure, better, worse),
        f"{check}: {better.error(measure):g} and {worse.error(measure):g} {UNIT[measure]}",
    )


def _smaller(measure: str, better: Printed, worse: Printed) -> Callable[[Run], tuple[bool, str]]:
    def found(run: Run) -> tuple[bool, str]:
        one, other = (error_of(run, printed, measure) for printed in (better, worse))
        unit = UNIT[measure]
        told = f"ours: {one[0]:.3g} {unit} ({one[1]}) and {other[0]:.3g} {unit} ({other[1]})"
        notes = (told, *(note_of_ratios(name) for name in (one[1], other[1])))
        told = "; ".join(note for note in notes if note)
        return one[0] < other[0], _by_person(run, measure, (one[1], other[1]), told)

    return found


def _by_person(run: Run, measure: str, approaches: tuple[str, str], told: str) -> str:
    """By how much the errors of two approaches differ within persons."""
    one, other = approaches
    if one == other:
        raise NotComputed(f"the same approach stands for both; {told}")
    first, second = (_errors(run, measure, name) for name in approaches)
    return over_persons((first - second).dropna(), told, UNIT[measure])


def _errors(run: Run, measure: str, approach: str) -> "pd.Series[float]":
    """Mean error of each person in stance, over stances and levels."""
    rows = of_kind(run, "errors", STANCE, measure=measure, approach=approach)
    means: pd.Series[float] = rows.groupby("specimen", observed=True)["mean"].mean()
    return means


def _without_passive_elements() -> Iterator[Claim]:
    """W3: dynamics alone are no better than none."""
    for measure in (CENTRE, ANGLE):
        ours, other = ZERO.error(measure), IK.error(measure)
        yield contradicted(
            f"closed_form.W3.{SHORT[measure]}",
            "Abstract, Results",
            f"dynamics are better than inverse kinematics in {WORDS[measure]}, whatever passive "
            "elements",
            YES_NO,
            1.0,
            float(ours < other),
            f"W3: without passive elements {ours:g} and {other:g} {UNIT[measure]}",
        )
        yield yes_no(
            f"order.W3.{SHORT[measure]}",
            "Results",
            f"error of {WORDS[measure]} in stance: dynamics without passive elements no smaller "
            "than inverse kinematics",
            _smaller(measure, IK, ZERO),
            f"W3: {ours:g} and {other:g} {UNIT[measure]}",
        )

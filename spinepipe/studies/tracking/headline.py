"""The answer for a clinician: which approach is nearest the truth, and whether stiffness is told.

It hangs on vertebral centres in motion, or in stance where nothing else has a truth.
"""

from collections.abc import Iterator, Sequence

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.report.words import capital, count, listed
from spinepipe.status import Status
from spinepipe.studies.tracking.findings import vibrating_approaches
from spinepipe.studies.tracking.findings_of_errors import (
    CALIBRATED,
    FEWEST,
    GENERIC,
    IK,
    SAID,
    ApproachRanking,
    all_worse,
    between,
    compared,
    standings,
    too_few,
)
from spinepipe.studies.tracking.findings_of_stiffness import closed, profiled
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import MARKER_OFF, MEASURES
from spinepipe.studies.tracking.words import sized, told

NO_MOTION = "No motion can be told: no approach found a posture of anybody."
NO_TRUTH = (
    "Which approach is right cannot be told: where vertebrae truly were is not known of any motion."
)


def headline(study: Tracking, cohort: Cohort, results: ResultTables) -> Headline:
    """The answer, how sure it is, and what casts doubt on it."""
    doubts = tuple(_doubts(study, cohort, results))
    fits = results.table("fits")
    if fits.empty or not (fits["frames"] > 0).any():
        return Headline(NO_MOTION, "", doubts)
    found = standings(cohort, results, SAID[0])
    words = [_answer(found[0]) if found else NO_TRUTH, _stiffness(results)]
    sure = [_spread(fits)]
    if found:
        sure = [_sure(found[0]), _dynamics(found[0]), _angles(cohort, results, found[0])]
    return Headline(_whole(words), _whole(sure), doubts)


def _whole(parts: Sequence[str]) -> str:
    return " ".join(part for part in parts if part)


def _answer(one: ApproachRanking) -> str:
    best = one.approaches[0]
    off = f"{one.sized(best)}{between(one, best)}"
    where = f"{MEASURES[one.measure][1]} {one.words}"
    if len(one.approaches) < 2:
        return f"By {told(best)} {where} are off by {off}; no other approach was asked."
    alike = one.alike
    if one.n < FEWEST:
        return (
            f"Of {count(len(one.approaches), 'approach', 'approaches')} {told(best)} happens to "
            f"have the least error of {where}, {off}; {count(one.n, 'person')} cannot show that "
            "it is better."
        )
    if not alike:
        return f"Nearest the truth is {told(best)}: {where} are off by {off}."
    others = len(one.approaches) - 1
    which = (
        f"{len(alike)} of {count(others, 'other')} cannot"
        if len(alike) < others
        else "no other can"
    )
    return (
        f"No approach is shown to be the best: {told(best)} has the least error of {where}, {off}, "
        f"but {which} be told from it."
    )


def _stiffness(results: ResultTables) -> str:
    """What profiles say, of whom they were made."""
    sure, asked = closed(results)
    if not asked:
        return ""
    whose = f"the spine of {listed(profiled(results))}"
    if sure == 0:
        return f"Markers do not tell how stiff {whose} is."
    if sure == asked:
        return f"Markers tell the stiffness of {whose} in all regions that were asked."
    return f"Markers tell the stiffness of {whose} in {sure} of {count(asked, 'profile')}."


def _sure(one: ApproachRanking) -> str:
    """What a difference between approaches was held against."""
    if one.n < FEWEST:
        return too_few(one.n)
    if len(one.approaches) < 2:
        return ""
    compared = len(one.approaches) - 1
    return (
        f"Approaches were held against each other within {one.n} persons, by paired differences "
        f"corrected for {count(compared, 'comparison')}."
    )


def _spread(fits: pd.DataFrame) -> str:
    """Without a truth: how closely markers are met, which is no proof."""
    off = fits.groupby("approach", observed=True)["marker_rmse_mm"].mean().dropna()
    if off.empty:
        return ""
    names = dict.fromkeys((str(off.idxmin()), str(off.idxmax())))
    ends = [f"{sized(float(off[name]), SAID[0])} ({told(name)})" for name in names]
    return (
        f"Markers are met to {listed(ends, last='to')}, root mean square; how closely does not "
        "show which posture is right."
    )


def _dynamics(one: ApproachRanking) -> str:
    """Dynamics with generic passive elements beside inverse kinematics."""
    if not {GENERIC, IK} <= set(one.approaches):
        return ""
    return f"{capital(told(GENERIC))} beside {told(IK)}: {compared(one, GENERIC, IK)}."


def _angles(cohort: Cohort, results: ResultTables, found: ApproachRanking) -> str:
    """The least error of the other measure over the same motions."""
    same = [one for one in standings(cohort, results, SAID[1]) if one.words == found.words]
    if not same:
        return ""
    one = same[0]
    best = one.approaches[0]
    return (
        f"Of {MEASURES[one.measure][1]} the least error has {told(best)}, "
        f"{one.sized(best)}{between(one, best)}."
    )


def _doubts(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What should be looked at before the answer is believed."""
    fits = results.table("fits")
    if fits.empty:
        return
    lost = fits[~fits["status"].isin([Status.CONVERGED.value, MARKER_OFF])]
    if len(lost):
        names = listed(dict.fromkeys(told(str(name)) for name in lost["approach"]), 3)
        yield (
            f"Look at this first: {len(lost)} of {count(len(fits), 'fit')} did not settle "
            f"({names})."
        )
    off = fits[fits["status"] == MARKER_OFF]
    if len(off):
        yield (
            f"{len(off)} of {count(len(fits), 'fit')} leave a marker further off than the study "
            "allows."
        )
    wild = vibrating_approaches(study, fits)
    if wild:
        yield f"These vibrate from frame to frame: {listed(map(told, wild))}."
    yield from _worse(cohort, results)


def _worse(cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Measures whose mean error is larger with every calibration than without."""
    parts, where = [], ""
    for measure in SAID:
        for one in standings(cohort, results, measure)[:1]:
            there = [name for name in CALIBRATED if name in one.approaches]
            if there and GENERIC in one.approaches and all_worse(one, there):
                sure = [n for n in there if one.paired(n, GENERIC).verdict == "larger"]
                held = f"{len(sure)} of {len(there)} beyond chance" if sure else "not beyond chance"
                held = "too few to tell whether by chance" if one.n < FEWEST else held
                parts.append(f"{MEASURES[measure][1]} {one.words} ({held})")
                where = count(one.n, "person")
    if parts:
        yield (
            "Calibrating passive elements makes errors larger on average, over "
            f"{where}: {listed(parts)}."
        )

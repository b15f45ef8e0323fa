"""The report of a study of tracked motions: its answer, figures, the spine in 3-D, and tables.

The answer for a clinician is which approach is nearest the truth, and whether stiffness is told. It
hangs on vertebral centres in motion, or in stance where nothing else has a truth.
"""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.page.document import Document, Headline, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables
from spinepipe.report.words import capital, count, listed
from spinepipe.status import Status
from spinepipe.studies.tracking.findings import findings, vibrating_approaches
from spinepipe.studies.tracking.findings_of_errors import (
    CALIBRATED,
    FEWEST,
    GENERIC,
    IK,
    SAID,
    ApproachRanking,
    all_worse,
    comparison_text,
    interval_text,
    rankings,
    too_few,
)
from spinepipe.studies.tracking.findings_of_stiffness import closed_profiles, persons_with_profiles
from spinepipe.studies.tracking.in_space import spine_in_space
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import (
    ACCURACY,
    AGAINST_WANG_2021,
    CLUSTERS,
    DRAWN,
    ERRORS,
    FITS,
    MARKER_OFF,
    MEASURES,
    PROFILE_POINTS,
    PROFILES,
    RANGES,
    REMARKS,
    SHARING,
    SIMILARITY,
    SIZES,
    STIFFNESS,
    WEIGHTS,
)
from spinepipe.studies.tracking.words import error_text, phrase

QUESTION = (
    "How do the vertebrae of a moving person turn under the skin, as markers on it tell: which "
    "approach is nearest the truth, how do lumbar joints share a motion, and do markers tell how "
    "stiff a spine is?"
)

_TITLES = {
    ACCURACY: "Errors over all persons",
    FITS: "How every fit ended",
    PROFILES: "Whether markers tell stiffness",
    AGAINST_WANG_2021: "Beside Wang et al. 2021",
    SHARING: "How lumbar joints share a motion",
    SIMILARITY: "How alike persons share a motion",
    WEIGHTS: "What the weight of loads does",
    STIFFNESS: "Stiffness of every joint",
    PROFILE_POINTS: "What each ratio costs",
    REMARKS: "What to know of recordings",
    CLUSTERS: "How rigid clusters of markers are",
    SIZES: "How large persons are",
    RANGES: "How far every joint moves",
    ERRORS: "Errors of every person",
}
"""Tables of the page in their order, with their titles."""

READ = (*(table.name for table in _TITLES), DRAWN.name)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_SORTED = {
    ACCURACY: (["measure", "trial", "mean"], True),
    FITS: (["status"], False),
    SHARING: (["trial", "approach", "window", "specimen"], True),
    CLUSTERS: (["variability_mm"], False),
}
"""By what rows of a table are sorted, and whether from the least; the others stay as they are.

Fits that did not settle stand first that way, as `converged` is the first of all words.
"""

NO_MOTION = "No motion can be told: no approach found a posture of anybody."
NO_TRUTH = (
    "Which approach is right cannot be told: where vertebrae truly were is not known of any motion."
)


def document(study: Tracking, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    found = headline(study, cohort, results)
    return Document(
        question=QUESTION,
        findings=findings(study, cohort, results),
        pictures=list(results.pictures.values()),
        tables=shown_tables(results),
        metadata=results.metadata,
        left_out=left_out(results),
        headline=Headline(_unbroken(found.words), _unbroken(found.how_sure), found.warnings),
        space=spine_in_space(results.table(DRAWN.name)),
    )


def _unbroken(words: str) -> str:
    """No line ends between a number and its percent sign."""
    return words.replace(" %", "\u00a0%")


def shown_tables(results: ResultTables) -> list[Sortable]:
    """Tables that the study has; those without rows are left out."""
    found: list[Sortable] = []
    for shape, title in _TITLES.items():
        rows = results.table(shape.name)
        if shape in _SORTED and len(rows):
            columns, rising = _SORTED[shape]
            rows = rows.sort_values(columns, ascending=rising, kind="stable")
        found += page_tables(shape, title, rows)
    return found


def left_out(results: ResultTables) -> tuple[str, ...]:
    """What there is nothing of, each with the reason."""
    parts = []
    if results.table("errors").empty:
        parts.append("errors (where vertebrae truly were is not known)")
    if results.table("stiffness").empty:
        parts.append("calibrated stiffness (no approach asks for it)")
    return (*parts, *papers.left_out("Wang et al. 2021"))


def headline(study: Tracking, cohort: Cohort, results: ResultTables) -> Headline:
    """The answer, how sure it is, and what casts doubt on it."""
    doubts = tuple(_doubts(study, cohort, results))
    fits = results.table("fits")
    if fits.empty or not (fits["frames"] > 0).any():
        return Headline(NO_MOTION, "", doubts)
    found = rankings(cohort, results, SAID[0])
    words = [_answer(found[0]) if found else NO_TRUTH, _stiffness(results)]
    sure = [_spread(fits)]
    if found:
        sure = list(_certainty(cohort, results, found[0]))
    return Headline(" ".join(filter(None, words)), " ".join(filter(None, sure)), doubts)


def _answer(one: ApproachRanking) -> str:
    best = one.approaches[0]
    off = f"{one.error_text(best)}{interval_text(one, best)}"
    where = f"{MEASURES[one.measure][1]} {one.words}"
    if len(one.approaches) < 2:
        return f"By {phrase(best)} {where} are off by {off}; no other approach was asked."
    ties = one.ties
    if one.n < FEWEST:
        return (
            f"Of {count(len(one.approaches), 'approach', 'approaches')} {phrase(best)} happens to "
            f"have the least error of {where}, {off}; {count(one.n, 'person')} cannot show that "
            "it is better."
        )
    if not ties:
        return f"Nearest the truth is {phrase(best)}: {where} are off by {off}."
    others = len(one.approaches) - 1
    which = (
        f"{len(ties)} of {count(others, 'other')} cannot" if len(ties) < others else "no other can"
    )
    return (
        f"No approach is shown to be the best: {phrase(best)} has the least error of {where}, "
        f"{off}, but {which} be told from it."
    )


def _stiffness(results: ResultTables) -> str:
    """What profiles say, of whom they were made."""
    sure, asked = closed_profiles(results)
    if not asked:
        return ""
    whose = f"the spine of {listed(persons_with_profiles(results))}"
    if sure == 0:
        return f"Markers do not tell how stiff {whose} is."
    if sure == asked:
        return f"Markers tell the stiffness of {whose} in all regions that were asked."
    return f"Markers tell the stiffness of {whose} in {sure} of {count(asked, 'profile')}."


def _certainty(cohort: Cohort, results: ResultTables, one: ApproachRanking) -> Iterator[str]:
    """What a difference between approaches was held against, and what else was compared."""
    if one.n < FEWEST:
        yield too_few(one.n)
    elif len(one.approaches) > 1:
        yield (
            f"Approaches were held against each other within {one.n} persons, by paired "
            f"differences corrected for {count(len(one.approaches) - 1, 'comparison')}."
        )
    # dynamics with generic passive elements beside inverse kinematics
    if {GENERIC, IK} <= set(one.approaches):
        both = f"{capital(phrase(GENERIC))} beside {phrase(IK)}"
        yield f"{both}: {comparison_text(one, GENERIC, IK)}."
    # the least error of the other measure over the same motions
    same = [other for other in rankings(cohort, results, SAID[1]) if other.words == one.words]
    for other in same[:1]:
        best = other.approaches[0]
        yield (
            f"Of {MEASURES[other.measure][1]} the least error has {phrase(best)}, "
            f"{other.error_text(best)}{interval_text(other, best)}."
        )


def _spread(fits: pd.DataFrame) -> str:
    """Without a truth: how closely markers are met, which is no proof."""
    off = fits.groupby("approach", observed=True)["marker_rmse_mm"].mean().dropna()
    if off.empty:
        return ""
    names = dict.fromkeys((str(off.idxmin()), str(off.idxmax())))
    ends = [f"{error_text(float(off[name]), SAID[0])} ({phrase(name)})" for name in names]
    return (
        f"Markers are met to {listed(ends, last='to')}, root mean square; how closely does not "
        "show which posture is right."
    )


def _doubts(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What should be looked at before the answer is believed."""
    fits = results.table("fits")
    if fits.empty:
        return
    lost = fits[~fits["status"].isin([Status.CONVERGED.value, MARKER_OFF])]
    if len(lost):
        names = listed(dict.fromkeys(phrase(str(name)) for name in lost["approach"]), 3)
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
        yield f"These vibrate from frame to frame: {listed(map(phrase, wild))}."
    # measures whose mean error is larger with every calibration than without
    parts, where = [], ""
    for measure in SAID:
        for one in rankings(cohort, results, measure)[:1]:
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

"""Key findings of a study of tracked motions as sentences, what is not to be trusted first."""

from collections.abc import Callable, Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import ResultTables, judged
from spinepipe.report.words import capital, count, listed, number, percent, plain, tick
from spinepipe.status import Status
from spinepipe.studies.tracking.findings_of_errors import (
    beside_kinematics,
    calibrated,
    close_to_markers,
    nearest,
)
from spinepipe.studies.tracking.findings_of_sharing import likeness, shares
from spinepipe.studies.tracking.findings_of_stiffness import calibrations, profiles, weights
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import MARKER_OFF
from spinepipe.studies.tracking.words import in_order, told

_MOST_PLACES = 4
VIBRATES = "acceleration_rms_deg_per_s2"

Finding = Callable[[Tracking, Cohort, ResultTables], Iterator[str]]


def findings(study: Tracking, cohort: Cohort, results: ResultTables) -> list[str]:
    """The sentences, without those that the study has no table for."""
    found = [sentence for make in MAKERS for sentence in make(study, cohort, results)]
    return [sentence.replace(" %", "\u00a0%") for sentence in found]


def ended(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Fits that did not settle."""
    fits = results.table("fits")
    if fits.empty:
        return
    lost = fits[~fits["status"].isin([Status.CONVERGED.value, MARKER_OFF])]
    if lost.empty:
        yield f"All {count(len(fits), 'fit')} settled."
        return
    messages = dict.fromkeys(str(m) for m in lost["message"].fillna("") if m)
    why = f" One message: {next(iter(messages))}." if messages else ""
    kept = int((lost["frames"] > 0).sum())
    used = f" {kept} of them left a posture, which is in tables and figures all the same."
    yield (
        f"{len(lost)} of {count(len(fits), 'fit')} did not settle: {places(lost)}.{why}"
        f"{used if kept else ' None of them left a posture.'}"
    )


def places(rows: pd.DataFrame) -> str:
    """Fits by person, trial and approach, the first of many."""
    names = [
        f"{plain(str(row['trial']))} of {row['specimen']} by {told(str(row['approach']))}"
        for row in rows.to_dict("records")
    ]
    return listed(names, _MOST_PLACES)


def markers_off(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Markers that a fit leaves too far off, and the farthest of all."""
    fits = results.table("fits")
    known = fits.dropna(subset=["largest_deviation_mm"]) if len(fits) else fits
    if known.empty:
        return
    allowed = tick(study.largest_deviation_mm)
    off = known[known["largest_deviation_mm"] > study.largest_deviation_mm]
    worst = known.iloc[int(known["largest_deviation_mm"].to_numpy(float).argmax())]
    far = number(float(worst["largest_deviation_mm"]))
    where = places(worst.to_frame().T)
    if off.empty:
        yield (
            f"No fit leaves a marker further off than the {allowed} mm that the study allows; the "
            f"farthest is {far} mm off ({where})."
        )
        return
    yield (
        f"{len(off)} of {count(len(known), 'fit')} leave a marker further off than the {allowed} "
        f"mm that the study allows ({places(off)}); the farthest is {far} mm off ({where})."
    )


def vibrating(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Approaches whose motions vibrate: joints accelerate more than the study calls one."""
    fits = results.table("fits")
    known = fits.dropna(subset=[VIBRATES]) if len(fits) else fits
    if known.empty:
        return
    limit = study.scales.turn_deg_per_s2
    wild = vibrating_approaches(study, fits)
    calm = known[~known["approach"].isin(list(wild))]
    above = f"{tick(limit)} deg/s² (root mean square of all joints)"
    if not wild:
        most = number(float(known[VIBRATES].max()))
        yield f"No motion vibrates: joints accelerate by {most} deg/s² at most, below {above}."
        return
    parts = []
    for name in in_order(wild):
        own = known[known["approach"] == name]
        size = number(float(own[VIBRATES].median()))
        parts.append(f"{told(name)} ({wild[name]} of {count(len(own), 'motion')}, median {size})")
    rest = ""
    if len(calm):
        rest = f" All others stay below {number(float(calm[VIBRATES].max()))} deg/s²."
    yield (
        f"Motions vibrate from frame to frame, with accelerations above {above}: "
        f"{listed(parts)}.{rest} Velocities and loads must not be taken from what vibrates."
    )


def vibrating_approaches(study: Tracking, fits: pd.DataFrame) -> dict[str, int]:
    """Approaches with motions that vibrate, and how many."""
    if fits.empty:
        return {}
    wild = fits[fits[VIBRATES].astype(float) > study.scales.turn_deg_per_s2]
    counts = wild.groupby("approach", observed=True).size()
    return {str(name): int(n) for name, n in counts.items()}


def rigid(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Clusters of markers that are not rigid, as markers on a plate have to be."""
    rows = results.table("clusters")
    if rows.empty:
        return
    known = rows[rows["status"] != "too_few"]
    few = len(rows) - len(known)
    unseen = f" {count(few, 'cluster is', 'clusters are')} seen in too few frames." if few else ""
    if known.empty:
        yield f"Whether clusters are rigid is not known.{unseen}"
        return
    loose = known[known["status"] == "not_rigid"]
    worst = known.iloc[int(known["variability_mm"].to_numpy(float).argmax())]
    most = (
        f"{number(float(worst['variability_mm']), 2)} mm ({worst['cluster']} of "
        f"{worst['specimen']}, {plain(str(worst['trial']))})"
    )
    if loose.empty:
        yield (
            f"All {count(len(known), 'cluster')} of markers are rigid: distances inside them vary "
            f"by {most} at most (SD).{unseen}"
        )
        return
    named = [f"{row['cluster']} of {row['specimen']}" for row in loose.to_dict("records")]
    yield (
        f"{len(loose)} of {count(len(known), 'cluster')} of markers "
        f"({percent(len(loose), len(known))}) are not rigid: "
        f"{listed(dict.fromkeys(named), _MOST_PLACES)}; the most, {most} (SD). Markers of such a "
        f"cluster moved on the skin or were mixed up.{unseen}"
    )


def sizes(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How large persons are beside the cohort's skeleton, and whether that is used."""
    rows = results.table("sizes")
    if rows.empty:
        return
    persons = rows["specimen"].nunique()
    known = rows.dropna(subset=["factor"])
    used = "with these sizes" if study.scaling == "markers" else "with the skeleton as it is"
    if known.empty:
        yield f"Markers do not tell the size of any of {count(persons, 'person')}."
        return
    n = known["specimen"].nunique()
    ends = [number(float(known["factor"].agg(end)), 3) for end in ("min", "max")]
    left = number(float(known["rms_mm"].max()), 2)
    yield (
        f"Markers of the static trial make {n} of {count(persons, 'person')} {ends[0]} to {ends[1]}"
        f" times as large as the cohort's skeleton, which leaves distances between markers {left} "
        f"mm off (root mean square, at most); motions were tracked {used}."
    )


def remarks(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How much there is to know of the input."""
    rows = results.table("remarks")
    if len(rows):
        persons = rows["specimen"].nunique()
        yield (
            f"{count(len(rows), 'remark')} on the input of {count(persons, 'person')}: gaps, "
            "repairs and levels without markers are in the table of remarks."
        )


def beside_the_paper(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How published quantities were judged."""
    said = judged(results.table("against_wang_2021"))
    if said:
        yield capital(said)


MAKERS: tuple[Finding, ...] = (
    *(ended, nearest, beside_kinematics, calibrated, close_to_markers),
    *(profiles, calibrations, vibrating, markers_off, shares, likeness, rigid),
    *(weights, sizes, remarks, beside_the_paper),
)
"""What makes findings, in the order of the page."""

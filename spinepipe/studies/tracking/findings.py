"""Key findings of a study of tracked motions as sentences, what is not to be trusted first."""

from collections.abc import Callable, Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import ResultTables
from spinepipe.report.page.tables import judged
from spinepipe.report.words import capital, count, fixed, listed, number, percent, plain, tick
from spinepipe.status import Status
from spinepipe.studies.tracking.findings_of_errors import (
    FEWEST,
    beside_kinematics,
    calibration_errors,
    close_to_markers,
    nearest_approach,
)
from spinepipe.studies.tracking.findings_of_stiffness import calibrations, profiles, weights
from spinepipe.studies.tracking.settings import CONSTRAINED, Tracking
from spinepipe.studies.tracking.tables import (
    DONE,
    MARKER_OFF,
    TOO_FEW,
    TOO_SMALL,
    UNDEFINED,
    WINDOW,
)
from spinepipe.studies.tracking.words import phrase, sort_approaches

_MOST_PLACES = 4
VIBRATES = "acceleration_rms_deg_per_s2"

PREFERRED = ("optk_generic", "optk_from_both", "optk_calibrated")
"""Whose shares are told: of the first that there is, else of the first approach of the table."""

Finding = Callable[[Tracking, Cohort, ResultTables], Iterator[str]]


def findings(study: Tracking, cohort: Cohort, results: ResultTables) -> list[str]:
    """The sentences, without those that the study has no table for."""
    found = [sentence for make in MAKERS for sentence in make(study, cohort, results)]
    return [sentence.replace(" %", "\u00a0%") for sentence in found]


def unsettled_fits(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
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
        f"{plain(str(row['trial']))} of {row['specimen']} by {phrase(str(row['approach']))}"
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


def vibrating_motions(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
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
    for name in sort_approaches(wild):
        own = known[known["approach"] == name]
        size = number(float(own[VIBRATES].median()))
        some = f"{wild[name]} of {count(len(own), 'motion')}"
        parts.append(f"{phrase(name)} ({some}, median {size})")
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


def shares(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """The joint that does most in each trial, and whether persons agree."""
    rows = results.table("sharing")
    rows = rows[rows["window"] == WINDOW] if len(rows) else rows
    if rows.empty:
        return
    small = rows[rows["status"] == TOO_SMALL].drop_duplicates(["specimen", "trial", "approach"])
    for trial, own in rows.groupby("trial", sort=False, observed=True):
        known = own.dropna(subset=["share"])
        if len(known):
            there = [str(name) for name in dict.fromkeys(known["approach"])]
            name = next((name for name in PREFERRED if name in there), there[0])
            yield _most(str(trial), name, known[known["approach"] == name])
    if len(small):
        yield (
            f"In {count(len(small), 'motion')} the lumbar spine turns too little to be shared out: "
            "they have no share."
        )
    # approaches in which joints turn against the motion
    known = rows.dropna(subset=["share"])
    out = known[(known["share"] < 0.0) | (known["share"] > 1.0)]
    if out.empty:
        yield "No joint turns against the motion of the lumbar spine, whatever the approach."
        return
    every = known.groupby("approach", observed=True).size()
    some = out.groupby("approach", observed=True).size()
    parts = [
        f"{phrase(name)} {int(some[name])} of {int(every[name])}"
        for name in sorted(sort_approaches(some.index), key=lambda name: -some[name] / every[name])
    ]
    yield (
        f"Shares below 0 or above 100 %, where joints turn against each other: {listed(parts, 4)}."
    )


def _most(trial: str, approach: str, rows: pd.DataFrame) -> str:
    wide = rows.pivot_table(index="specimen", columns="joint", values="share", observed=True)
    joint = str(wide.mean().idxmax())
    agree = int((wide.idxmax(axis="columns") == joint).sum())
    n = len(wide)
    values = 100.0 * wide[joint]
    said = (
        f"{capital(plain(trial))}, by {phrase(approach)}: {joint} does most of the lumbar "
        f"rotation, {fixed(float(values.mean()), 0)} %"
    )
    if n < 2:
        return f"{said}, in the one person there is."
    said += f" ({fixed(float(values.min()), 0)} to {fixed(float(values.max()), 0)} %)"
    if agree == n:
        return f"{said}, in each of {count(n, 'person')}."
    return f"{said} on average, but in {n - agree} of {count(n, 'person')} another joint does most."


def likeness(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How alike persons share a motion; where that is not defined it is said."""
    rows = results.table("similarity")
    rows = rows[rows["window"] == WINDOW] if len(rows) else rows
    if rows.empty:
        return
    for trial, own in rows.groupby("trial", sort=False, observed=True):
        free = own[~own["approach"].astype(str).str.startswith(CONSTRAINED)]
        parts = [*_defined(free[free["status"] == DONE])]
        lost = free[free["status"] == UNDEFINED]
        if len(lost):
            names = listed([phrase(str(name)) for name in lost["approach"]])
            parts.append(f"not defined for {names}, as persons differ more than the curve varies")
        if (free["status"] == TOO_FEW).all() and len(free):
            parts = ["fewer than two persons have a curve"]
        if parts:
            yield (
                f"How alike persons share {plain(str(trial))} (coefficient of multiple "
                f"correlation, 1: all alike): {'; '.join(parts)}."
            )
    fixed_ones = rows["approach"].astype(str).str.startswith(CONSTRAINED)
    if fixed_ones.any():
        yield "With fixed ratios persons are alike because the ratios are, whatever they did."


def _defined(rows: pd.DataFrame) -> Iterator[str]:
    if rows.empty:
        return
    n = int(rows["n_specimens"].min())
    values = rows.set_index("approach")["cmc"].astype(float).sort_values()
    few = "" if n >= FEWEST else f", of {count(n, 'person')} alone"
    if len(values) == 1:
        yield f"{fixed(float(values.iloc[0]))} for {phrase(str(values.index[0]))}{few}"
        return
    ends = [f"{fixed(float(values.iloc[k]))} ({phrase(str(values.index[k]))})" for k in (0, -1)]
    yield f"{ends[0]} to {ends[1]}{few}"


MAKERS: tuple[Finding, ...] = (
    *(unsettled_fits, nearest_approach, beside_kinematics, calibration_errors, close_to_markers),
    *(profiles, calibrations, vibrating_motions, markers_off, shares, likeness, rigid),
    *(weights, sizes, remarks, beside_the_paper),
)
"""What makes findings, in the order of the page."""

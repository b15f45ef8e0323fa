"""Key findings of a cohort study as sentences, what casts doubt on all others first."""

from collections.abc import Callable, Iterator
from math import exp
from typing import Any

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.page.tables import judged
from spinepipe.report.words import AXIS, after_number, case, count, number, percent
from spinepipe.status import Status
from spinepipe.studies.cohort_stiffness.page_experiments import axes, hysteresis, ranges, zones
from spinepipe.studies.cohort_stiffness.page_optional import (
    covariates,
    excluded_linear_laws,
    nuisance_sizes,
    order_with_nuisances,
    stiffening_verdicts,
)
from spinepipe.studies.cohort_stiffness.representations import (
    IN_WORDS,
    NUISANCE,
    POOLED,
    PUBLISHED,
    STIFFENING,
)
from spinepipe.studies.cohort_stiffness.settings import NOBODY, NOTHING, CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import joint_label_of, own_fits

_MOST_PLACES = 6

_VERDICTS = {
    "yes": ("hold", "Holds here"),
    "no": ("do not hold", "Does not hold here"),
    "undecided": ("cannot be decided", "Cannot be decided with this cohort"),
    "circular": ("circular", "True by construction or put into a made-up cohort, and no test"),
    "not_asked": ("not asked", "Not asked in this study"),
}

_MOST_CLAIMS = 6

_CRITERIA = {
    "fitted": "Motion that was fitted",
    "left_out_case": "Motion under a left-out load case",
    "left_out_specimen": "Motion of a left-out specimen",
}

_PARTS = {
    "between_specimens": "between specimens",
    "between_levels": "between levels",
    "between_joints": "of joints beyond that",
}

Finding = Callable[..., Iterator[str]]
"""Sentences from a study and tables of its results."""


def findings(study: CohortStiffness, results: ResultTables) -> list[str]:
    """The sentences, without those that the study has no table for."""
    told: list[str] = []
    for make, names in MAKERS:
        first, *others = (results.table(name) for name in names)
        if len(first):
            told += make(study, first, *others)
    return [sentence.replace(" %", "\u00a0%") for sentence in told]


def signs(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """Where the measured motion goes against the load."""
    flipped = rows[rows["verdict"] == "flipped"]
    if len(flipped):
        places = [
            f"{row['specimen']} {row['joint']} in {case(row['test']).lower()} "
            f"({AXIS[row['coordinate']].lower()}: {row['message']})"
            for row in flipped.to_dict("records")
        ]
        where = "1 place" if len(flipped) == 1 else f"{len(flipped)} places"
        yield (
            f"Look at this first: in {where} the measured motion goes against the load: "
            f"{_some(places)}. Stiffness of these joints, and whatever is compared with it, cannot "
            "be believed before this is settled."
        )
    yield from _sizes(rows[rows["verdict"] == "implausible"])
    undecided = int((rows["verdict"] == "undecided").sum())
    if undecided or not len(flipped):
        moved = int(rows["verdict"].isin(["as_expected", "implausible"]).sum())
        rest = f"; {undecided} cannot be told" if undecided else ""
        yield f"{moved} of {count(len(rows), 'measured joint motion')} go with the load{rest}."


def _sizes(implausible: pd.DataFrame) -> Iterator[str]:
    """Where a joint moves much more or less than any joint that was measured before."""
    if implausible.empty:
        return
    slopes = implausible["measured_over_expected"].astype(float)
    where = "1 place" if len(implausible) == 1 else f"{len(implausible)} places"
    first = implausible.iloc[int((slopes - slopes.median()).abs().argmin())]
    yield (
        f"Look at units too: in {where} the measured motion is less than a fifth of the expected "
        f"one, or more than five times ({number(slopes.min())} to {number(slopes.max())}). "
        f"{first['specimen']} {first['joint']} in "
        f"{case(first['test']).lower()}: {first['message']}."
    )


def failed(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """Fits without a stiffness, and why."""
    usable = [status.value for status in Status if status.usable]
    lost = rows[~rows["status"].isin(usable)]
    if lost.empty:
        yield f"All {count(len(rows), 'fit')} ended with a stiffness."
        return
    places = [f"{_fit(row)}: {row['message'] or row['status']}" for row in lost.to_dict("records")]
    yield f"{len(lost)} of {count(len(rows), 'fit')} have no stiffness: {_some(places)}."


def bounds(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """Fits with a stiffness at a bound."""
    at = rows[rows["status"] == Status.CONVERGED_AT_BOUND.value]
    if at.empty:
        return
    whole = at["fitted_to"] == joint_label_of(rows)
    places = [f"{_fit(row)} ({row['message']})" for row in at[whole].to_dict("records")]
    fewer = int((~whole).sum())
    parts = [
        f"{len(places)} to all load cases: {_some(places)}" if places else "",
        f"{fewer} to fewer load cases, which say too little about it" if fewer else "",
    ]
    beside = at["representation"]
    kinds = ("stiffness", "a growth", "an error of a centre or axis")
    there = (True, beside.isin(STIFFENING).any(), beside.isin(NUISANCE).any())
    what = " or ".join(kind for kind, is_there in zip(kinds, there, strict=True) if is_there)
    yield (
        f"{count(len(at), 'fit')} of {len(rows)} ended with a {what} at a bound, where the data "
        f"only say that it is beyond: {'; '.join(part for part in parts if part)}."
    )


def optima(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """Fits whose answer hangs on the start."""
    several = rows[rows["n_optima"] > 1]
    if len(several):
        places = [_fit(row) for row in several.to_dict("records")]
        found = count(len(several), "fit has", "fits have")
        yield f"{found} several optima, so that the answer depends on the start: {_some(places)}."


def identifiable(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How many fitted values the data do not constrain, and how well errors are explained."""
    own = own_fits(rows)
    parts = []
    for name, part in own.groupby("representation", sort=False):
        flags = part["identifiable"].dropna().astype(bool)
        lost, total = int((~flags).sum()), len(flags)
        if lost:
            share = f"{lost} of {total} values ({percent(lost, total)})"
            parts.append(f"{IN_WORDS[str(name)]} {share}")
    if parts:
        yield f"Not identifiable from all load cases together: {'; '.join(parts)}."
    elif len(own):
        yield "From all load cases together every fitted stiffness is identifiable."


def _fit(row: dict[Any, Any]) -> str:
    fitted = str(row["fitted_to"]).replace("_", " ")
    return f"{row['specimen']}, {IN_WORDS[row['representation']]}, fitted to {fitted}"


def _some(places: list[str]) -> str:
    more = len(places) - _MOST_PLACES
    return "; ".join(places[:_MOST_PLACES]) + (f"; and {more} more" if more > 0 else "")


CHOSEN_AFTER = (
    " The first was chosen after looking, by these errors: p are too small, and one that tells "
    "another from it proves little."
)


def ranking(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """The order of representations by each criterion."""
    for criterion, words in _CRITERIA.items():
        ranked = rows[(rows["criterion"] == criterion) & rows["rank"].notna()].sort_values("rank")
        if (~ranked["representation"].isin(PUBLISHED)).any():
            told = [_place(row, study.significance) for row in ranked.to_dict("records")]
            after = CHOSEN_AFTER if ranked["p"].notna().any() else ""
            yield f"{words}, from least to largest error (mean ± SE): {'; '.join(told)}.{after}"
    best = [
        f"{words} prefers {' and '.join(IN_WORDS[first] for first in part['representation'])}"
        for name, words in (("aicc", "Akaike's criterion"), ("bic", "Schwarz's criterion"))
        if len(part := rows[(rows["criterion"] == name) & (rows["rank"] == 1)])
    ]
    if best:
        yield f"Of fits to all load cases, {', '.join(best)}."


def _place(row: dict[Any, Any], significance: float) -> str:
    """Name and error with its standard error; where it is no worse than the first, that."""
    error = row["standard_error"]
    spread = "" if pd.isna(error) else f" ± {number(error, 2)}"
    same = (
        ""
        if pd.isna(row["p"]) or row["p"] < significance
        else (f" (not told apart from the first, p {number(row['p'], 2)})")
    )
    error_of = f"{number(row['value'])}{spread}{after_number(row['unit'])}"
    return f"{IN_WORDS[row['representation']]} {error_of}{same}"


def claims(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How many claims hold, and the first of each verdict with their numbers."""
    parts = {name: rows[rows["holds"] == name] for name in _VERDICTS}
    told = [f"{_VERDICTS[name][0]} {len(part)}" for name, part in parts.items() if len(part)]
    yield (
        f"Of {count(len(rows), 'claim')} about this cohort: {', '.join(told)}; table 1 has the "
        "numbers that decide, and what they are."
    )
    for name, part in parts.items():
        if len(part):
            first = "; ".join(_claim(row) for row in part.head(_MOST_CLAIMS).to_dict("records"))
            more = f"; and {len(part) - _MOST_CLAIMS} more" if len(part) > _MOST_CLAIMS else ""
            yield f"{_VERDICTS[name][1]}: {first}{more}."


def _claim(row: dict[Any, Any]) -> str:
    """Statement with its value, interval and p; the message where there is no value."""
    statement = str(row["statement"]).rstrip(".")
    words = f"{statement[:1].lower()}{statement[1:]}"
    if pd.isna(row["value"]):
        return f"{words} ({row['message']})" if row["message"] else words
    numbers = [f"{number(row['value'])} {row['unit']}".rstrip()]
    if not (pd.isna(row["low"]) or pd.isna(row["high"])):
        numbers.append(f"95 % interval {number(row['low'])} to {number(row['high'])}")
    if not pd.isna(row["p"]):
        beside, little = row["p_holm"], row["p_no"]
        absent = "" if pd.isna(little) else f", {number(little, 2)} that it matters"
        told = "" if pd.isna(beside) else f", {number(beside, 2)} beside the other claims"
        numbers.append(f"p {number(row['p'], 2)}{absent}{told}")
    return f"{words} ({', '.join(numbers)})"


def loaded_errors(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """Errors in the loaded direction at the largest load, load case by load case."""
    labels = [joint_label_of(rows), NOTHING]
    chosen = rows[
        (rows["steps"] == "peak")
        & rows["stage"].isin(["literature", "fitted"])
        & rows["fitted_to"].isin(labels)
        & rows["mae"].notna()
    ]
    for (test, _), part in chosen.groupby(["test", "coordinate"], sort=False):
        told = [
            f"{IN_WORDS[row['representation']]} {number(row['mae'], 2)}"
            f"{after_number(row['unit'])}"
            + ("" if pd.isna(row["mae_percent"]) else f" ({number(row['mae_percent'], 2)} %)")
            for row in part.to_dict("records")
        ]
        yield (
            f"{case(str(test))}, error in the loaded direction at the largest load (median over "
            f"specimens, share of the largest motion): {'; '.join(told)}."
        )


def spreads(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """Spreads that the hierarchical fit found, as factors: one SD up or down."""
    rows = rows[rows["representation"] == POOLED[0]]
    whole = rows[(rows["without"] == NOBODY) & (rows["fitted_to"] == joint_label_of(rows))]
    settled = whole[whole["status"].map(lambda name: Status(name).usable).astype(bool)]
    told = [_spread(row) for row in settled.dropna(subset=["centre"]).to_dict("records")]
    if told:
        yield (
            "Stiffness in the middle of the cohort, and the factor that one SD stands for: "
            f"{'; '.join(told)}."
        )


def _spread(row: dict[Any, Any]) -> str:
    factors = [
        f"{words} {number(exp(row[name]))}"
        for name, words in _PARTS.items()
        if not pd.isna(row[name])
    ]
    centre = f"{AXIS[row['coordinate']].lower()} {number(row['centre'])} {row['unit']}"
    return f"{centre} ({', '.join(factors)})" if factors else centre


def beside_the_paper(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How the published quantities were judged."""
    told = judged(rows)
    if told:
        yield told


MAKERS: tuple[tuple[Finding, tuple[str, ...]], ...] = (
    (signs, ("sign_checks",)),
    (failed, ("fits",)),
    (bounds, ("fits",)),
    (optima, ("fits",)),
    (identifiable, ("stiffness",)),
    (ranking, ("ranking",)),
    (order_with_nuisances, ("ranking",)),
    (nuisance_sizes, ("nuisances",)),
    (stiffening_verdicts, ("findings", "ranking")),
    (excluded_linear_laws, ("stiffness",)),
    (claims, ("findings",)),
    (loaded_errors, ("mae",)),
    (spreads, ("pooling",)),
    (covariates, ("covariates",)),
    (ranges, ("load_displacement",)),
    (zones, ("load_displacement",)),
    (hysteresis, ("load_displacement",)),
    (axes, ("helical_axes",)),
    (beside_the_paper, ("against_gould_2024b",)),
)
"""Each with the tables that it reads; without rows of the first there is nothing to say."""

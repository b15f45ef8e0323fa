"""What the corrected verdicts of the table findings amount to; sentences stand in conclusions.csv.

Nothing is concluded here of fewer than three specimens, and no other p is looked at.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.words import SIGNS, listed
from spinepipe.studies.cohort_stiffness.claims import CIRCULAR, DECIDED, UNDECIDED
from spinepipe.studies.cohort_stiffness.claims_of_errors import CONTESTS
from spinepipe.studies.cohort_stiffness.claims_of_stiffness import SPECIFIC
from spinepipe.studies.cohort_stiffness.conclusions_of_stiffness import (
    differences,
    direction,
    directions,
)
from spinepipe.studies.cohort_stiffness.representations import NUISANCE, SHARED, STIFFENING, named
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import LEFT_OUT_CASE, LEFT_OUT_SPECIMEN
from spinepipe.units import COORDINATES

Row = dict[Any, Any]
Claims = dict[str, Row]

UNSEEN = {LEFT_OUT_SPECIMEN: "a left-out specimen", LEFT_OUT_CASE: "a left-out load case"}

PUBLISHED = {
    "cross_validation_beats_literature": ("the other specimens' median", LEFT_OUT_SPECIMEN),
    "optimised_beats_literature_left_out_case": (
        "one stiffness for all joints of a specimen",
        LEFT_OUT_CASE,
    ),
}
"""Claims about published stiffness: what is compared with it, and what both predict."""

ABOUT_UNSEEN = (*UNSEEN, *PUBLISHED)
"""How names of claims end that are about motion no fit has seen."""

COVARIATES = {
    "age_years": "age",
    "height_m": "height",
    "mass_kg": "body mass",
    "degeneration_grade": "degeneration grade",
}


def claim_conclusions(
    study: CohortStiffness, values: pd.DataFrame, findings: pd.DataFrame
) -> Iterator[Conclusion]:
    """All that is said over specimens, of three or more.

    Parameters
    ----------
    values : as of `joint_values`. findings : the table of that name.
    """
    claims = {str(row["finding"]): row for row in findings.to_dict("records")}
    for what, by in (("specimens", "specimen"), ("levels", "joint")):
        yield from _differ(claims, values, what, by)
    yield from _load_cases(claims)
    if study.base is not None:  # readings that are left out are not unseen
        return
    special = {*STIFFENING, *NUISANCE}
    plain = [pair for pair in CONTESTS if not special & {*pair}]
    yield from _descriptions(_contests(claims, plain))
    laws = [pair for pair in CONTESTS if pair[0] in STIFFENING and pair[1] not in STIFFENING]
    yield from _worth("laws", _contests(claims, laws))
    yield from _worth("centres", _contests(claims, [p for p in CONTESTS if p[0] in NUISANCE]))
    yield from _published(claims)


def _contests(claims: Claims, pairs: Sequence[tuple[str, str]]) -> list[Row]:
    """Comparisons of two descriptions on readings left out, decided or not.

    Returns
    -------
    Rows of the table with ``order``, which is the better and which the worse one where they are
    decided, and ``names``, the words of a sentence about them.
    """
    found: list[Row] = []
    for pair, (stage, what) in ((pair, one) for pair in pairs for one in UNSEEN.items()):
        row = claims.get("{}_beats_{}_{}".format(*pair, stage))
        if row and row["holds"] in (*DECIDED, UNDECIDED) and pd.notna(row["value"]):
            order = pair[::-1] if row["holds"] == "no" else pair
            best, worse = (named(name).sentence for name in order)
            names = {"best": best, "worse": worse, "what": what}
            found.append({**row, "order": order, "names": names})
    return found


def _decided(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["holds"] in DECIDED]


def _size(row: Row) -> Value:
    """The difference that is claimed, with its own interval; of a no the other way round."""
    value, *ends = (float(row[name]) for name in ("value", "low", "high"))
    sign = -1.0 if row["holds"] == "no" and value < 0.0 else 1.0
    low, high = (None if pd.isna(end) else sign * end for end in ends[:: int(sign)])
    n: int | None = None if pd.isna(row["specimens"]) else int(row["specimens"])
    unit = str(SIGNS.get(row["unit"], row["unit"]))
    return Value(sign * value, unit, low, high, n, f"findings: {row['finding']}")


def _counts(rows: Sequence[Row]) -> dict[str, Value]:
    return numbers_from("findings", compared=len(rows), decided=len(_decided(rows)))


def _descriptions(rows: Sequence[Row]) -> Iterator[Conclusion]:
    """Which description predicts better, by all comparisons of two."""
    decided = _decided(rows)
    if not decided:
        if rows:
            yield Conclusion("descriptions", "none_shown", _counts(rows))
        return
    orders = [row["order"] for row in decided]
    firsts = [order[0] for order in orders]
    first = max(firsts, key=firsts.count)
    compared = {name for row in rows for name in row["order"]}
    wins = [row for row in decided if row["order"][0] == first]
    beaten = {(row["names"]["what"], row["order"][1]) for row in wins}
    # the best beats all others in predicting the same, and none beats it in anything
    whole = [what for what in UNSEEN.values() if {(what, n) for n in compared - {first}} <= beaten]
    best = bool(whole) and first not in {order[1] for order in orders}
    # of the best the closest rival is told, else whether one value for all joints is enough
    told = min(wins, key=lambda row: row["order"][1] != SHARED[0])
    if best:
        told = min(
            (row for row in wins if row["names"]["what"] in whole),
            key=lambda row: abs(row["value"]),
        )
    verdict = "best" if best else "some"
    yield Conclusion("descriptions", verdict, {"less": _size(told), **_counts(rows)}, told["names"])


def _worth(rule: str, rows: Sequence[Row]) -> Iterator[Conclusion]:
    """Whether unknowns beside the stiffness pay: both verdicts where it is not one answer."""
    verdicts = {"better": "yes", "worse": "no"}
    for verdict, holds in verdicts.items():
        decided = [row for row in rows if row["holds"] == holds]
        if decided:
            told = max(decided, key=lambda row: abs(row["value"]))
            yield Conclusion(rule, verdict, {"less": _size(told)}, told["names"])
    if rows and not _decided(rows):
        yield Conclusion(rule, "not_shown", _counts(rows))


def _published(claims: Claims) -> Iterator[Conclusion]:
    """Whether fitted stiffness predicts better than published one; once where neither does."""
    verdicts = {"yes": "better", "no": "worse", UNDECIDED: "not_shown"}
    rows = [claims[name] for name in PUBLISHED if name in claims]
    rows = [row for row in rows if row["holds"] in verdicts and pd.notna(row["value"])]
    if len(rows) == len(PUBLISHED) and not _decided(rows):
        both = {name: _size(row) for name, row in zip(("others", "own"), rows, strict=True)}
        yield Conclusion("published", "neither_shown", both)
        return
    for row in rows:
        own, stage = PUBLISHED[row["finding"]]
        words = {"own": own, "what": UNSEEN[stage]}
        yield Conclusion("published", verdicts[row["holds"]], {"less": _size(row)}, words)


def _differ(claims: Claims, values: pd.DataFrame, what: str, by: str) -> Iterator[Conclusion]:
    """Whether specimens or levels differ, by the claims of all directions."""
    times = differences(values, by)
    begins = f"stiffness_differs_between_{what}_"
    rows = {name: claims.get(begins + name, {}) for name in COORDINATES if name in times}
    holds = {name: row["holds"] for name, row in rows.items() if pd.notna(row.get("value"))}
    if not holds:
        return
    differ = [name for name, verdict in holds.items() if verdict in ("yes", CIRCULAR)]
    rest = [name for name in holds if name not in differ]
    most = max(differ or holds, key=times.__getitem__)
    verdict = ("some" if rest else "differ") if differ else "not_shown"
    verdict += "_put_in" if CIRCULAR in holds.values() else ""
    verdict = "alike" if {*holds.values()} == {"no"} else verdict
    numbers = {"times": Value(times[most], source=f"stiffness: largest over least median by {by}")}
    half = (50.0 * (values["high"] - values["low"]) / values["value"]).median()
    words = {"most": direction(most), "differ": directions(differ), "rest": directions(rest)}
    words["known"] = ""
    if pd.notna(half):
        numbers["half"] = Value(float(half), "%", source="stiffness: ends")
        words["known"] = f"; a single value is known to ± {numbers['half']}"
    yield Conclusion(what, verdict, numbers, words)


def _load_cases(claims: Claims) -> Iterator[Conclusion]:
    """Whether load cases need different stiffness."""
    verdicts = {"yes": "yes", "no": "small", UNDECIDED: "not_shown"}
    for representation, claim in SPECIFIC.items():
        row = claims.get(claim.finding)
        if row and row["holds"] in verdicts and pd.notna(row["value"]):
            n, source = int(row["specimens"]), f"findings: {claim.finding}"
            numbers = numbers_from(source, below=round(row["value"] * n), n=n)
            words = {"described": named(representation).sentence}
            yield Conclusion("load_cases", verdicts[row["holds"]], numbers, words)
            break


def covariate_conclusions(rows: pd.DataFrame) -> Iterator[Conclusion]:
    """What stiffness goes with, by p corrected within their table, and what was not asked."""
    names = [COVARIATES.get(name, str(name)) for name in rows.get("covariate", ())]
    rows = rows.assign(name=names) if len(rows) else pd.DataFrame(columns=["holds", "message"])
    held = rows[rows["holds"] == "yes"]
    for row in held.to_dict("records"):
        factor, low, high = (float(row[name]) for name in ("factor", "low", "high"))
        n = int(row["specimens"])
        numbers = numbers_from("covariates: specimens", n=n)
        numbers["factor"] = Value(factor, "", low, high, n, "covariates: factor")
        words = {"direction": direction(row["coordinate"]), "covariate": row["name"]}
        yield Conclusion("covariates", "yes", numbers, {**words, "step": str(row["step"])})
    parts = {"covariates": rows[rows["holds"] == UNDECIDED]}
    parts |= {"asked": rows[rows["holds"] == "refused"]}
    verdicts = {"covariates": "others_not_shown" if len(held) else "not_shown", "asked": "check"}
    for rule, part in parts.items():
        for message, same in part.groupby("message" if rule == "asked" else "holds", sort=False):
            told = listed(dict.fromkeys(same["name"]), most=6)
            yield Conclusion(rule, verdicts[rule], names={"covariates": told, "why": str(message)})

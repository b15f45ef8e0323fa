"""Key findings about what is computed only where a study asks for it.

Laws that stiffen: do they predict better what was not fitted? Errors of joint centres and axes: are
they large, and do they change the order of representations? The order changes where
representations, each by its value in `ranking`, stand otherwise once those that were fitted with
nuisances too take the place of those without. Covariates: what of the specimens does stiffness go
with?
"""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.report.words import AXIS, after_number, count, number, percent
from spinepipe.studies.cohort_stiffness.claims import FEWEST
from spinepipe.studies.cohort_stiffness.claims_of_errors import CONTESTS
from spinepipe.studies.cohort_stiffness.representations import (
    IN_WORDS,
    NUISANCE,
    SHARED,
    STIFFENING,
    named,
)
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import (
    LEFT_OUT_CASE,
    LEFT_OUT_SPECIMEN,
    joint_label_of,
    own_fits,
)

Row = dict[Any, Any]

_HELD_OUT = {LEFT_OUT_CASE: "a left-out load case", LEFT_OUT_SPECIMEN: "a left-out specimen"}

_VERDICTS = {
    "yes": "is predicted better",
    "no": "is predicted worse",
    "undecided": "is not shown to be predicted better",
}


def stiffening_verdicts(
    study: CohortStiffness, rows: pd.DataFrame, ranking: pd.DataFrame
) -> Iterator[str]:
    """Laws that stiffen beside their linear counterparts, from `findings` and `ranking`."""
    for better, worse in CONTESTS:
        if better in STIFFENING and worse not in STIFFENING:
            criterion = _akaike(better, worse, ranking)
            yield from _worth(better, worse, rows.set_index("finding"), criterion)


def _akaike(better: str, worse: str, ranking: pd.DataFrame) -> str:
    """Which of the two Akaike's criterion prefers, of what was fitted; empty without values."""
    if ranking.empty:
        return ""
    values = ranking[ranking["criterion"] == "aicc"].set_index("representation")["value"].dropna()
    if not {better, worse} <= set(values.index):
        return ""
    less = float(values[worse] - values[better])
    name = "the law that stiffens" if less > 0.0 else "the linear one"
    by = number(abs(less), 2)
    return f" Of the motion that was fitted Akaike's criterion prefers {name}, by {by}."


def _worth(better: str, worse: str, claims: pd.DataFrame, criterion: str) -> Iterator[str]:
    """What held-out motion says of one law against the linear one, and a criterion beside it."""
    names = {stage: f"{better}_beats_{worse}_{stage}" for stage in _HELD_OUT}
    asked = {
        stage: claims.loc[name].to_dict()
        for stage, name in names.items()
        if name in claims.index and claims.loc[name, "holds"] in _VERDICTS
    }
    if not asked:
        return
    holds = {row["holds"] for row in asked.values()}
    verdict = "Not shown"
    if "no" in holds:
        verdict = "No" if "yes" not in holds else "It hangs on what is held out"
    elif "yes" in holds:
        verdict = "Yes"
    told = "; ".join(f"{_HELD_OUT[stage]} {_told(row)}" for stage, row in asked.items())
    names_of = f"\u201c{IN_WORDS[better]}\u201d against \u201c{IN_WORDS[worse]}\u201d"
    yield (
        f"Do joints that stiffen predict better what was not fitted? {verdict}. With {names_of} "
        f"{told}.{criterion}"
    )


def _told(row: Row) -> str:
    """Verdict, difference of the errors and p that decides."""
    words = _VERDICTS[row["holds"]]
    if pd.isna(row["value"]):
        return f"{words} ({row['message']})"
    less = f"error less by {number(row['value'], 2)} {row['unit']}"
    ends = "" if pd.isna(row["low"]) else f", {number(row['low'], 2)} to {number(row['high'], 2)}"
    p = "" if pd.isna(row["p_holm"]) else f", p {number(row['p_holm'], 2)} beside the other claims"
    return f"{words} ({less}{ends}{p})"


def excluded_linear_laws(study: CohortStiffness, stiffness: pd.DataFrame) -> Iterator[str]:
    """In how many joints a linear law is excluded, and what stiffness then means."""
    own = own_fits(stiffness)
    own = own[own["growth"].notna()]
    parts, left = [], 0
    for name, part in own.groupby("representation", sort=False):
        if name in SHARED:  # one law of all joints
            part = part.drop_duplicates(["specimen", "coordinate"])
        excluded, total = int((part["growth_low"].astype(float) > 0.0).sum()), len(part)
        left += total - excluded
        share = f"{excluded} of {total} laws ({percent(excluded, total)})"
        parts.append(f"{IN_WORDS[str(name)]}: {share}")
    if parts:
        rest = " Of the others the data do not tell whether they stiffen." if left else ""
        yield (
            f"A linear joint is excluded, each law by itself at 95 %: {'; '.join(parts)}.{rest} "
            "Stiffness of these laws is that at rest."
        )


FAR = 3
"""A pull beyond this, either way, is seldom of its prior: one in 370."""


def order_with_nuisances(study: CohortStiffness, ranking: pd.DataFrame) -> Iterator[str]:
    """What fitting them beside does to the order on held-out motion."""
    for criterion in (LEFT_OUT_SPECIMEN, LEFT_OUT_CASE):
        yield from _order(ranking[ranking["criterion"] == criterion], _HELD_OUT[criterion])


def orders(values: pd.Series) -> tuple[list[str], list[str]]:
    """Representations from best to worst, without nuisances, and with them where there are such.

    Parameters
    ----------
    values : by representation. Both lists call them by their names without nuisances.
    """
    plain = {str(name): float(value) for name, value in values.items() if name not in NUISANCE}
    beside = {named(name).without_nuisances: name for name in NUISANCE if name in values.index}
    instead = {name: float(values[beside.get(name, name)]) for name in plain}
    return sorted(plain, key=plain.__getitem__), sorted(instead, key=instead.__getitem__)


def _order(rows: pd.DataFrame, words: str) -> Iterator[str]:
    ranked = rows.dropna(subset="rank").set_index("representation")
    values = ranked["value"].astype(float)
    pairs = [(named(name).without_nuisances, name) for name in NUISANCE if name in values.index]
    pairs = [(plain, name) for plain, name in pairs if plain in values.index]
    if not pairs:
        return
    unit, specimens = after_number(str(ranked["unit"].iloc[0])), int(ranked["specimens"].iloc[0])
    told = "; ".join(
        f"{IN_WORDS[plain]} {number(values[plain])}{unit} without, {number(values[name])}{unit} "
        "with them"
        for plain, name in pairs
    )
    about = f"Errors of joint centres and axes fitted beside, error of {words}: {told}."
    if specimens < FEWEST:
        few = f"{count(specimens, 'specimen')}, and that needs {FEWEST}"
        yield f"{about} Whether the order changes cannot be told: {few}."
        return
    before, after = orders(values)
    if before == after:
        yield f"{about} The order of representations is the same with them."
        return
    first, second = ("; ".join(IN_WORDS[name] for name in names) for names in (before, after))
    changed = f"Without them it is {first}. With them it is {second}."
    yield f"{about} The order of representations changes. {changed}"


def nuisance_sizes(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How many are told by readings, and how many are larger than their prior lets expect."""
    whole = rows[rows["fitted_to"] == joint_label_of(rows)]
    for name, part in whole.groupby("representation", sort=False):
        error, prior = part["standard_error"].astype(float), part["prior_sd"].astype(float)
        told, far = int((error < 0.5 * prior).sum()), int((part["pull"].abs() > FAR).sum())
        yield (
            f"Of {len(part)} errors of centres and axes ({IN_WORDS[str(name)]}) readings tell "
            f"{told} ({percent(told, len(part))}) to less than half their prior's SD; {far} are "
            f"beyond {number(FAR)} of these SDs."
        )


_WORDS = {
    "age_years": "age",
    "height_m": "height",
    "mass_kg": "body mass",
    "degeneration_grade": "degeneration grade",
}


def covariates(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """What goes with stiffness, what cannot be told, and what was not to be asked."""
    for row in rows[rows["holds"] == "yes"].to_dict("records"):
        yield (
            f"{AXIS[row['coordinate']]} stiffness goes with {_name(row)}: {_factor(row)}, over "
            f"{row['specimens']} specimens. That is no cause."
        )
    untold = [
        f"{AXIS[row['coordinate']].lower()} with {_name(row)}: {_factor(row)}"
        for row in rows[rows["holds"] == "undecided"].to_dict("records")
    ]
    if untold:  # with what the cohort does not exclude
        yield (
            f"Not told apart from no effect: {'; '.join(untold)}. What lies inside an interval is "
            "not excluded."
        )
    for message, part in rows[rows["holds"] == "refused"].groupby("message", sort=False):
        names = list(dict.fromkeys(_name(row) for row in part.to_dict("records")))
        where = list(dict.fromkeys(AXIS[one].lower() for one in part["coordinate"]))
        yield (
            f"Whether stiffness goes with {', '.join(names)} was not asked "
            f"({', '.join(where)}): {message}."
        )


def _name(row: Row) -> str:
    return _WORDS.get(row["covariate"], str(row["covariate"]))


def _factor(row: Row) -> str:
    ends = f"{number(row['low'], 2)} to {number(row['high'], 2)}"
    p: str = "" if pd.isna(row["p_holm"]) else f", p {number(row['p_holm'], 2)} beside the others"
    return f"times {number(row['factor'], 2)} for {row['step']} (95 % interval {ends}{p})"

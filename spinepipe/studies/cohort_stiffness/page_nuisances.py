"""Key findings about errors of joint centres and axes: do they change the order, are they large?

The order changes where representations, each by its value in `ranking`, stand otherwise once those
that were fitted with nuisances too take the place of those without.
"""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import after_number, count, number, percent
from spinepipe.studies.cohort_stiffness.claims import FEWEST
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS, NUISANCE, named
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import (
    LEFT_OUT_CASE,
    LEFT_OUT_SPECIMEN,
    joint_label_of,
)

_HELD_OUT = {LEFT_OUT_SPECIMEN: "a left-out specimen", LEFT_OUT_CASE: "a left-out load case"}

FAR = 3
"""A pull beyond this, either way, is seldom of its prior: one in 370."""


def nuisances(study: CohortStiffness, results: ResultTables) -> Iterator[str]:
    """What fitting them beside does to the order on held-out motion, and how large they are."""
    ranking = results.table("ranking")
    for criterion, words in _HELD_OUT.items():
        if len(ranking):
            yield from _order(ranking[ranking["criterion"] == criterion], words)
    yield from _sizes(results.table("nuisances"))


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


def _sizes(rows: pd.DataFrame) -> Iterator[str]:
    """How many are told by readings, and how many are larger than their prior lets expect."""
    if rows.empty:
        return
    whole = rows[rows["fitted_to"] == joint_label_of(rows)]
    for name, part in whole.groupby("representation", sort=False):
        error, prior = part["standard_error"].astype(float), part["prior_sd"].astype(float)
        told, far = int((error < 0.5 * prior).sum()), int((part["pull"].abs() > FAR).sum())
        yield (
            f"Of {len(part)} errors of centres and axes ({IN_WORDS[str(name)]}) readings tell "
            f"{told} ({percent(told, len(part))}) to less than half their prior's SD; {far} are "
            f"beyond {number(FAR)} of these SDs."
        )

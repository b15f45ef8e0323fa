"""The posterior of a joint-pose study as sentences, each by a rule that stands here."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import AXIS, count, fixed, listed, number, percent
from spinepipe.status import Status
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, STIFFNESS_UNITS

ALIKE = 0.5
"""Where weights count for more than this share of the poses, the data hardly tell them apart."""

FEW = 10.0
"""Weights that count for fewer poses than this hang on which poses happened to be drawn."""


def posterior(results: ResultTables) -> list[str]:
    """Sentences of stiffness, landmarks, predicted motion and poses; none without the tables."""
    rows = results.table("posterior")
    if rows.empty:
        return []
    lost = rows[rows["status"] != Status.CONVERGED.value]
    good = rows[rows["status"] == Status.CONVERGED.value]
    told = [
        _lost(lost),
        _stiffness(good[good["quantity"] == "stiffness"]),
        _landmarks(good[good["quantity"] == "landmark"]),
        _motion(results.table("posterior_motion")),
        *_poses(results.table("pose_weights")),
    ]
    return [sentence for sentence in told if sentence]


def _lost(lost: pd.DataFrame) -> str:
    """Which specimens have no posterior to be believed, and why."""
    if lost.empty:
        return ""
    first = lost.drop_duplicates("specimen")
    why = [f"{row['specimen']} ({row['message']})" for _, row in first.iterrows()]
    return f"No posterior is told of {listed(why)}."


def _stiffness(rows: pd.DataFrame) -> str:
    """Interval of each stiffness of one specimen; of several, how many have both ends."""
    if rows.empty:
        return ""
    lead = "With landmarks unknown to their palpation error"
    if len(rows) > len(COORDINATES):
        closed = int((~(rows["open_below"].astype(bool) | rows["open_above"].astype(bool))).sum())
        return (
            f"{lead}, {closed} of {len(rows)} stiffnesses have a 95 % interval that the data make; "
            "of the others the prior's bound makes an end."
        )
    return f"{lead}, 95 % of the posterior: {'; '.join(_interval(r) for _, r in rows.iterrows())}."


def _interval(row: pd.Series) -> str:
    coordinate = COORDINATES[STIFFNESS_COLUMNS.index(row["unknown"])]
    unit = STIFFNESS_UNITS[coordinate]
    where = "" if row["joint"] == "*" else f" of {row['joint']}"
    name = f"{AXIS[coordinate].lower()}{where}"
    low, high = number(row["low"]), number(row["high"])
    if row["open_below"] and row["open_above"]:
        return f"{name} not known"
    if row["open_above"]:
        return f"{name} above {low} {unit}, its upper end not known"
    if row["open_below"]:
        return f"{name} below {high} {unit}, its lower end not known"
    return f"{name} {low} to {high} {unit} (median {number(row['median'])})"


def _landmarks(rows: pd.DataFrame) -> str:
    """Of how many landmark coordinates the data tell anything."""
    if rows.empty:
        return ""
    known = int((~rows["prior_dominated"].astype(bool)).sum())
    if not known:
        return (
            f"Motion tells next to nothing of where landmarks are: of {len(rows)} coordinates none "
            "is known by a tenth better than by palpation."
        )
    return (
        f"Motion tells something of {known} of {len(rows)} landmark coordinates: these are known "
        "by a tenth better, or more, than by palpation."
    )


def _motion(rows: pd.DataFrame) -> str:
    """How many readings lie where the posterior says that readings lie."""
    read = rows[(rows["status"] == Status.CONVERGED.value) & rows["inside"].notna()]
    if read.empty:
        return ""
    inside = int(read["inside"].astype(bool).sum())
    return (
        f"{inside} of {len(read)} readings lie in the 95 % band that the posterior predicts for "
        "them. The same readings made the band: this can refute the model, not confirm it."
    )


def _poses(rows: pd.DataFrame) -> Iterator[str]:
    """Of each specimen: whether data tell its poses apart, and which pose and stiffness to take."""
    for specimen, part in rows.groupby("specimen", sort=False):
        each = part.drop_duplicates("pose").set_index("pose")["weight"]
        if not each.sum():
            continue
        effective = 1.0 / float((each**2).sum())
        lead = (
            f"{specimen}: by what they make of the data, {count(len(each), 'sampled pose')} weigh "
            f"as much as {fixed(effective, 0)} alike would"
        )
        best = int(str(each.idxmax()))
        if effective > ALIKE * len(each):
            yield (
                f"{lead}. The data hardly tell poses apart: no pose is to be chosen, and the "
                f"likeliest, {best}, has {_share(each)} of the weight."
            )
        elif effective < FEW:
            yield (
                f"{lead}. Few were drawn where the data want them: which pose is likeliest hangs "
                "on the draw. Go by the posterior, or sample more poses."
            )
        else:
            yield (
                f"{lead}. The data prefer some: the likeliest, {best}, has {_share(each)} of the "
                f"weight, with {_suiting(part[part['pose'] == best])}."
            )


def _share(weights: pd.Series) -> str:
    return percent(round(1e4 * float(weights.max())), 10_000)


def _suiting(rows: pd.DataFrame) -> str:
    """The stiffnesses that suit a pose."""
    found = []
    for _, row in rows.iterrows():
        coordinate = COORDINATES[STIFFNESS_COLUMNS.index(row["unknown"])]
        where = "" if row["joint"] == "*" else f" of {row['joint']}"
        value = f"{number(row['value'])} {STIFFNESS_UNITS[coordinate]}"
        found.append(f"{AXIS[coordinate].lower()}{where} {value}")
    return "; ".join(found)

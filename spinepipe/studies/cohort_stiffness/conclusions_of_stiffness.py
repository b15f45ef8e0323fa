"""How stiff the joints are, in units of the field; the sentences stand in conclusions.csv."""

from collections.abc import Iterator, Sequence
from math import isfinite, pi

import numpy as np
import pandas as pd

from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.words import AXIS, count, level, listed, short
from spinepipe.studies.cohort_stiffness.claims import FEWEST
from spinepipe.studies.cohort_stiffness.representations import FITTED, OF_JOINTS, SHARED, named
from spinepipe.studies.cohort_stiffness.stages import own_fits
from spinepipe.studies.cohort_stiffness.tables import STIFFNESS
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

FIELD = {"N m/rad": ("N m/deg", pi / 180.0), "N/m": ("N/mm", 1e-3)}
"""Units of the table to those that the field prints, with the factor."""

ALL_JOINTS = "all joints"
"""In the place of a joint, where all joints of a specimen share a value."""

HOW = "stiffness: own fits to all load cases"


def joint_values(stiffness: pd.DataFrame) -> pd.DataFrame:
    """The stiffness that a page tells: own fits of specimens to all load cases, described one way.

    Of the descriptions it is the finest of those that have a typical value in most directions.
    A value that is not identifiable or at a bound is none: it is empty, and of its region the ends
    are left that exist. What was never fitted, as published stiffness, is not among the rows.

    Returns
    -------
    Rows of the table in units of the field, rotations first, one for `ALL_JOINTS` where they share
    a value. More columns are ``value`` and ``place``, which is that for medians: infinite where
    one end alone is known.
    """
    own = own_fits(stiffness) if len(stiffness) else pd.DataFrame(columns=STIFFNESS.names)
    names = [one for one in sorted(FITTED, key=_order) if one in set(own["representation"])]
    found = [_rows(own[own["representation"] == name]) for name in names] or [_rows(own)]
    return max(found, key=lambda rows: sum(v is not None for v in typical_by(rows).values()))


def _order(name: str) -> tuple[bool, bool, bool]:
    """Each joint its own first, before these all by itself and with centres as stated."""
    one = named(name)
    return one.pooled or bool(one.without_nuisances), name not in OF_JOINTS, one.stiffens


def _rows(own: pd.DataFrame) -> pd.DataFrame:
    own = own[own[["stiffness", "low", "high"]].notna().any(axis=1)].copy()
    shared = [name in SHARED and not named(name).by_level for name in own["representation"]]
    own.loc[shared, "joint"] = ALL_JOINTS
    own = own.drop_duplicates(["specimen", "joint", "coordinate"])
    factor = np.array([FIELD[unit][1] for unit in own["unit"]], dtype=float)
    value, low, high = (own[name].astype(float) * factor for name in ("stiffness", "low", "high"))
    sure = own["identifiable"].eq(True) & own["at_bound"].eq("no")
    above = (low.notna() & high.isna()) | own["at_bound"].eq("upper")
    below = (low.isna() & high.notna()) | own["at_bound"].eq("lower")
    place = np.select([sure, above, below], [value, np.inf, -np.inf], np.nan)
    told = {"value": value.where(sure), "low": low, "high": high, "place": place}
    own = own.assign(**told, unit=[FIELD[unit][0] for unit in own["unit"]])
    order = {name: number for number, name in enumerate((*ROTATIONS, *TRANSLATIONS))}
    return own.sort_values("coordinate", key=lambda names: names.map(order), kind="stable")


def typical_by(values: pd.DataFrame) -> dict[str, Value | None]:
    """The typical stiffness by coordinate, in the order of `joint_values`."""
    return {str(name): typical(rows) for name, rows in values.groupby("coordinate", sort=False)}


def typical(rows: pd.DataFrame) -> Value | None:
    """Of rows of one coordinate: median and range over specimens, or over the joints of one.

    A specimen counts by the median over its joints. A single value has its own 95 % interval. None
    where the median is not bounded.
    """
    known, kind = rows.dropna(subset="place"), kind_of(rows)
    by = known["specimen"] if kind == "specimens" else known["joint"]
    numbers = known.groupby(by, sort=False)["place"].median().dropna()
    if numbers.empty or not isfinite(numbers.median()):
        return None
    ends = known[["low", "high"]].iloc[0] if kind == "single" else numbers.agg(["min", "max"])
    low, high = (float(end) if isfinite(end) else None for end in ends)
    unit, n = str(known["unit"].iloc[0]), len(numbers)
    return Value(float(numbers.median()), unit, low, high, n, f"{HOW}, {kind}")


def kind_of(rows: pd.DataFrame) -> str:
    """What a typical value is over: ``specimens``, ``joints`` of one, or a ``single`` value."""
    known = rows.dropna(subset="place")
    if known["specimen"].nunique() > 1:
        return "specimens"
    return "joints" if len(known) > 1 else "single"


def direction(coordinate: str) -> str:
    """A coordinate as a direction of motion in a sentence."""
    words = AXIS[coordinate].lower()
    return f"{words} translation" if coordinate in TRANSLATIONS else words


def directions(coordinates: Sequence[str]) -> str:
    """Several, in the order of coordinates."""
    return listed([direction(name) for name in COORDINATES if name in coordinates], most=6)


def stiffness_conclusions(values: pd.DataFrame, free: Sequence[str]) -> Iterator[Conclusion]:
    """The answer, key numbers, and directions of ``free`` that readings do not bound or tell of."""
    found = typical_by(values)
    told = {name: value for name, value in found.items() if value is not None}
    names = {"rest": " at rest" if values["growth"].notna().any() else ""}
    if told:
        yield _answer(values, told, names)
    else:
        yield Conclusion("typical", "not_bounded" if len(values) else "none")
    for name, value in told.items():
        rows = values[values["coordinate"] == name]
        more = {**names, "direction": direction(name)}
        n = numbers_from(value.source, n=value.n or 0)
        yield Conclusion("direction", kind_of(rows), {"value": value, **n}, more)
    yield from _open(values, [name for name in found if name not in told])
    untold = [name for name in free if name not in found]
    if untold and found:
        yield Conclusion("not_fitted", "directions", names={"directions": directions(untold)})


def _answer(values: pd.DataFrame, told: dict[str, Value], names: dict[str, str]) -> Conclusion:
    letters = dict(zip("abc", told, strict=False))
    rows = values[values["coordinate"].isin(letters.values())].dropna(subset="place")
    words = {f"direction_{letter}": direction(name) for letter, name in letters.items()}
    (specimen, joint), *others = rows[["specimen", "joint"]].drop_duplicates().to_numpy(str)
    n = rows["specimen"].nunique()
    few = f"{count(n, 'specimen')}' typical joint resists"
    few = f"joints of {short(specimen)} typically resist" if n == 1 else few
    words["who"] = few if n < FEWEST else "a typical joint resists"
    if not others:
        what = "each joint" if joint == ALL_JOINTS else f"joint {level(joint)}"
        words |= {"what": what, "specimen": short(specimen)}
    numbers = {letter: told[name] for letter, name in letters.items()}
    verdict = f"{'several' if others else 'single'}_{len(letters)}"
    return Conclusion("typical", verdict, numbers, {**names, **words})


def _open(values: pd.DataFrame, lost: Sequence[str]) -> Iterator[Conclusion]:
    """Directions without a typical value: those with a lower end each, the others together."""
    nothing = []
    for name in lost:
        rows = values[values["coordinate"] == name]
        # no value is below its lower end, so no median is below that of the ends
        low = rows.groupby("specimen")["low"].median().median()
        if rows["low"].isna().any():
            nothing.append(name)
            continue
        unit = str(rows["unit"].iloc[0])
        least = Value(float(low), unit, float(low), None, len(rows), f"{HOW}, lower ends")
        words = {"direction": direction(name), "unit": unit}
        yield Conclusion("open", "above", {"least": least}, words)
    if nothing:
        yield Conclusion("open", "both", names={"directions": directions(nothing)})


def differences(values: pd.DataFrame, by: str) -> dict[str, float]:
    """By coordinate, how many times as stiff as the softest the stiffest specimen or level is.

    Parameters
    ----------
    values : as of `joint_values`. by : ``specimen`` or ``joint``; each counts by its median.
    """
    known = values[np.isfinite(values["place"])]
    found = {}
    for name, rows in known.groupby("coordinate", sort=False):
        medians = rows.groupby(by)["value"].median()
        if len(medians) > 1:
            found[str(name)] = float(medians.max() / medians.min())
    return found

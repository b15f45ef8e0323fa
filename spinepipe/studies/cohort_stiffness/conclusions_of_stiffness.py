"""How stiff the joints are, in units of the field; the sentences stand in conclusions.csv."""

from collections.abc import Iterator, Sequence
from math import isfinite, pi

import numpy as np
import pandas as pd

from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.words import AXIS, level, listed, short
from spinepipe.studies.cohort_stiffness.representations import FITTED, SHARED, finest, named
from spinepipe.studies.cohort_stiffness.stages import own_fits
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

FIELD = {"N m/rad": ("N m/deg", pi / 180.0), "N/m": ("N/mm", 1e-3)}
"""Units of the table to those that the field prints, with the factor."""

ALL_JOINTS = "all joints"
"""In the place of a joint, where all joints of a specimen share a value."""

HOW = "stiffness: own fits to all load cases"


def joint_values(stiffness: pd.DataFrame) -> pd.DataFrame:
    """The stiffness that a page tells: each specimen's own fit to all load cases, described one way.

    Of the descriptions it is the finest of those that have a typical value in most directions.
    A value that is not identifiable or at a bound is none: it is empty, and of its region the ends
    are left that exist. What was never fitted, as published stiffness, is not among the rows.

    Returns
    -------
    One row per specimen, joint (`ALL_JOINTS` where they share a value) and coordinate, rotations
    first: ``representation``, ``specimen``, ``joint``, ``coordinate``, ``unit``, ``value``, ``low``,
    ``high``, ``place`` (the value for medians: infinite where only one end is known), ``growth``.
    """
    own = own_fits(stiffness) if len(stiffness) else stiffness.reindex(columns=_READ)
    names = _from_fine_to_coarse([one for one in FITTED if one in set(own["representation"])])
    found = [_rows(own[own["representation"] == name]) for name in names]
    if not found:
        return _rows(own)
    return max(found, key=lambda rows: sum(v is not None for v in typical_by(rows).values()))


_READ = (
    *("representation", "specimen", "joint", "coordinate", "unit", "stiffness", "low", "high"),
    *("identifiable", "at_bound", "growth", "fitted_to", "source"),
)


def _from_fine_to_coarse(names: Sequence[str]) -> list[str]:
    """Those fitted specimen by specimen and with joints as stated first."""
    left, order = list(names), []
    while name := finest(left):
        order.append(name)
        left.remove(name)
    return [*order, *reversed(left)]


def _rows(own: pd.DataFrame) -> pd.DataFrame:
    kept = own[[name for name in _READ if name in own]].copy()
    kept = kept[kept["stiffness"].notna() | kept["low"].notna() | kept["high"].notna()]
    shared = kept["representation"].map(lambda name: name in SHARED and not named(name).by_level)
    kept.loc[shared.astype(bool), "joint"] = ALL_JOINTS
    kept = kept.drop_duplicates(["specimen", "joint", "coordinate"])
    factor = kept["unit"].map(lambda unit: FIELD[unit][1]).astype(float)
    sure = kept["identifiable"].eq(True) & kept["at_bound"].eq("no")
    kept["value"] = (kept["stiffness"].astype(float) * factor).where(sure)
    for end in ("low", "high"):
        kept[end] = kept[end].astype(float) * factor
    above, below = (
        kept["low"].notna() & kept["high"].isna(),
        kept["high"].notna() & kept["low"].isna(),
    )
    one_end = np.select([above & ~sure, below & ~sure], [np.inf, -np.inf], np.nan)
    kept["place"] = kept["value"].fillna(pd.Series(one_end, kept.index))
    kept["unit"] = kept["unit"].map(lambda unit: FIELD[unit][0])
    order = {name: place for place, name in enumerate((*ROTATIONS, *TRANSLATIONS))}
    kept = kept.sort_values("coordinate", key=lambda names: names.map(order), kind="stable")
    return kept.drop(columns=["stiffness", "identifiable", "at_bound", "fitted_to", "source"])


def typical_by(values: pd.DataFrame) -> dict[str, Value | None]:
    """The typical stiffness by coordinate, in the order of `joint_values`."""
    return {str(name): typical(rows) for name, rows in values.groupby("coordinate", sort=False)}


def typical(rows: pd.DataFrame) -> Value | None:
    """Of rows of one coordinate: median and range over specimens, or over the joints of one.

    A specimen counts by the median over its joints. A single value has its own 95 % interval. None
    where the median is not bounded.
    """
    known = rows.dropna(subset="place")
    if known.empty:
        return None
    unit = str(known["unit"].iloc[0])
    if len(known) == 1:
        (one,) = known.to_dict("records")
        ends = (None if pd.isna(one[end]) else float(one[end]) for end in ("low", "high"))
        return Value(one["value"], unit, *ends, 1, HOW) if pd.notna(one["value"]) else None
    numbers = known.set_index("joint")["place"]
    if kind_of(known) == "specimens":
        numbers = known.groupby("specimen", sort=False)["place"].median().dropna()
    middle = float(numbers.median())
    if not isfinite(middle):
        return None
    least, most = (float(x) if isfinite(x) else None for x in (numbers.min(), numbers.max()))
    return Value(middle, unit, least, most, len(numbers), f"{HOW}, median and range")


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


def stiffness_conclusions(values: pd.DataFrame) -> Iterator[Conclusion]:
    """The answer, key numbers, and directions that readings do not bound."""
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
        n = {"n": Value(value.n or 0, source=value.source)}
        yield Conclusion("direction", kind_of(rows), {"value": value, **n}, more)
    yield from _open(values, [name for name in found if name not in told])


def _answer(values: pd.DataFrame, told: dict[str, Value], names: dict[str, str]) -> Conclusion:
    letters = dict(zip("abc", told, strict=False))
    rows = values[values["coordinate"].isin(letters.values())].dropna(subset="place")
    words = {f"direction_{letter}": direction(name) for letter, name in letters.items()}
    (specimen, joint), *others = rows[["specimen", "joint"]].drop_duplicates().to_numpy(str)
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

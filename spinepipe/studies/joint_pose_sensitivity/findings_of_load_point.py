"""What the load point does to stiffness, as sentences: how much, and whether motion tells it."""

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.panels import EVERY_JOINT
from spinepipe.report.words import AXIS, count, fixed, number, tick

CHANGES = 0.1
"""Share of a stiffness by which it must differ over the load points to be named."""


def load_point(results: ResultTables) -> str:
    """How stiffness hangs on the load point, whether the readings tell it, and its range then."""
    rows = results.table("load_point_effect")
    if rows.empty or rows["stated"].isna().all():
        return ""
    reach = (rows["highest"] - rows["lowest"]) / rows["stated"]
    named = rows.assign(reach=reach)[reach > CHANGES]
    least = f"{tick(100.0 * CHANGES)} %"
    points = count(int(rows["points"].max()), "load point")
    if named.empty:
        told = f"No fitted stiffness differs by more than {least} over {points}."
        return " ".join((told, _told_apart(rows)))
    largest = named.sort_values("reach", ascending=False, kind="stable")
    each = largest.drop_duplicates("coordinate")
    parts = [_changes(row, named, rows) for _, row in each.iterrows()]
    others = rows["coordinate"].nunique() > len(each)
    rest = f"; the others differ by less than {least}" if others else ""
    told = f"Over {points}, {'; '.join(parts)}{rest}."
    ranges = [_range(row, rows) for _, row in each.iterrows()]
    return " ".join(one for one in (told, _told_apart(rows), *ranges) if one)


def _changes(row: pd.Series, named: pd.DataFrame, rows: pd.DataFrame) -> str:
    """``flexion–extension stiffness is 9.61 to 31.1 N m/rad (21.1 at the study's): …``."""
    name, unit = AXIS[row["coordinate"]].lower(), row["unit"]
    slopes = [
        f"{fixed(row[f'per_mm_{way}'])} per mm {way}"
        for way in ("anterior", "superior")
        if pd.notna(row[f"per_mm_{way}"])
    ]
    return (
        f"{name} stiffness{_whose(row, named, rows)} is {number(row['lowest'])} to "
        f"{number(row['highest'])} {unit} ({number(row['stated'])} where the study puts the load"
        f"{'; ' if slopes else ''}{' and '.join(slopes)})"
    )


def _whose(row: pd.Series, named: pd.DataFrame, rows: pd.DataFrame) -> str:
    """Of several specimens or joints, in how many it differs, and in which most."""
    of = rows[rows["coordinate"] == row["coordinate"]]
    if len(of) == 1:
        return ""
    here = int((named["coordinate"] == row["coordinate"]).sum())
    place = " ".join(one for one in (row["specimen"], row["joint"]) if one != EVERY_JOINT)
    return f" (in {here} of {len(of)}, most in {place})"


def _told_apart(rows: pd.DataFrame) -> str:
    """Whether the readings exclude any load point."""
    each = rows.drop_duplicates("specimen")
    told = each.dropna(subset=["allowed"])
    if told.empty:
        return "Whether motion tells load points apart cannot be said: too few readings."
    excluded = int((told["fitted"] - told["allowed"]).sum())
    fitted = int(told["fitted"].sum())
    costs = ""
    if told["cost_lowest"].notna().any():
        low, high = told["cost_lowest"].min(), told["cost_highest"].max()
        costs = f" (cost {fixed(low)} to {fixed(high)} times that of the study's point)"
    if excluded:
        return f"The readings exclude {excluded} of {fitted} load points with a fit{costs}."
    return f"The readings exclude none{costs}: motion does not tell where the load acted."


def _range(row: pd.Series, rows: pd.DataFrame) -> str:
    """The range with the load point uncertain, beside that of the fit."""
    sds = [
        f"{tick(row[f'{way}_sd_mm'])} mm {way}"
        for way in ("anterior", "superior")
        if row[f"{way}_sd_mm"] > 0.0
    ]
    if not sds:
        return ""
    whose = ""
    if (rows["coordinate"] == row["coordinate"]).sum() > 1:
        place = " ".join(one for one in (row["specimen"], row["joint"]) if one != EVERY_JOINT)
        whose = f" in {place}"
    return (
        f"With the load known to {' and '.join(sds)} (SD), {AXIS[row['coordinate']].lower()} "
        f"stiffness{whose} lies in {_ends(row, 'uncertain')} {row['unit']} (95 %), "
        f"not in {_ends(row, 'stated')}."
    )


def _ends(row: pd.Series, which: str) -> str:
    """``14.2 to 61``; an open end is told as such."""
    low, high = row[f"{which}_low"], row[f"{which}_high"]
    start = number(low) if pd.notna(low) else "an open lower end"
    end = number(high) if pd.notna(high) else "an open upper end"
    return f"{start} to {end}"

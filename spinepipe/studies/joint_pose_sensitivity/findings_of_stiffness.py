"""What is known of stiffness, as sentences: over joint poses and load points, by the posterior."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.panels import EVERY_JOINT
from spinepipe.report.words import AXIS, count, fixed, listed, number, percent, tick
from spinepipe.status import USABLE, Status
from spinepipe.studies.joint_pose_sensitivity.filters import near_start
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, STIFFNESS_UNITS

MOSTLY = 0.5
"""Where more fits have an open region, the median value is one that the data do not exclude."""

CHANGES = 0.1
"""Share of a stiffness by which it must differ over the load points to be named."""

ALIKE = 0.5
"""Where weights count for more than this share of the poses, the data hardly tell them apart."""

FEW = 10.0
"""Weights that count for fewer poses than this hang on which poses happened to be drawn."""

# --- over joint poses -----------------------------------------------------------------------------


def stiffness(study: JointPoseSensitivity, results: ResultTables) -> str:
    """Median stiffness, with a warning where the data do not hold it."""
    rows = results.table("summary")
    if rows.empty:
        return ""
    chosen = rows[
        (rows["part"] == "poses")
        & (rows["dataset"] == "reduced")
        & (rows["quantity"] == "stiffness")
        & rows["coordinate"].isin(study.calibration.free)
    ].dropna(subset=["median"])
    fitted, success = results.table("calibrations"), results.table("success")
    solved = fitted if fitted.empty else fitted[fitted["status"].isin(USABLE)]
    at_start = {} if fitted.empty else _at_start(study, solved)
    if not (solved.empty or success.empty):  # the reduced poses
        kept = success.loc[success["reduced"], ["specimen", "pose"]]
        solved = solved.merge(kept, on=["specimen", "pose"])
    chosen = chosen[~chosen["coordinate"].isin(list(at_start))]
    is_open = chosen["open_share"].astype(float) > MOSTLY
    held = [
        _medians(part, chosen) + _not_identifiable(solved, str(name), part)
        for name, part in chosen[~is_open].groupby("coordinate", sort=False)
    ]
    not_held = [
        _not_held(part, chosen) for _, part in chosen[is_open].groupby("coordinate", sort=False)
    ]
    told = (
        f"Median stiffness over the reduced poses: {'; '.join(held)}." if held else "",
        f"Not held by the data: {'; '.join(not_held)}." if not_held else "",
        f"Nothing is known of {'; '.join(at_start.values())}." if at_start else "",
        _exact(solved) if held or not_held or at_start else "",
    )
    return " ".join(words for words in told if words)


def _at_start(study: JointPoseSensitivity, solved: pd.DataFrame) -> dict[str, str]:
    """Coordinates whose stiffness most fits left where it started, and in words how many.

    Such a value is the study's own input; a median of it is no result. Values that the data hold
    are left alone, wherever they are.
    """
    found: dict[str, str] = {}
    for name, column, start in zip(
        COORDINATES, STIFFNESS_COLUMNS, study.stiffness.in_order(), strict=True
    ):
        if name not in study.calibration.free or not {column, f"{name}_identifiable"} <= {*solved}:
            continue
        values = solved[[column]].to_numpy(float)
        near = near_start(values, np.array([start]), study.success.near_start_percent)[:, 0]
        lost = near & ~solved[f"{name}_identifiable"].fillna(False).to_numpy(bool)
        if lost.sum() > MOSTLY * len(solved):
            title = AXIS[name].lower()
            found[name] = f"{title}: {lost.sum()} of {len(solved)} fits left it at its start"
    return found


def _not_held(part: pd.DataFrame, chosen: pd.DataFrame) -> str:
    """Which stiffness most fits do not hold, and above what it lies."""
    first = part.iloc[0]
    title = AXIS[first["coordinate"]].lower()
    every = chosen[chosen["coordinate"] == first["coordinate"]]
    if len(every) > 1:
        return f"{title} in {len(part)} of {_all(every)}"
    told = (
        f"{title}, whose region is open in {percent(first['open_share'] * first['n'], first['n'])}"
    )
    if pd.isna(first["lower_end_median"]):
        return f"{told} of fits"
    ends = (
        f"{number(first['lower_end_low_quartile'])} to {number(first['lower_end_high_quartile'])}"
    )
    return f"{told} of fits; lower ends {ends} {first['unit']} (IQR)"


def _medians(part: pd.DataFrame, chosen: pd.DataFrame) -> str:
    """Median and IQR, or the lowest and highest median of several specimens or joints."""
    first = part.iloc[0]
    title = AXIS[first["coordinate"]].lower()
    if len(part) == 1:
        every = chosen[chosen["coordinate"] == first["coordinate"]]
        whose = f"{place}, " if (place := _place(first, every)) and len(every) > 1 else ""
        iqr = f"{number(first['low_quartile'])} to {number(first['high_quartile'])}"
        return f"{title} {number(first['median'])} {first['unit']} ({whose}IQR {iqr})"
    ordered = part.sort_values("median", kind="stable")
    low, high = ordered.iloc[0], ordered.iloc[-1]
    if number(low["median"]) == number(high["median"]):
        return f"{title} {number(low['median'])} {first['unit']} in all {_all(part)}"
    names = [_place(row, part) for row in (low, high)]
    return (
        f"{title} {number(low['median'])} ({names[0]}) to {number(high['median'])} {first['unit']} "
        f"({names[1]}), medians of {_all(part)}"
    )


def _all(part: pd.DataFrame) -> str:
    """``2 specimens``, ``3 joints`` or ``6 joints of 2 specimens``."""
    specimens = count(part["specimen"].nunique(), "specimen")
    if (part["joint"] == EVERY_JOINT).all():
        return specimens
    joints = count(len(part), "joint")
    return joints if part["specimen"].nunique() == 1 else f"{joints} of {specimens}"


def _place(row: pd.Series, part: pd.DataFrame) -> str:
    words = [row["specimen"]] if part["specimen"].nunique() > 1 else []
    words += [row["joint"]] if row["joint"] != EVERY_JOINT else []
    return " ".join(words)


def _not_identifiable(solved: pd.DataFrame, name: str, part: pd.DataFrame) -> str:
    """The share of fitted values that the data do not hold, where there are any."""
    if solved.empty:
        return ""
    own = solved.merge(part[["specimen", "joint"]].drop_duplicates())
    flags = own[f"{name}_identifiable"].dropna()
    lost = int((~flags.astype(bool)).sum())
    if not lost:
        return ""
    share = percent(lost, len(flags))
    return f", but not identifiable in {lost} of {len(flags)} fitted ({share})"


def _exact(solved: pd.DataFrame) -> str:
    """What too few readings mean, where there are too few."""
    if solved.empty:
        return ""
    each = solved.drop_duplicates(["specimen", "pose"])["degrees_of_freedom"]
    few = int((each <= 0).sum())
    if not few:
        return ""
    if (each == 0).all():
        return "All fits are exact: as many readings as unknowns, so no misfit can show."
    which = f"All {len(each)} fits" if few == len(each) else f"{few} of {len(each)} fits"
    return f"{which} have no more readings than unknowns: such fits are exact or undetermined."


# --- over load points -----------------------------------------------------------------------------


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
        return " ".join((told, _excluded_points(rows)))
    largest = named.sort_values("reach", ascending=False, kind="stable")
    each = largest.drop_duplicates("coordinate")
    parts = [_changes(row, named, rows) for _, row in each.iterrows()]
    others = rows["coordinate"].nunique() > len(each)
    rest = f"; the others differ by less than {least}" if others else ""
    told = f"Over {points}, {'; '.join(parts)}{rest}."
    ranges = [_range(row, rows) for _, row in each.iterrows()]
    return " ".join(one for one in (told, _excluded_points(rows), *ranges) if one)


def _changes(row: pd.Series, named: pd.DataFrame, rows: pd.DataFrame) -> str:
    """``flexion–extension stiffness is 9.61 to 31.1 N m/rad (21.1 at the study's): …``."""
    name, unit = AXIS[row["coordinate"]].lower(), row["unit"]
    slopes = [
        f"{fixed(row[f'per_mm_{way}'])} per mm {way}"
        for way in ("anterior", "superior")
        if pd.notna(row[f"per_mm_{way}"])
    ]
    whose = ""
    of = rows[rows["coordinate"] == row["coordinate"]]
    if len(of) > 1:  # in how many specimens or joints it differs, and in which most
        here = int((named["coordinate"] == row["coordinate"]).sum())
        place = " ".join(one for one in (row["specimen"], row["joint"]) if one != EVERY_JOINT)
        whose = f" (in {here} of {len(of)}, most in {place})"
    return (
        f"{name} stiffness{whose} is {number(row['lowest'])} to "
        f"{number(row['highest'])} {unit} ({number(row['stated'])} where the study puts the load"
        f"{'; ' if slopes else ''}{' and '.join(slopes)})"
    )


def _excluded_points(rows: pd.DataFrame) -> str:
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


# --- the posterior --------------------------------------------------------------------------------


def posterior(results: ResultTables) -> list[str]:
    """Sentences of stiffness, landmarks, predicted motion and poses; none without the tables."""
    rows = results.table("posterior")
    if rows.empty:
        return []
    lost = rows[rows["status"] != Status.CONVERGED.value].drop_duplicates("specimen")
    why = [f"{row['specimen']} ({row['message']})" for _, row in lost.iterrows()]
    good = rows[rows["status"] == Status.CONVERGED.value]
    told = [
        f"No posterior is told of {listed(why)}." if why else "",
        _intervals(good[good["quantity"] == "stiffness"]),
        _known_landmarks(good[good["quantity"] == "landmark"]),
        _readings_in_band(results.table("posterior_motion")),
        *_pose_weights(results.table("pose_weights")),
    ]
    return [sentence for sentence in told if sentence]


def _intervals(rows: pd.DataFrame) -> str:
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


def _known_landmarks(rows: pd.DataFrame) -> str:
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


def _readings_in_band(rows: pd.DataFrame) -> str:
    """How many readings lie where the posterior says that readings lie."""
    read = rows[(rows["status"] == Status.CONVERGED.value) & rows["inside"].notna()]
    if read.empty:
        return ""
    inside = int(read["inside"].astype(bool).sum())
    return (
        f"{inside} of {len(read)} readings lie in the 95 % band that the posterior predicts for "
        "them. The same readings made the band: this can refute the model, not confirm it."
    )


def _pose_weights(rows: pd.DataFrame) -> Iterator[str]:
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
        best, share = int(str(each.idxmax())), percent(round(1e4 * float(each.max())), 10_000)
        if effective > ALIKE * len(each):
            yield (
                f"{lead}. The data hardly tell poses apart: no pose is to be chosen, and the "
                f"likeliest, {best}, has {share} of the weight."
            )
        elif effective < FEW:
            yield (
                f"{lead}. Few were drawn where the data want them: which pose is likeliest hangs "
                "on the draw. Go by the posterior, or sample more poses."
            )
        else:
            suiting = []  # the stiffnesses that suit the likeliest pose
            for _, row in part[part["pose"] == best].iterrows():
                coordinate = COORDINATES[STIFFNESS_COLUMNS.index(row["unknown"])]
                where = "" if row["joint"] == "*" else f" of {row['joint']}"
                value = f"{number(row['value'])} {STIFFNESS_UNITS[coordinate]}"
                suiting.append(f"{AXIS[coordinate].lower()}{where} {value}")
            yield (
                f"{lead}. The data prefer some: the likeliest, {best}, has {share} of the "
                f"weight, with {'; '.join(suiting)}."
            )

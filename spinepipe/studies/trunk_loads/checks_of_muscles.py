"""What may be wrong with muscles that a cohort brings along, and with tables that name levels."""

from collections.abc import Iterator, Mapping

import pandas as pd

from spinepipe.muscles.trunk import BODIES, LEVELS, SIDES, SLICES
from spinepipe.problems import Problem, did_you_mean, one_of

PLACES = tuple(dict.fromkeys((*BODIES, *reversed(SLICES))))
"""Bodies that a point of a muscle may belong to: T1 to T10 move with T11."""

STRENGTHS = ("pcsa_mm2", "max_isometric_force_n")


def muscle_problems(cohort: str, further: Mapping[str, pd.DataFrame]) -> Iterator[Problem]:
    """Everything that is wrong with muscles.csv, muscle_parameters.csv and columns of levels.

    Parameters
    ----------
    further : tables by stem, indexed by the number of the line.
    """
    points, muscles = further.get("muscles"), further.get("muscle_parameters")
    if points is not None:
        yield from _points(f"{cohort}/muscles.csv", points)
    if muscles is not None:
        yield from _parameters(f"{cohort}/muscle_parameters.csv", muscles)
    if points is not None and muscles is not None:
        yield from _both(cohort, points, muscles)
        yield from _sides(f"{cohort}/muscles.csv", points, muscles)
    for stem, rows in further.items():
        if "level" in rows:
            yield from _levels(f"{cohort}/{stem}.csv", rows["level"].dropna())


def _points(file: str, rows: pd.DataFrame) -> Iterator[Problem]:
    for line, body in rows["body"].items():
        if body not in PLACES:
            remedy = did_you_mean(str(body), PLACES, "ribs, arms and head belong to T11")
            place = (file, int(str(line)), "body")
            yield Problem(*place, f"unknown body '{body}'", one_of(PLACES), remedy)
    counted = rows["muscle"].map(rows["muscle"].value_counts())
    for line, name in rows["muscle"][counted == 1].items():
        found, allowed = f"{name} has one point", "two points or more, from end to end"
        yield Problem(file, int(str(line)), "muscle", found, allowed, "add its other end")


def _parameters(file: str, rows: pd.DataFrame) -> Iterator[Problem]:
    there = [name for name in STRENGTHS if name in rows]
    for line, row in rows.iterrows():
        place, name = (file, int(str(line))), row["muscle"]
        if row["side"] not in SIDES:
            remedy = did_you_mean(str(row["side"]), SIDES, "write right or left")
            yield Problem(*place, "side", f"'{row['side']}'", one_of(SIDES), remedy)
        given = {column: float(row[column]) for column in there if not pd.isna(row[column])}
        for column, value in given.items():
            if value <= 0.0:
                found = f"{name} has {value:g}"
                remedy = "write its size, or delete the muscle"
                yield Problem(*place, column, found, "above 0: it could not pull", remedy)
        if not given:
            found, allowed = f"neither of {name}", " or ".join(STRENGTHS)
            yield Problem(*place, STRENGTHS[0], found, allowed, "fill one of the cells")


def _both(cohort: str, points: pd.DataFrame, muscles: pd.DataFrame) -> Iterator[Problem]:
    """Muscles that one of the two files has and the other has not."""
    files = {"muscles": points["muscle"], "muscle_parameters": muscles["muscle"]}
    for stem, other in (("muscles", "muscle_parameters"), ("muscle_parameters", "muscles")):
        known = files[other].drop_duplicates().tolist()
        alone = files[stem].drop_duplicates()
        for line, name in alone[~alone.isin(known)].items():
            place = (f"{cohort}/{stem}.csv", int(str(line)), "muscle")
            remedy = did_you_mean(str(name), known, f"add it to {other}.csv or delete it")
            allowed = f"a muscle of {other}.csv"
            yield Problem(*place, f"{name} is not in {other}.csv", allowed, remedy)


def _sides(file: str, points: pd.DataFrame, muscles: pd.DataFrame) -> Iterator[Problem]:
    """Muscles that lie on the other side than they are said to, or all of them."""
    side = dict(zip(muscles["muscle"], muscles["side"], strict=True))
    judged = {
        str(name): rows["z_mm"]
        for name, rows in points.groupby("muscle", sort=False)
        if side.get(name) in SIDES
    }
    wrong = {name: z for name, z in judged.items() if (_outwards(z, side[name]) < 0.0).all()}
    if len(judged) > 1 and len(wrong) == len(judged):
        found, allowed = "every muscle on the other side of the body", "z to the right"
        remedy = "change the sign of z: the axes are x forwards, y up, z to the right"
        yield Problem(file, None, "z_mm", found, allowed, remedy)
        return
    for name, z in wrong.items():
        found = f"{name} is {side[name]} and lies at z {z.min():g} to {z.max():g} mm"
        allowed = "z above 0 on the right, below 0 on the left"
        remedy = "mirrored twice? change the sign of its z, or its side"
        yield Problem(file, int(str(z.index[0])), "z_mm", found, allowed, remedy)


def _outwards(z: "pd.Series[float]", side: str) -> "pd.Series[float]":
    return z if side == "right" else -z


def _levels(file: str, column: "pd.Series[str]") -> Iterator[Problem]:
    known = (*LEVELS, *SLICES)
    for line, name in column[~column.isin(known)].items():
        remedy = did_you_mean(str(name), known, "a joint is named upper vertebra first")
        place = (file, int(str(line)), "level")
        yield Problem(*place, f"unknown level '{name}'", one_of(known), remedy)

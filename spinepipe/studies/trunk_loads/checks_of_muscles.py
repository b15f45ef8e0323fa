"""What may be wrong with muscles that a cohort brings along, and with tables that name levels."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.muscles.folder import PELVIS, SHEATH, in_ground
from spinepipe.muscles.trunk import BODIES, LEVELS, SIDES, SLICES
from spinepipe.problems import InputProblem, Spelling
from spinepipe.units import MM_PER_M

CARRIERS = tuple(dict.fromkeys((*BODIES, *reversed(SLICES))))
"""Vertebrae that a body may move with: T1 to T10 move with T11."""

PLACES = (*CARRIERS, *PELVIS, SHEATH)
"""Bodies that a point of a muscle may belong to, where the cohort tells of no others."""


def muscle_problems(cohort: Cohort) -> Iterator[InputProblem]:
    """Everything that is wrong with muscles.csv, muscle_parameters.csv, body_frames.csv and columns
    of levels."""
    name, further = cohort.name, cohort.further
    points, muscles = further.get("muscles"), further.get("muscle_parameters")
    frames = _frames_of_owner(cohort)
    if frames is not None:
        yield from _frames(f"{name}/body_frames.csv", further["body_frames"], not frames.empty)
    if points is not None:
        yield from _points(f"{name}/muscles.csv", points, frames)
    if points is not None and muscles is not None:
        yield from _sides(f"{name}/muscles.csv", points, muscles, frames)
    for stem, rows in further.items():
        if "level" in rows:
            yield from _levels(f"{name}/{stem}.csv", rows["level"].dropna())


def _frames_of_owner(cohort: Cohort) -> pd.DataFrame | None:
    """Frames of the specimen whose joints are taken, the first of joints.csv."""
    frames = cohort.further.get("body_frames")
    if frames is None or cohort.joints is None:
        return frames
    return frames[frames["specimen"] == cohort.joints["specimen"].iloc[0]]


def _frames(file: str, rows: pd.DataFrame, has_owner: bool) -> Iterator[InputProblem]:
    """Bodies of anybody that move with nothing known; no rows of whose muscles are taken."""
    if not has_owner:
        found, allowed = "no row of the first specimen of joints.csv", "a frame for each body"
        yield InputProblem(
            file, None, "specimen", found, allowed, "add its rows, or delete the file"
        )
    as_written = {name.casefold(): name for name in CARRIERS}
    for line, body in rows["body"].items():
        if body not in CARRIERS and (meant := as_written.get(str(body).casefold())):
            place, found = (file, int(str(line)), "body"), f"unknown body '{body}'"
            yield InputProblem(*place, found, f"'{meant}', as elsewhere", f"write '{meant}'")


def _points(file: str, rows: pd.DataFrame, frames: pd.DataFrame | None) -> Iterator[InputProblem]:
    known = PLACES if frames is None else tuple(frames["body"])
    otherwise = "ribs, arms and head belong to T11, or add body_frames.csv with their frames"
    if frames is not None:
        otherwise = "add its frame to body_frames.csv"
    bodies = Spelling(known, otherwise)
    for line, body in rows["body"][~rows["body"].isin(known)].items():
        place, found = (file, int(str(line)), "body"), f"unknown body '{body}'"
        yield InputProblem(*place, found, bodies.allowed, bodies.remedy(str(body)))


def _sides(
    file: str, points: pd.DataFrame, muscles: pd.DataFrame, frames: pd.DataFrame | None
) -> Iterator[InputProblem]:
    """Sides most of whose muscles lie on the other one; single ones are mirrored with a remark."""
    side = dict(zip(muscles["muscle"], muscles["side"], strict=True))
    if frames is not None:
        points = points[points["body"].isin(list(frames["body"]))]
    if points.empty:
        return
    right = points.assign(right_m=_right_of_midline(points, frames)).groupby("muscle", sort=False)
    lies = {str(name): float(rows["right_m"].sum()) for name, rows in right}
    wrong = {one: [m for m, z in lies.items() if _wrong(z, side.get(m), one)] for one in SIDES}
    judged = {one: [m for m in lies if side.get(m) == one] for one in SIDES}
    most = [one for one in SIDES if 2 * len(wrong[one]) > len(judged[one])]
    if len(most) == len(SIDES):
        found, allowed = "most muscles on the other side of the body", "z to the right"
        remedy = "change the sign of z: the axes are x forwards, y up, z to the right"
        yield InputProblem(file, None, "z_mm", found, allowed, remedy)
        return
    for one in most:
        first = points.index[points["muscle"] == wrong[one][0]][0]
        found = (
            f"{len(wrong[one])} of {len(judged[one])} muscles that are {one} lie on the other side,"
            f" {wrong[one][0]} among them"
        )
        allowed = "z above 0 on the right, below 0 on the left"
        remedy = "not mirrored, or mirrored twice? change the sign of their z, or their side"
        yield InputProblem(file, int(str(first)), "z_mm", found, allowed, remedy)


def _right_of_midline(points: pd.DataFrame, frames: pd.DataFrame | None) -> "pd.Series[float]":
    """Metres by which points lie to the right in ground."""
    own = points[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / MM_PER_M
    placed = own if frames is None else in_ground(frames, points["body"].tolist(), own)
    return pd.Series(np.asarray(placed[:, 2]), points.index)


def _wrong(right_m: float, called: str | None, side: str) -> bool:
    """Whether a muscle is called by a side and lies on the other."""
    return called == side and (right_m < 0.0 if side == "right" else right_m > 0.0)


def _levels(file: str, column: "pd.Series[str]") -> Iterator[InputProblem]:
    levels = Spelling((*LEVELS, *SLICES), "a joint is named upper vertebra first")
    for line, name in column[~column.isin(levels.known)].items():
        place, found = (file, int(str(line)), "level"), f"unknown level '{name}'"
        yield InputProblem(*place, found, levels.allowed, levels.remedy(str(name)))

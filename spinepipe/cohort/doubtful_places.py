"""Lengths in another unit, points far from their vertebra, columns of points exchanged.

Metres for millimetres make a file unsound (`check_geometry`); centimetres and inches do not, and a
load point in another unit than the landmarks only moves the load.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import log
from typing import Any

import numpy as np

from spinepipe.anatomy.levels import ONE_SPREAD, SIZE_SPREAD, height_mm, spacing_mm
from spinepipe.cohort.answers import of_specimens, typical
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt, Found, Group
from spinepipe.cohort.neutral_pose import NeutralPose
from spinepipe.documents.csv_table import read_rows
from spinepipe.effects.contract import Array
from spinepipe.problems import Problem

UNITS = {
    1e3: "lengths in m",
    10.0: "lengths in cm",
    25.4: "lengths in inches",
    0.1: "lengths multiplied by 10",
    1.0 / 25.4: "lengths multiplied by 25.4",
}
"""What a number must be multiplied by to be mm, and what it is in."""

NEAR_MM = 35.0
"""Points that are no further from their vertebra are where they should be."""

NEARER = 1.5
"""Times that another unit must bring points nearer to their vertebrae."""

THERE_MM = 70.0
"""And how near: as slices of a trunk have their centres of mass in front of the spine."""

MOST_ALIKE = 0.6
"""Share of the lengths of a specimen that are too large or small by one factor, if a unit is."""

MOST = 0.8
"""Share of the points that a mistake of the whole column must explain."""

NEARER_SWAPPED = 2.0
"""And exchanged columns: of these there are more."""

FAR_MM: Mapping[str, float] = {
    "bodies": 150.0,
    "loads": 300.0,
    "preload": 300.0,
    "landmarks": 120.0,
}
"""From the middle of a vertebra, chosen. Bodies: slices of a trunk lie up to 50 mm in front
(Pearsall 1996, doi 10.1007/BF02667349), those of a full-body model 63 mm, its pelvis 121 mm from
L5S1, and arms may hang on them; loads: lever arms of rigs; landmarks: tips of processes."""

NOWHERE_MM = 1000.0
"""No point of a specimen is so far from its vertebra."""

FORCE = ("fx_n", "fy_n", "fz_n")

COLUMNS = {
    "bodies": ("com_x_mm", "com_y_mm", "com_z_mm"),
    "loads": ("px_mm", "py_mm", "pz_mm"),
    "preload": ("px_mm", "py_mm", "pz_mm"),
    "landmarks": ("x_mm", "y_mm", "z_mm"),
}

_Behind = tuple[str, str, bool, Array]
"""Words, column, whether certain, and the points as they would be without the mistake."""

_Told = dict[tuple[str, str, bool], list[tuple[int, str, float]]]


def doubtful_points(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[Doubt]:
    """Doubts about where centres of mass and load points are beside joints that are trusted."""
    for stem in ("bodies", "loads", "preload", *(() if cohort.joints is None else ("landmarks",))):
        yield from _points(cohort, poses, stem)


def first_line(cohort: Cohort, stem: str, row: int) -> int | None:
    """Line, as an editor shows it, of a row of a table, counted from 0."""
    rows, _ = read_rows(cohort.folder / f"{stem}.csv", stem)
    return None if rows is None or row >= len(rows.lines) else rows.lines[row]


def first_row(
    cohort: Cohort,
    stem: str,
    specimen: str,
    test: str,
    column: str | None = None,
    joint: str | None = None,
) -> int | None:
    """Line of a test's first row; of a column the first whose cell is not empty or 0."""
    table: Any = getattr(cohort, stem)
    rows = table["specimen"].isin([specimen, "*"]) & (table["test"] == test)
    if joint is not None:
        rows &= table["joint"] == joint
    filled = rows if column is None else rows & table[column].notna() & (table[column] != 0.0)
    chosen = np.flatnonzero(filled if filled.any() else rows)
    return first_line(cohort, stem, int(chosen[0])) if len(chosen) else None


def file_of(cohort: Cohort, stem: str) -> str:
    """A table's file in messages."""
    return f"{cohort.folder.resolve().name}/{stem}.csv"


def unit_like(ratio: float) -> float | None:
    """What lengths must be multiplied by that are so many times too large; None if no unit does."""
    factor = min(UNITS, key=lambda one: abs(log(ratio * one)))
    return factor if abs(log(ratio * factor)) <= log(SIZE_SPREAD) else None


def _ratios(cohort: Cohort, pose: NeutralPose) -> dict[str, float]:
    """Length of each vertebra, from joint to joint, over that of its level.

    Where there is one joint alone, heights of bodies count, from endplate to endplate.
    """
    expected = [spacing_mm(vertebra) for vertebra in pose.vertebrae[1:-1]]
    found = zip(pose.vertebrae[1:-1], pose.spacing, expected, strict=True)
    ratios = {name: float(mm) / usual for name, mm, usual in found if usual is not None}
    return ratios or heights(cohort, pose.specimen)


def heights(cohort: Cohort, specimen: str) -> dict[str, float]:
    """Height of each body, from endplate to endplate, over that of its level."""
    table = cohort.landmarks
    if table is None:
        return {}
    own = table[table["specimen"] == specimen]
    names = zip(own["vertebra"], own["landmark"], strict=True)
    points = dict(zip(names, own[list(COLUMNS["landmarks"])].to_numpy(float), strict=True))
    faces = ("superior_endplate_centre", "inferior_endplate_centre")
    return {
        name: float(np.linalg.norm(points[name, faces[0]] - points[name, faces[1]])) / usual
        for name in cohort.vertebrae
        if (usual := height_mm(name)) is not None
        if (name, faces[0]) in points and (name, faces[1]) in points
    }


def doubtful_sizes(cohort: Cohort, poses: Sequence[NeutralPose]) -> Found:
    """Vertebrae of a size that no spine has: all of a specimen, or one between its neighbours."""
    whole: dict[float | None, dict[str, float]] = defaultdict(dict)
    single: dict[str, list[Doubt]] = {}
    for pose in poses:
        ratios = _ratios(cohort, pose)
        size = _typical_size(cohort, pose, ratios)
        if size <= 0.0 or abs(log(size)) > log(SIZE_SPREAD):
            whole[unit_like(size) if size > 0.0 else None][pose.specimen] = size
        elif odd := list(_odd_vertebrae(cohort, pose, ratios, size)):
            single[pose.specimen] = odd
    every = [_of_another_size(cohort, unit, found) for unit, found in whole.items()]
    every += [doubt for doubts in single.values() for doubt in doubts]
    return Found.of(every, [*single, *(name for found in whole.values() for name in found)])


def _stem(cohort: Cohort) -> str:
    return "landmarks" if cohort.joints is None else "joints"


def _typical_size(cohort: Cohort, pose: NeutralPose, ratios: Mapping[str, float]) -> float:
    """Of a specimen over that of its levels; 1 where single points make the difference.

    Bodies count too, so that no single point decides.
    """
    lengths = list(ratios.values())
    if cohort.joints is None:
        lengths += heights(cohort, pose.specimen).values()
    size = typical(lengths) if lengths else 1.0
    alike = [
        one for one in lengths if size > 0.0 and one < SIZE_SPREAD * size < SIZE_SPREAD**2 * one
    ]
    return size if not lengths or size == 0.0 or len(alike) > MOST_ALIKE * len(lengths) else 1.0


def _of_another_size(cohort: Cohort, unit: float | None, found: Mapping[str, float]) -> Doubt:
    size = typical(list(found.values()))
    shown = (
        f"neighbouring joints {size:.3g} times as far apart as in a spine "
        f"({of_specimens(found, cohort.specimen_names)})"
    )
    allowed = f"1/{SIZE_SPREAD:g} to {SIZE_SPREAD:g} times the mean of the level"
    remedy = (
        "look at the unit of lengths"
        if unit is None
        else f"suspected: {UNITS[unit]} and not mm ({1.0 / unit:.3g}); multiply "
        f"{', '.join(COLUMNS['landmarks'])} by {round(unit, 4):g}"
    )
    stem = _stem(cohort)
    rows = np.flatnonzero(getattr(cohort, stem)["specimen"] == next(iter(found)))
    line = first_line(cohort, stem, int(rows[0]))
    problem = Problem(file_of(cohort, stem), line, "x_mm", shown, allowed, remedy)
    return Doubt(problem, "lengths", certain=unit is not None)


def _odd_vertebrae(
    cohort: Cohort, pose: NeutralPose, ratios: Mapping[str, float], usual: float
) -> Iterator[Doubt]:
    """Single vertebrae much longer or shorter than the rest of their specimen."""
    stem = _stem(cohort)
    for vertebra, ratio in ratios.items():
        if 1.0 / ONE_SPREAD <= ratio / usual <= ONE_SPREAD:
            continue
        shown = f"{vertebra} of {pose.specimen} {ratio:.3g} times as long as the level is"
        allowed = f"1/{ONE_SPREAD:g} to {ONE_SPREAD:g} times, as the rest of the specimen is"
        joint = cohort.joint_names[cohort.vertebrae.index(vertebra) - 1]
        named = ("vertebra", vertebra) if stem == "landmarks" else ("joint", joint)
        table = getattr(cohort, stem)
        rows = np.flatnonzero((table["specimen"] == pose.specimen) & (table[named[0]] == named[1]))
        line = first_line(cohort, stem, int(rows[0])) if len(rows) else None
        remedy = f"look for a misplaced point of {vertebra} or of its neighbours"
        place = (file_of(cohort, stem), line, "y_mm")
        yield Doubt(Problem(*place, shown, allowed, remedy), "lengths")


def _points(cohort: Cohort, poses: Sequence[NeutralPose], stem: str) -> Iterator[Doubt]:
    """Points far from their vertebra, and what would bring them near it, all of a specimen's."""
    table: Any = getattr(cohort, stem)
    if table is None:
        return
    acting = table[list(COLUMNS[stem])].notna().all(axis=1)
    if "fx_n" in table:
        acting &= (table[list(FORCE)] != 0.0).any(axis=1)
    told: _Told = defaultdict(list)
    for pose in poses:
        rows = np.flatnonzero(acting & table["specimen"].isin([pose.specimen, "*"]))
        if len(rows):
            points = table[list(COLUMNS[stem])].to_numpy(float)[rows]
            near = np.array([pose.near(name) for name in table["vertebra"].iloc[rows]])
            other = _at_another(pose, points, near) if "fx_n" in table else None
            behind = _behind(stem, table.iloc[rows], points, near)
            grown = behind is not None and np.linalg.norm(behind[3]) > 2.0 * np.linalg.norm(points)
            if other is not None and not grown:  # small ones are at a low vertebra in cm too
                away = float(np.linalg.norm(points - near, axis=1).max())
                words = f"suspected: the wrong vertebra; the points lie at {other}"
                told[words, "vertebra", False].append((int(rows[0]), pose.specimen, away))
                continue
            for suspect in _suspects(stem, table.iloc[rows], points, near, behind):
                key = (suspect.words, suspect.column, suspect.certain)
                told[key].append((int(rows[suspect.row]), pose.specimen, suspect.away_mm))
    for (words, column, certain), found in told.items():
        yield _of_points(cohort, stem, words, column, certain, found)


@dataclass(frozen=True)
class _Suspect:
    """A row, counted from 0, whose point is elsewhere: what is behind it, how sure, how far."""

    row: int
    words: str
    column: str
    certain: bool
    away_mm: float


def _suspects(
    stem: str, table: Any, points: Array, near: Array, behind: _Behind | None
) -> Iterator[_Suspect]:
    """Rows of a specimen whose points are elsewhere."""
    away = np.linalg.norm(points - near, axis=1)
    if behind is not None:
        words, column, certain, moved = behind
        nearer = np.linalg.norm(moved - near, axis=1) < away
        for row in np.flatnonzero(nearer).tolist():
            yield _Suspect(row, words, column, certain, float(away[row]))
        return
    for row in _exchanged_names(table, points, near) if stem in ("landmarks", "bodies") else ():
        told = "suspected: names of two neighbouring vertebrae exchanged; exchange them back"
        yield _Suspect(row, told, "vertebra", False, float(away[row]))
    for row in np.flatnonzero(away > FAR_MM[stem]).tolist():
        column = COLUMNS[stem][int(np.argmax(np.abs(points[row] - near[row])))]
        sure = bool(away[row] > NOWHERE_MM)
        yield _Suspect(row, "look for a misplaced point", column, sure, float(away[row]))


def _at_another(pose: NeutralPose, points: Array, near: Array) -> str | None:
    """The vertebra at which all loads act, where that is another one than they name."""
    here = _distance(points, near)
    away = {name: _distance(points, pose.near(name)) for name in pose.vertebrae[1:]}
    best = min(away, key=lambda name: away[name])
    return best if here > NEAR_MM and away[best] * NEARER_SWAPPED < here else None


def _exchanged_names(table: Any, points: Array, near: Array) -> Iterator[int]:
    """Rows of two neighbours that are much nearer to each other's middle than to their own."""
    names = table["vertebra"].to_numpy()
    levels = list(dict.fromkeys(names))
    centres = np.array([points[names == name].mean(axis=0) for name in levels])
    middles = np.array([near[names == name][0] for name in levels])
    for first, second in combinations(range(len(levels)), 2):
        pair = [first, second]
        own = np.linalg.norm(centres[pair] - middles[pair], axis=1).sum()
        others = np.linalg.norm(centres[pair] - middles[pair[::-1]], axis=1).sum()
        if own > NEAR_MM and others * NEARER_SWAPPED < own:
            yield from np.flatnonzero(np.isin(names, [levels[at] for at in pair])).tolist()


def _behind(stem: str, table: Any, points: Array, near: Array) -> _Behind | None:
    """What brings the points of a specimen near their vertebrae: a unit or exchanged columns."""
    here = _distance(points, near)
    if here <= (NEAR_MM if len(points) == 1 or "fx_n" in table else NEAR_MM / 2.0):
        return None
    tried = [*_units(stem, points), *_others(stem, points)]
    best = min(tried, key=lambda one: one[0] * _distance(one[4], near))
    needed, told, column, sure, moved = best
    there = _distance(moved, near)
    shrunk = float(np.abs(moved).max()) < float(np.abs(points).max()) / 5.0
    if there * needed >= here or there > (NEAR_MM if shrunk and len(points) == 1 else THERE_MM):
        return None
    nearer = np.linalg.norm(moved - near, axis=1) < np.linalg.norm(points - near, axis=1) + 5.0
    if nearer.mean() < MOST:  # a unit is that of all rows
        return None
    sure = sure and len(points) > 1 and there < NEAR_MM and here > 3.0 * there
    return f"suspected: {told}", column, sure or here > NOWHERE_MM, moved


_Try = tuple[float, str, str, bool, Array]
"""Times nearer that is asked, what is suspected, column, whether it may be certain, the points."""


def _units(stem: str, points: Array) -> Iterator[_Try]:
    names = COLUMNS[stem]
    for factor, words in UNITS.items():
        what = words.replace("lengths", "points")
        todo = f"multiply {', '.join(names)} by {round(factor, 4):g}"
        told = f"{what} and not mm ({1.0 / factor:.3g}); {todo}"
        yield NEARER, told, names[0], stem == "bodies", factor * points


def _others(stem: str, points: Array) -> Iterator[_Try]:
    """Exchanged columns, turned signs, and points of other rows."""
    names = COLUMNS[stem]
    for first, second in ((0, 1), (1, 2), (0, 2)):
        order = [0, 1, 2]
        order[first], order[second] = second, first
        told = f"{names[first]} and {names[second]} exchanged; exchange them back"
        yield NEARER_SWAPPED, told, names[first], False, points[:, order]
    for axis, way in enumerate(("backwards", "downwards", "to the left")):
        told = f"the sign of {names[axis]}: counted {way}; turn it"
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        yield NEARER_SWAPPED, told, names[axis], False, sign * points
    if stem == "bodies" and len(points) > 2:
        told = f"{', '.join(names)} relative to the row before and not in ground; add them up"
        yield NEARER_SWAPPED, told, names[1], False, np.cumsum(points, axis=0)
        for step, way in ((-1, "down"), (1, "up")):
            told = f"{', '.join(names)} one row too far {way}: each vertebra has its neighbour's"
            yield NEARER_SWAPPED, told, names[1], False, np.roll(points, step, axis=0)


def _distance(points: Array, near: Array) -> float:
    """Root mean square, mm."""
    return float(np.sqrt(np.mean(np.sum((points - near) ** 2, axis=1))))


def _of_points(
    cohort: Cohort,
    stem: str,
    words: str,
    column: str,
    certain: bool,
    found: Sequence[tuple[int, str, float]],
) -> Doubt:
    rows = sorted({row for row, _, _ in found})
    whose = of_specimens(dict.fromkeys(name for _, name, _ in found), cohort.specimen_names)
    far = max(away for _, _, away in found)
    shown = f"{len(rows)} points up to {far:.3g} mm from the middle of their vertebra ({whose})"
    allowed = f"points at or near the vertebra of their row, at most {FAR_MM[stem]:g} mm"
    place = (file_of(cohort, stem), first_line(cohort, stem, rows[0]), column)
    group: Group = "loads" if stem in ("loads", "preload") else "lengths"
    return Doubt(Problem(*place, shown, allowed, words), group, certain)

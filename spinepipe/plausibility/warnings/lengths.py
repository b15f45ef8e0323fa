"""Lengths in another unit, points far from their vertebra, columns of points exchanged.

Metres for millimetres make a file unsound (`check_geometry`); centimetres and inches do not, and a
load point in another unit than the landmarks only moves the load.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.load_response import typical
from spinepipe.cohort.swapped_landmarks import FAR_MM, XYZ, column_mistakes
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.plausibility.score import BETTER, hypotheses, suspect, usual
from spinepipe.plausibility.warnings.levels import NeutralPose, height_mm, spacing_mm
from spinepipe.plausibility.warnings.warning import (
    PlausibilityWarning,
    TableCell,
    WarningGroup,
    first_row,
    warn,
)

MOST_ALIKE = 0.6
"""Share of the lengths of a specimen that are too large or small by one factor, if a unit is."""

MOST = 0.8
"""Share of the points that a mistake of the whole column must explain."""

UNIT_BETTER = 1.5
"""As `BETTER`, of a unit: it changes all three coordinates, and chance does that less often."""

COLUMNS = {
    "bodies": ("com_x_mm", "com_y_mm", "com_z_mm"),
    "loads": ("px_mm", "py_mm", "pz_mm"),
    "preload": ("px_mm", "py_mm", "pz_mm"),
    "landmarks": XYZ,
}


def stem_of_joints(cohort: Cohort) -> str:
    """The table that says where joints are."""
    return "landmarks" if cohort.joints is None else "joints"


# --- sizes of vertebrae ---------------------------------------------------------------------------


def sizes(cohort: Cohort, poses: Sequence[NeutralPose]) -> WarningGroup:
    """Vertebrae of a size that no spine has: all of a specimen, or one between its neighbours."""
    whole: dict[Any, dict[str, float]] = defaultdict(dict)
    single: dict[str, list[PlausibilityWarning]] = {}
    for pose in poses:
        bodies = _heights(cohort, pose.specimen)
        # length of each vertebra, from joint to joint, over that of its level; where there is one
        # joint alone, bodies count
        lengths = zip(pose.vertebrae[1:-1], pose.spacing, strict=True)
        ratios = {v: float(mm) / level for v, mm in lengths if (level := spacing_mm(v))} or bodies
        size = _typical_size(
            [*ratios.values(), *(() if cohort.joints is not None else bodies.values())]
        )
        if not usual("spine_size").holds(size):
            whole[suspect("length", size, "spine_size")][pose.specimen] = size
        elif odd := list(_odd_vertebrae(cohort, pose, ratios, size)):
            single[pose.specimen] = odd
    found = [one for warnings in single.values() for one in warnings]
    for unit, own in whole.items():
        stem = stem_of_joints(cohort)
        place = TableCell(stem, first_row(cohort, stem, specimen=next(iter(own))), XYZ[0])
        remedy = unit and unit.mend(what="lengths", columns=", ".join(XYZ))
        found.append(
            warn(
                cohort,
                "spine_size",
                place,
                remedy=remedy,
                certain=unit is not None,
                whose=own,
                size=typical(list(own.values())),
            )
        )
    return WarningGroup.of(found, [*single, *(name for own in whole.values() for name in own)])


def _heights(cohort: Cohort, specimen: str) -> dict[str, float]:
    """Height of each body, from endplate to endplate, over that of its level."""
    table = cohort.landmarks
    if table is None:
        return {}
    own = table[table["specimen"] == specimen]
    names = zip(own["vertebra"], own["landmark"], strict=True)
    points = dict(zip(names, own[list(XYZ)].to_numpy(float), strict=True))
    top, bottom = FRAME_LANDMARKS[:2]
    return {
        name: float(np.linalg.norm(points[name, top] - points[name, bottom])) / level
        for name in cohort.vertebrae
        if (level := height_mm(name)) and {(name, top), (name, bottom)} <= set(points)
    }


def _typical_size(ratios: Sequence[float]) -> float:
    """Of a specimen over that of its levels; 1 where single points make the difference."""
    size = typical(ratios) if ratios else 1.0
    spread = usual("spine_size").high
    alike = [one for one in ratios if size > 0.0 and size / spread < one < spread * size]
    return size if size == 0.0 or len(alike) > MOST_ALIKE * len(ratios) else 1.0


def _odd_vertebrae(
    cohort: Cohort, pose: NeutralPose, ratios: Mapping[str, float], size: float
) -> Iterator[PlausibilityWarning]:
    """Single vertebrae much longer or shorter than the rest of their specimen."""
    stem = stem_of_joints(cohort)
    for vertebra, ratio in ratios.items():
        if not usual("vertebra_size").holds(ratio / size):
            joint = cohort.joint_names[cohort.vertebrae.index(vertebra) - 1]
            named = {"vertebra": vertebra} if stem == "landmarks" else {"joint": joint}
            place = TableCell(
                stem, first_row(cohort, stem, specimen=pose.specimen, **named), XYZ[1]
            )
            yield warn(
                cohort, "vertebra_size", place, whose=[pose.specimen], vertebra=vertebra, size=ratio
            )


# --- points beside joints that are trusted --------------------------------------------------------


class _Told(NamedTuple):
    """Remedy, column and whether it is certain: one line for all points that share them."""

    remedy: str
    column: str
    certain: bool


class _Explained(NamedTuple):
    """What is behind points that are elsewhere, and where they would be without it."""

    told: _Told
    points: Array


def points(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[PlausibilityWarning]:
    """Centres of mass, load points and landmarks that are far from their vertebra."""
    for stem in ("bodies", "loads", "preload", *(() if cohort.joints is None else ("landmarks",))):
        table: pd.DataFrame | None = getattr(cohort, stem)
        if table is None:
            continue
        acting = table[list(COLUMNS[stem])].notna().all(axis=1)
        if "fx_n" in table:
            acting &= (table[["fx_n", "fy_n", "fz_n"]] != 0.0).any(axis=1)
        told: dict[_Told, list[tuple[int, str, float]]] = defaultdict(list)
        for pose in poses:
            rows = np.flatnonzero(acting & table["specimen"].isin([pose.specimen, "*"]))
            if len(rows):
                own = table[list(COLUMNS[stem])].to_numpy(float)[rows]
                near = np.array([pose.near(name) for name in table["vertebra"].iloc[rows]])
                away = np.linalg.norm(own - near, axis=1)
                for row, behind in _suspects(stem, table.iloc[rows], own, near, pose):
                    told[behind].append((int(rows[row]), pose.specimen, float(away[row])))
        for one, found in told.items():
            lines = sorted({row for row, _, _ in found})
            yield warn(
                cohort,
                f"{stem}_away",
                TableCell(stem, lines[0], one.column),
                remedy=one.remedy,
                certain=one.certain,
                whose=[name for _, name, _ in found],
                range=f"at most {_most_mm(stem):g}",
                count=len(lines),
                away=max(away for _, _, away in found),
            )


def _most_mm(stem: str) -> float:
    """From the middle of a vertebra; of landmarks what the reader of files asks of them too."""
    return FAR_MM if stem == "landmarks" else usual(f"{stem}_away").high


def _suspects(
    stem: str, table: pd.DataFrame, points: Array, near: Array, pose: NeutralPose
) -> Iterator[tuple[int, _Told]]:
    """Rows of a specimen, counted from 0, whose points are elsewhere, and what is behind it."""
    away = np.linalg.norm(points - near, axis=1)
    behind = _explained(stem, table, points, near)
    other = _at_another(pose, points, near) if "fx_n" in table else None
    # Points in cm lie at a low vertebra too: what makes them so much larger comes first.
    if other and not (behind and np.linalg.norm(behind.points) > 2.0 * np.linalg.norm(points)):
        words = f"suspected: the wrong vertebra; the points lie at {other}"
        yield int(np.argmax(away)), _Told(words, "vertebra", False)
    elif behind is not None:
        nearer = np.linalg.norm(behind.points - near, axis=1) < away
        yield from ((row, behind.told) for row in np.flatnonzero(nearer).tolist())
    else:
        words = "suspected: names of two neighbouring vertebrae exchanged; exchange them back"
        for row in _exchanged_names(table, points, near) if stem in ("landmarks", "bodies") else ():
            yield row, _Told(words, "vertebra", False)
        for row in np.flatnonzero(away > _most_mm(stem)).tolist():
            column = COLUMNS[stem][int(np.argmax(np.abs(points[row] - near[row])))]
            sure = not usual("nowhere").holds(away[row])
            yield row, _Told("look for a misplaced point", column, sure)


def _at_another(pose: NeutralPose, points: Array, near: Array) -> str | None:
    """The vertebra at which all loads act, where that is another one than they name."""
    here = _distance(points, near)
    away = {name: _distance(points, pose.near(name)) for name in pose.vertebrae[1:]}
    best = min(away, key=lambda name: away[name])
    return best if not usual("point_near").holds(here) and away[best] * BETTER < here else None


def _exchanged_names(table: pd.DataFrame, points: Array, near: Array) -> Iterator[int]:
    """Rows of two neighbours that are much nearer to each other's middle than to their own."""
    names = table["vertebra"].to_numpy()
    levels = list(dict.fromkeys(names))
    centres = np.array([points[names == name].mean(axis=0) for name in levels])
    middles = np.array([near[names == name][0] for name in levels])
    for first, second in combinations(range(len(levels)), 2):
        pair = [first, second]
        own = np.linalg.norm(centres[pair] - middles[pair], axis=1).sum()
        others = np.linalg.norm(centres[pair] - middles[pair[::-1]], axis=1).sum()
        if not usual("point_near").holds(own) and others * BETTER < own:
            yield from np.flatnonzero(np.isin(names, [levels[at] for at in pair])).tolist()


def _explained(stem: str, table: pd.DataFrame, points: Array, near: Array) -> _Explained | None:
    """What brings the points of a specimen near their vertebrae: a unit or exchanged columns."""
    here, near_mm = _distance(points, near), usual("point_near").high
    if here <= (near_mm if len(points) == 1 or "fx_n" in table else near_mm / 2.0):
        return None
    tried = list(_tried(stem, points))
    better, remedy, column, of_all, moved = min(tried, key=lambda t: t[0] * _distance(t[4], near))
    there = _distance(moved, near)
    # Slices of a trunk have their centres in front of it; one point may be near in cm by chance.
    shrunk = len(points) == 1 and float(np.abs(moved).max()) < float(np.abs(points).max()) / 5.0
    most = near_mm if shrunk else usual("point_near").usual_high
    if there * better >= here or there > most:
        return None
    nearer = np.linalg.norm(moved - near, axis=1) < np.linalg.norm(points - near, axis=1) + 5.0
    if nearer.mean() < MOST:
        return None
    sure = of_all and len(points) > 1 and there < near_mm and here > 3.0 * there
    sure |= not usual("nowhere").holds(here)
    return _Explained(_Told(remedy, column, bool(sure)), moved)


_Try = tuple[float, str, str, bool, Array]
"""Times nearer that is asked, remedy, column, whether it may be certain, the points."""


def _tried(stem: str, points: Array) -> Iterator[_Try]:
    """Points with each mistake undone: units, columns, and numbers of other rows."""
    names = COLUMNS[stem]
    for unit in hypotheses("length"):
        remedy = unit.mend(what="points", columns=", ".join(names))
        yield UNIT_BETTER, remedy, names[0], stem == "bodies", unit.factor * points
    for words, column, undone in column_mistakes(names):
        yield BETTER, f"suspected: {words}; correct it", column, False, undone(points)
    if stem == "bodies" and len(points) > 2:
        told = f"suspected: {', '.join(names)}"
        words = f"{told} relative to the row before and not in ground; add them up"
        yield BETTER, words, names[1], False, np.cumsum(points, axis=0)
        for step, way in ((-1, "down"), (1, "up")):
            words = f"{told} one row too far {way}: each vertebra has its neighbour's"
            yield BETTER, words, names[1], False, np.roll(points, step, axis=0)


def _distance(points: Array, near: Array) -> float:
    """Root mean square, mm."""
    return float(np.sqrt(np.mean(np.sum((points - near) ** 2, axis=1))))

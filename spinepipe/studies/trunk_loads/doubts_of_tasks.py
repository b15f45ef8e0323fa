"""What is most likely wrong with sound tasks: units that no cell gives away."""

from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.problems import Problem
from spinepipe.studies.trunk_loads.forms import HANDS, PUSH_N, PUSH_NM, TASKS, turn
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.units import ROTATIONS

LEAST_DEG = 3.0
"""Three tasks and more that all bend the trunk less ask nothing of it; 170 deg are 3 in radians."""

LEAST_MM = 150.0
"""From the centre of L5S1; nearer is inside the trunk."""

LEAST_N, LEAST_NM = 1.0, 1.0
"""Less is not felt beside the weight of the trunk, 400 N."""


def told(study: TrunkLoads, cohort: Cohort, root: Path) -> tuple[str, tuple[Problem, ...]]:
    """No words, and a warning for each column that is most likely in another unit."""
    rows, file = cohort.further[TASKS.stem], f"{cohort.name}/{TASKS.file}"
    return "", (*_angles(file, rows), *_hands(file, rows), *_pushes(file, rows))


def _angles(file: str, rows: pd.DataFrame) -> Iterator[Problem]:
    for axis in ROTATIONS:
        column = turn("trunk", axis)
        turned = _filled(rows[[column]])
        if len(turned) >= 3 and (largest := float(turned[column].abs().max())) < LEAST_DEG:
            found = f"at most {largest:.3g} deg in {len(turned)} tasks"
            place = (file, int(str(turned.index[0])), column)
            remedy = "suspected: radians and not degrees (57.3); convert the column"
            yield Problem(*place, found, f"{LEAST_DEG:g} deg and more in one task", remedy)


def _hands(file: str, rows: pd.DataFrame) -> Iterator[Problem]:
    places = _filled(rows[list(HANDS)])
    away = (places**2).sum(axis=1) ** 0.5
    if len(away) and float(away.max()) < LEAST_MM:
        found = f"hands at most {away.max():.3g} mm from the centre of L5S1, in all tasks"
        place = (file, int(str(away.index[0])), HANDS[0])
        remedy = "suspected: cm, inches or m and not mm; convert the columns"
        yield Problem(*place, found, f"{LEAST_MM:g} mm and more: outside the trunk", remedy)


def _pushes(file: str, rows: pd.DataFrame) -> Iterator[Problem]:
    for columns, least, unit in ((PUSH_N, LEAST_N, "N"), (PUSH_NM, LEAST_NM, "N m")):
        for column in columns:
            pushes = _filled(rows[[column]])
            if len(pushes) and (largest := float(pushes[column].abs().max())) < least:
                found = f"pushes of at most {largest:.3g} {unit} in all tasks"
                place = (file, int(str(pushes.index[0])), column)
                remedy = f"suspected: k{unit} and not {unit}; convert the column"
                yield Problem(*place, found, f"{least:g} {unit} and more in one task", remedy)


def _filled(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows with a number that is not nought, others nought."""
    numbers = rows.fillna(0.0)
    return numbers[(numbers != 0.0).any(axis=1)]

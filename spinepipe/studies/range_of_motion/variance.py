"""Job: what the motion of joints hangs on: specimen, joint frames or stiffness."""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.report.words import count
from spinepipe.sensitivity_analysis.shares import VarianceShare, nested_shares, variance_shares
from spinepipe.statistics import ComputationStatus
from spinepipe.status import joined
from spinepipe.studies.range_of_motion.grid import MotionGrid, read_grid
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import EVERY, FACTORS, ROM_VARIANCE
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES

FEWEST_COMPLETE = 0.5
"""A specimen whose share of complete poses is smaller takes no part in the cohort's analysis."""

_OURS = {"row": "pose", "column": "stiffness", "draw": "pose", "treatment": "stiffness"}
"""What the analyses call in general terms, and what it is here."""

_GENERAL = re.compile(rf"\b({'|'.join(_OURS)})\b")


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``rom_variance.parquet``."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    grid = read_grid(tables[0], settings, cohort)
    made_by = provenance("rom_variance", settings, cohort)
    write(from_rows(ROM_VARIANCE, list(variance_rows(grid))), output, made_by)


def variance_rows(grid: MotionGrid) -> Iterator[dict[str, Any]]:
    """Rows of each specimen and, where there are several, of the cohort."""
    for number, test in enumerate(grid.tests):
        # deg in the coordinate that the test turns; the first pose and set are no draws
        drawn = grid.motion[:, 1:, 1:, number, :, COORDINATES.index(grid.loaded[number])]
        same = {"test": test, "coordinate": grid.loaded[number]}
        tested = np.flatnonzero(grid.asked[:, :, :, number].any(axis=(1, 2)))
        # of each specimen (poses, K, J), the poses with an equilibrium with every stiffness set
        complete = [
            motion[np.isfinite(motion).all(axis=(1, 2))] for motion in (drawn[at] for at in tested)
        ]
        names = [grid.specimens[at] for at in tested]
        for specimen, motion in zip(names, complete, strict=True):
            yield from ({**same, "specimen": specimen, **row} for row in _own(grid, motion))
        if len(names) > 1:
            yield from ({**same, "specimen": EVERY, **row} for row in _all(grid, complete))


def _own(grid: MotionGrid, motion: Array) -> Iterator[dict[str, Any]]:
    """Rows of one specimen, joint by joint; motion (poses, K, J)."""
    for at, joint in enumerate(grid.joints):
        found = variance_shares(motion[:, :, at], hypercubes=True)
        parts = {"pose": found.row, "stiffness": found.column, "rest": found.interaction}
        ended = (found.status, found.message)
        yield {"joint": joint, **_row(motion[None, :, :, at], ended, parts)}


def _all(grid: MotionGrid, motions: list[Array]) -> Iterator[dict[str, Any]]:
    """Rows of the cohort, joint by joint: as many poses of each specimen as all of them have."""
    most = max(len(motion) for motion in motions)
    kept = [motion for motion in motions if len(motion) >= max(1.0, FEWEST_COMPLETE * most)]
    if not kept:
        empty = motions[0][None]
        ended = (ComputationStatus.TOO_FEW, "no pose has an equilibrium with every stiffness set")
        yield from ({"joint": joint, **_row(empty[..., 0], ended, {})} for joint in grid.joints)
        return
    # A balanced design: shares of nested draws take equally many of each specimen.
    poses = min(len(motion) for motion in kept)
    values = np.stack([motion[:poses] for motion in kept])
    specimens = len(motions) - len(kept)
    missing = [count(specimens, "specimen")] * (specimens > 0)
    missing += [f"up to {count(most - poses, 'pose')} of a specimen"] * (most > poses)
    left_out = f"left out for lack of equilibria: {', '.join(missing)}" if missing else ""
    for at, joint in enumerate(grid.joints):
        found = nested_shares(values[..., at])
        parts = {
            "specimen": found.specimen,
            "pose": found.draw,
            "stiffness": found.treatment,
            "rest": found.rest,
        }
        message = joined(found.message, left_out)
        yield {"joint": joint, **_row(values[..., at], (found.status, message), parts)}


def _row(
    values: Array, ended: tuple[ComputationStatus, str], parts: dict[str, VarianceShare | None]
) -> dict[str, Any]:
    """Columns of an analysis of values (S, P, K)."""
    specimens, poses, stiffnesses = values.shape
    done = ended[0] is ComputationStatus.DONE
    shares = {
        f"{name}_{end}": getattr(parts.get(name), field, None)
        for name in FACTORS
        for end, field in (("share", "estimate"), ("low", "low"), ("high", "high"))
    }
    return {
        "n_specimens": specimens,
        "n_poses": poses,
        "n_stiffness": stiffnesses,
        "sd": float(values.std(ddof=1)) if done else None,
        **shares,
        "status": ended[0].value,
        "message": _GENERAL.sub(lambda word: _OURS[word[0]], ended[1]),
    }

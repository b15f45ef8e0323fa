"""Jobs: how lumbar joints share a motion, and how alike persons share it.

A joint's share is its rotation over that of all lumbar joints together, L5S1 to T12L1, about the
axis that the motion is about, from the neutral pose, instant by instant. Where the lumbar spine as
a whole is turned by less than 2 deg there is none: it would be a small number over a small one.

A person's curve is the shares of the lumbar joints over a part of the cycle, one joint's after the
other's: what differs from joint to joint counts as much as what changes over time. The paper that
this is from (Wang et al. 2021) does not say how it put joints together.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.skeleton import LUMBAR, LUMBAR_JOINTS, PELVIS
from spinepipe.statistics.waveforms import MultipleCorrelation, multiple_correlation
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import (
    DONE,
    INSTANTS,
    SHARING,
    SIMILARITY,
    TOO_FEW,
    TOO_SMALL,
    WINDOWS,
)
from spinepipe.studies.tracking.tracked_motions import TrackedMotion, motions
from spinepipe.studies.tracking.trials import AXIS, kinds_of_trials
from spinepipe.tables import from_rows, read_frames, write

LEAST_RAD = float(np.deg2rad(2.0))

ENOUGH = 0.5
"""Share of the instants of a window at which a person has to be turned enough to count."""

_TRIFLE = 1e-9
"""Of a cycle: a frame on the border of a window is in it, however its time was rounded."""

Kinds = Mapping[tuple[str, str], str]
"""Kinds of trials by person and trial."""


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``sharing.parquet``."""
    settings, cohort = study_of_kind(Tracking, root, study)
    rows = list(sharing_rows(read_frames(tables)["tracked"], kinds_of_trials(cohort)))
    write(from_rows(SHARING, rows), output, provenance("sharing", settings, cohort))


def similarity(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``similarity.parquet``."""
    settings, cohort = study_of_kind(Tracking, root, study)
    rows = list(similarity_rows(read_frames(tables)["tracked"], kinds_of_trials(cohort)))
    write(from_rows(SIMILARITY, rows), output, provenance("similarity", settings, cohort))


@dataclass(frozen=True, eq=False)
class MotionShares:
    """Shares over a cycle, from 0 at the first frame to 1 at the last.

    Attributes
    ----------
    cycle : (F,). share : (F, 6), joints from below; zero where there is none. enough : (F,) whether
        there is one.
    """

    cycle: Array
    share: Array
    enough: NDArray[np.bool_]

    def inside(self, window: tuple[float, float]) -> NDArray[np.bool_]:
        """(F,) whether an instant lies in a part of the cycle, ends included."""
        low, high = window
        return (self.cycle >= low - _TRIFLE) & (self.cycle <= high + _TRIFLE)


def shares_of(motion: TrackedMotion, kind: str, instants: int | None = None) -> MotionShares | None:
    """Shares of a motion, at its frames or at so many instants; None where nothing is moved.

    Parameters
    ----------
    kind : of the trial, which says about which axis.
    instants : evenly over the cycle, ends included; None for the frames.
    """
    if kind not in AXIS or len(motion.time_s) < 2:
        return None
    first, last = motion.time_s[0], motion.time_s[-1]
    times = motion.time_s if instants is None else np.linspace(first, last, instants)
    # a share where the lumbar spine as a whole is turned enough, of the sum over its joints
    turned = motion.at(times)[:, PELVIS + 1 :, 3 + AXIS[kind]][:, LUMBAR]
    total = turned.sum(axis=1)
    enough = np.abs(total) >= LEAST_RAD
    share = np.where(enough[:, None], turned / np.where(enough, total, 1.0)[:, None], 0.0)
    return MotionShares((times - first) / (last - first), share, enough)


def sharing_rows(tracked: pd.DataFrame, kinds: Kinds) -> Iterator[dict[str, Any]]:
    """Rows by motion, window and joint; none of a stance."""
    for motion in motions(tracked):
        shares = shares_of(motion, kinds[motion.specimen, motion.trial])
        if shares is None:
            continue
        for window, ends in WINDOWS.items():
            inside = shares.inside(ends)
            used = inside & shares.enough
            few = TOO_SMALL if inside.any() else TOO_FEW
            for k, joint in enumerate(LUMBAR_JOINTS):
                yield motion.names | {
                    "joint": joint,
                    "window": window,
                    "share": float(shares.share[used, k].mean()) if used.any() else None,
                    "frames_used": int(used.sum()),
                    "status": DONE if used.any() else few,
                }


def similarity_rows(tracked: pd.DataFrame, kinds: Kinds) -> Iterator[dict[str, Any]]:
    """Rows by trial, approach and window, over the persons that did it."""
    groups: dict[tuple[str, str], list[MotionShares]] = {}
    for motion in motions(tracked):
        shares = shares_of(motion, kinds[motion.specimen, motion.trial], INSTANTS)
        if shares is not None:
            groups.setdefault((motion.trial, motion.approach), []).append(shares)
    for (trial, approach), persons in groups.items():
        for window, ends in WINDOWS.items():
            found, left_out = _correlation(persons, ends)
            yield {
                "trial": trial,
                "approach": approach,
                "window": window,
                "cmc": found.value,
                "n_specimens": found.curves,
                "status": found.status.value,
                "message": "; ".join(part for part in (found.message, left_out) if part),
            }


def _correlation(
    persons: Sequence[MotionShares], window: tuple[float, float]
) -> tuple[MultipleCorrelation, str]:
    """Coefficient over persons, and what was left out of it.

    Persons that are turned enough at less than half the instants are left out, then the instants at
    which one of the others is not.
    """
    inside = persons[0].inside(window)
    # a curve: all joints at the instants that every remaining person has
    kept = [one for one in persons if one.enough[inside].mean() >= ENOUGH]
    used = np.logical_and.reduce([inside, *(one.enough for one in kept)])
    curves = np.array([one.share[used].T.ravel() for one in kept])
    told = []
    if len(kept) < len(persons):
        told.append(f"{len(persons) - len(kept)} persons turned too little")
    if kept and used.sum() < inside.sum():
        told.append(f"{inside.sum() - used.sum()} of {inside.sum()} instants left out")
    return multiple_correlation(curves.reshape(len(kept), -1)), "; ".join(told)

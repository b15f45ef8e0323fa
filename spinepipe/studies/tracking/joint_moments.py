"""Job: net moments of all joints over recorded motions, and how they agree with measured ones."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.recorded_motion import RecordedMotion, net_moments
from spinepipe.motion.skeleton import JOINTS
from spinepipe.motion.standing_spine import usual_spine
from spinepipe.muscles.myo_sim import source_of_myo_sim
from spinepipe.muscles.trunk import Trunk
from spinepipe.studies.recorded_motion import recorded_motion
from spinepipe.studies.recordings import MEASURED_MOMENTS, STANCE, of_trial, trial_rows
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.persons import ratios_of
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import JOINT_MOMENTS, MOMENT_AGREEMENT
from spinepipe.studies.tracking.trials import digests_of_lifts
from spinepipe.tables import from_rows, write

MOMENTS = ("right_bending_nm", "left_rotation_nm", "extension_nm")
"""About ground x, y, z, and the same of `measured_moments.csv`."""

FORCES = ("anterior_n", "superior_n", "right_n")
MEASURED = ("mx_nm", "my_nm", "mz_nm")
EXTENSION = MOMENTS.index("extension_nm")

ABOUT_LIFT_OFF_S = 0.15
"""To each side of lift-off, where a plate and filtered markers do not tell the same instant."""

WAYS = ("moving", "still")

Rows = list[dict[str, Any]]


def run(
    root: str, study: str, tables: Sequence[str], joint_moments: str, moment_agreement: str
) -> None:
    """Write both tables; there are no tables to read."""
    settings, cohort = study_of_kind(Tracking, root, study)
    rows, agreement = table_rows(settings, cohort)
    made_by = provenance("joint_moments", settings, cohort, None, digests_of_lifts(cohort))
    write(from_rows(JOINT_MOMENTS, rows), joint_moments, made_by)
    write(from_rows(MOMENT_AGREEMENT, agreement), moment_agreement, made_by)


def table_rows(settings: Tracking, cohort: Cohort) -> tuple[Rows, Rows]:
    """Rows of `joint_moments`, and of `moment_agreement`."""
    rows, agreement = Rows(), Rows()
    source = source_of_myo_sim().trunk
    for specimen in cohort.specimen_names:
        for motion in motions_of(settings, cohort, specimen, source):
            known = {"specimen": specimen, "trial": motion.name}
            both = zip(WAYS, (motion.loads, motion.still), strict=True)
            found = {way: net_moments(motion.joints, loads) for way, loads in both}
            rows += [known | row for row in moment_rows(motion, found)]
            beside = of_trial(cohort, MEASURED_MOMENTS, specimen, motion.name)
            agreement += [known | row for row in agreement_rows(motion, found, beside)]
    return rows, agreement


Found = Mapping[str, tuple[Array, Array]]
"""Forces (F, 17, 3) N and moments (F, 17, 3) N m with accelerations and without, by `WAYS`."""


def motions_of(
    settings: Tracking, cohort: Cohort, specimen: str, source: Trunk
) -> Iterator[RecordedMotion]:
    """The trials of a person that move; the person's spine is made of a reference trunk."""
    spine = usual_spine(subject_of(cohort, specimen), source)
    shares = ratios_of(cohort)[settings.ratios]
    for row in trial_rows(cohort, specimen):
        if row["kind"] != STANCE:
            trial = str(row["trial"])
            yield recorded_motion(cohort, specimen, trial, spine, settings.cutoff_hz, shares)


def moment_rows(motion: RecordedMotion, found: Found) -> Iterator[dict[str, Any]]:
    """Rows by joint and time."""
    columns = (*FORCES, *MOMENTS)
    names = [*columns, *(f"still_{name}" for name in columns)]
    numbers = np.concatenate([part for way in WAYS for part in found[way]], axis=-1)
    largest = np.linalg.norm(found["moving"][1], axis=-1).argmax(axis=0)
    for k, joint in enumerate(JOINTS):
        for frame, values in enumerate(numbers[:, k].tolist()):
            yield {
                "joint": joint,
                "time_s": float(motion.time_s[frame]),
                **dict(zip(names, values, strict=True)),
                "largest": bool(frame == largest[k]),
            }


def agreement_rows(
    motion: RecordedMotion, found: Found, measured: pd.DataFrame
) -> Iterator[dict[str, Any]]:
    """Rows by joint, how it was measured, and way; frames that were measured, not about lift-off.

    Parameters
    ----------
    measured : rows of the trial.
    """
    time_s, off = motion.time_s, motion.lift_off_s
    told = measured.dropna(subset=list(MEASURED))
    for (joint, method), rows in told.groupby(["joint", "method"], sort=False):
        rows = rows.sort_values("time_s")
        times = rows["time_s"].to_numpy(float)
        there = (time_s >= times[0]) & (time_s <= times[-1])
        truth = np.stack([np.interp(time_s, times, rows[name]) for name in MEASURED], axis=1)
        away = np.full(len(time_s), np.inf) if off is None else time_s - off
        kept = there & (np.abs(away) > ABOUT_LIFT_OFF_S)
        if not kept.any():
            continue
        for way in WAYS:
            own = found[way][1][:, JOINTS.index(str(joint))]
            error = own - truth
            peak, true = float(own[kept, EXTENSION].max()), float(truth[kept, EXTENSION].max())
            yield {
                "joint": joint,
                "method": method,
                "way": way,
                "frames": int(kept.sum()),
                "lift_off_s": off,
                "rmse_nm": _rms(error[kept, EXTENSION]),
                "before_nm": _rms(error[kept & (away < 0.0), EXTENSION]),
                "after_nm": _rms(error[kept & (away > 0.0), EXTENSION]),
                "mean_nm": float(error[kept, EXTENSION].mean()),
                "right_bending_nm": _rms(error[kept, MOMENTS.index("right_bending_nm")]),
                "left_rotation_nm": _rms(error[kept, MOMENTS.index("left_rotation_nm")]),
                "peak_nm": peak,
                "measured_peak_nm": true,
                "peak_percent": 100.0 * (peak / true - 1.0) if true > 0.0 else None,
            }


def _rms(values: Array) -> float | None:
    """Root mean square; None of nothing."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else None

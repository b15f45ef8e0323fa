"""Made-up results of studies of tracked motions: numbers follow from formulas, nothing is solved.

The cohort is that of the phantom, whose truth is known; errors and all else are made up.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import BODIES, JOINTS, LUMBAR_JOINTS
from spinepipe.schema import Table
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.tracking.accuracy import accuracy_rows
from spinepipe.studies.tracking.error_metrics import SAGITTAL
from spinepipe.studies.tracking.profile import PROFILED, REGIONS, point_rows, verdict
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import (
    ACCURACY,
    AGAINST_WANG_2021,
    CLUSTERS,
    DRAWN,
    ERRORS,
    FITS,
    PROFILE_POINTS,
    PROFILES,
    RANGES,
    REMARKS,
    SHARING,
    SIMILARITY,
    SIZES,
    STIFFNESS,
    TRACKED,
    WEIGHTS,
    WINDOWS,
)
from spinepipe.studies.tracking.tracked_motions import IN_ORDER
from spinepipe.studies.tracking.trials import AXIS, FORMS
from spinepipe.tables import from_rows
from spinepipe.units import COORDINATES, ROTATIONS

Row = dict[str, Any]

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "config" / "cohorts" / "tracking_phantom"

ERROR = {
    "ik": 8.0,
    "ik_constrained_christophy_2012": 9.0,
    "ik_smooth": 7.8,
    "optk_zero": 8.1,
    "optk_generic": 5.0,
    "optk_calibrated": 6.0,
    "optk_from_both": 6.5,
}
"""Mean error of centres of the first person in motion, mm; a third of it in degrees."""

VIBRATING = {"ik": 30000.0}
MARKER_RMSE = {"ik": 2.0, "optk_zero": 1.5, "optk_generic": 3.0}
BEND_DEG = -30.0
FRAMES = 21
RATIOS = np.array([0.2, 0.5, 1.0, 2.0, 5.0])
COSTS = {
    "told": np.array([20.0, 6.0, 0.0, 6.0, 20.0]),
    "one_sided": np.array([0.5, 0.0, 6.0, 12.0, 18.0]),
    "not_told": np.array([1.0, 0.5, 0.0, 0.5, 1.0]),
    "falls": np.array([0.0, 6.0, 12.0, 18.0, 24.0]),
    "falls slowly": np.array([0.0, 2.0, 12.0, 18.0, 24.0]),
    "gap": np.array([1.0, 0.0, 9.0, 2.0, 3.0]),
    "lost": np.full(5, np.inf),
}
"""What ratios cost; `told`, `one_sided` and `not_told` are verdicts, all others are `not_told`."""


@dataclass(frozen=True)
class Size:
    """What a made-up study has.

    Attributes
    ----------
    persons : how many of the cohort. trials : those of the cohort. truth : whether it is known.
    approaches : of `ERROR`. verdict : of all profiles, a key of `COSTS`. moves : whether anybody
        moves enough. failing : approaches whose fits found no posture.
    """

    persons: int = 3
    trials: tuple[str, ...] = ("stance", "flexion_extension", "lateral_bending")
    truth: bool = True
    approaches: tuple[str, ...] = tuple(ERROR)
    verdict: str = "one_sided"
    moves: bool = True
    failing: tuple[str, ...] = ()

    @property
    def found(self) -> tuple[str, ...]:
        """Approaches that found postures."""
        return tuple(name for name in self.approaches if name not in self.failing)


@cache
def _read() -> Cohort:
    return cohorts.read(FOLDER, (SUBJECTS, *FORMS))


def cohort_of(size: Size) -> Cohort:
    """The first persons of the phantom, with or without their truth."""
    whole = _read()
    names = whole.specimen_names[: size.persons]
    left_out = () if size.truth else ("truth_centres",)
    further = {
        name: rows[rows["specimen"].isin(names)] if "specimen" in rows else rows
        for name, rows in whole.further.items()
        if name not in left_out
    }
    own = whole.specimens["specimen"].isin(names)
    return replace(whole, specimens=whole.specimens[own], further=further)


def study_of(size: Size) -> Tracking:
    """The study."""
    asked: Row = {"study": "s", "kind": "tracking", "cohort": "tracking_phantom"}
    drawn = [name for name in ("ik", "optk_generic") if name in size.approaches]
    asked["drawn_approaches"] = drawn or [size.approaches[0]]
    return Tracking.model_validate(asked | {"approaches": list(size.approaches)})


def frame(table: Table, rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as the file of a table has them; what a row does not tell is empty."""
    names = [column.name for column in table.columns]
    return from_rows(table, [{name: row.get(name) for name in names} for row in rows]).to_pandas()


def motions(size: Size) -> Iterator[tuple[int, Row]]:
    """Number of a person, and names of a motion that was found; stance has no smooth curve."""
    for number, person in enumerate(cohort_of(size).specimen_names):
        for trial in size.trials:
            for approach in size.found:
                if trial == "stance" and approach in ("ik_smooth", "optk_calibrated"):
                    continue
                yield number, {"specimen": person, "trial": trial, "approach": approach}


def tracked_rows(size: Size) -> Iterator[Row]:
    """All lumbar joints turn alike about the axis of the motion, vibrating ones to and fro."""
    for number, known in motions(size):
        frames = 1 if known["trial"] == "stance" else FRAMES
        column = f"{ROTATIONS[AXIS.get(known['trial'], 0)]}_deg"
        for k in range(frames):
            far = np.sin(np.pi * k / max(frames - 1, 1)) * (1.0 + 0.1 * number)
            far += (3.0 * (-1) ** k) * (known["approach"] in VIBRATING)
            for joint in IN_ORDER:
                turned = BEND_DEG / 6.0 * far if joint in LUMBAR_JOINTS and size.moves else 0.0
                rest = dict.fromkeys((f"{name}_mm" for name in COORDINATES[:3]), 0.0)
                rest |= dict.fromkeys((f"{name}_deg" for name in ROTATIONS), 0.0)
                now = {"frame": k, "time_s": 0.1 * k, "joint": joint}
                yield known | now | rest | {column: float(turned)}


def drawn_rows(size: Size) -> Iterator[Row]:
    """Three frames of a straight spine that moves forwards, with two markers."""
    asked = set(study_of(size).drawn_approaches)
    for number, known in motions(size):
        if known["approach"] not in asked:
            continue
        for k in range(1 if known["trial"] == "stance" else 3):
            now = known | {"frame": 10 * k, "time_s": float(k)}
            still = dict.fromkeys((f"{name}_deg" for name in ROTATIONS), 0.0)
            for level, body in enumerate(BODIES):
                at = {"x_mm": 10.0 * k * level / 17, "y_mm": 25.0 * level, "z_mm": float(number)}
                yield now | still | at | {"kind": "body", "name": body}
            for m, name in enumerate(("T1_a", "L4")):
                at = {"x_mm": -60.0 + 10.0 * k, "y_mm": 400.0 - 350.0 * m, "z_mm": 0.0}
                yield now | at | {"kind": "modelled", "name": name}
                if not (k == 1 and m == 1):
                    at["x_mm"] += 5.0
                    yield now | at | {"kind": "measured", "name": name}


def fit_rows(size: Size) -> Iterator[Row]:
    """All settled but those that fail."""
    sizes = {"iterations": 9, "unknowns": 100, "markers_cost": 1.0, "cpu_s": 1.0}
    for _, known in motions(replace(size, failing=())):
        approach = known["approach"]
        if approach in size.failing:
            lost = {"status": "not_converged", "message": "it fell over", "frames": 0}
            yield known | lost
            continue
        moving = known["trial"] != "stance"
        fast = VIBRATING.get(approach, 12.0) if moving else None
        yield (
            known
            | sizes
            | {
                "status": "converged",
                "message": "",
                "marker_rmse_mm": MARKER_RMSE.get(approach, 2.5),
                "largest_deviation_mm": 9.0,
                "acceleration_rms_deg_per_s2": fast,
                "frames": FRAMES if moving else 1,
            }
        )


def error_rows(size: Size) -> Iterator[Row]:
    """By formula: persons differ by a tenth, levels by little."""
    levels = {"centre_mm": BODIES[1:], "angle_deg": JOINTS[SAGITTAL]}
    share = {"centre_mm": 1.0, "angle_deg": 1.0 / 3.0}
    for number, known in motions(size):
        for measure, named in levels.items():
            base = ERROR[known["approach"]] * share[measure] * (1.0 + 0.1 * number)
            base *= 0.5 if known["trial"] == "stance" else 1.0
            for k, level in enumerate(named):
                mean = base * (1.0 + 0.02 * (k - 0.5 * (len(named) - 1)))
                more = {"p95": 1.1 * mean, "largest": 1.2 * mean, "n": 9}
                yield known | more | {"measure": measure, "level": level, "mean": mean}


def sharing_rows(size: Size) -> Iterator[Row]:
    """The lowest joint does most, the highest least; inverse kinematics turns one against."""
    shares = dict(zip(LUMBAR_JOINTS, (0.3, 0.25, 0.15, 0.12, 0.1, 0.08), strict=True))
    for number, known in motions(size):
        if known["trial"] == "stance":
            continue
        for window in WINDOWS:
            for joint, share in shares.items():
                wild = known["approach"] in VIBRATING and joint == "L1L2"
                value = -0.4 if wild else share + 0.01 * number * (joint == "L5S1")
                told = {"share": value if size.moves else None, "frames_used": 9 * size.moves}
                status = "done" if size.moves else "too_small"
                yield known | told | {"joint": joint, "window": window, "status": status}


def similarity_rows(size: Size) -> Iterator[Row]:
    """Fixed ratios are alike, inverse kinematics has no coefficient, all others half."""
    for trial in (name for name in size.trials if name != "stance"):
        for approach in size.found:
            fixed, wild = approach.startswith("ik_constrained"), approach in VIBRATING
            few = size.persons < 2
            status = "too_few" if few else "undefined" if wild else "done"
            value = 1.0 if fixed else 0.5
            yield {
                "trial": trial,
                "approach": approach,
                "window": "20-80",
                "cmc": value if status == "done" else None,
                "n_specimens": size.persons,
                "status": status,
                "message": "",
            }


def profile_rows(size: Size) -> Iterator[tuple[Row, list[Row]]]:
    """Of the first person: verdict and points of each region and coordinate."""
    person = cohort_of(size).specimen_names[0]
    costs = COSTS[size.verdict]
    for region in REGIONS:
        for coordinate in PROFILED:
            known = {"specimen": person, "region": region, "coordinate": coordinate}
            points = [known | row for row in point_rows(RATIOS, costs)]
            yield known | verdict(RATIOS, costs), points


def stiffness_rows(size: Size) -> Iterator[Row]:
    """Rotations of all joints, a little softer than generic in flexion."""
    laws = [name for name in ("optk_from_both",) if name in size.found]
    for person in cohort_of(size).specimen_names:
        for law in laws:
            for joint in JOINTS:
                for coordinate in COORDINATES:
                    for side in ("positive", "negative"):
                        known = {"specimen": person, "law": law, "joint": joint, "side": side}
                        turned = coordinate in ROTATIONS
                        ratio = 0.6 if coordinate == "extension" else 1.1
                        told = {
                            "at_low_moment": 20.0,
                            "at_high_moment": 100.0 * ratio,
                            "high_moment_nm": 5.0,
                            "generic_low": 80.0,
                            "generic_high": 150.0,
                            "inside_generic": ratio > 0.8,
                            "ratio_to_generic": ratio,
                        }
                        ended = {"a": 1.0, "b": 10.0, "status": "converged", "message": ""}
                        yield known | {"coordinate": coordinate} | ended | (told if turned else {})


def weight_rows(size: Size) -> Iterator[Row]:
    """Markers are met less the more loads count; centres best at 1, angles at the end."""
    for trial in size.trials:
        for ratio in (0.1, 1.0, 10.0):
            off = {"centre_mm": 3.0 + abs(np.log(ratio)), "angle_deg": 2.0 - 0.3 * np.log(ratio)}
            yield {
                "specimen": cohort_of(size).specimen_names[0],
                "trial": trial,
                "ratio": ratio,
                "marker_rmse_mm": 3.0 + 0.5 * np.log(ratio),
                "load_rms_nm": 9.0 - np.log(ratio),
                "status": "converged",
                **(off if size.truth else {}),
            }


def recording_rows(size: Size) -> dict[str, pd.DataFrame]:
    """What is known of recordings before anything is tracked."""
    person = cohort_of(size).specimen_names[0]
    clusters = [
        {
            "specimen": person,
            "trial": size.trials[0],
            "cluster": name,
            "variability_mm": value,
            "variability_percent": 100.0 * value / 40.0,
            "frames": 9,
            "status": "rigid",
        }
        for name, value in (("T1", 0.3), ("L4", 0.5))
    ]
    sizes = [
        {"specimen": person, "segment": segment, "factor": factor, "status": "told"}
        | {"n_pairs": 9, "rms_mm": 3.0, "largest_mm": 7.0, "message": ""}
        | {"first_marker": "T1_a", "second_marker": "L4"}
        for segment, factor in (("pelvis", 0.98), ("lumbar", 1.01), ("thoracic", 1.03))
    ]
    remarks = [{"specimen": person, "trial": "", "remark": "<two> short gaps"}]
    return {
        "clusters": frame(CLUSTERS, clusters),
        "sizes": frame(SIZES, sizes),
        "remarks": frame(REMARKS, remarks),
    }


def against_rows() -> list[Row]:
    """One published quantity that ours is outside of."""
    values = {"paper": 8.5, "paper_low": 8.0, "paper_high": 9.0, "ours": 5.0}
    words = {"id": "accuracy", "where": "Results", "quantity": "mean error", "unit": "mm"}
    judged = {"limit": "two_sided", "verdict": "outside", "reason": "another cohort"}
    judged["evidence"] = "independent"
    return [{**words, **values, **judged}]


def tables_of(size: Size, **changed: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """All tables, some changed."""
    return {name: rows.copy() for name, rows in _tables(size).items()} | changed


@cache
def _tables(size: Size) -> dict[str, pd.DataFrame]:
    errors = frame(ERRORS, list(error_rows(size)) if size.truth else [])
    profiles = list(profile_rows(size))
    ranges = [
        known | {"joint": "L4L5", "coordinate": "extension", "range": 5.0, "unit": "deg"}
        for _, known in motions(size)
    ]
    return {
        "tracked": frame(TRACKED, list(tracked_rows(size))),
        "fits": frame(FITS, list(fit_rows(size))),
        "drawn": frame(DRAWN, list(drawn_rows(size))),
        "stiffness": frame(STIFFNESS, list(stiffness_rows(size))),
        "profiles": frame(PROFILES, [row for row, _ in profiles]),
        "profile_points": frame(PROFILE_POINTS, [row for _, rows in profiles for row in rows]),
        **recording_rows(size),
        "weights": frame(WEIGHTS, list(weight_rows(size))),
        "ranges": frame(RANGES, ranges),
        "sharing": frame(SHARING, list(sharing_rows(size))),
        "similarity": frame(SIMILARITY, list(similarity_rows(size))),
        "errors": errors,
        "accuracy": frame(ACCURACY, list(accuracy_rows(errors))),
        "against_wang_2021": frame(AGAINST_WANG_2021, against_rows()),
    }

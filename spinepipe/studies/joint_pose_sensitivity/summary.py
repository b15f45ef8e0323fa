"""Job: medians and spreads of stiffness, errors and joint poses, as papers print them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.marks import read_json
from spinepipe.studies.joint_pose_sensitivity.filters import judge_bootstrap
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import LOWER_ENDS, SUMMARY, region_columns
from spinepipe.studies.joint_pose_sensitivity.variables import (
    absolute_error,
    measured_size,
    readings,
)
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import (
    COORDINATE_COLUMNS,
    COORDINATE_UNITS,
    COORDINATES,
    ROTATIONS,
    STIFFNESS_COLUMNS,
    STIFFNESS_UNITS,
    TRANSLATIONS,
)


def run(root: str, study: str, tables: list[str], best: str, output: str) -> None:
    """Write ``summary.parquet``."""
    settings, cohort = study_and_cohort(root, study)
    frames = read_frames(tables)
    frames["simulations"] = readings(frames["simulations"], cohort.zeroed_at_step_0)
    keys = [(name, ranked["pose"]) for name, sets in read_json(best).items() for ranked in sets]
    best_poses = pd.DataFrame(keys, columns=["specimen", "pose"])
    rows = list(_pose_rows(settings, frames, best_poses))
    if "bootstrap" in frames:
        rows += _bootstrap_rows(settings, cohort, frames["bootstrap"])
    write(from_rows(SUMMARY, rows), output, provenance("summary", settings, cohort))


FEW_OPEN_BELOW = 0.1
"""Share of fits without a lower end up to which the others' lower ends speak for all."""


@dataclass(frozen=True)
class _SummaryKey:
    """Where rows of the summary belong."""

    part: str
    loading: str
    dataset: str
    specimen: str

    def row(
        self, quantity: str, joint: str, coordinate: str, unit: str, values: Any, size: Any = None
    ) -> dict[str, Any]:
        """One row; ``size`` holds the measured motion that errors are compared with."""
        key = {name: getattr(self, name) for name in ("specimen", "part", "loading", "dataset")}
        what = {"quantity": quantity, "joint": joint, "coordinate": coordinate, "unit": unit}
        regions = dict.fromkeys(("open_share", *LOWER_ENDS))
        told = {"percent_of_measured": percent(values, size), **regions}
        return {**key, **what, **spread(values), **told}


def spread(values: Any) -> dict[str, Any]:
    """Median, quartiles and ends of the finite values."""
    known = np.asarray(values, dtype=float)
    known = known[np.isfinite(known)]
    names = ("minimum", "low_quartile", "median", "high_quartile", "maximum")
    if not len(known):
        return {"n": 0, **dict.fromkeys((*names, "iqr", "range"))}
    ends = dict(zip(names, np.percentile(known, [0, 25, 50, 75, 100]).tolist(), strict=True))
    widths = {
        "iqr": ends["high_quartile"] - ends["low_quartile"],
        "range": ends["maximum"] - ends["minimum"],
    }
    return {"n": len(known), **ends, **widths}


def percent(errors: Any, size: Any) -> float | None:
    """Median error as a percentage of the median measured motion."""
    if size is None:
        return None
    error, motion = (np.asarray(values, dtype=float) for values in (errors, size))
    error, motion = error[np.isfinite(error)], motion[np.isfinite(motion)]
    if not len(error) or not len(motion) or np.median(motion) == 0.0:
        return None
    return float(100.0 * np.median(error) / np.median(motion))


def _pose_rows(
    settings: JointPoseSensitivity, frames: Mapping[str, pd.DataFrame], best: pd.DataFrame
) -> Iterator[dict[str, Any]]:
    calibrated = frames["simulations"][frames["simulations"]["stiffness"] == "calibrated"]
    errors, sizes = absolute_error(calibrated), measured_size(calibrated)
    judged = frames["success"]
    keep = {  # the poses of each dataset
        "all": frames["poses"][["specimen", "pose"]].drop_duplicates(),
        "reduced": judged.loc[judged["reduced"], ["specimen", "pose"]],
        "best": best,
    }
    for dataset, keys in keep.items():
        chosen = {
            name: rows.merge(keys, on=["specimen", "pose"])
            for name, rows in (
                ("calibrations", frames["calibrations"]),
                ("errors", errors),
                ("sizes", sizes),
                ("poses", frames["poses"]),
            )
        }
        for specimen in judged["specimen"].unique():
            own = {name: rows[rows["specimen"] == specimen] for name, rows in chosen.items()}
            part = _SummaryKey("poses", "equilibrium", dataset, str(specimen))
            yield from _stiffness_rows(settings, part, own["calibrations"])
            yield from _error_rows(part, own["errors"], own["sizes"])
            for joint, rows in own["poses"].groupby("joint", sort=False):
                for name, axis in zip(TRANSLATIONS, "xyz", strict=True):
                    yield part.row("origin", str(joint), name, "mm", rows[f"{axis}_mm"])
                for name in ROTATIONS:
                    yield part.row("orientation", str(joint), name, "deg", rows[f"{name}_deg"])


def _stiffness_rows(
    settings: JointPoseSensitivity, part: _SummaryKey, fits: pd.DataFrame
) -> Iterator[dict[str, Any]]:
    if settings.calibration.grouping == "per_joint":
        fits = fits[fits["joint"] != "*"]  # a refused fit has one row for all joints
    for joint, rows in fits.groupby("joint", sort=False):
        for name in settings.calibration.free:
            column = STIFFNESS_COLUMNS[COORDINATES.index(name)]
            values = rows[column].to_numpy(float)
            row = part.row("stiffness", str(joint), name, STIFFNESS_UNITS[name], values)
            yield row | _regions(rows, name)


def _regions(fits: pd.DataFrame, name: str) -> dict[str, Any]:
    """Share of fits whose region is open, and the spread of lower ends; of fits with regions."""
    _, low, _, below, above, _ = region_columns(name)
    if below not in fits:
        return {}
    known = fits[fits[below].notna()]
    if known.empty:
        return {}
    is_open = known[below].astype(bool) | known[above].astype(bool)
    few_below = known[below].astype(bool).mean() <= FEW_OPEN_BELOW
    ends = spread(known[low] if few_below else [])
    told = {name: ends[name.removeprefix("lower_end_")] for name in LOWER_ENDS}
    return {"open_share": float(is_open.mean()), **told}


def _error_rows(
    part: _SummaryKey, errors: pd.DataFrame, sizes: pd.DataFrame
) -> Iterator[dict[str, Any]]:
    """Rows of what was measured at all."""
    for joint, rows in errors.groupby("joint", sort=False):
        motion = sizes[sizes["joint"] == joint]
        for name in COORDINATES:
            if motion[name].notna().any():
                values, size = rows[name].to_numpy(float), motion[name].to_numpy(float)
                yield part.row("error", str(joint), name, COORDINATE_UNITS[name], values, size)


def _bootstrap_rows(
    settings: JointPoseSensitivity, cohort: Cohort, fits: pd.DataFrame
) -> Iterator[dict[str, Any]]:
    """All fits of a bootstrap and loading, and those that the filters keep."""
    keys = ["specimen", "bootstrap", "loading", "set"]
    judged = judge_bootstrap(settings, fits)
    kept = fits.merge(judged.loc[judged["reduced"], keys], on=keys)
    motion = _own_motion(settings, cohort)
    as_in_simulations = {f"{name}_error_{unit}": name for name, unit in COORDINATE_UNITS.items()}
    for specimen, bootstrap, loading in fits[keys[:3]].drop_duplicates().itertuples(index=False):
        for dataset, chosen in (("all", fits), ("reduced", kept)):
            part = _SummaryKey(f"{bootstrap}_bootstrap", str(loading), dataset, str(specimen))
            here = chosen[(chosen[keys[:3]] == [specimen, bootstrap, loading]).all(axis=1)]
            of_fits = here
            if settings.calibration.grouping == "per_specimen":  # one row per fit, of all joints
                of_fits = here[here["joint"] == fits["joint"].iloc[0]].assign(joint="*")
            yield from _stiffness_rows(settings, part, of_fits)
            own = motion[motion["specimen"] == specimen]
            yield from _error_rows(part, here.rename(columns=as_in_simulations), own)


def _own_motion(settings: JointPoseSensitivity, cohort: Cohort) -> pd.DataFrame:
    """Mean absolute measured motion per specimen and joint in the cohort's own joint frames."""
    assert cohort.motion is not None
    rows = cohort.motion[cohort.motion["test"].isin(settings.tests or cohort.tests)]
    rows = readings(rows, cohort.zeroed_at_step_0)
    named = rows.rename(columns=dict(zip(COORDINATE_COLUMNS, COORDINATES, strict=True)))
    sizes = named.assign(**{name: named[name].abs() for name in COORDINATES})
    found = sizes.groupby(["specimen", "joint"], sort=False)[list(COORDINATES)].mean()
    return found.reset_index()

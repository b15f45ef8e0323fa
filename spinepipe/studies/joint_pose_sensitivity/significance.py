"""Job: the tests of the published study on poses, stiffness and errors, with corrected p-values."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array, Indices
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.tested_rows import FamilyTest, corrected_rows
from spinepipe.marks import read_json
from spinepipe.statistics import (
    chi_squared_normality,
    friedman,
    kendall,
    kolmogorov_smirnov_normality,
    lilliefors_normality,
    spearman,
)
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import STATISTICS
from spinepipe.studies.joint_pose_sensitivity.variables import (
    absolute_error,
    complete_grid,
    measured_coordinates,
    measured_size,
    pose_factors,
    pose_parameters,
    readings,
)
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

NORMALITY = (chi_squared_normality, kolmogorov_smirnov_normality, lilliefors_normality)


def run(root: str, study: str, tables: list[str], best: str, output: str) -> None:
    """Write ``statistics.parquet``."""
    settings, cohort = study_and_cohort(root, study)
    frames = read_frames(tables)
    seen = readings(frames["simulations"], cohort.zeroed_at_step_0)
    errors, motion = absolute_error(seen), measured_size(seen[seen["stiffness"] == "calibrated"])
    ranked_sets = read_json(best)
    rows: list[dict[str, Any]] = []
    for specimen in cohort.specimen_names:
        judged = frames["success"]
        kept = judged.loc[judged["reduced"] & (judged["specimen"] == specimen), "pose"].to_numpy()
        own = {
            name: table[(table["specimen"] == specimen) & table["pose"].isin(kept)]
            for name, table in (("errors", errors), ("motion", motion), ("poses", frames["poses"]))
        }
        fits = frames["calibrations"]
        fits = fits[(fits["specimen"] == specimen) & fits["pose"].isin(kept)]
        data = Specimen(settings, kept, **own, fits=fits, ranking=ranked_sets[specimen])
        rows += [{**row, "specimen": specimen} for row in corrected_rows(data.tests())]
    write(from_rows(STATISTICS, rows), output, provenance("statistics", settings, cohort))


@dataclass(frozen=True)
class Specimen:
    """What is tested of one specimen, its reduced poses only.

    Attributes
    ----------
    motion : mean size of the measured motion in the frames of each pose, as `measured_size`.
    """

    settings: JointPoseSensitivity
    kept: Indices
    poses: pd.DataFrame
    fits: pd.DataFrame
    errors: pd.DataFrame
    motion: pd.DataFrame
    ranking: Sequence[dict[str, Any]]

    def tests(self) -> Iterator[FamilyTest]:
        """All tests, family by family."""
        if not len(self.kept):
            return
        yield from self._normality()
        yield from self._calibrated_fits()
        for joint, coordinate in measured_coordinates(self.errors):
            yield from self._grid(joint, coordinate)

    def _normality(self) -> Iterator[FamilyTest]:
        named: list[tuple[str, str, Array]] = []
        for name, column in pose_parameters(self.poses).items():
            named.append(("*", str(name), column.to_numpy(float)))
        named += [(joint, name, values) for joint, name, values in self._stiffness()]
        for joint, coordinate in measured_coordinates(self.errors):
            error = self._own_errors(joint)[coordinate].dropna().to_numpy(float)
            named.append((joint, f"{coordinate}_error", error))
        for test in NORMALITY:
            for joint, name, values in named:
                yield FamilyTest("normality", joint, name, "", "", test(values))

    def _stiffness(self) -> Iterator[tuple[str, str, Array]]:
        """(joint, name, values) of every fitted stiffness, by pose."""
        for joint, rows in self.fits.groupby("joint", sort=False):
            by_pose = rows.set_index("pose").loc[self.kept]
            for name in self.settings.calibration.free:
                column = STIFFNESS_COLUMNS[COORDINATES.index(name)]
                yield str(joint), f"{name}_stiffness", by_pose[column].to_numpy(float)

    def _own_errors(self, joint: str) -> pd.DataFrame:
        """Errors by pose with each pose's own stiffness; ``*``: mean over the measured joints."""
        own = self.errors[self.errors["stiffness"] == "calibrated"]
        if joint != "*":
            return own[own["joint"] == joint].set_index("pose").loc[self.kept]
        measured = {name for name, _ in measured_coordinates(own)}
        names = list(COORDINATES)
        grouped = own[own["joint"].isin(measured)].groupby("pose")[names]
        return grouped.mean().reindex(self.kept)  # empty where all runs are lost

    def _calibrated_fits(self) -> Iterator[FamilyTest]:
        """Errors and stiffness of the poses' own fits against each other and against the pose."""
        factors = pose_factors(self.poses).loc[self.kept]
        for joint, name, values in self._stiffness():
            for factor in factors:
                found = spearman(factors[factor].to_numpy(float), values)
                yield FamilyTest("stiffness against pose", joint, name, str(factor), "", found)
            yield from self._errors_against("error against stiffness", joint, name, values)
        for factor in factors:
            values = factors[factor].to_numpy(float)
            yield from self._errors_against("error against pose", "*", str(factor), values)
        for joint, coordinate in measured_coordinates(self.errors):
            # is the error larger where the same motion, seen in other frames, is larger?
            moved = self.motion[self.motion["joint"] == joint].set_index("pose").loc[self.kept]
            both = [moved[coordinate], self._own_errors(joint)[coordinate]]
            found = spearman(*pd.concat(both, axis=1).dropna().to_numpy(float).T)
            response, measured = f"{coordinate}_error", f"{coordinate}_measured"
            yield FamilyTest("error against motion", joint, response, measured, "", found)

    def _errors_against(
        self, family: str, joint: str, factor: str, values: Array
    ) -> Iterator[FamilyTest]:
        errors = self._own_errors(joint)
        for coordinate in COORDINATES:
            error = errors[coordinate].to_numpy(float)
            known = np.isfinite(error)
            if known.any():
                found = spearman(values[known], error[known])
                yield FamilyTest(family, joint, f"{coordinate}_error", factor, "", found)

    def _grid(self, joint: str, coordinate: str) -> Iterator[FamilyTest]:
        """Friedman tests and correlations over the grid of poses and best stiffness sets."""
        grid = complete_grid(self.errors, joint, coordinate)
        if grid.empty:
            return
        error = f"{coordinate}_error"
        values = grid.to_numpy(float)
        # blocks are poses and treatments sets of stiffness, then the other way round
        yield FamilyTest("friedman", joint, error, "stiffness", "", friedman(values))
        yield FamilyTest("friedman", joint, error, "pose", "", friedman(values.T))
        family = f"two-factor: {error} at {joint} against"
        factors = pose_factors(self.poses).loc[grid.index]
        for factor in factors:
            for stratum in grid:
                pair = factors[factor].to_numpy(float), grid[stratum].to_numpy(float)
                for test in (kendall, spearman):
                    name = str(factor), str(stratum)
                    yield FamilyTest(f"{family} pose", joint, error, *name, test(*pair))
        for factor, stiffness in self._best_stiffness(joint, [str(name) for name in grid.columns]):
            for pose, row in zip(grid.index, values, strict=True):
                found = spearman(stiffness, row)
                yield FamilyTest(f"{family} stiffness", joint, error, factor, str(pose), found)

    def _best_stiffness(self, joint: str, names: Sequence[str]) -> Iterator[tuple[str, Array]]:
        """(name, values) of each fitted stiffness in the best sets, in the order of names."""
        sets = {ranked["name"]: np.array(ranked["stiffness"]) for ranked in self.ranking}
        joints = list(dict.fromkeys(self.errors["joint"]))
        for name in self.settings.calibration.free:
            column = COORDINATES.index(name)
            row = [
                sets[one][joints.index(joint) if len(sets[one]) > 1 else 0, column] for one in names
            ]
            yield f"{name}_stiffness", np.array(row)

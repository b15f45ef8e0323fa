"""Which uncertain input moves the results of a cohort most."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from spinepipe.api import plot
from spinepipe.api.result import Result, concluded, with_units
from spinepipe.api.study import Say, study_of
from spinepipe.cohort import Cohort
from spinepipe.progress import silent
from spinepipe.studies.global_sensitivity.analyse import analysed, outputs_of
from spinepipe.studies.global_sensitivity.base import base, stiffness_of
from spinepipe.studies.global_sensitivity.batch import Batch
from spinepipe.studies.global_sensitivity.respond import responses
from spinepipe.studies.global_sensitivity.sampling import design_of, drawn_in_units
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.start import start_of
from spinepipe.studies.global_sensitivity.tables import INDICES, RESPONSES
from spinepipe.studies.global_sensitivity.vary import vary
from spinepipe.studies.parts import stiffness_of_joints
from spinepipe.tables import to_arrow
from spinepipe.units import ROTATIONS

METHODS = {"sobol": "sobol", "morris": "morris", "fast": "fast", "lhs": "latin_hypercube"}

MOTION_AND_LOAD = ("motion", "joint_load")

_TOTAL = ("ST", "mu_star", "S1", "S1_RBD")
"""What ranks factors, of the indices that a method has."""


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivity(Result):
    """Indices of all factors.

    Attributes
    ----------
    table : a row per specimen, output, factor and index, with its interval; see docs/results.md.
    runs : how many there are by their status.
    samples : value of each factor in each sample. responses : motion and joint loads of each.
    """

    runs: pd.DataFrame
    samples: pd.DataFrame
    responses: pd.DataFrame

    def plot(self, ax: Any = None) -> Any:
        """Indices of each factor, see `spinepipe.plot.indices`."""
        known = self.table["index"].unique()
        return plot.indices(self, index=next(one for one in _TOTAL if one in known), ax=ax)

    @property
    def indices(self) -> pd.DataFrame:
        """The same as ``table``."""
        return self.table


def sensitivity(
    cohort: Cohort,
    factors: Mapping[str, Mapping[str, Any]],
    *,
    outputs: Sequence[str] = MOTION_AND_LOAD,
    method: Literal["sobol", "morris", "fast", "lhs"] = "sobol",
    samples: int = 256,
    stiffness: Literal["published", "fitted"] = "published",
    tests: Sequence[str] | None = None,
    settings: Mapping[str, Any] | None = None,
    say: Say = silent,
) -> Sensitivity:
    """Vary all factors at once and ask which moved the results.

    The numbers are those of a study of kind ``global_sensitivity`` with these settings, to the bit.

    Parameters
    ----------
    factors : by name, each as in a study file, such as
        ``{"of": "stiffness", "coordinate": "extension", "times": {"sd": 0.3}}``.
    outputs : motion of joints and what they carry, along the three rotations.
    samples : base samples; the runs are a multiple of them, see docs/studies/global_sensitivity.md.
    stiffness : where factors start: published values, or each specimen's own fit.
    settings : any further keys of such a study, as in its file; they come before the others.
    say : told of each specimen, such as `print`.

    Raises
    ------
    InputError
        With all that is wrong with factors, settings and cohort.

    Examples
    --------
    >>> import spinepipe as sp
    >>> disc = sp.read_cohort("config/cohorts/l4l5_disc")
    >>> stiffness = {"of": "stiffness", "coordinate": "extension", "times": {"sd": 0.3}}
    >>> size = {"of": "load_size", "times": {"sd": 0.1}}
    >>> asked = sp.sensitivity(
    ...     disc, {"k": stiffness, "load": size}, tests=["extension"], samples=8, outputs=["motion"]
    ... )
    >>> sorted(asked.table["factor"].unique())
    ['dummy', 'k', 'load']
    """
    asked = {
        "factors": [{**factor, "name": name} for name, factor in factors.items()],
        "design": {"method": METHODS[method], "samples": samples},
        "outputs": {one: list(ROTATIONS) if one in outputs else [] for one in MOTION_AND_LOAD},
        "stiffness": "fitted" if stiffness == "fitted" else None,
        "tests": None if tests is None else list(tests),
        **(settings or {}),
    }
    study = study_of(GlobalSensitivity, cohort, asked)
    shown = drawn_in_units(study)
    values, design = shown / np.array(study.per_si), design_of(study)
    indices: list[pd.DataFrame] = []
    runs: list[pd.DataFrame] = []
    for specimen in study.chosen_specimens(cohort):
        say(f"{specimen}: {len(values)} runs")
        rows = _responses(study, cohort, specimen, values)
        found, _ = analysed(study, design, list(outputs_of(rows, study)), specimen)
        indices.append(found.to_pandas())
        runs.append(rows.to_pandas())
    table = with_units(INDICES, pd.concat(indices, ignore_index=True))
    answered = with_units(RESPONSES, pd.concat(runs, ignore_index=True))
    drawn = pd.DataFrame(shown, columns=list(study.factor_names))
    drawn.attrs["units"] = dict(zip(study.factor_names, study.units, strict=True))
    by_status = answered.groupby("status").agg(rows=("sample", "size")).reset_index()
    said = concluded(study, cohort, {INDICES.name: table, RESPONSES.name: answered})
    return Sensitivity(table, said, by_status, drawn, answered)


def _responses(study: GlobalSensitivity, cohort: Cohort, specimen: str, values: Any) -> Any:
    """The table ``responses`` of a specimen, in the batches in which a run computes it."""
    given = stiffness_of_joints(cohort, study.start_stiffness, study.level_stiffness)
    if study.is_fitted:
        given = stiffness_of(base(study, cohort, specimen)[0])
    damping, tests = np.array(study.damping.in_order()), study.chosen_tests(cohort)
    start = start_of(cohort, specimen, given, damping, tests, study.steps == "all")
    size = study.batch_size(len(study.chosen_specimens(cohort)))
    columns: dict[str, list[Any]] = {}
    for first in range(0, len(values), size):
        own = values[first : first + size]
        batch = Batch(first, len(own), start, vary(start, study.changes, own))
        for name, cells in responses(batch, cohort.joint_names)[0].items():
            columns.setdefault(name, []).extend(cells)
    return to_arrow(RESPONSES, columns, specimen=specimen)

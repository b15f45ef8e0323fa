"""Outputs run by run beside the factors' values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from spinepipe.report.global_sensitivity.measures import Measures
from spinepipe.report.global_sensitivity.panels import Panel
from spinepipe.report.spread import Array
from spinepipe.statics.status import Status
from spinepipe.studies.global_sensitivity import DUMMY
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, TRANSLATIONS

TOP = 3
Values = Mapping[str, pd.Series]
"""Value of each factor of the design by sample."""


@dataclass(frozen=True, eq=False)
class Output:
    """One output of one joint.

    Attributes
    ----------
    values : output by sample, in the unit of the tables.
    factors : its leading factors, of a group one member.
    index : rows of the main index of this output, by factor or group.
    """

    panel: Panel
    specimen: str
    joint: str
    values: pd.Series
    factors: tuple[str, ...]
    index: pd.DataFrame


def output_of(
    panel: Panel,
    responses: pd.DataFrame,
    measures: Measures,
    drawn: Values,
    groups: Mapping[str, str],
) -> Output | None:
    """The output at the joint where it varies most, of the first specimen; None without runs.

    Parameters
    ----------
    groups : group of each factor.
    """
    specimen = str(panel.rows["specimen"].iloc[0])
    rows = responses[
        (responses["specimen"] == specimen)
        & (responses["test"] == panel.test)
        & (responses["step"] == panel.step)
        & (responses["status"] == Status.CONVERGED.value)
    ]
    if rows.empty:
        return None
    column = column_of(panel.output, panel.coordinate, responses)
    joint = str(rows.groupby("joint", sort=False)[column].std().fillna(0.0).idxmax())
    values = rows[rows["joint"] == joint].set_index("sample")[column]
    index = panel.rows[
        (panel.rows["index"] == measures.main)
        & (panel.rows["specimen"] == specimen)
        & (panel.rows["joint"] == joint)
    ].set_index("factor")
    order = index["estimate"].drop(DUMMY, errors="ignore").sort_values(ascending=False)
    leading = _drawn(list(order.index), values, drawn, groups)
    return Output(panel, specimen, joint, values, leading, index)


def _drawn(
    order: Sequence[str], values: pd.Series, drawn: Values, groups: Mapping[str, str]
) -> tuple[str, ...]:
    """The leading factors; of a group the member whose ranks follow the output's most."""
    ranks = values.rank()

    def follows(name: str) -> float:
        return abs(float(ranks.corr(drawn[name].reindex(values.index).rank())))

    members = [[name for name in drawn if groups[name] == leader] for leader in order[:TOP]]
    return tuple(max(of_group, key=follows) for of_group in members if of_group)


def column_of(output: str, coordinate: str, responses: pd.DataFrame) -> str:
    """Column of an output in ``responses``: motion ends with mm or deg, loads with n or nm."""
    if output == "motion":
        return f"predicted_{COORDINATE_COLUMNS[COORDINATES.index(coordinate)]}"
    ending = f"{coordinate}_{'n' if coordinate in TRANSLATIONS else 'nm'}"
    return next(str(name) for name in responses.columns if str(name).endswith(ending))


def running(x: Array, y: Array, few: int = 12) -> tuple[Array, Array]:
    """(P,) middles and (3, P) 5th percentile, median and 95th of y along x.

    Parts hold equal numbers of runs, of about 100 different values of x: designs repeat values, and
    runs that share one are much alike. Of a design of few levels each level is one part.
    """
    levels = np.unique(x)
    if len(levels) <= few:
        groups = [x == level for level in levels]
    else:
        parts = min(20, max(4, len(levels) // 100))
        part = np.searchsorted(np.quantile(levels, np.arange(1, parts) / parts), x)
        groups = [part == number for number in range(parts)]
    middles = np.array([np.median(x[group]) for group in groups])
    found = np.array([np.percentile(y[group], [5.0, 50.0, 95.0]) for group in groups])
    return middles, found.T

"""The runs of an output at the joint where it varies most, and the inputs that it follows there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.outputs import Measures, Output
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, TRANSLATIONS

TOP = 3


@dataclass(frozen=True, eq=False)
class JointRuns:
    """One output of one joint, of the first specimen.

    Attributes
    ----------
    values : output by sample, in the unit of the tables. failed : samples without an equilibrium.
    factors : its leading factors; of a group the member that the output follows most.
    design : value of each factor by sample. units : of each factor.
    """

    output: Output
    joint: str
    values: pd.Series
    failed: pd.Index
    factors: tuple[str, ...]
    design: Mapping[str, pd.Series]
    units: Mapping[str, str]

    def drawn(self, factor: str) -> pd.Series:
        """Values of a factor in the samples that have the output."""
        return self.design[factor].reindex(self.values.index)


def runs_of(
    output: Output, responses: pd.DataFrame, design: pd.DataFrame, measures: Measures
) -> JointRuns | None:
    """The runs of an output; None where none has an equilibrium."""
    specimen = str(output.rows["specimen"].iloc[0])
    every = responses[
        (responses["specimen"] == specimen)
        & (responses["test"] == output.test)
        & (responses["step"] == output.step)
    ]
    stands = every["status"] == Status.CONVERGED.value
    rows = every[stands]
    if rows.empty:
        return None
    column = column_of(output.kind, output.coordinate, responses)
    joint = str(rows.groupby("joint", sort=False)[column].std().fillna(0.0).idxmax())
    values = rows[rows["joint"] == joint].set_index("sample")[column]
    parts = {str(name): part for name, part in design.groupby("factor", sort=False)}
    drawn = {name: part.set_index("sample")["value"] for name, part in parts.items()}
    units = {name: str(part["unit"].iloc[0]) for name, part in parts.items()}
    groups = dict(zip(design["factor"], design["group"], strict=True))
    own = next((one for one in output.by_joint([joint]) if one.joint == joint), output)
    order = [row["factor"] for row in own.ordered(measures.main)]
    leading = _members(order, values, drawn, groups)
    failed = pd.Index(every.loc[~stands, "sample"].unique())
    return JointRuns(output, joint, values, failed, leading, drawn, units)


def _members(
    order: Sequence[str],
    values: pd.Series,
    drawn: Mapping[str, pd.Series],
    groups: Mapping[str, str],
) -> tuple[str, ...]:
    """The leading factors; of a group the member whose ranks follow the output's most."""
    ranks = values.rank()

    def follows(name: str) -> float:
        return abs(float(ranks.corr(drawn[name].reindex(values.index).rank())))

    members = [[name for name in drawn if groups[name] == leader] for leader in order[:TOP]]
    return tuple(max(of_group, key=follows) for of_group in members if of_group)


def column_of(kind: str, coordinate: str, responses: pd.DataFrame) -> str:
    """Column of an output in ``responses``: motion ends with mm or deg, loads with n or nm."""
    if kind == "motion":
        return f"predicted_{COORDINATE_COLUMNS[COORDINATES.index(coordinate)]}"
    ending = f"{coordinate}_{'n' if coordinate in TRANSLATIONS else 'nm'}"
    return next(str(name) for name in responses.columns if str(name).endswith(ending))

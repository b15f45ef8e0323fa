"""Figures of answers, each drawn on one `matplotlib.axes.Axes`, a new one unless given."""

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes

from spinepipe.cohort import Cohort
from spinepipe.units import COORDINATE_COLUMNS

if TYPE_CHECKING:  # they draw themselves by this module
    from spinepipe.api.missing_effects import MissingEffects
    from spinepipe.api.sensitivity import Sensitivity
    from spinepipe.api.stiffness import Stiffness


def curves(
    cohort: Cohort,
    test: str,
    *,
    predicted: xr.Dataset | pd.DataFrame | None = None,
    coordinate: str = "extension_deg",
    specimen: str | None = None,
    joint: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Motion of a joint over the steps of a test: cycles as measured, and as predicted.

    Parameters
    ----------
    predicted : of `spinepipe.simulate`, or rows of it. coordinate : a column of ``motion.csv``.
    specimen, joint : the first of the cohort by default.
    """
    if coordinate not in COORDINATE_COLUMNS:
        raise ValueError(f"coordinate is {coordinate!r}; allowed: {', '.join(COORDINATE_COLUMNS)}")
    ax = ax or plt.subplots()[1]
    if isinstance(predicted, xr.Dataset):
        predicted = predicted.to_dataframe().reset_index().dropna(subset=[coordinate])
    specimen, joint = specimen or cohort.specimen_names[0], joint or cohort.joint_names[0]
    for label, rows, style in (("measured", cohort.motion, "o"), ("predicted", predicted, "-")):
        if rows is None:
            continue
        own = rows[
            (rows["specimen"] == specimen) & (rows["joint"] == joint) & (rows["test"] == test)
        ]
        for cycle, one in own.groupby("cycle"):
            ax.plot(one["step"], one[coordinate], style, label=f"{label}, cycle {cycle}")
    ax.set(xlabel="load step", ylabel=coordinate.replace("_deg", ", deg").replace("_mm", ", mm"))
    ax.set_title(f"{specimen}, {joint}, {test}")
    ax.legend()
    return ax


def stiffness(fit: "Stiffness", *, coordinate: str = "extension", ax: Axes | None = None) -> Axes:
    """Fitted stiffness of each joint against one coordinate, with its 95 % region."""
    ax = ax or plt.subplots()[1]
    rows = fit.table[fit.table["coordinate"] == coordinate]
    for place, (specimen, own) in enumerate(rows.groupby("specimen", sort=False)):
        at = [list(dict.fromkeys(rows["joint"])).index(one) + 0.08 * place for one in own["joint"]]
        ax.plot(at, own["stiffness"], "o", label=str(specimen))
        ax.vlines(at, own["low"], own["high"])
    joints = list(dict.fromkeys(rows["joint"]))
    ax.set(xlabel="joint", ylabel=f"stiffness against {coordinate}, {rows['unit'].iloc[0]}")
    ax.set_xticks(range(len(joints)), joints)
    ax.legend()
    return ax


def left_out(fit: "Stiffness", *, ax: Axes | None = None) -> Axes:
    """Mean absolute error in the loaded coordinate on motion that no fit saw, test by test."""
    ax = ax or plt.subplots()[1]
    loaded = fit.left_out[fit.left_out["loaded"].astype(bool)]
    unseen = loaded.groupby("test", sort=False)["mae"].mean()
    ax.barh(list(unseen.index), unseen.to_list())
    ax.set(xlabel="mean absolute error, mm or deg")
    return ax


def indices(asked: "Sensitivity", *, index: str = "ST", ax: Axes | None = None) -> Axes:
    """An index of each factor over all outputs: every one as a dot."""
    ax = ax or plt.subplots()[1]
    rows = asked.table[asked.table["index"] == index]
    ax.plot(rows["estimate"], rows["factor"], "o", alpha=0.5)
    ax.set(xlabel=index)
    return ax


def effects(found: "MissingEffects", *, ax: Axes | None = None) -> Axes:
    """How probable it is of each effect that it is missing."""
    ax = ax or plt.subplots()[1]
    rows = found.probabilities.iloc[::-1]
    ax.barh(rows["name"].to_list(), rows["probability"].to_list())
    ax.set(xlabel="probability", xlim=(0.0, 1.0))
    return ax

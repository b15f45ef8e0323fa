"""Figure: joints of each specimen."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure
from spinepipe.studies.joint_count.settings import JointCount

from spinepipe.cohort import Cohort


def bars_figure(study: JointCount, cohort: Cohort, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """A bar for each specimen."""
    figure = Figure(figsize=(3.0, 2.0))
    rows = tables["joints"]
    figure.subplots().bar(rows["specimen"], rows["joints"])
    return figure

"""Figure: joints of each specimen."""

from collections.abc import Mapping

import pandas as pd
from spinepipe.studies.joint_count.settings import JointCount

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart
from spinepipe.report.forms.rows import Rows


def bars(study: JointCount, cohort: Cohort, tables: Mapping[str, pd.DataFrame]) -> Chart:
    """A bar for each specimen."""
    frame = tables["joints"].rename(columns={"specimen": "row", "joints": "value"})
    return Chart("Joints", [Rows(frame=frame, bars=True, x_label="joints")], "Joints counted.")

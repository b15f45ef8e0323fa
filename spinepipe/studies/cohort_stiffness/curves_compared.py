"""From the table ``load_displacement``: what was measured beside what the model does."""

import pandas as pd

from spinepipe.studies.cohort_stiffness.tables import MEASURED, SIMULATED

KEY = ["specimen", "joint", "test", "cycle"]


def both(rows: pd.DataFrame, name: str, unit: str) -> pd.DataFrame:
    """One row per curve: a number measured and simulated, and the way to the ends of each.

    Parameters
    ----------
    rows : of ``load_displacement``. name : of the number, whose column ends in ``unit``.

    Returns
    -------
    Columns `KEY`, ``measured``, ``simulated``, ``measured_way``, ``simulated_way``; NaN where not
    known.
    """
    value = f"{name}_{unit}"
    told = rows[[*KEY, "source"]].assign(
        number=rows[value].astype(float),
        way=0.5 * (rows[f"{name}_high_{unit}"].astype(float) - rows[f"{name}_low_{unit}"]),
    )
    sides = []
    for source in (MEASURED, SIMULATED):
        here = told[told["source"] == source].drop(columns="source")
        sides.append(here.rename(columns={"number": source, "way": f"{source}_way"}))
    return sides[0].merge(sides[1], on=KEY, how="left")

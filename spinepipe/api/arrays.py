"""Tables as arrays over their keys: `xarray.Dataset`, every variable with its unit."""

from collections.abc import Mapping, Sequence

import pandas as pd
import xarray as xr

from spinepipe.cohort import Cohort
from spinepipe.documents.names import EVERYONE
from spinepipe.units import COORDINATE_COLUMNS, COORDINATE_UNITS

MOTION_UNITS = dict(zip(COORDINATE_COLUMNS, COORDINATE_UNITS.values(), strict=True))
MOTION_KEYS = ("specimen", "test", "cycle", "step", "joint")

_LOADS = {
    **dict.fromkeys(("fx_n", "fy_n", "fz_n"), "N"),
    **dict.fromkeys(("mx_nm", "my_nm", "mz_nm"), "N m"),
}


def arrays(rows: pd.DataFrame, keys: Sequence[str], units: Mapping[str, str]) -> xr.Dataset:
    """Rows as arrays with a dimension per key, in the order of the rows; NaN where there is none.

    Parameters
    ----------
    units : by column; what has none is left without the attribute ``units``.
    """
    found = rows.set_index(list(keys)).to_xarray()
    found = found.reindex({key: rows[key].unique() for key in keys})
    for name in found.data_vars:
        if unit := units.get(str(name)):
            found[name].attrs["units"] = unit
    return found


def of_cohort(cohort: Cohort) -> xr.Dataset:
    """Motion, over specimen, test, cycle, step and joint, and loads, over vertebrae; in ground.

    Variables are the columns of ``motion.csv`` and ``loads.csv``, and ``sd_...`` of one reading of
    a coordinate, where the cohort tells it. What acts in every cycle has no dimension ``cycle``.
    """
    parts = []
    if cohort.motion is not None:
        motion = cohort.motion[[*MOTION_KEYS, *COORDINATE_COLUMNS]]
        parts.append(arrays(motion, MOTION_KEYS, MOTION_UNITS))
    if cohort.loads is not None:
        keys, loads = ["specimen", "test", "step", "vertebra"], cohort.loads
        of_all = loads["specimen"] == EVERYONE
        each = loads[of_all].drop(columns="specimen").merge(cohort.specimens["specimen"], "cross")
        loads = pd.concat([loads[~of_all], each])
        for place in (loads[loads["cycle"].isna()], loads[loads["cycle"].notna()]):
            if len(place):
                by = keys if place["cycle"].isna().all() else [*keys, "cycle"]
                parts.append(arrays(place[[*by, *_LOADS]], by, _LOADS))
    found = xr.merge(parts, join="outer", compat="no_conflicts")
    if (sd := cohort.reading_sd()) is not None:
        for name, value in zip(COORDINATE_COLUMNS, sd, strict=True):
            found[f"sd_{name}"] = xr.DataArray(value, attrs={"units": MOTION_UNITS[name]})
    return found.assign_attrs(cohort=cohort.name, title=cohort.title)

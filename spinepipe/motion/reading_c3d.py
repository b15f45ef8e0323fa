"""Motion as `.c3d`, by ezc3d: units and rate of its own; a residual of -1 says: not seen."""

from pathlib import Path
from typing import Any

import numpy as np

from spinepipe.motion.recorded import Recorded, recorded, unit_of
from spinepipe.problems import InputError, Problem

MORE_LABELS = ("LABELS", *(f"LABELS{k}" for k in range(2, 10)))
"""A parameter holds 255 names; further ones follow in the next."""


def read_c3d(path: Path, file: str) -> Recorded:
    """Markers of a `.c3d`, in the axes of the file; its first frame tells when it begins.

    Parameters
    ----------
    file : its name in messages.

    Raises
    ------
    InputError
        Where it cannot be read, or tells neither unit nor rate.
    """
    from ezc3d import c3d

    try:
        content = c3d(str(path))
    except (OSError, ValueError, RuntimeError) as error:
        allowed, remedy = "a .c3d", "export the motion again"
        raise InputError([Problem(file, None, None, str(error), allowed, remedy)]) from error
    point = content["parameters"]["POINT"]
    raw = content["data"]["points"][:3].transpose(2, 1, 0)
    names = _labels(point)[: raw.shape[1]]
    rate = float(next(iter(_value(point, "RATE")), 0.0))
    if not rate > 0.0 or not raw.size:
        found = f"{rate:g} frames a second, {raw.shape[0]} frames of {raw.shape[1]} markers"
        remedy = "export the motion again"
        raise InputError([Problem(file, None, "POINT:RATE", found, "all above 0", remedy)])
    scale = unit_of(file, None, "POINT:UNITS", str(next(iter(_value(point, "UNITS")), "")))
    lost = content["data"]["meta_points"]["residuals"][0].T < 0.0
    places = np.where(lost[..., None], np.nan, scale * raw)
    time_s = (content["header"]["points"]["first_frame"] + np.arange(len(raw))) / rate
    return recorded(tuple(names), time_s, places)


def _labels(point: Any) -> list[str]:
    return [str(name).strip() for key in MORE_LABELS for name in _value(point, key)]


def _value(point: Any, key: str) -> list[Any]:
    return list(point[key]["value"]) if key in point else []

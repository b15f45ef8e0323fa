"""Files of motion as ezc3d writes them, of which the reader shares no code."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from ezc3d import c3d

from spinepipe.effects.contract import Array

RATE = 50.0


def write_c3d(path: Path, places: Array, names: Sequence[str], units: str = "mm") -> Path:
    """Places (F, K, 3) in these units, `RATE` a second; NaN is a residual of -1 at a place kept."""
    content = c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    content["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    content["parameters"]["POINT"]["UNITS"]["value"] = [units]
    points = np.ones((4, places.shape[1], len(places)))
    lost = np.isnan(places).any(axis=-1)
    points[:3] = np.where(lost[..., None], 123.0, places).transpose(2, 1, 0)
    content["data"]["points"] = points
    content["data"]["meta_points"]["residuals"] = np.where(lost.T, -1.0, 0.0)[None]
    content.write(str(path))
    return path

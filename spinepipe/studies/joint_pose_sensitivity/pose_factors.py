"""What describes a sampled joint pose as a factor: its angles, and how far its origins are off."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from spinepipe.units import ROTATIONS, TRANSLATIONS

ORIGIN_DISTANCE = "origin_distance"
_AXES: Mapping[str, str] = {
    **{f"{axis}_mm": f"{name}_origin" for axis, name in zip("xyz", TRANSLATIONS, strict=True)},
    **{f"{name}_deg": f"{name}_orientation" for name in ROTATIONS},
}


def pose_parameters(poses: pd.DataFrame) -> pd.DataFrame:
    """All parameters of the poses of one specimen: a row per pose, six columns per joint.

    Columns such as ``L2L3_anterior_origin`` (mm) and ``L2L3_extension_orientation`` (deg).
    """
    named = poses.rename(columns=dict(_AXES))
    wide = named.pivot(index="pose", columns="joint", values=list(_AXES.values()))
    joints = list(dict.fromkeys(poses["joint"]))
    order = [(name, joint) for joint in joints for name in _AXES.values()]
    found = wide[order]
    return found.set_axis([f"{joint}_{name}" for name, joint in order], axis=1)


def pose_factors(poses: pd.DataFrame) -> pd.DataFrame:
    """The published description of the poses of one specimen: four columns, a row per pose.

    Angles (deg) averaged over the joints, and the distance (mm) of the joint origins from their
    mean over these poses, averaged over the joints (Gould 2024a, section 2.4.4).
    """
    origin = poses[["x_mm", "y_mm", "z_mm"]]
    off = (origin - origin.groupby(poses["joint"]).transform("mean")).to_numpy(float)
    columns = {f"{name}_orientation": poses[f"{name}_deg"].to_numpy(float) for name in ROTATIONS}
    columns[ORIGIN_DISTANCE] = np.linalg.norm(off, axis=1)
    found = pd.DataFrame(columns).groupby(poses["pose"].to_numpy()).mean()
    return found.rename_axis("pose")

"""Joint frames of a varied specimen: from moved landmarks, then moved along their own axes."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.cohort.varied.landmark_frames import many_joint_frames, why_none
from spinepipe.cohort.varied.start import Start
from spinepipe.cohort.varied.variation import Variation
from spinepipe.effects.contract import Array


@dataclass(frozen=True, eq=False)
class Frames:
    """Joint frames in ground of M spines: (M, J, 3, 3) and (M, J, 3) m, and who has none, why."""

    rotations: Array
    origins: Array
    refused: dict[int, str]


def varied_frames(start: Start, change: Variation) -> Frames:
    """First the landmarks are moved, then the frames that they make."""
    count = len(change.frames)
    rotations = np.tile([frame.rotation for frame in start.model.frames], (count, 1, 1, 1))
    origins = np.tile([frame.origin for frame in start.model.frames], (count, 1, 1))
    refused = _from_landmarks(start, change.landmarks, rotations, origins)
    _moved(change.frames, rotations, origins)
    return Frames(rotations, origins, refused)


def _from_landmarks(
    start: Start, offsets: Array, rotations: Array, origins: Array
) -> dict[int, str]:
    """Replace frames of joints one of whose vertebrae has a moved landmark."""
    refused: dict[int, str] = {}
    moved = np.any(offsets, axis=(0, 2, 3))
    points = start.points + offsets
    for joint, name in enumerate(start.model.joints):
        if start.given[joint] or not np.any(moved[joint : joint + 2]):
            continue
        of = (points[:, joint], points[:, joint + 1])
        known = (start.known[joint], start.known[joint + 1])
        made = many_joint_frames(*of, *known)
        rotations[:, joint], origins[:, joint] = made.rotations, made.origins
        for sample in np.flatnonzero(~made.defined).tolist():
            reason = why_none(of[0][sample], of[1][sample], *known)
            refused.setdefault(sample, f"joint {name}: {reason}")
    return refused


def _moved(by: Array, rotations: Array, origins: Array) -> None:
    """Move each frame along its own axes, then turn it, as ``frame @ transform_of(by)`` does."""
    for joint in np.flatnonzero(by.any(axis=(0, 2))):
        own = rotations[:, joint]
        origins[:, joint] += (own @ by[:, joint, :3, None])[..., 0]
        rotations[:, joint] = own @ Rotation.from_euler("ZXY", by[:, joint, 3:]).as_matrix()

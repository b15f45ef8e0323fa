"""What the animation shows of a motion: bodies, markers as measured and markers of the model."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.motion.objective import Watched
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import BODIES, body_poses
from spinepipe.units import DEG_PER_RAD, MM_PER_M, ROTATIONS

MOST_FRAMES = 40
"""More are thinned out evenly."""

_PLACE = ("x_mm", "y_mm", "z_mm")
_TURN = tuple(f"{name}_deg" for name in ROTATIONS)


def drawn_rows(watched: Watched, q: Array) -> Iterator[dict[str, Any]]:
    """Rows of postures (F, 18, 6) m and rad at nodes."""
    frames = np.unique(np.linspace(0, len(q) - 1, min(len(q), MOST_FRAMES)).round().astype(int))
    turns, origins = body_poses(watched.skeleton, q[frames])
    modelled = marker_places(watched.skeleton, watched.markers, q[frames])
    for k, frame in enumerate(frames.tolist()):
        now = {"frame": frame, "time_s": float(watched.grid.times_s[frame])}
        for body, turn, place in zip(BODIES, turns[k], origins[k], strict=True):
            angles = DEG_PER_RAD * zxy_angles(turn)
            turned = dict(zip(_TURN, angles.tolist(), strict=True))
            yield now | {"kind": "body", "name": body, **_at(place), **turned}
        for m, name in enumerate(watched.markers.names):
            still = dict.fromkeys(_TURN)
            yield now | {"kind": "modelled", "name": name, **_at(modelled[k, m]), **still}
            if watched.weight[frame, m] > 0.0:
                at = _at(watched.places[frame, m])
                yield now | {"kind": "measured", "name": name, **at, **still}


def _at(place: Array) -> dict[str, float]:
    return dict(zip(_PLACE, (MM_PER_M * place).tolist(), strict=True))

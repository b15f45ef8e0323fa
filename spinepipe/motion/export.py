"""A tracked spine as an OpenSim model, and its motion, so that OpenSim replays it.

Bodies, joints and coordinates are ours: the pelvis moves in ground, and each vertebra in the joint
below it, by three translations and by rotations Z, X', Y''. Passive elements are left out: they are
two-sided exponentials, for which OpenSim has no force.
"""

from collections.abc import Sequence
from itertools import chain, count, pairwise

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import osim_parts as parts
from spinepipe.motion.skeleton import BODIES, JOINTS, MarkerSet, Skeleton
from spinepipe.units import COORDINATES, DEG_PER_RAD, STANDARD_GRAVITY, TRANSLATIONS

PELVIS_JOINT = "pelvis"
"""What moves the pelvis in ground."""

COLUMNS = tuple(f"{joint}_{name}" for joint in (PELVIS_JOINT, *JOINTS) for name in COORDINATES)
"""Coordinates of the model, as a posture has them."""

_PER_SI = np.array([1.0 if name in TRANSLATIONS else DEG_PER_RAD for name in COORDINATES])
_HERE = Pose(np.eye(3), np.zeros(3))


def opensim_names(names: Sequence[str]) -> tuple[str, ...]:
    """Names that OpenSim can take; in others _ stands for what it cannot take, and a number."""
    taken = {name for name in names if parts.NAME.fullmatch(name)}
    found = []
    for name in names:
        one = name
        if one not in taken:
            plain = "".join(c if parts.NAME.fullmatch(c) else "_" for c in name) or "_"
            numbered = (f"{plain}_{k}" for k in count(2))
            one = next(new for new in chain((plain,), numbered) if new not in taken)
            taken.add(one)
        found.append(one)
    return tuple(found)


def osim(skeleton: Skeleton, markers: MarkerSet, name: str) -> str:
    """OpenSim document of a skeleton and its markers.

    Raises
    ------
    RefusedModel
        Of names that OpenSim cannot take.
    """
    kinds = ("Body", "Joint", "Marker")
    root, (bodies, joints, placed) = parts.document(
        name, "", STANDARD_GRAVITY, kinds, markers.names
    )
    masses = skeleton.masses
    ends = [step.origin for step in skeleton.steps]
    each = zip(BODIES, masses.kg, masses.com, masses.about_com, (*ends, ends[-1]), strict=True)
    for body, kg, com, about, end in each:
        bodies.append(parts.body(body, float(kg), com, about, _HERE, end))
    paths = ("/ground", *(f"/bodyset/{body}" for body in BODIES))
    steps = (_HERE, *skeleton.steps)
    named = zip((PELVIS_JOINT, *JOINTS), pairwise(paths), steps, strict=True)
    for joint, (lower, upper), step in named:
        joints.append(parts.joint(joint, (lower, step), (upper, _HERE)))
    for marker, on, at in zip(markers.names, markers.body, markers.at, strict=True):
        placed.append(parts.marker(marker, paths[on + 1], at))
    return parts.written(root)


def mot(name: str, time_s: Array, q: Array, columns: Sequence[str] = COLUMNS) -> str:
    """OpenSim's motion file of postures (F, J, 6) m and rad at times (F,) s: m and deg.

    Parameters
    ----------
    columns : names of the 6 J coordinates; by default those of a skeleton.
    """
    rows = np.column_stack([time_s, (q * _PER_SI).reshape(len(q), len(columns))])
    head = (name, "version=1", f"nRows={len(rows)}", f"nColumns={rows.shape[1]}", "inDegrees=yes")
    lines = [*head, "endheader", "\t".join(("time", *columns))]
    lines += ["\t".join(f"{value:.15g}" for value in row) for row in rows.tolist()]
    return "\n".join(lines) + "\n"

"""What instruments read as what the cohort's columns mean: rotations, translations, loads.

Rotations become angles of Z, X', Y'' (Wu et al. 2002), translations those of the joint's origin,
loads what acts on the loaded vertebra, with moments about the load point.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.decomposition import svd
from spinepipe.frames import zxy_angles
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.words import count
from spinepipe.testing_machine.channels import LOAD_COLUMNS
from spinepipe.testing_machine.instruments import LoadCell, MarkerClusters, Rotations
from spinepipe.testing_machine.recording import Recording
from spinepipe.testing_machine.settings import MachineMapping
from spinepipe.units import COORDINATE_COLUMNS

Array = NDArray[np.float64]

SHIFTS, TURNS = COORDINATE_COLUMNS[:3], COORDINATE_COLUMNS[3:]
ABOUT = {"x": "right_bending_deg", "y": "left_rotation_deg", "z": "extension_deg"}
THINNEST_MM = 1.0
"""A cluster whose markers are nearer than this (RMS) to a line does not tell how it turns about it.
"""

LOOSE, LOOSE_MM = 8.0, (0.5, 5.0)
"""A cluster is no rigid body where what least squares leave of it is more than so many times what
they leave in its best tenth of rows, but at least and at most so many mm (RMS).
"""


def converted(one: Recording, mapping: MachineMapping) -> Recording:
    """The recording in the cohort's terms."""
    if mapping.rotations is not None:
        one = _in_our_order(one, mapping.rotations, mapping.zeroed)
    if mapping.load_cell is not None:
        one = _applied(one, mapping.load_cell, mapping.of_file(one.of).load_point_mm)
    return one


def _in_our_order(one: Recording, rotations: Rotations, zeroed: bool) -> Recording:
    motion, finest = dict(one.motion), dict(one.finest)
    for joint in dict.fromkeys(joint for joint, name in one.motion if name in TURNS):
        told = np.column_stack([one.motion[joint, name] for name in ABOUT.values()])
        turned = _zxy(told, rotations, zeroed)
        coarsest = max(finest[joint, name] for name in TURNS)
        for place, name in enumerate(TURNS):
            motion[joint, name], finest[joint, name] = turned[:, place], coarsest
    return replace(one, motion=motion, finest=finest)


def _zxy(told: Array, rotations: Rotations, zeroed: bool) -> Array:
    """(N, 3) angles of Z, X', Y'', deg, of (N, 3) angles about x, y, z, deg, told otherwise.

    Parameters
    ----------
    zeroed : whether they count from the pose of the first row: differences of angles would be those
        of no rotation.
    """
    if rotations.order == "helical":
        turned = Rotation.from_rotvec(told, degrees=True)
    else:
        order = rotations.order.upper() if rotations.axes == "body" else rotations.order
        places = ["xyz".index(axis) for axis in rotations.order]
        turned = Rotation.from_euler(order, told[:, places], degrees=True)
    if zeroed:
        turned = turned * turned[0].inv()
    return np.degrees(zxy_angles(turned.as_matrix()))


def joint_rotations(
    one: Recording, markers: MarkerClusters, vertebrae: tuple[str, ...]
) -> Recording:
    """The recording with rotations of joints, from the pose of its first row, in the place of
    markers; those of a cluster are of least squares (Kabsch 1976, Acta Cryst A32, 922-923).

    Raises
    ------
    InputError
        Where the markers of a cluster lie on a line, or do not stay a rigid body.
    """
    turned: dict[str, Array] = {}
    problems = []
    for vertebra, names in markers.clusters.items():
        seen = np.array([[one.motion[name, axis] for axis in SHIFTS] for name in names])
        seen = seen.transpose(2, 0, 1)  # (N, markers, 3)
        seen = seen - seen.mean(axis=1, keepdims=True)
        thin = float(svd(seen[0])[1][1]) / np.sqrt(len(names))
        if thin < THINNEST_MM:
            found = f"markers of {vertebra} that lie on a line to {thin:.2g} mm"
            remedy = "name another marker of it that is off the line"
            allowed = f"at least {THINNEST_MM:g} mm"
            problems.append(InputProblem(one.file, None, None, found, allowed, remedy))
        u, _, v = svd(seen[0].T @ seen)
        u[..., -1] *= np.linalg.det(u @ v)[:, None]  # no mirror image
        turned[vertebra] = (u @ v).swapaxes(1, 2)
        off = np.linalg.norm(seen - seen[0] @ u @ v, axis=2)  # (N, markers)
        rms = np.sqrt((off**2).mean(axis=1))
        most = float(np.clip(LOOSE * np.quantile(rms, 0.1), *LOOSE_MM))
        if (loose := np.flatnonzero(rms > most)).size:
            row = loose[0]
            found = f"markers of {vertebra} that are {rms[row]:.2g} mm (RMS) off a rigid body, "
            found += f"{names[int(off[row].argmax())]} most, in {count(loose.size, 'row')}"
            place = one.file, int(one.lines[row]), None
            remedy = "look for a marker that is lost, frozen or another one; empty its cells there "
            remedy += "and set `empty_cells: left_out`, or name other markers"
            problems.append(InputProblem(*place, found, f"at most {most:.2g} mm", remedy))
    if problems:
        raise InputError(problems)
    motion: dict[tuple[str, str], Array] = {}
    for lower, upper in pairwise(vertebrae):
        below = turned.get(lower, np.eye(3)[None])
        angles = np.degrees(zxy_angles(below.swapaxes(1, 2) @ turned[upper]))
        motion |= {(upper + lower, name): angles[:, n] for n, name in enumerate(TURNS)}
    return replace(one, motion=motion, finest=dict.fromkeys(motion, 0.0))


def _applied(one: Recording, cell: LoadCell, point: tuple[float, ...] | None) -> Recording:
    """Loads on the vertebra; the moment about p is that about the cell's c and (c - p) x F."""
    read = np.column_stack([one.loads.get(name, 0.0 * one.lines) for name in LOAD_COLUMNS])
    if cell.tare_s is not None and one.time is not None:
        read = read - read[one.time <= cell.tare_s].mean(axis=0)
    sign = -1.0 if cell.reads == "reaction" else 1.0
    forces, moments = sign * read[:, :3], sign * read[:, 3:]
    if cell.point_mm is not None and point is not None:
        moments = moments + np.cross(np.subtract(cell.point_mm, point) / 1000.0, forces)
    both = np.hstack([forces, moments])
    return replace(one, loads={name: both[:, LOAD_COLUMNS.index(name)] for name in one.loads})


def sentences(places: set[tuple[str, str]], mapping: MachineMapping) -> Iterator[str]:
    """How rotations, translations and loads were taken."""
    joints = dict.fromkeys(sorted(joint for joint, _ in places))
    turned = [j for j in joints if places.issuperset((j, name) for name in TURNS)]
    rotations, cell = mapping.rotations, mapping.load_cell
    beside = mapping.motion_files
    if beside is not None and beside.markers is not None:
        yield "Rotations are those of clusters of markers, from the pose of the first row."
    elif turned and rotations is None:
        yield (
            f"Rotations of {', '.join(turned)} are taken as those of z, x', y'' (extension, right "
            "bending, left rotation); `rotations` tells another order."
        )
    elif turned and rotations is not None:
        axes = "axes that turn with them" if rotations.axes == "body" else "fixed axes"
        how = f"in the order {', '.join(rotations.order)} about {axes}"
        how = "as rotation vectors" if rotations.order == "helical" else how
        since = ", from the pose of the first row" if mapping.zeroed else ""
        yield f"Rotations, told {how}, are converted to those of z, x', y''{since}."
    plain = [j for j in joints if any((j, name) in places for name in SHIFTS)]
    if plain:
        yield (
            f"Translations of {', '.join(plain)} are taken as those of the joint's origin: where "
            "they were read belongs in joints.csv."
        )
    if cell is not None:
        what = "a reaction: all signs are turned" if cell.reads == "reaction" else "what acts"
        yield f"The load cell reads {what}."
    if cell is not None and cell.point_mm is not None:
        yield (
            f"Moments about the load cell, at {list(cell.point_mm)} mm, are told about the load "
            "point in the neutral pose; for 1 mm by which it moves, 100 N change them by 0.1 N m."
        )

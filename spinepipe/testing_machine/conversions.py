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
from spinepipe.problems import InputProblem
from spinepipe.testing_machine.channels import LOAD_COLUMNS
from spinepipe.testing_machine.instruments import LoadCell, Markers, Rotations
from spinepipe.testing_machine.recording import Recording
from spinepipe.testing_machine.settings import MachineMapping
from spinepipe.units import COORDINATE_COLUMNS

Array = NDArray[np.float64]

SHIFTS, TURNS = COORDINATE_COLUMNS[:3], COORDINATE_COLUMNS[3:]
ABOUT = {"x": "right_bending_deg", "y": "left_rotation_deg", "z": "extension_deg"}
UNCLEAR_DEG = 0.1
THINNEST_MM = 1.0
"""A cluster whose markers are nearer than this (RMS) to a line does not tell how it turns about it.
"""


def converted(one: Recording, mapping: MachineMapping) -> tuple[Recording, list[InputProblem]]:
    """The recording in the cohort's terms; problems where it lacks what the settings ask for."""
    point = mapping.of_file(one.of).load_point_mm
    lacks = [*_lacking_motion(one, mapping), *_lacking_loads(one, mapping.load_cell)]
    if not lacks:
        one = _in_our_order(one, mapping)
        if mapping.load_cell is not None:
            one = _applied(one, mapping.load_cell, point)
    return one, [InputProblem(one.file, None, *lack) for lack in lacks]


def _lacking_motion(one: Recording, mapping: MachineMapping) -> Iterator[tuple[str, str, str, str]]:
    """Key, what was found, what is allowed, remedy."""
    if mapping.rotations is not None:
        for joint in dict.fromkeys(joint for joint, _ in one.motion):
            there = sum((joint, name) in one.motion for name in TURNS)
            if there in (1, 2):
                found = f"{there} of the three rotations of {joint}"
                allowed = "all three: fewer are no rotation that could be told in another order"
                remedy = "add them, or delete `rotations` if they are angles of z, x', y''"
                yield "rotations", found, allowed, remedy
            elif there and mapping.zeroed and mapping.rotations.zero is None:
                yield from _zero_unclear(joint, _told(one, joint), mapping.rotations)
    for point in mapping.motion_points:
        if sum(other.joint == point.joint for other in mapping.motion_points) > 1:
            yield "motion_points", f"{point.joint} twice", "each joint once", "delete one of them"
        missing = [name for name in COORDINATE_COLUMNS if (point.joint, name) not in one.motion]
        if missing:
            found = f"no column of {point.joint} for {', '.join(missing)}"
            allowed = "three rotations and three translations, as all of them move the point"
            yield "motion_points", found, allowed, "add them to `motion`, or delete the point"


def _zero_unclear(
    joint: str, told: Array, rotations: Rotations
) -> Iterator[tuple[str, str, str, str]]:
    """Rotations that do not start at zero, where it makes a difference what they count from."""
    ways = [rotations.model_copy(update={"zero": zero}) for zero in ("each_angle", "pose")]
    apart = [_zxy(told, way) - _zxy(told, rotations) for way in ways]
    most = max(float(np.ptp(one, axis=0).max()) for one in apart)
    if most > UNCLEAR_DEG:
        start = ", ".join(f"{angle:.3g}" for angle in told[0])
        allowed = f"a start at zero, or a word: it makes a difference of {most:.2g} deg"
        remedy = "add `zero: neutral`, each_angle or pose to `rotations`"
        yield "rotations.zero", f"{joint} at {start} deg about x, y, z first", allowed, remedy


def _told(one: Recording, joint: str) -> Array:
    return np.column_stack([one.motion[joint, name] for name in ABOUT.values()])


def _in_our_order(one: Recording, mapping: MachineMapping) -> Recording:
    motion, finest = dict(one.motion), dict(one.finest)
    if mapping.rotations is not None:
        for joint in dict.fromkeys(joint for joint, name in one.motion if name in TURNS):
            turned = _zxy(_told(one, joint), mapping.rotations)
            coarsest = max(finest[joint, name] for name in TURNS)
            for place, name in enumerate(TURNS):
                motion[joint, name], finest[joint, name] = turned[:, place], coarsest
    for point in mapping.motion_points:
        # a point p of the upper vertebra moves by t + (R - 1)(p - o), its origin o by t
        lever = np.subtract(point.read_at_mm, point.origin_mm)
        angles = np.column_stack([motion[point.joint, name] for name in TURNS])
        if mapping.zeroed:
            angles = angles - angles[0]
        moved = Rotation.from_euler("ZXY", angles, degrees=True).apply(lever) - lever
        for place, name in enumerate(SHIFTS):
            motion[point.joint, name] = motion[point.joint, name] - moved[:, place]
    return replace(one, motion=motion, finest=finest)


def _zxy(told: Array, rotations: Rotations) -> Array:
    """(N, 3) angles of Z, X', Y'', deg, of (N, 3) angles about x, y, z, deg, told otherwise."""
    if rotations.zero == "each_angle":
        told = told - told[0]
    if rotations.order == "helical":
        turned = Rotation.from_rotvec(told, degrees=True)
    else:
        order = rotations.order.upper() if rotations.axes == "body" else rotations.order
        places = ["xyz".index(axis) for axis in rotations.order]
        turned = Rotation.from_euler(order, told[:, places], degrees=True)
    if rotations.zero == "pose":
        turned = turned * turned[0].inv()
    return np.degrees(zxy_angles(turned.as_matrix()))


def joint_rotations(
    one: Recording, markers: Markers, vertebrae: tuple[str, ...]
) -> tuple[Recording, list[InputProblem]]:
    """The recording with rotations of joints, from the pose of its first row, in the place of
    markers; those of a cluster are of least squares (Kabsch 1976, Acta Cryst A32, 922-923).
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
    motion: dict[tuple[str, str], Array] = {}
    for lower, upper in pairwise(vertebrae):
        below = turned.get(lower, np.eye(3)[None])
        angles = np.degrees(zxy_angles(below.swapaxes(1, 2) @ turned[upper]))
        motion |= {(upper + lower, name): angles[:, n] for n, name in enumerate(TURNS)}
    return replace(one, motion=motion, finest=dict.fromkeys(motion, 0.0)), problems


def _lacking_loads(one: Recording, cell: LoadCell | None) -> Iterator[tuple[str, str, str, str]]:
    """Key, what was found, what is allowed, remedy."""
    if cell is None:
        return
    missing = ", ".join(name for name in LOAD_COLUMNS if name not in one.loads)
    if missing and (cell.point_mm is not None or any(cell.axes_deg)):
        allowed = "three forces and three moments, as moved or turned ones depend on all"
        yield "load_cell", f"no column for {missing}", allowed, "add them, or delete the key"
    if cell.tare_s is not None and one.time is None:
        yield "load_cell.tare_s", "no time", "`time`", "add `time:`, or use `tare_line`"
    if cell.tare_line is not None and cell.tare_line not in one.lines:
        allowed = f"a line of numbers, {one.lines[0]} to {one.lines[-1]}, that is not left out"
        yield "load_cell.tare_line", str(cell.tare_line), allowed, "correct the line"


def _applied(one: Recording, cell: LoadCell, point: tuple[float, ...] | None) -> Recording:
    """Loads on the vertebra; the moment about p is that about the cell's c and (c - p) x F."""
    read = np.column_stack([one.loads.get(name, 0.0 * one.lines) for name in LOAD_COLUMNS])
    if cell.tare_s is not None and one.time is not None:
        read = read - read[one.time <= cell.tare_s].mean(axis=0)
    elif cell.tare_line is not None:
        read = read - read[one.lines == cell.tare_line]
    turn = Rotation.from_euler("ZXY", cell.axes_deg, degrees=True)
    sign = -1.0 if cell.reads == "reaction" else 1.0
    forces, moments = sign * turn.apply(read[:, :3]), sign * turn.apply(read[:, 3:])
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
        yield f"Rotations, told {how}, are converted to those of z, x', y''."
    moved = {point.joint: point for point in mapping.motion_points}
    for point in moved.values():
        yield (
            f"Translations of {point.joint} were read at {list(point.read_at_mm)} mm and are "
            f"converted to the joint's origin, {list(point.origin_mm)} mm; joints.csv must have it "
            "there, with axes along ground."
        )
    plain = [j for j in joints if j not in moved and any((j, name) in places for name in SHIFTS)]
    if plain:
        yield f"Translations of {', '.join(plain)} are taken as those of the joint's origin."
    if cell is not None:
        what = "a reaction: all signs are turned" if cell.reads == "reaction" else "what acts"
        yield f"The load cell reads {what}."
    if cell is not None and cell.point_mm is not None:
        yield (
            f"Moments about the load cell, at {list(cell.point_mm)} mm, are told about the load "
            "point in the neutral pose; for 1 mm by which it moves, 100 N change them by 0.1 N m."
        )

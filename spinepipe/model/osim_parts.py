"""Elements of an OpenSim 4 document: bodies, custom joints of six coordinates, markers, lists."""

import re
from collections.abc import Iterable
from math import atan2, cos, hypot, sin
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model.spine import RefusedModel
from spinepipe.units import COORDINATES

NAME = re.compile(r"[A-Za-z0-9_.-]+")
"""OpenSim separates paths by / and reads lists of names by spaces."""

DRAWN = np.array([0.47, 0.39, 0.62])
"""Half the depth, height and width of a drawn vertebra, for each m from joint to joint: a lumbar
one is about 34, 28 and 45 mm. Nothing is computed with it.
"""

AXES = (
    ("rotation1", "extension", "0 0 1"),
    ("rotation2", "right_bending", "1 0 0"),
    ("rotation3", "left_rotation", "0 1 0"),
    ("translation1", "anterior", "1 0 0"),
    ("translation2", "superior", "0 1 0"),
    ("translation3", "right", "0 0 1"),
)
"""OpenSim's transform axes: rotations first, each about an axis the one before it has moved."""


SIX = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
"""Places of xx, yy, zz, xy, xz, yz in a (3, 3) inertia."""


def document(
    name: str, credits: str, gravity: Array, kinds: Iterable[str], names: Iterable[str]
) -> tuple[Element, list[Element]]:
    """The root of a document with one model, and the lists of objects in the model's sets.

    Parameters
    ----------
    gravity : (3,) m/s2. kinds : of objects, such as `Body`. names : of all objects.

    Raises
    ------
    RefusedModel
        Of a name that OpenSim cannot take.
    """
    for one in (name, *names):
        if not NAME.fullmatch(one):
            raise RefusedModel(
                f"{name}: OpenSim cannot take the name {one!r}; use letters, digits, _ . and - only"
            )
    root = Element("OpenSimDocument", Version="40000")
    model = SubElement(root, "Model", name=name)
    told(model, "credits", f"Written by spinepipe. Units: m, kg, s, N, rad.{credits}")
    told(model, "gravity", numbers(gravity))
    sets = (SubElement(model, f"{kind}Set", name=f"{kind.lower()}set") for kind in kinds)
    return root, [SubElement(one, "objects") for one in sets]


def written(root: Element) -> str:
    """A document as the text of its file."""
    indent(root)
    text = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def told(parent: Element, tag: str, text: str) -> None:
    """A property and its value."""
    SubElement(parent, tag).text = text


def numbers(values: Iterable[float]) -> str:
    """Values as OpenSim reads a list of them, without loss."""
    return " ".join(repr(float(value)) for value in values)


def body(name: str, mass: float, com: Array, inertia: Array, low: Pose, high: Array) -> Element:
    """A body: kg, centre of mass (3,) m in its frame, inertia (3, 3) kg m2 about that.

    It is drawn between two joints.

    Parameters
    ----------
    low, high : pose of the joint below in its frame, and place (3,) m of that above.
    """
    element = Element("Body", name=name)
    middle = SubElement(SubElement(element, "components"), "PhysicalOffsetFrame", name="drawn")
    geometry = SubElement(SubElement(middle, "attached_geometry"), "Ellipsoid", name="vertebra")
    told(geometry, "socket_frame", "..")
    told(geometry, "radii", numbers(float(np.linalg.norm(high - low.origin)) * DRAWN))
    _placed(middle, "..", Pose(low.rotation, 0.5 * (low.origin + high)))
    told(element, "mass", repr(float(mass)))
    told(element, "mass_center", numbers(com))
    told(element, "inertia", numbers(inertia[SIX]))
    return element


def marker(name: str, frame: str, at: Array) -> Element:
    """A marker at a point (3,) m of a frame, told by its path."""
    element = Element("Marker", name=name)
    told(element, "socket_parent_frame", frame)
    told(element, "location", numbers(at))
    told(element, "fixed", "true")
    return element


def joint(name: str, lower: tuple[str, Pose], upper: tuple[str, Pose]) -> Element:
    """A custom joint whose coordinates are ours, e.g. ``L3L4_anterior`` (m, rad).

    Parameters
    ----------
    lower, upper : path of each body, and the pose of the joint's frame in it.
    """
    element = Element("CustomJoint", name=name)
    told(element, "socket_parent_frame", "lower")
    told(element, "socket_child_frame", "upper")
    coordinates = SubElement(element, "coordinates")
    for coordinate in COORDINATES:
        SubElement(coordinates, "Coordinate", name=f"{name}_{coordinate}")
    element.append(offset_frames(lower, upper))
    transform = SubElement(element, "SpatialTransform")
    for axis, coordinate, direction in AXES:
        motion = SubElement(transform, "TransformAxis", name=axis)
        told(motion, "coordinates", f"{name}_{coordinate}")
        told(motion, "axis", direction)
        told(SubElement(motion, "LinearFunction", name="function"), "coefficients", "1 0")
    return element


def offset_frames(lower: tuple[str, Pose], upper: tuple[str, Pose]) -> Element:
    """Frames ``lower`` and ``upper`` on two bodies: path of each, and the frame's pose in it."""
    frames = Element("frames")
    for name, (path, frame) in (("lower", lower), ("upper", upper)):
        _placed(SubElement(frames, "PhysicalOffsetFrame", name=name), path, frame)
    return frames


def _placed(offset: Element, path: str, frame: Pose) -> None:
    told(offset, "socket_parent", path)
    told(offset, "translation", numbers(frame.origin))
    told(offset, "orientation", numbers(_xyz_angles(frame.rotation)))


def _xyz_angles(rotation: Array) -> tuple[float, float, float]:
    """Angles in rad with ``R = Rx(a) Ry(b) Rz(c)``; c from ``Rx(-a) R`` stays exact at b = 90°."""
    (_, _, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    a = atan2(-yz, zz)
    b = atan2(xz, hypot(yz, zz))
    c = atan2(cos(a) * yx + sin(a) * zx, cos(a) * yy + sin(a) * zy)
    return a, b, c

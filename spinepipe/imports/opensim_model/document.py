"""Bodies, joints and frames of an OpenSim document, placed in ground in the default pose.

Version 4 has joints in a set of their own and tells frames by paths; versions 2 and 3 have each
joint within the body that it carries, and tell bodies by name. A property that is not in the file
has OpenSim's own default. Constraints are not solved.
"""

import re
from collections.abc import Iterator
from posixpath import join, normpath
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.documents.names import ALLOWED, name_fault
from spinepipe.documents.text import NUMBER
from spinepipe.documents.xml_text import LINE
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.problems import InputError, InputProblem

GROUND = "ground"
ORIGIN = (0.0, 0.0, 0.0)

_HERE = Pose(np.eye(3), np.zeros(3))
_OFFSET = "PhysicalOffsetFrame"
_PATH = "#path"

_COORDINATES = {
    **{"WeldJoint": "", "PinJoint": "Z", "SliderJoint": "x", "UniversalJoint": "XY"},
    **{"BallJoint": "XYZ", "GimbalJoint": "XYZ", "PlanarJoint": "Zxy", "FreeJoint": "XYZxyz"},
}
"""Axes of a joint's coordinates in their order: capital letters turn, small ones shift."""

Placement = tuple[str, Pose]
"""A body, and the pose of a frame in it."""


def is_on(element: Element) -> bool:
    """Whether a force or constraint acts; older files say whether it does not."""
    words = (element.findtext("appliesForce", "true"), element.findtext("isEnforced", "true"))
    off = element.findtext("isDisabled", "false").strip() == "true"
    return not off and all(word.strip() != "false" for word in words)


class OsimJoint(NamedTuple):
    """A joint: its frames on two bodies, the child's in the parent's in the default pose (None: of
    a form that is not read), and whether it has a coordinate that is not locked."""

    name: str
    parent: Placement
    child: Placement
    motion: Pose | None
    moves: bool


class OsimDocument:
    """What is in a file.

    Attributes
    ----------
    model : its element. problems : faults met so far; whoever reads on adds to them.
    bodies : elements by name.
    placed : pose in ground of each body that could be placed. below : for each of those but ground,
        the joint that it was placed by and the body on its other side.
    """

    def __init__(self, root: Element, file: str) -> None:
        """Read and place.

        Raises
        ------
        InputError
            For a document of another kind.
        """
        self.file, self.problems = file, list[InputProblem]()
        version, model = root.get("Version", ""), root.find("Model")
        number = int(version) if version.isdecimal() else 0
        if model is None or not (20000 <= number <= 30000 or number >= 40000):
            found = f"<{root.tag} Version='{version}'>, {'no' if model is None else 'a'} Model"
            allowed = "a Model in an OpenSimDocument of version 20000 to 30000 or from 40000 on"
            remedy = "open it in OpenSim 4 and save it again"
            raise InputError([InputProblem(file, 1, None, found, allowed, remedy)])
        self.model, self._frames = model, dict[str, Element]()
        self._find_frames()
        if all(one.get("name") != GROUND for one in self._frames.values()):
            self._frames[f"/{GROUND}"] = Element("Ground", name=GROUND)
        every = self._frames.values()
        self.bodies = {one.get("name", ""): one for one in every if one.tag != _OFFSET}
        self.placed, self.below = {GROUND: _HERE}, dict[str, tuple[OsimJoint, str]]()
        joints = list(self._joints())
        while sum(map(self._place, joints)):
            pass

    def objects(self, group: str, kind: str) -> Iterator[Element]:
        """Objects of a set of the model whose tags match and that are not switched off."""
        every = self.model.iterfind(f"{group}/objects/*")
        return (one for one in every if re.fullmatch(kind, one.tag) and is_on(one))

    def name(self, at: Element) -> str:
        """Of an element, which must be one that a table may have."""
        name = at.get("name", "")
        if (fault := name_fault(name)) is not None:
            self.fault(at, "name", fault, ALLOWED, "rename it in OpenSim")
        return name

    def fault(self, at: Element, key: str, found: str, allowed: str, remedy: str) -> None:
        """Note a fault of an element."""
        place = (self.file, int(at.get(LINE, "1")), f"{at.tag} {at.get('name', '')}, {key}")
        self.problems.append(InputProblem(*place, found, allowed, remedy))

    def stand_on(self, body: str) -> None:
        """Turn `below` round from a body to ground: it stands on nothing then, ground on it."""
        way = list[tuple[str, OsimJoint, str]]()
        while body in self.below:
            joint, lower = self.below.pop(body)
            way.append((lower, joint, body))
            body = lower
        self.below |= {lower: (joint, upper) for lower, joint, upper in way}

    def numbers(self, at: Element, key: str, default: tuple[float, ...]) -> Array:
        """Numbers of a property, as many as by default; any number of them where that is empty."""
        words = (at.findtext(key) or "").split() or list(map(str, default))
        if (default and len(words) != len(default)) or not all(map(NUMBER.fullmatch, words)):
            allowed = f"{len(default) or 'any'} numbers"
            self.fault(at, key, f"'{' '.join(words)}'", allowed, "correct it")
            return np.array(default)
        return np.array(words, dtype=float)

    def frame(self, at: Element, key: str) -> Placement | None:
        """The body of a frame that an element names, and where the frame lies in it."""
        pose = _HERE
        for _ in range(len(self._frames) + 1):  # more frames on each other are a circle
            named = (at.findtext(key) or "").strip()
            found = self._frames.get(normpath(join(at.get(_PATH, "/"), named)))
            if found is None:  # told by its name alone
                last = named.rpartition("/")[2]
                alike = [one for one in self._frames.values() if one.get("name") == last]
                found = alike[0] if len(alike) == 1 else None
            if found is None:
                break
            if found.tag != _OFFSET:
                return found.get("name", ""), pose
            pose = self._pose(found, "translation", "orientation") @ pose
            at, key = found, "socket_parent"
        self.fault(at, key, f"'{named}'", "a body or frame of this file", "correct the name")
        return None

    def side(self, at: Element, new: str, old: str, *pose: str) -> Placement | None:
        """The frame of a socket; in older files a body, and keys of where a frame lies in it."""
        if at.find(new) is not None:
            return self.frame(at, new)
        on = self.frame(at, old)
        return on and (on[0], self._pose(at, *pose)) if pose else on

    def function(self, at: Element, key: str, inputs: list[float]) -> float | None:
        """Value of a function of an element; None: of a form that is not read."""
        found, scale = next((of for of in at if of.get("name") == key), None), 1.0
        found = at.find(f"{key}/*") if found is None else found
        while found is not None and found.tag == "MultiplierFunction":
            scale *= float(self.numbers(found, "scale", (1.0,))[0])
            found = found.find("function/*")
        if found is None or found.tag == "Constant":
            value = 0.0 if found is None else float(self.numbers(found, "value", (0.0,))[0])
            return scale * value
        if found.tag == "LinearFunction":
            factors = self.numbers(found, "coefficients", (1.0,) * len(inputs) + (0.0,))
            return scale * float(factors @ [*inputs, 1.0])
        x, y = self.numbers(found, "x", ()), self.numbers(found, "y", ())
        if len(inputs) == 1 and len(x) == len(y) > 1 and np.diff(x).min() > 0.0:
            slopes, at_point = np.diff(y) / np.diff(x), np.abs(x - inputs[0]) < 1e-12
            if np.ptp(slopes) < 1e-9:
                return scale * float(y[0] + slopes[0] * (inputs[0] - x[0]))
            if at_point.any():  # a spline is known in its points alone
                return scale * float(y[at_point][0])
        return None

    def _pose(self, at: Element, location: str, orientation: str) -> Pose:
        """A pose told by a place, m, and by angles, rad, about axes x, y', z''."""
        angles = self.numbers(at, orientation, ORIGIN)
        turned = Rotation.from_euler("XYZ", angles).as_matrix()
        return Pose(turned, self.numbers(at, location, ORIGIN))

    def _find_frames(self) -> None:
        """Give all elements their paths, and note those that are frames."""
        self.model.set(_PATH, "/")
        for parent in self.model.iter():  # before its children
            path = parent.get(_PATH, "/").rstrip("/")
            for child in parent:
                name = child.tag.lower() if child.tag.endswith("Set") else child.get("name")
                child.set(_PATH, f"{path}/{name}" if name else path or "/")
                if name and child.tag in ("Ground", "Body", _OFFSET):
                    self._frames[child.get(_PATH, "")] = child

    def _joints(self) -> Iterator[OsimJoint]:
        every = [(joint, "") for joint in self.objects("JointSet", r"\w*Joint")]
        for body, element in self.bodies.items():
            every += [(joint, body) for joint in element.iterfind("Joint/*")]
        at = ("location_in_parent", "orientation_in_parent")
        for joint, body in every:
            parent = self.side(joint, "socket_parent_frame", "parent_body", *at)
            own = (body, self._pose(joint, "location", "orientation"))
            child = own if body else self.frame(joint, "socket_child_frame")
            if parent is not None and child is not None:
                locked = [one.findtext("locked", "").strip() for one in joint.iter("Coordinate")]
                moves = any(one != "true" for one in locked)
                name = joint.get("name", "")
                yield OsimJoint(name, parent, child, self._motion(joint), moves)

    def _value(self, of: Element) -> float | None:
        """Of a coordinate in the default pose, m or rad: as it is prescribed, unless locked."""
        told = [of.findtext(key, "").strip() == "true" for key in ("prescribed", "locked")]
        if told == [True, False]:
            return self.function(of, "prescribed_function", [0.0])
        return float(self.numbers(of, "default_value", (0.0,))[0])

    def _motion(self, joint: Element) -> Pose | None:
        """Pose of the child's frame in that of the parent: body-fixed turns, then a shift."""
        if joint.findtext("reverse", "").strip() == "true":
            return None
        values = {one.get("name", ""): self._value(one) for one in joint.iter("Coordinate")}
        steps: list[tuple[bool, Array, float | None]] = []
        if joint.tag == "CustomJoint":
            for one in sorted(joint.iter("TransformAxis"), key=lambda one: one.get("name", "")):
                inputs = [values.get(n, 0.0) for n in one.findtext("coordinates", "").split()]
                axis = self.numbers(one, "axis", (1.0, 0.0, 0.0))
                axis /= np.linalg.norm(axis) or 1.0
                known = [value for value in inputs if value is not None]
                amount = self.function(one, "function", known) if known == inputs else None
                steps.append((one.get("name", "").startswith("rotation"), axis, amount))
        elif joint.tag in _COORDINATES:
            for letter, value in zip(_COORDINATES[joint.tag], values.values(), strict=False):
                axis = np.eye(3)["xyz".index(letter.lower())]
                steps.append((letter.isupper(), axis, value))
        else:
            return None
        turned, shift = Rotation.identity(), np.zeros(3)
        for turns, axis, amount in steps:
            if amount is None:
                return None
            turned = turned * Rotation.from_rotvec(amount * axis) if turns else turned
            shift = shift if turns else shift + amount * axis
        return Pose(turned.as_matrix(), shift)

    def _place(self, joint: OsimJoint) -> bool:
        """Place the body on one side of a joint by that on the other; whether there was one."""
        (lower, at), (upper, to) = joint.parent, joint.child
        if joint.motion is None or (lower in self.placed) == (upper in self.placed):
            return False
        step = at @ joint.motion @ to.inverse()
        if upper in self.placed:
            lower, upper, step = upper, lower, step.inverse()
        self.placed[upper] = self.placed[lower] @ step
        self.below[upper] = joint, lower
        return True

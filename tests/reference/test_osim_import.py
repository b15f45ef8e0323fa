"""An .osim file as a cohort, against OpenSim's own reading of it.

Catches frames, masses, markers and bushings of an OpenSim model that enter otherwise.
"""

import os
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import opensim
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cohort.specimen import bodies, joint_frames, spine_model
from spinepipe.documents.xml_text import read_xml
from spinepipe.frames import Pose
from spinepipe.imports.imported import write
from spinepipe.imports.opensim_model.document import OsimDocument
from spinepipe.imports.registry import read
from spinepipe.model import SpineModel
from spinepipe.model.file import effects_for, read_model
from spinepipe.model.osim import osim
from spinepipe.muscles.folder import in_ground
from spinepipe.statics import System, follow
from spinepipe.world import Chain as LoadedChain
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import Chain

NUMBERS = frozenset(
    {"gravity", "mass", "mass_center", "inertia", "translation", "orientation"}
    | {
        f"{kind}_{what}"
        for kind in ("rotational", "translational")
        for what in ("stiffness", "damping")
    }
)
NAMES = ("S1", "L5", "L4", "L3", "L2", "L1", "T12")


def imported(folder: Path, **settings: object) -> tuple[cohorts.Cohort, tuple[str, ...]]:
    """The cohort of `model.osim` in a folder, and what was said."""
    keys = {"kind": "opensim_model", "cohort": "osim", "title": "t", "source": "s"}
    keys |= {"file": "model.osim", **settings}
    yaml = folder / "import.yaml"
    yaml.write_text("\n".join(f"{key}: {value}" for key, value in keys.items()), encoding="utf-8")
    found = read(yaml)
    write(found, folder / "osim", replace=True)
    return cohorts.read(folder / "osim"), found.sentences


@pytest.fixture(params=range(6))
def chain(request: pytest.FixtureRequest) -> Chain:
    rng = np.random.default_rng(70 + request.param)
    return chains.random_chain(rng, 1 + request.param, tilt_deg=60.0)


def rebuilt(folder: Path, chain: Chain, text: str, **settings: object) -> SpineModel:
    """Our model of a file, made of the imported cohort and its model file alone."""
    (folder / "model.osim").write_text(text, encoding="utf-8")
    cohort, _ = imported(folder, **settings)
    effects = effects_for(read_model(folder / "osim" / "model.yaml"), "random", cohort.joint_names)
    return spine_model(cohort, "random", joint_frames(cohort, "random"), effects, chain.damping[0])


def first(folder: Path, chain: Chain) -> SpineModel:
    """The exported chain, whose bodies are called like no vertebrae."""
    called = zip(NAMES, ("ground", *(f"V{j}" for j in range(chain.n_joints))), strict=False)
    named = ", ".join(f"{name}: {body}" for name, body in called)
    return rebuilt(folder, chain, osim(bridge.spine_model(chain)), vertebrae=f"{{{named}}}")


def near(found: object, expected: object, within: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=within)


def test_what_is_exported_comes_back(tmp_path: Path, chain: Chain) -> None:
    found, model = first(tmp_path, chain), bridge.spine_model(chain)
    for ours, theirs in zip(found.frames, model.frames, strict=True):
        near(ours.origin, theirs.origin, 1e-9)
        near(ours.rotation, theirs.rotation, 1e-9)
    for ours, theirs in zip(found.bodies, model.bodies, strict=True):
        near(ours.mass, theirs.mass, 1e-9)
        near(ours.com, theirs.com, 1e-9)
        near(ours.inertia, theirs.inertia, 1e-9)
    near(found.effects[0].values, model.effects[0].values, 1e-6)


def test_it_goes_out_again_as_it_came(tmp_path: Path, chain: Chain) -> None:
    """The second time vertebrae are known by their names, and ground by that of the first joint."""
    once = osim(first(tmp_path, chain))
    again = osim(rebuilt(tmp_path, chain, once))
    for one, other in zip(*(ET.fromstring(text).iter() for text in (once, again)), strict=True):
        assert (one.tag, one.attrib) == (other.tag, other.attrib)
        words = (one.text or "").split(), (other.text or "").split()
        if one.tag in NUMBERS:
            near(np.array(words[0], float), np.array(words[1], float), 1e-9)
        else:
            assert words[0] == words[1]


def test_equilibrium_of_the_imported_model_is_that_of_the_file(
    tmp_path: Path, chain: Chain
) -> None:
    model = first(tmp_path, chain)
    loads = [(f"V{load.body}", load) for load in chain.loads]
    theirs = opensim_peer.equilibrium_of_file(tmp_path / "model.osim", loads)
    path = follow(System(LoadedChain(model), model, bridge.load_case(chain)))
    for joint, pose in enumerate(path[-1].equilibrium.q.reshape(-1, 6)):
        found = [theirs[f"J{joint}_{name}"] for name in opensim_peer.COORDINATES]
        near(pose, found, 1e-6)


def rich(path: Path) -> opensim.Model:
    """Pelvis, sacrum, L5, L4 as files have them: offsets in offsets, welds, defaults that turn."""
    vec = opensim.Vec3
    model = opensim.Model()
    model.setName("rich")
    for number, name in enumerate(("pelvis", "sacrum", "lumbar5", "lumbar4", "disc", "arm")):
        inertia = opensim.Inertia(0.02 + 0.001 * number, 0.03, 0.04, 0.001, -0.002, 0.003)
        model.addBody(opensim.Body(name, 1.5 + number, vec(0.01, 0.02 * number, -0.003), inertia))
    bodies = {body.getName(): body for body in model.getBodyList()}
    ground = model.getGround()
    free = opensim.FreeJoint(
        "free", ground, vec(0.1, 0.9, 0), vec(0.1, -0.2, 0.3), bodies["pelvis"], vec(0), vec(0)
    )
    for number in range(6):
        free.get_coordinates(number).setDefaultValue(0.05 * (number - 2))
    model.addJoint(free)
    weld = opensim.WeldJoint(
        "weld", bodies["pelvis"], vec(-0.05, 0.07, 0), vec(0, 0, -0.2),
        bodies["sacrum"], vec(0.01, 0, 0), vec(0.1, 0, 0),
    )  # fmt: skip
    model.addJoint(weld)
    # a frame on a frame on a body
    low = opensim.PhysicalOffsetFrame(
        "low",
        bodies["sacrum"],
        opensim.Transform(opensim.Rotation(0.1, opensim.UnitVec3(0, 0, 1)), vec(0.02, 0.03, 0.001)),
    )
    bodies["sacrum"].addComponent(low)
    high = opensim.PhysicalOffsetFrame(
        "high",
        low,
        opensim.Transform(opensim.Rotation(-0.3, opensim.UnitVec3(1, 0, 0)), vec(0, 0.04, 0)),
    )
    low.addComponent(high)
    motion = opensim_peer._motion([f"q{number}" for number in range(6)])
    motion.upd_rotation2().set_function(opensim.LinearFunction(0.5, 0.02))
    motion.upd_translation3().setCoordinateNames(opensim.ArrayStr())
    motion.upd_translation3().set_function(opensim.Constant(0.004))
    custom = opensim.CustomJoint(
        "custom",
        high,
        vec(0),
        vec(0),
        bodies["lumbar5"],
        vec(0.001, -0.02, 0),
        vec(0, 0.1, 0.2),
        motion,
    )
    model.addJoint(custom)
    ball = opensim.BallJoint(
        "ball",
        bodies["lumbar5"],
        vec(0, 0.03, 0),
        vec(0.1, 0, 0),
        bodies["lumbar4"],
        vec(0),
        vec(0),
    )
    for number in range(3):
        ball.get_coordinates(number).setDefaultValue(0.1 - 0.07 * number)
    model.addJoint(ball)
    model.addJoint(
        opensim.WeldJoint(
            "glue", bodies["lumbar5"], vec(0.01), vec(0), bodies["disc"], vec(0), vec(0.2, 0.1, 0)
        )
    )
    pin = opensim.PinJoint(
        "pin", bodies["lumbar4"], vec(0, 0.3, 0.1), vec(0), bodies["arm"], vec(0), vec(0)
    )
    model.addJoint(pin)
    for name, on, at in (
        ("SACR", high, vec(-0.1, 0.01, 0)), ("ASIS", bodies["pelvis"], vec(0.1, 0.02, 0.12)),
        ("L4", bodies["lumbar4"], vec(-0.07, 0, 0.01)), ("hand", bodies["arm"], vec(0)),
    ):  # fmt: skip
        model.addMarker(opensim.Marker(name, on, at))
    cylinder = opensim.WrapCylinder()
    cylinder.setName("drum")
    cylinder.set_radius(0.01)
    cylinder.set_length(0.2)
    bodies["lumbar5"].addWrapObject(cylinder)
    muscle = opensim.Thelen2003Muscle("MF_m4_r", 321.0, 0.07, 0.03, 0.1)
    muscle.addNewPathPoint("one", bodies["pelvis"], vec(-0.04, 0.01, 0.02))
    muscle.addNewPathPoint("two", bodies["lumbar4"], vec(-0.05, 0.01, 0.015))
    muscle.updGeometryPath().addPathWrap(bodies["lumbar5"].getWrapObject("drum"))
    model.addForce(muscle)
    model.finalizeConnections()
    for name, value in {"q0": 0.002, "q1": 0.003, "q3": 0.03, "q4": 0.05, "q5": -0.07}.items():
        model.updCoordinateSet().get(name).setDefaultValue(value)
    model.printToXML(str(path))
    return opensim.Model(str(path))


def transform(found: opensim.Transform) -> Pose:
    matrix = found.R().asMat33()
    rows = [[matrix.get(i, j) for j in range(3)] for i in range(3)]
    return Pose(np.array(rows), found.p().to_numpy())


def test_a_model_of_opensims_own_making(tmp_path: Path) -> None:
    model = rich(tmp_path / "model.osim")
    state = model.initSystem()
    model.realizePosition(state)
    cohort, told = imported(tmp_path)
    assert cohort.vertebrae == ("S1", "L5", "L4")
    assert cohort.gravity
    frames = joint_frames(cohort, "rich")
    for frame, name in zip(frames, ("custom", "ball"), strict=True):
        theirs = transform(
            model.getJointSet().get(name).getChildFrame().getTransformInGround(state)
        )
        near(frame.origin, theirs.origin, 1e-9)
        near(frame.rotation, theirs.rotation, 1e-9)
    # L5 has the disc that is glued to it
    glued = [model.getBodySet().get(name) for name in ("lumbar5", "disc")]
    at = [body.getTransformInGround(state) for body in glued]
    kg = [body.getMass() for body in glued]
    centres = [
        transform(pose).apply(body.getMassCenter().to_numpy())
        for pose, body in zip(at, glued, strict=True)
    ]
    found = bodies(cohort, "rich")[0]
    near(found.mass, sum(kg), 1e-9)
    near(found.com, np.average(centres, axis=0, weights=kg), 1e-9)
    whole = np.zeros((3, 3))
    for pose, body, mass, centre in zip(at, glued, kg, centres, strict=True):
        inertia = body.getInertia()
        (xx, yy, zz), (xy, xz, yz) = (
            getattr(inertia, of)().to_numpy() for of in ("getMoments", "getProducts")
        )
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        turned = transform(pose).rotation
        far = np.cross(centre - found.com, np.eye(3))
        whole += turned @ own @ turned.T + mass * far.T @ far
    near(found.inertia, whole, 1e-9)
    # markers: those of the pelvis in axes of ground from L5S1, of L4 in the frame of its joint
    rows = pd.read_csv(tmp_path / "osim" / "marker_set.csv").set_index("marker")
    here = Pose(np.eye(3), frames[0].origin)
    assert list(rows.index) == ["SACR", "ASIS", "L4"]
    for name, frame in (("SACR", here), ("ASIS", here), ("L4", frames[1])):
        theirs = model.getMarkerSet().get(name).getLocationInGround(state).to_numpy()
        near(
            frame.apply(rows.loc[name, ["x_mm", "y_mm", "z_mm"]].to_numpy(float) / 1e3),
            theirs,
            1e-9,
        )
    assert rows["vertebra"].tolist() == ["S1", "S1", "L4"]
    # the muscle: points in ground by our frames of bodies, and by OpenSim
    table = pd.read_csv(tmp_path / "osim" / "muscles.csv")
    points = in_ground(
        pd.read_csv(tmp_path / "osim" / "body_frames.csv"),
        table["body"].tolist(),
        table[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / 1e3,
    )
    theirs = [
        transform(model.getBodySet().get(body).getTransformInGround(state)).apply(at)
        for body, at in (("pelvis", (-0.04, 0.01, 0.02)), ("lumbar4", (-0.05, 0.01, 0.015)))
    ]
    near(points, theirs, 1e-9)
    (parameters,) = pd.read_csv(tmp_path / "osim" / "muscle_parameters.csv").to_dict("records")
    assert parameters == {
        "muscle": "MF_m4_r", "group": "multifidus", "side": "right", "max_isometric_force_n": 321.0,
        "optimal_fibre_length_mm": 70.0, "wrap_objects": "drum",
    }  # fmt: skip
    said = " ".join(told)
    for words in (
        "Turned by default",
        "L5S1 and L4L5",
        "run over wrap objects",
        "6.5 kg by L4",
        "1 on arm",
    ):
        assert words in said


SIMPLE_JOINTS = ("Pin", "Slider", "Universal", "Ball", "Gimbal", "Planar", "Free", "Weld")


@sweep("kind", SIMPLE_JOINTS)
def test_every_simple_joint(tmp_path: Path, kind: str) -> None:
    model = opensim.Model()
    body = opensim.Body("b", 1.0, opensim.Vec3(0), opensim.Inertia(1, 1, 1))
    model.addBody(body)
    places = (opensim.Vec3(0.1, 0.2, 0.3), opensim.Vec3(0.3, -0.2, 0.4), body, opensim.Vec3(0.05))
    turned = opensim.Vec3(0.1, 0.2, -0.3)
    joint = getattr(opensim, f"{kind}Joint")("j", model.getGround(), *places, turned)
    for number in range(joint.numCoordinates()):
        joint.get_coordinates(number).setDefaultValue(0.2 + 0.1 * number)
    model.addJoint(joint)
    model.finalizeConnections()
    path = tmp_path / f"{kind}.osim"
    model.printToXML(str(path))
    state = model.initSystem()
    model.realizePosition(state)
    theirs = transform(model.getBodySet().get("b").getTransformInGround(state))
    root, _ = read_xml(path, path.name)
    assert root is not None
    ours = OsimDocument(root, path.name).placed["b"]
    near(ours.origin, theirs.origin, 1e-12)
    near(ours.rotation, theirs.rotation, 1e-12)


OLD_BODY = """
<Body name="{name}"><mass>{mass}</mass><mass_center>0.01 0.02 -0.01</mass_center>
<inertia_xx>0.02</inertia_xx><inertia_yy>0.03</inertia_yy><inertia_zz>0.04</inertia_zz>
<inertia_xy>0.001</inertia_xy><inertia_xz>0</inertia_xz><inertia_yz>-0.002</inertia_yz>
<Joint>{joint}</Joint></Body>"""

OLD_WELD = """
<WeldJoint name="base"><parent_body>ground</parent_body>
<location_in_parent>0.1 0.9 0</location_in_parent>
<orientation_in_parent>0 0 0.2</orientation_in_parent>
<location>0.01 0 0</location><orientation>0.1 0 0</orientation></WeldJoint>"""

OLD_JOINT = """
<CustomJoint name="L5_S1"><parent_body>sacrum</parent_body>
<location_in_parent>-0.01 0.06 0</location_in_parent>
<orientation_in_parent>0.1 -0.2 -0.3</orientation_in_parent>
<location>0 -0.01 0</location><orientation>0 0 0.1</orientation>
<CoordinateSet><objects>
<Coordinate name="bend"><default_value>0.2</default_value></Coordinate>
<Coordinate name="turn"><default_value>0.1</default_value></Coordinate>
</objects></CoordinateSet>
<SpatialTransform>
<TransformAxis name="rotation1"><function><MultiplierFunction><function><LinearFunction>
<coefficients>0.5 0.01</coefficients></LinearFunction></function><scale>0.8</scale>
</MultiplierFunction></function><coordinates>bend</coordinates><axis>0 0 1</axis></TransformAxis>
<TransformAxis name="rotation2"><function><SimmSpline><x>-1 1</x><y>-0.3 0.5</y></SimmSpline>
</function><coordinates>turn</coordinates><axis>1 0 0</axis></TransformAxis>
<TransformAxis name="rotation3"><function><SimmSpline><x>-1 0.2 1 2</x><y>-1 0.3 0.4 0.1</y>
</SimmSpline></function><coordinates>bend</coordinates><axis>0 1 0</axis></TransformAxis>
<TransformAxis name="translation1"><function><Constant><value>0.003</value></Constant></function>
<axis>1 0 0</axis></TransformAxis>
<TransformAxis name="translation2"><function><Constant><value>0.04</value></Constant></function>
<axis>0 1 0</axis></TransformAxis>
<TransformAxis name="translation3"><function><Constant><value>0</value></Constant></function>
<axis>0 0 1</axis></TransformAxis>
</SpatialTransform></CustomJoint>"""

OLD_BUSHING = """
<BushingForce name="disc"><body_1>sacrum</body_1><body_2>L5</body_2>
<location_body_1>{at}</location_body_1><orientation_body_1>{turned}</orientation_body_1>
<location_body_2>0 -0.01 0</location_body_2><orientation_body_2>0 0 0.1</orientation_body_2>
<rotational_stiffness>20 30 40</rotational_stiffness>
<translational_stiffness>1000 2000 0</translational_stiffness></BushingForce>"""


def old(version: int, bushing: str = "") -> str:
    bodies = "".join(
        (
            '<Body name="ground"><mass>0</mass><mass_center>0 0 0</mass_center></Body>',
            OLD_BODY.format(name="sacrum", mass=3, joint=OLD_WELD),
            OLD_BODY.format(name="L5", mass=2, joint=OLD_JOINT),
        )
    )
    marker = '<Marker name="m"><body>L5</body><location>-0.05 0.02 0.01</location></Marker>'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="{version}"><Model name="old"><gravity>0 -9.81 0</gravity>
<BodySet><objects>{bodies}</objects></BodySet>
<ForceSet><objects>{bushing}</objects></ForceSet>
<MarkerSet><objects>{marker}</objects></MarkerSet>
</Model></OpenSimDocument>"""


@sweep("version", [20302, 30000])
def test_a_model_of_version_2_or_3(tmp_path: Path, version: int) -> None:
    (tmp_path / "model.osim").write_text(old(version), encoding="utf-8")
    model = opensim.Model(str(tmp_path / "model.osim"))
    state = model.initSystem()
    model.realizePosition(state)
    cohort, _ = imported(tmp_path)
    (frame,) = joint_frames(cohort, "old")
    theirs = transform(model.getJointSet().get("L5_S1").getChildFrame().getTransformInGround(state))
    near(frame.origin, theirs.origin, 1e-9)
    near(frame.rotation, theirs.rotation, 1e-9)
    (body,) = bodies(cohort, "old")
    l5 = model.getBodySet().get("L5")
    placed = transform(l5.getTransformInGround(state))
    near(body.com, placed.apply(l5.getMassCenter().to_numpy()), 1e-9)
    own = np.array([[0.02, 0.001, 0], [0.001, 0.03, -0.002], [0, -0.002, 0.04]])
    near(body.inertia, placed.rotation @ own @ placed.rotation.T, 1e-9)
    marker = pd.read_csv(tmp_path / "osim" / "marker_set.csv")
    at = frame.apply(marker[["x_mm", "y_mm", "z_mm"]].to_numpy(float)[0] / 1e3)
    near(at, model.getMarkerSet().get(0).getLocationInGround(state).to_numpy(), 1e-9)


def test_a_bushing_of_version_3_in_the_frame_of_a_joint(tmp_path: Path) -> None:
    """Its frame on the sacrum is where OpenSim has that of L5; elsewhere it is left out."""
    (tmp_path / "model.osim").write_text(old(30000), encoding="utf-8")
    model = opensim.Model(str(tmp_path / "model.osim"))
    state = model.initSystem()
    frame = model.getJointSet().get("L5_S1").getChildFrame()
    here = frame.findTransformBetween(state, model.getBodySet().get("sacrum"))
    at, turned = here.p().to_numpy(), here.R().convertRotationToBodyFixedXYZ().to_numpy()
    for away in (0.0, 0.01):
        place = " ".join(map(repr, (at + np.array([away, 0, 0])).tolist()))
        bushing = OLD_BUSHING.format(at=place, turned=" ".join(map(repr, turned.tolist())))
        (tmp_path / "model.osim").write_text(old(30000, bushing), encoding="utf-8")
        (tmp_path / "osim" / "model.yaml").unlink(missing_ok=True)
        _, told = imported(tmp_path)
        assert any("BushingForce left out" in one for one in told) == (away > 0.0)
        assert (tmp_path / "osim" / "model.yaml").exists() == (away == 0.0)
        if away == 0.0:
            (law,) = effects_for(read_model(tmp_path / "osim" / "model.yaml"), "old", ("L5S1",))
            # no stiffness to the right: the least that a bushing has
            near(law.values, [[1000, 2000, 1, 40, 20, 30]], 1e-9)
            said = " ".join(told)
            assert "end of the range" in said
            assert "small rotations" in said


def public_files() -> list[Path]:
    folder = os.environ.get("SPINEPIPE_PUBLIC_FILES")
    return sorted(Path(folder).rglob("*.osim")) if folder else []


@pytest.mark.skipif(not public_files(), reason="SPINEPIPE_PUBLIC_FILES names no .osim")
def test_bodies_of_public_models_are_where_opensim_has_them() -> None:
    for path in public_files():
        root, problems = read_xml(path, path.name)
        assert root is not None, problems
        if 30000 < int(root.get("Version", "")) < 40000:  # betas of version 4 are refused
            continue
        ours = OsimDocument(root, path.name)
        assert not ours.problems
        model = opensim.Model(str(path))
        state = model.initSystem()
        for coordinate in model.getCoordinateSet():  # as the file says, not as constraints have it
            coordinate.setValue(state, coordinate.getDefaultValue(), False)
        model.realizePosition(state)
        for name in ours.placed.keys() - {"ground"}:
            body = model.getBodySet().get(name)
            theirs = transform(body.getTransformInGround(state))
            # OpenSim renews older files through texts of seven digits
            near(ours.placed[name].origin, theirs.origin, 1e-6)
            near(ours.placed[name].rotation, theirs.rotation, 1e-9)

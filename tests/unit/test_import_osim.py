"""`spinepipe import` of an OpenSim model, without OpenSim: what is told and what is refused.

Catches a faulty model that enters, and a part of a model that is passed over in silence.
"""

from pathlib import Path

import numpy as np
import pytest
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cohort.specimen import bodies, joint_frames
from spinepipe.imports.imported import ImportedCohort, write
from spinepipe.imports.registry import read
from spinepipe.problems import InputError

HEAD = '<?xml version="1.0"?>\n<OpenSimDocument Version="40500">\n'
L5_AT = "0.01 0.1 0"

MODEL = f"""<Model name="m"><gravity>0 -9.81 0</gravity>
<BodySet name="bodyset"><objects>
<Body name="pelvis"><mass>9</mass><inertia>.1 .1 .1 0 0 0</inertia>
 <WrapObjectSet><objects><WrapCylinder name="idle"/></objects></WrapObjectSet></Body>
<Body name="L5"><mass>2</mass><mass_center>0 .02 .01</mass_center>
 <inertia>.01 .02 .025 0 0 0</inertia></Body>
<Body name="rib"><mass>3</mass></Body><Body name="other"><mass>0</mass></Body>
</objects></BodySet>
<JointSet name="jointset"><objects>
<WeldJoint name="base"><socket_parent_frame>/ground</socket_parent_frame>
 <socket_child_frame>/bodyset/pelvis</socket_child_frame></WeldJoint>
<BallJoint name="disc"><socket_parent_frame>low</socket_parent_frame>
 <socket_child_frame>/bodyset/L5</socket_child_frame>
 <coordinates><Coordinate name="a"/><Coordinate name="b"/></coordinates>
 <frames><PhysicalOffsetFrame name="low"><socket_parent>/bodyset/pelvis</socket_parent>
  <translation>{L5_AT}</translation></PhysicalOffsetFrame></frames></BallJoint>
<PinJoint name="rib"><socket_parent_frame>/bodyset/L5</socket_parent_frame>
 <socket_child_frame>/bodyset/rib</socket_child_frame>
 <coordinates><Coordinate name="r"/></coordinates></PinJoint>
<WeldJoint name="side"><socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
 <socket_child_frame>/bodyset/other</socket_child_frame></WeldJoint>
</objects></JointSet>
<ForceSet><objects><CoordinateActuator name="x"/><CoordinateActuator name="y"/>
<FunctionBasedBushingForce/>
<BushingForce name="off"><appliesForce>false</appliesForce>
 <socket_frame1>/bodyset/L5</socket_frame1></BushingForce></objects></ForceSet>
<MarkerSet><objects><Marker name="SACR"><socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
</Marker></objects></MarkerSet>
<ConstraintSet><objects><CoordinateCouplerConstraint name="couple"/></objects></ConstraintSet>
</Model>"""

TAIL = "\n</OpenSimDocument>\n"
GOOD = HEAD + MODEL + TAIL


def imported(folder: Path, model: str = GOOD, **settings: object) -> ImportedCohort:
    keys = {"kind": "opensim_model", "cohort": "osim", "title": "t", "source": "s"}
    keys |= {"file": "m.osim", **settings}
    (folder / "m.osim").write_text(model, encoding="utf-8")
    yaml = folder / "import.yaml"
    yaml.write_text("\n".join(f"{key}: {value}" for key, value in keys.items()), encoding="utf-8")
    return read(yaml)


def changed(old: str, new: str) -> str:
    assert MODEL.count(old) == 1
    return HEAD + MODEL.replace(old, new) + TAIL


def test_what_is_not_read_is_counted(tmp_path: Path) -> None:
    told = imported(tmp_path).sentences
    assert "2 vertebrae: S1 is pelvis, L5 is L5." in told
    counts = "1 BushingForce, 2 CoordinateActuator, 1 CoordinateCouplerConstraint"
    more = "1 FunctionBasedBushingForce, 1 WrapCylinder that no path uses"
    assert f"Not read: {counts}, {more}." in told
    assert "Masses left out, carried on joints of their own: 3 kg by L5." in told


def test_a_model_whose_z_is_up(tmp_path: Path) -> None:
    """All turned by hand: forwards x, to the left y, up z."""
    texts = {
        "0 -9.81 0": "0 0 -9.81", L5_AT: "0.01 0 0.1", "0 .02 .01": "0 -.01 .02",
        ".01 .02 .025 0 0 0": ".01 .025 .02 0 0 0",
    }  # fmt: skip
    turned = MODEL
    for old, new in texts.items():
        turned = turned.replace(old, new)
    write(imported(tmp_path), tmp_path / "osim", replace=False)
    straight = cohorts.read(tmp_path / "osim")
    write(imported(tmp_path, HEAD + turned + TAIL, axes="x z -y"), tmp_path / "osim", replace=True)
    found = cohorts.read(tmp_path / "osim")
    for one, other in zip(joint_frames(found, "m"), joint_frames(straight, "m"), strict=True):
        np.testing.assert_allclose(one.origin, other.origin, rtol=0, atol=1e-12)
        np.testing.assert_allclose(one.rotation, other.rotation, rtol=0, atol=1e-12)
    for one, other in zip(bodies(found, "m"), bodies(straight, "m"), strict=True):
        np.testing.assert_allclose(one.com, other.com, rtol=0, atol=1e-12)
        np.testing.assert_allclose(one.inertia, other.inertia, rtol=0, atol=1e-12)


def test_a_body_between_two_vertebrae_is_told(tmp_path: Path) -> None:
    found = imported(tmp_path, vertebrae="{S1: pelvis, T1: rib}")
    words = "Bodies lie between vertebrae, the joint is the upper one: T1S1 (L5)."
    assert words in found.sentences


def test_a_prescribed_coordinate_stands_where_it_is_prescribed(tmp_path: Path) -> None:
    """Two joints, each with a coordinate of this name, as version 4 may have them."""
    pin = '<Coordinate name="r"><default_value>.1</default_value></Coordinate>'
    kept = (
        '<Coordinate name="r"><default_value>.2</default_value><prescribed>true</prescribed>'
        "<prescribed_function><Constant><value>.3</value></Constant></prescribed_function>"
    )
    text = GOOD.replace('<Coordinate name="r"/>', pin).replace(
        '<Coordinate name="a"/><Coordinate name="b"/>',
        f'<Coordinate name="a"/><Coordinate name="b"/>{kept}</Coordinate>',
    )
    table = str(imported(tmp_path, text).files["joints.csv"]).splitlines()
    assert float(table[1].split(",")[5]) == pytest.approx(np.degrees(0.3))


def test_a_chain_from_the_top_down_is_turned(tmp_path: Path) -> None:
    """L5 on ground carries the pelvis; the joint's frame is where it was."""
    text = GOOD.replace("/bodyset/pelvis</socket_child", "/bodyset/L5</socket_child", 1)
    text = text.replace("frame>low<", "frame>/bodyset/L5<", 1)
    text = text.replace("/bodyset/L5</socket_child_frame>\n <coordinates>",
        "low</socket_child_frame>\n <coordinates>", 1)  # fmt: skip
    found = imported(tmp_path, text)
    assert found.files["joints.csv"].splitlines()[1] == "m,L5S1,0,0,0,0,0,0"


def muscle(name: str, *points: str, more: str = "") -> str:
    listed = "".join(points)
    path = f"<GeometryPath><PathPointSet><objects>{listed}</objects></PathPointSet></GeometryPath>"
    return f'<Thelen2003Muscle name="{name}">{path}{more}</Thelen2003Muscle>'


def point(body: str, at: str, kind: str = "PathPoint") -> str:
    on = f"<socket_parent_frame>/bodyset/{body}</socket_parent_frame>"
    return f"<{kind}>{on}<location>{at}</location></{kind}>"


def test_muscles_that_count_and_those_that_do_not(tmp_path: Path) -> None:
    low, high = point("pelvis", "0 0 -.02"), point("rib", "0 .1 -.03", "ConditionalPathPoint")
    made = (
        muscle("RA1", low, high, more="<max_isometric_force>50</max_isometric_force>"),
        muscle("glut_r", low, point("other", "0 0 0")),
        muscle("slide_r", low, point("L5", "0 0 0", "MovingPathPoint")),
        muscle("weak_r", low, high, more="<max_isometric_force>0</max_isometric_force>"),
    )
    text = changed('<CoordinateActuator name="x"/>', "".join(made))
    found = imported(tmp_path, text)
    assert found.files["muscle_parameters.csv"] == (
        "muscle,group,side,max_isometric_force_n,optimal_fibre_length_mm,wrap_objects\n"
        "RA1,ra,left,50,100,\n"
    )
    assert found.files["muscles.csv"] == (
        "muscle,point,body,x_mm,y_mm,z_mm\nRA1,0,S1,0,0,-20\nRA1,1,rib,0,100,-30\n"
    )
    assert found.files["body_frames.csv"] == (
        "specimen,body,carried_by,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg\n"
        "m,S1,S1,0,0,0,0,0,0\nm,rib,L5,10,100,0,0,0,0\n"
    )
    for words in (
        "1 muscle for trunk_loads; its study must say source_stress_mpa.",
        "1 ConditionalPathPoint taken as there in every posture.",
        "Left out: 1 muscle across no joint between vertebrae: glut_r.",
        "Left out: 1 muscle with a point that moves or has no place: slide_r.",
        "Left out: 1 muscle without force: weak_r.",
        "Moved with a vertebra, though on joints of their own: rib.",
    ):
        assert words in found.sentences


def test_an_inertia_that_no_body_has_is_left_out_and_told(tmp_path: Path) -> None:
    found = imported(tmp_path, changed(".01 .02 .025 0 0 0", ".01 .02 .05 0 0 0"))
    assert "Inertia left out, none that a body can have: L5." in found.sentences
    write(found, tmp_path / "osim", replace=False)
    (body,) = bodies(cohorts.read(tmp_path / "osim"), "m")
    assert body.mass == 2.0
    assert not body.inertia.any()


def test_without_masses_there_is_no_weight(tmp_path: Path) -> None:
    found = imported(tmp_path, changed("<mass>2</mass>", "<mass>0</mass>"))
    write(found, tmp_path / "osim", replace=False)
    assert not cohorts.read(tmp_path / "osim").gravity


def test_what_stands_for_no_mass_is_none(tmp_path: Path) -> None:
    """As `spinepipe export` writes a cohort without bodies."""
    text = GOOD.replace("<mass>9<", "<mass>0<").replace("<mass>2<", "<mass>0.001<")
    found = imported(tmp_path, text.replace(".01 .02 .025 0 0 0", "1e-06 1e-06 1e-06 0 0 0"))
    assert "bodies.csv" not in found.files
    assert "Without mass, 1 g and 1e-6 kg m2 stand for none: L5." in found.sentences


REFUSED: dict[str, tuple[str, dict[str, object], str]] = {
    "entities": (
        '<?xml version="1.0"?>\n<!DOCTYPE x [<!ENTITY e "e">]>\n<OpenSimDocument/>',
        {}, "m.osim, line 2: found a document type",
    ),
    "an open element": (HEAD + "<Model>" + TAIL, {}, "line 4: found mismatched tag"),
    "a deep one": (
        HEAD + "<a>" * 5000 + "</a>" * 5000 + TAIL, {}, "found <OpenSimDocument Version='40500'>",
    ),
    "another document": ("<Model/>", {}, "found <Model Version=''>, no Model"),
    "a beta of version 4": (
        GOOD.replace("40500", "30516"), {}, "open it in OpenSim 4 and save it",
    ),
    "a word": (changed(L5_AT, "0.01 x 0"), {}, "line 17, PhysicalOffsetFrame low, translation"),
    "two numbers": (changed(L5_AT, "0.01 0"), {}, "found '0.01 0'; allowed: 3 numbers"),
    "a frame that is none": (
        changed("<socket_parent>/bodyset/pelvis", "<socket_parent>/bodyset/pelvix"),
        {}, "line 17, PhysicalOffsetFrame low, socket_parent: found '/bodyset/pelvix'",
    ),
    "frames in a circle": (
        changed("<socket_parent>/bodyset/pelvis", "<socket_parent>../low"), {}, "'../low'",
    ),
    "no vertebrae": (GOOD.replace("L5", "fifth"), {}, "such as {S1: pelvis, L5: lumbar5}"),
    "an unknown body": (
        GOOD, {"vertebrae": "{S1: pelvis, L5: L6}"},
        "found 'L6'; allowed: a placed body: one of ground, pelvis, L5, rib, other",
    ),
    "a marker's name": (changed("SACR", "a/b"), {}, "Marker a/b, name: found 'a/b' with '/'"),
    "upside down": (GOOD, {"vertebrae": "{L5: L5, S1: rib, L4: pelvis}"}, "caudal to cranial"),
    "no chain": (GOOD, {"vertebrae": "{S1: pelvis, L5: L5, L4: other}"}, "does not stand on"),
    "weight forwards": (changed("0 -9.81 0", "-9.81 0 0"), {}, "say `axes:`"),
    "axes that are none": (GOOD, {"axes": "x y y"}, "axes: found 'x y y'"),
    "a name with a blank": (
        changed('Model name="m"', 'Model name="my model"'), {}, "say `specimen:`",
    ),
}  # fmt: skip


@sweep("name", REFUSED)
def test_what_is_refused(tmp_path: Path, name: str) -> None:
    text, settings, words = REFUSED[name]
    with pytest.raises(InputError) as caught:
        imported(tmp_path, text, **settings)
    assert words in str(caught.value)

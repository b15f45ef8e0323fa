"""The trunk that is read from myo-sim against the same files compiled by MuJoCo.

Meshes, wrapping shapes and the head are taken out of the files, all else stays, so that MuJoCo
makes of bodies, joints, points and paths what it makes of them. It has no joint at T12L1 or T11T12.

Catches muscle paths read otherwise than MuJoCo compiles them.
"""

import xml.etree.ElementTree as ET
from dataclasses import replace
from importlib.metadata import distribution
from pathlib import Path

import mujoco
import numpy as np
import pytest
from trunk_posture import lengths, lever_arms, random_bends

from spinepipe.muscles.myo_sim import source_of_myo_sim

ROUND_OFF_M = 1e-12
"""Lengths of half a metre, summed from nine differences of coordinates."""

DIFFERENCE_M = 1e-9
"""A central difference over 1e-5 rad of lengths good to 1e-15 m; its own error is about 1e-11."""

JOINTS = (
    ("flex_extension", "lat_bending", "axial_rotation"),
    *((f"L{n}_L{n + 1}_FE", f"L{n}_L{n + 1}_LB", f"L{n}_L{n + 1}_AR") for n in (4, 3, 2, 1)),
)


@pytest.fixture(scope="module")
def model():
    """MuJoCo's model of the torso without shapes."""
    package = distribution("myo-sim")
    assets = Path(str(package.locate_file("myo_sim/models/torso/assets")))
    chain, tendons = (
        ET.parse(assets / f"myotorso_{name}.xml").getroot() for name in ("chain", "tendon")
    )
    for root in (chain, tendons):
        stripped(root)
    whole = ET.Element("mujoco")
    ET.SubElement(whole, "compiler", angle="radian", autolimits="true")
    ET.SubElement(whole, "worldbody").extend(chain.findall("body"))
    whole.extend(tendons.findall("tendon"))
    return mujoco.MjModel.from_xml_string(ET.tostring(whole, encoding="unicode"))


def stripped(element: ET.Element) -> None:
    """Leave out shapes, what is included from elsewhere and names of classes of defaults."""
    for name in ("class", "childclass"):
        element.attrib.pop(name, None)
    for child in list(element):
        if child.tag in ("geom", "include"):
            element.remove(child)
        else:
            stripped(child)


@pytest.fixture(scope="module")
def trunk():
    """Without the multifidus that is repeated above L1, which the file has not."""
    whole = source_of_myo_sim(placed_by_ct=False).trunk
    own = np.array(["_at_" not in name for name in whole.muscles.names])
    return replace(whole, muscles=whole.muscles.of(own))


def bends_of(seed: int) -> np.ndarray:
    """Random ones at the five lumbar joints."""
    bends = random_bends(seed)
    bends[5:] = 0.0
    return bends


def posed(model, bends):
    """MuJoCo's data, with each hinge at its angle; nought at the joints that it does not have."""
    data = mujoco.MjData(model)
    for names, angles in zip(JOINTS, bends, strict=False):
        for name, angle in zip(names, angles, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    return data


def dense(model, data) -> np.ndarray:
    """(tendons, velocities) change of length per change of angle, from MuJoCo's sparse rows."""
    found = np.zeros((model.ntendon, model.nv))
    for row, (many, start) in enumerate(zip(model.ten_J_rownnz, model.ten_J_rowadr, strict=True)):
        at = slice(start, start + many)
        found[row, model.ten_J_colind[at]] = data.ten_J[at]
    return found


def in_order(model, trunk) -> list[int]:
    return [model.tendon(f"{name}_tendon").id for name in trunk.muscles.names]


def called_otherwise(trunk) -> np.ndarray:
    """Whether the trunk has the fascicle mirrored: the file of the source has it on one side."""
    return np.array([name == "LTpT_T12_l" for name in trunk.muscles.names])


def test_paths_are_as_long_as_mujocos_at_rest(model, trunk) -> None:
    found = posed(model, np.zeros((7, 3))).ten_length[in_order(model, trunk)]
    np.testing.assert_allclose(lengths(trunk, np.zeros((7, 3))), found, atol=ROUND_OFF_M)


@pytest.mark.parametrize("seed", range(4))
def test_paths_are_as_long_as_mujocos_when_bent(model, trunk, seed: int) -> None:
    """Fascicles of the sheath apart, which hang on another body there, and mirrored ones."""
    bends = bends_of(seed)
    found = posed(model, bends).ten_length[in_order(model, trunk)]
    mirror = posed(model, bends * [1.0, -1.0, -1.0]).ten_length[in_order(model, trunk)]
    rectus = np.array([group == "rectus_abdominis" for group in trunk.muscles.groups])
    expected = np.where(rectus | called_otherwise(trunk), mirror, found)
    bony = ~trunk.muscles.in_sheath
    np.testing.assert_allclose(lengths(trunk, bends)[bony], expected[bony], atol=ROUND_OFF_M)


@pytest.mark.parametrize("seed", range(2))
def test_lever_arms_are_mujocos(model, trunk, seed: int) -> None:
    bends = bends_of(seed)
    data = posed(model, bends)
    columns = [[model.joint(name).dofadr[0] for name in names] for names in JOINTS]
    expected = dense(model, data)[in_order(model, trunk)][:, np.array(columns)]
    found = lever_arms(trunk, bends)[:, :5]
    rectus = np.array([group == "rectus_abdominis" for group in trunk.muscles.groups])
    same = ~(trunk.muscles.in_sheath | rectus | called_otherwise(trunk))
    assert same.sum() == 210 - 14 - 2 - 1
    np.testing.assert_allclose(found[same], expected[same], atol=DIFFERENCE_M)

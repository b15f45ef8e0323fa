"""The 6 x 6 stiffness of a joint about a point: by differences of its energy, of OpenSim's wrench.

What would be caught: a wrong sign of the lever, axes exchanged, a point of other axes, an interval
of what is not known, a zero in its place.
"""

from pathlib import Path

import numpy as np
import opensim
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import spinepipe as sp
from spinepipe.frames import Pose
from spinepipe.studies.cohort_stiffness.point_matrix import NAMES, matrix_table
from spinepipe.units import COORDINATES

K = np.array([149e3, 1.89e6, 135e3, 51.0, 68.8, 291.0])
TURNED = Rotation.from_euler("zxy", [0.4, -0.2, 0.3]).as_matrix()
FRAME = Pose(TURNED, np.array([0.01, 0.2, -0.03]))
POINT_MM = np.array([12.0, 35.0, -8.0])
PUSH, TURN = 149e3, 1.5 / np.deg2rad(1.0)
"""N/m and N m/rad of the joint that is pushed."""


def fitted(names: dict[str, tuple[float, float, float]]) -> pd.DataFrame:
    rows = [("J", name, *numbers) for name, numbers in names.items()]
    return pd.DataFrame(rows, columns=["joint", "coordinate", "stiffness", "low", "high"])


def matrix(found: pd.DataFrame, column: str = "stiffness") -> np.ndarray:
    return found.pivot(index="row", columns="column", values=column).loc[NAMES, NAMES]


def energy(moved: np.ndarray, point: np.ndarray) -> float:
    """J in the springs of the joint when the upper vertebra moves about a point of ground, m."""
    turn = Rotation.from_rotvec(moved[3:]).as_matrix()
    origin = point + moved[:3] + turn @ (FRAME.origin - point)
    angles = Rotation.from_matrix(TURNED.T @ turn @ TURNED).as_euler("ZXY")
    q = np.concatenate([TURNED.T @ (origin - FRAME.origin), angles])
    return 0.5 * float(K @ q**2)


def differences(point: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Second central differences of the energy, steps of 1e-5 m and rad along these axes."""
    step, both = 1e-5, np.kron(np.eye(2), axes)
    found = np.empty((6, 6))
    for i, j in np.ndindex(6, 6):
        parts = [
            a * b * energy(step * (a * both[:, i] + b * both[:, j]), point)
            for a in (1, -1)
            for b in (1, -1)
        ]
        found[i, j] = sum(parts) / (4.0 * step**2)
    return found


def test_it_is_the_curvature_of_the_energy() -> None:
    wanted = differences(FRAME.apply(POINT_MM / 1000.0), TURNED)
    rows = fitted({name: (k, k, k) for name, k in zip(COORDINATES, K, strict=True)})
    found = matrix_table(rows, K[None], ["J"], POINT_MM)
    np.testing.assert_allclose(matrix(found), wanted, rtol=1e-4, atol=1e-2)
    inverse = np.linalg.inv(wanted)
    compliance = matrix(found, "compliance")
    np.testing.assert_allclose(compliance, inverse, rtol=1e-4, atol=1e-4 * inverse.max() ** 0.5)
    for column in ("stiffness_low", "stiffness_high"):  # nothing is uncertain
        np.testing.assert_allclose(matrix(found, column), matrix(found), rtol=1e-12)
    assert (found["published"] == "").all()
    units = matrix(found, "stiffness_unit")
    assert (units.iloc[0, 0], units.iloc[0, 5], units.iloc[5, 5]) == ("N/m", "N/rad", "N m/rad")


def test_intervals_add_up_and_what_is_unknown_stays_empty() -> None:
    """Turning at 30 mm below takes k l2 of shear: ways add as independent errors do."""
    rows = fitted({"anterior": (1e5, 0.8e5, 1.3e5), "extension": (50.0, 45.0, np.nan)})
    found = matrix_table(rows, K[None], ["J"], [0.0, 30.0, 0.0])
    (turned,) = found[(found["row"] == "extension") & (found["column"] == "extension")].to_dict(
        "records"
    )
    assert turned["stiffness"] == pytest.approx(50.0 + 0.9e-3 * 1e5)
    assert turned["stiffness_low"] == pytest.approx(140.0 - np.hypot(5.0, 18.0))
    assert np.isnan(turned["stiffness_high"])  # no upper end of one of the two
    (lever,) = found[(found["row"] == "anterior") & (found["column"] == "extension")].to_dict(
        "records"
    )
    assert lever["stiffness"] == pytest.approx(0.03 * 1e5)  # it moves forward and is not let turn
    assert (lever["stiffness_low"], lever["stiffness_high"]) == pytest.approx((2400.0, 3900.0))
    (pressed,) = found[(found["row"] == "superior") & (found["column"] == "superior")].to_dict(
        "records"
    )
    assert (pressed["stiffness"], pressed["published"]) == (1.89e6, "superior")
    assert np.isnan([pressed["stiffness_low"], pressed["stiffness_high"]]).all()
    aside = found[(found["row"] == "right") & (found["column"] == "right")]
    assert aside["published"].item() == "right, right_bending"  # its compliance takes both

    rows = fitted({"anterior": (np.nan, np.nan, np.nan), "extension": (50.0, 45.0, 60.0)})
    found = matrix_table(rows, K[None], ["J"], [0.0, 30.0, 0.0])
    told = matrix(found)
    assert np.isnan(told.loc["extension", "extension"])
    assert told.loc["right_bending", "right_bending"] == pytest.approx(68.8 + 0.9e-3 * 135e3)
    assert told.loc["superior", "extension"] == 0.0


def write_pushed(folder: Path) -> None:
    """A joint of 149 000 N/m and 85.944 N m/rad that is pushed by 20 to 100 N at 15 mm."""
    folder.mkdir()
    (folder / "cohort.yaml").write_text(
        "cohort: pushed\ntitle: one joint\nsource: written for the tests\nvertebrae: [L5, L4]\n"
        "gravity: false\nmeasurement_sd: {rotation_deg: 0.01, translation_mm: 0.01}\n"
    )
    (folder / "specimens.csv").write_text("specimen\na\n")
    zeros = dict.fromkeys(("extension_deg", "right_bending_deg", "left_rotation_deg"), 0.0)
    frame = {"specimen": "a", "joint": "L4L5", "x_mm": 0.0, "y_mm": 0.0, "z_mm": 0.0, **zeros}
    loads, motion = [], []
    for step in range(6):
        key, force, turned = {"specimen": "a", "test": "shear", "step": step}, 20.0 * step, 0.0
        for _ in range(50):  # the arm of a dead load shortens as the vertebra turns
            turned = -force * 0.015 * np.cos(turned) / TURN
        wrench = {"fx_n": force, **dict.fromkeys(("fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"), 0.0)}
        loads.append({**key, "vertebra": "L4", **wrench, "px_mm": 0.0, "py_mm": 15.0, "pz_mm": 0.0})
        moved = {"extension_deg": np.rad2deg(turned), "anterior_mm": 1000.0 * force / PUSH}
        motion.append({**key, "joint": "L4L5", **moved})
    for name, rows in (("joints", [frame]), ("loads", loads), ("motion", motion)):
        pd.DataFrame(rows).to_csv(folder / f"{name}.csv", index=False)


def test_where_the_load_acts_is_softer_than_the_joint(tmp_path: Path) -> None:
    """149 000 N/m at the joint's origin; at the load 1 / (1/149000 + 0.015^2 / 85.94) = 107 188."""
    write_pushed(tmp_path / "pushed")
    cohort = sp.read_cohort(tmp_path / "pushed")
    fit = sp.calibrate(cohort, free=["anterior", "extension"], leave_out=None)
    for height_mm, wanted in ((0.0, 149e3), (15.0, 107188.0)):
        found = fit.stiffness_matrix(point_mm=(0.0, height_mm, 0.0), joint="L4L5")
        assert set(found["specimen"]) == {"a"}
        at = (found["row"] == "anterior") & (found["column"] == "anterior")
        (entry,) = found[at].to_dict("records")
        assert entry["stiffness"] == pytest.approx(149e3, rel=1e-4)  # it is not let turn
        assert 1.0 / entry["compliance"] == pytest.approx(wanted, rel=1e-4)
        assert entry["compliance_low"] < entry["compliance"] < entry["compliance_high"]
        assert entry["published"] == ""


def test_opensim_holds_a_bushing_so() -> None:
    """Force and moment of its bushing at a body that is moved about a point, by differences."""
    system = opensim.Model()
    body = opensim.Body("upper", 1.0, opensim.Vec3(0.0), opensim.Inertia(1.0))
    system.addBody(body)
    joint = opensim.FreeJoint("free", system.getGround(), body)
    system.addJoint(joint)
    origin, angles = FRAME.origin, Rotation.from_matrix(TURNED).as_euler("XYZ")
    turned = opensim.Rotation()
    turned.setRotationToBodyFixedXYZ(opensim.Vec3(*angles))
    place = opensim.Transform(turned, opensim.Vec3(*origin))
    x, y, z = K[:3]
    about_x, about_y, about_z = K[4], K[5], K[3]
    bushing = opensim.BushingForce(
        "bushing", system.getGround(), place, body, place,
        opensim.Vec3(x, y, z), opensim.Vec3(about_x, about_y, about_z),
        opensim.Vec3(0.0), opensim.Vec3(0.0),
    )  # fmt: skip
    system.addForce(bushing)
    state = system.initSystem()
    point, step, found = POINT_MM / 1000.0, 1e-6, np.empty((6, 6))
    for column in range(6):
        wrenches = []
        for sign in (1.0, -1.0):
            moved = sign * step * np.eye(6)[column]
            turn = Rotation.from_rotvec(moved[3:])
            shift = point + moved[:3] - turn.apply(point)
            for number, value in enumerate([*turn.as_euler("XYZ"), *shift]):
                joint.get_coordinates(number).setValue(state, value)
            system.realizeDynamics(state)
            told = bushing.getRecordValues(state)
            names = bushing.getRecordLabels()
            at = [number for number in range(names.getSize()) if ".upper" in names.get(number)]
            values = np.array([told.get(number) for number in at])
            force, moment = values[:3], values[3:6]  # on the body, at its origin, in ground: shift
            wrenches.append(np.concatenate([force, moment + np.cross(shift - point, force)]))
        found[:, column] = -(wrenches[0] - wrenches[1]) / (2.0 * step)
    rows = fitted({name: (k, k, k) for name, k in zip(COORDINATES, K, strict=True)})
    there = FRAME.inverse().apply(POINT_MM / 1000.0) * 1000.0
    both = np.kron(np.eye(2), TURNED)
    ours = matrix(matrix_table(rows, K[None], ["J"], there))
    np.testing.assert_allclose(both @ ours @ both.T, found, rtol=1e-4, atol=1.0)

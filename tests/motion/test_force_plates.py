"""Force plates of a `.c3d`: a force of known place on plates of all types, written by ezc3d.

Truth is a force at a point with a free moment, taken apart into channels by the definition of each
type; the plate lies askew in the laboratory. Catches a wrong sign, unit, offset or order.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c3d_of_ezc3d import write_c3d
from ezc3d import c3d
from scipy.spatial.transform import Rotation

from spinepipe.motion.reading_c3d import open_c3d
from spinepipe.motion.reading_plates import analog_values, read_force_plates
from spinepipe.problems import InputError

SAMPLES, FRAMES = 4, 3
UNITS = ["N"] * 3 + ["Nmm"] * 3

TURN = Rotation.from_euler("zx", [30.0, 178.0], degrees=True).as_matrix()
"""Axes of the plate in the laboratory: z leads downwards."""

MIDDLE, HALF = np.array([0.9, -0.4, 0.02]), np.array([0.25, 0.3])
CORNERS = [
    MIDDLE + TURN @ [i * HALF[0], j * HALF[1], 0.0] for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))
]
ORIGIN_MM = {1: (0, 0, 0), 2: (3, -2, -40), 3: (120, 200, -54), 4: (3, -2, -40)}
CALIBRATION = np.diag([2.0, 2.0, 4.0, 300.0, 300.0, 200.0]) + 0.1

rng = np.random.default_rng(5)
COUNT = SAMPLES * FRAMES
FORCE = rng.uniform([-60, -60, -900], [60, 60, -300], (COUNT, 3))
"""On the axes of the plate; a person stands on it, so that it is upwards, against z."""
AT = np.column_stack([rng.uniform(-0.2, 0.2, (COUNT, 2)), np.zeros(COUNT)])
FREE = np.column_stack([np.zeros((COUNT, 2)), rng.uniform(-9, 9, COUNT)])


def channels_of(kind: int) -> np.ndarray:
    """(S, C) N, N mm and mm."""
    middle = np.cross(AT, FORCE) + FREE
    if kind == 1:
        return np.column_stack([FORCE, 1e3 * AT[:, :2], 1e3 * FREE[:, 2]])
    origin = 1e-3 * np.array(ORIGIN_MM[kind])
    if kind in (2, 4):
        whole = np.column_stack([FORCE, 1e3 * (middle + np.cross(origin, FORCE))])
        return whole if kind == 2 else whole @ np.linalg.inv(CALIBRATION).T
    # four sensors carry it: their eight numbers answer six loads, the least of all such
    a, b, depth = origin
    signs = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    loads = np.zeros((6, 8))
    loads[0, :2], loads[1, 2:4], loads[2, 4:] = 1.0, 1.0, 1.0
    loads[3, 4:], loads[4, 4:] = signs[:, 1] * b, -signs[:, 0] * a
    loads[5, :4] = -b, b, a, -a
    sensors = middle + np.cross([0.0, 0.0, depth], FORCE)
    return np.column_stack([FORCE, sensors]) @ np.linalg.pinv(loads).T


def written(
    path: Path, kind: int, offset: int = 0, scale: float = 1.0, gen: float = 1.0, **changed: Any
) -> Path:
    values = channels_of(kind)
    content = c3d()
    parameters = content["parameters"]
    parameters["POINT"]["RATE"]["value"] = [50.0]
    parameters["POINT"]["UNITS"]["value"] = ["mm"]
    parameters["POINT"]["LABELS"]["value"] = ["T1"]
    content["data"]["points"] = np.ones((4, 1, FRAMES))
    count = values.shape[1]
    units = {1: [*UNITS[:3], "mm", "mm", "Nmm"], 2: UNITS, 3: ["N"] * 8, 4: ["V"] * 6}[kind]
    analog: dict[str, Any] = {
        "RATE": [50.0 * SAMPLES],
        "GEN_SCALE": [gen],
        "SCALE": [scale] * count,
    }
    analog |= {
        "OFFSET": [offset] * count,
        "UNITS": units,
        "LABELS": [f"c{k}" for k in range(count)],
    }
    for name, value in analog.items():
        parameters["ANALOG"][name]["value"] = value
    content["data"]["analogs"] = values.T[None]
    plates: dict[str, Any] = {
        "USED": [1],
        "TYPE": [kind],
        "CORNERS": 1e3 * np.array(CORNERS).T[:, :, None],
        "ORIGIN": np.array(ORIGIN_MM[kind], float)[:, None],
        "CHANNEL": np.arange(1, count + 1)[:, None],
        "CAL_MATRIX": CALIBRATION[:, :, None] if kind == 4 else None,
    } | changed
    for name, value in plates.items():
        if value is not None:
            parameters["FORCE_PLATFORM"][name]["value"] = value
    content.write(str(path))
    return path


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_a_force_at_a_point_is_found_again(tmp_path: Path, kind: int) -> None:
    """Numbers of single precision."""
    (plate,) = read_force_plates(written(tmp_path / "p.c3d", kind))
    np.testing.assert_allclose(plate.force, FORCE @ TURN.T, atol=2e-3)
    np.testing.assert_allclose(plate.centre_of_pressure, MIDDLE + AT @ TURN.T, atol=1e-5)
    np.testing.assert_allclose(plate.free_moment, FREE @ TURN.T, atol=2e-3)
    np.testing.assert_allclose(plate.time_s, np.arange(COUNT) / (50.0 * SAMPLES), atol=1e-9)
    assert plate.repaired == ()
    assert (plate.force[:, 2] > 0.0).all()


def test_scales_and_offsets_of_channels_count(tmp_path: Path) -> None:
    path = written(tmp_path / "p.c3d", 2, offset=-300, scale=0.25, gen=0.5)
    found = analog_values(open_c3d(path, path.name))
    np.testing.assert_allclose(found, channels_of(2), rtol=2e-6, atol=0.1)


def test_an_origin_that_leads_upwards_is_turned_round_and_told(tmp_path: Path) -> None:
    right = read_force_plates(written(tmp_path / "p.c3d", 2))[0]
    origin = -np.array(ORIGIN_MM[2], float)[:, None]
    path = written(tmp_path / "q.c3d", 2, ORIGIN=origin)
    (plate,) = read_force_plates(path)
    np.testing.assert_allclose(plate.free_moment, right.free_moment, atol=1e-9)
    assert plate.repaired == ("ORIGIN of plate 1 leads upwards and is taken the other way",)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("TYPE", [7], "a plate of type 7"),
        ("CHANNEL", np.arange(2, 8)[:, None], "channels 2, 3, 4, 5, 6, 7"),
        ("CORNERS", np.zeros((3, 4, 1)), "corners of no plane"),
        ("USED", [2], "1 numbers"),
    ],
)
def test_plates_that_cannot_be_read_are_named(
    tmp_path: Path, name: str, value: Any, says: str
) -> None:
    path = written(tmp_path / "p.c3d", 2, **{name: value})
    with pytest.raises(InputError) as caught:
        read_force_plates(path)
    assert caught.value.problems[0].found == says


def test_a_file_without_plates_or_channels_has_none(tmp_path: Path) -> None:
    markers = write_c3d(tmp_path / "m.c3d", np.ones((3, 1, 3)), ["T1"])
    assert read_force_plates(markers) == ()
    assert analog_values(open_c3d(markers, markers.name)).shape == (3, 0)
    assert read_force_plates(written(tmp_path / "p.c3d", 2, USED=[0])) == ()

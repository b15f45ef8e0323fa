"""Pressure in the abdomen: force is pressure times area, its moment about T11 is 5 cm of it."""

import numpy as np
import pytest

from spinepipe.frames import rotation_zxy
from spinepipe.muscles.diaphragm import AREA_M2, diaphragm_area, diaphragm_load
from spinepipe.muscles.regressions import packaged
from spinepipe.muscles.subject import REFERENCE, Subject


def test_moment_of_pressure_extends_the_trunk() -> None:
    """10 kPa on 452 cm2 at 5 cm: 452 N and 22.6 N m."""
    t11 = np.array([0.01, 0.3, 0.0])
    load = diaphragm_load(10e3, 0.0452, t11, np.eye(3))
    np.testing.assert_allclose(load.force, [0.0, 452.0, 0.0])
    np.testing.assert_allclose(np.cross(load.at - t11, load.force), [0.0, 0.0, 22.6])


def test_the_lift_turns_with_the_ribs() -> None:
    turned = rotation_zxy(-0.9, 0.2, -0.1)
    t11 = np.array([0.1, 0.25, 0.02])
    upright = diaphragm_load(5e3, 0.03, np.zeros(3), np.eye(3))
    load = diaphragm_load(5e3, 0.03, t11, turned)
    np.testing.assert_allclose(load.force, turned @ upright.force, atol=1e-12)
    np.testing.assert_allclose(load.at - t11, turned @ upright.at, atol=1e-15)


def test_the_area_grows_as_the_rib_cage() -> None:
    known = packaged("constant_density")
    other = Subject("male", 20.0, 1.730, 1.1 * 75.1)
    assert diaphragm_area(REFERENCE, REFERENCE, known) == AREA_M2
    assert diaphragm_area(other, REFERENCE, known) == pytest.approx(1.1 * AREA_M2)

"""The angle of one joint at which a joint law, as published, balances a moment.

Catches a law that is not the published one.
"""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from sweeps import sweep

from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System, follow
from spinepipe.world import Chain

# One upright weightless joint with a spring k under a moment M about its axis of extension

K, UP, TURN = 50.0, 1e6, 290.0


def angle(
    moment: float,
    name: str,
    options: dict[str, Any],
    *values: float,
    compression: float = 0.0,
) -> Array:
    """(6,) coordinates of the one joint with a law."""
    springs = ScopedEffect(create("linear_bushing"), (0,), np.array([[1e5, UP, 1e5, K, K, TURN]]))
    law = ScopedEffect(create(name, options), (0,), np.array([values]))
    model = SpineModel(
        "one",
        ("J0",),
        (Pose(np.eye(3), np.zeros(3)),),
        (Body("V0", 0.1, np.array([0.0, 0.02, 0.0]), 1e-4 * np.eye(3)),),
        np.zeros(3),
        np.array([[1e3] * 3 + [2.0] * 3]),
        (springs, law),
    )
    force, turning = np.array([0.0, -compression, 0.0]), np.array([0.0, 0.0, moment])
    wrenches = (Wrench(0, np.zeros(3), force, turning),)
    case = LoadCase("test", 1, (LoadStep(0, wrenches),))
    found = follow(System(Chain(model), model, case))[-1].equilibrium
    assert found.status.usable, found.message
    return found.q


@pytest.mark.parametrize("moment", [-7.5, 1.0, 7.5])
class TestOneJoint:
    """The angle at which the published law balances the moment."""

    def test_exponential(self, moment: float) -> None:
        found = angle(moment, "nonlinear_stiffening", {"shape": "exponential"}, 10.0)
        expected = np.sign(moment) * np.log1p(10.0 * abs(moment) / K) / 10.0
        # rounding |q| over 1e-4 rad moves it by some 1e-8 rad
        assert found[3] == pytest.approx(expected, abs=5e-8)

    def test_tangent(self, moment: float) -> None:
        found = angle(moment, "nonlinear_stiffening", {"shape": "tangent"}, 75.0)
        root = np.sqrt(75.0)
        assert found[3] == pytest.approx(np.arctan(moment * root / K) / root, abs=1e-14)

    def test_cubic(self, moment: float) -> None:
        found = angle(moment, "nonlinear_stiffening", {"shape": "cubic"}, 50.0)
        roots = np.roots([K * 50.0, 0.0, K, -moment])
        (expected,) = roots[np.abs(roots.imag) < 1e-9].real
        assert found[3] == pytest.approx(expected, abs=1e-14)

    def test_bilinear(self, moment: float) -> None:
        found = angle(moment, "nonlinear_stiffening", {"shape": "bilinear"}, 1.5, 0.08)
        beyond = (abs(moment) - K * 0.08) / (2.5 * K)
        expected = moment / K if beyond < 0.0 else np.sign(moment) * (0.08 + beyond)
        assert found[3] == pytest.approx(expected, abs=1e-14)

    @sweep("sharpness", [2.0, 2.7, 6.0, 30.0])
    def test_neutral_zone(self, moment: float, sharpness: float) -> None:
        found = angle(moment, "neutral_zone", {}, 0.4, 0.06, sharpness)

        def left(q: float) -> float:
            taken = 0.6 * K * q / (1.0 + abs(q / 0.06) ** sharpness) ** (1.0 / sharpness)
            return K * q - taken - moment

        assert found[3] == pytest.approx(brentq(left, -0.5, 0.5, xtol=1e-15), abs=1e-13)

    def test_a_smooth_zone_is_nearly_the_hyperbolic_tangent(self, moment: float) -> None:
        """Within 2 % of what the zone takes off in all: load = k q - lost w tanh(q / w)."""
        found = angle(moment, "neutral_zone", {}, 0.4, 0.04, 2.7)

        def left(q: float) -> float:
            return K * q - 0.6 * K * 0.04 * np.tanh(q / 0.04) - moment

        expected = brentq(left, -0.5, 0.5, xtol=1e-15)
        assert found[3] == pytest.approx(expected, abs=0.02 * 0.6 * 0.04 / 0.4)

    @sweep("offset", [-0.8, 0.3, 0.8])
    def test_neutral_zone_off_centre(self, moment: float, offset: float) -> None:
        values = (0.4, 0.06, 2.7, offset)
        found = angle(moment, "neutral_zone", {"zone": "off_centre"}, *values)

        def taken(q: float) -> float:  # the integral of the stiffness that the zone takes off
            return quad(lambda at: 0.6 * K * lost(at / 0.06 - offset), 0.0, q, limit=200)[0]

        def lost(u: float) -> float:  # slope of u / (1 + |u|^n)^(1/n)
            return float((1.0 + abs(u) ** 2.7) ** (-1.0 / 2.7 - 1.0))

        expected = brentq(lambda q: K * q - taken(q) - moment, -0.5, 0.5, xtol=1e-14)
        assert found[3] == pytest.approx(expected, abs=1e-10)

    @sweep("side, way", [("positive", 1.0), ("negative", -1.0)])
    def test_stop(self, moment: float, side: str, way: float) -> None:
        found = angle(moment, "facet_contact", {"side": side}, 100.0, 0.05, 1.0)
        free, stopped = moment / K, (moment + way * 100.0 * 0.05) / (K + 100.0)
        expected = stopped if way * free > 0.05 else free
        assert found[3] == pytest.approx(expected, abs=1e-14)

    def test_a_stop_of_two_curved_faces(self, moment: float) -> None:
        """Hertz: load over the power 3/2 of how far they approach."""
        found = angle(moment, "facet_contact", {"side": "positive"}, 100.0, 0.05, 1.5)

        def left(q: float) -> float:
            return K * q + 100.0 / np.deg2rad(2.0) ** 0.5 * max(q - 0.05, 0.0) ** 1.5 - moment

        assert found[3] == pytest.approx(brentq(left, -0.5, 0.5, xtol=1e-15), abs=1e-13)

    def test_coupling(self, moment: float) -> None:
        found = angle(
            moment, "bending_rotation_coupling", {"pair": ("anterior", "extension")}, 900.0
        )
        expected = np.linalg.solve([[1e5, 900.0], [900.0, K]], [0.0, moment])
        np.testing.assert_allclose(found[[0, 3]], expected, rtol=0, atol=1e-14)

    @sweep("compression", [400.0, -200.0])
    def test_preload(self, moment: float, compression: float) -> None:
        """A force through the joint's origin stays there, so it compresses and does not turn."""
        found = angle(moment, "preload_stiffening", {}, 1e-3, compression=compression)
        assert found[1] == pytest.approx(-compression / UP, abs=1e-14)
        assert found[3] == pytest.approx(moment / (K * (1.0 + 1e-3 * compression)), abs=1e-14)

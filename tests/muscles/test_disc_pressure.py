"""Eq 6 of Ghezelbash 2016: the 24 values of Fig 4, and its range."""

import numpy as np
import pytest

from spinepipe.muscles.disc_pressure import disc_pressure

DEG = np.pi / 180
AREA = 1455e-6
"""m2, section 3.1."""

THETA_DEG = (0, 2, 4, 6, 8, 10)
FIG_4 = {
    0.0: (-0.015560, 0.015976, 0.060864, 0.119104, 0.190696, 0.275640),
    902.1: (0.777870, 0.794377, 0.824236, 0.867447, 0.924011, 0.993926),
    1804.2: (1.601959, 1.603438, 1.618268, 1.646451, 1.687985, 1.742871),
    2706.3: (2.456709, 2.443158, 2.442960, 2.456114, 2.482619, 2.522477),
}
"""MPa by compression in N; worked out from Eq 6 at the nominal pressures of Fig 4's caption."""

DREISCHARF = {0.0: 0.0, 902.1: 0.805195, 1804.2: 1.610390, 2706.3: 2.415584}
"""MPa, P / 0.77."""


@pytest.mark.parametrize("compression", FIG_4)
def test_the_values_of_fig_4(compression: float) -> None:
    """1e-6 MPa: the values are printed to six decimals."""
    found = [disc_pressure(compression, AREA, theta * DEG) for theta in THETA_DEG]
    assert [p.pa / 1e6 for p in found] == pytest.approx(FIG_4[compression], abs=1e-6)
    assert {round(p.dreischarf_pa / 1e6, 6) for p in found} == {DREISCHARF[compression]}
    assert all(p.inside or compression == 2706.3 for p in found)


@pytest.mark.parametrize(
    ("compression", "theta_deg", "inside"),
    [
        *((1000.0, 5.0, True), (0.0, 0.0, True), (1000.0, -0.5, False), (1000.0, 10.5, False)),
        *((2800.0, 5.0, False), (-10.0, 5.0, False), (-1e-9, 0.0, False), (0.0, -1e-9, False)),
    ],
)
def test_the_range_of_the_fit(compression: float, theta_deg: float, inside: bool) -> None:
    """0 to 1.86 MPa and 0 to 10 deg, ends counted in."""
    assert disc_pressure(compression, AREA, theta_deg * DEG).inside is inside

"""Pressure in the disc L4L5 from compression and flexion (Ghezelbash 2016, Eq 6).

A polynomial fitted to a finite-element model of one disc: P = compression / area of the disc up to
1.86 MPa, flexion 0 to 10 deg counted from the unloaded geometry. Flexion is positive here, as in
the paper, so it is minus our rotation about +z. Without load and flexion it gives -0.016 MPa, and
for each P there is an angle of least pressure: it does not rise with flexion everywhere.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.facts import number, numbers, several
from spinepipe.units import DEG_PER_RAD

PA_PER_MPA = 1e6

_ONE, _P, _T, _PP, _PT, _TT = several(__name__, "disc_pressure_polynomial")[""]
"""MPa and degrees: 1, P, theta, P^2, P theta, theta^2."""

_FITTED = numbers(__name__, "disc_pressure_range")
LARGEST_PA = _FITTED["nominal_pressure"] * PA_PER_MPA
LARGEST_FLEXION = _FITTED["flexion"] / DEG_PER_RAD
"""Compression over area, Pa, and flexion, rad, up to which the polynomial was fitted (from 0)."""

DREISCHARF = number(__name__, "pressure_over_disc_pressure")
"""P over pressure in the disc, of Dreischarf 2013 as Ghezelbash 2016 Fig 4 has it."""


@dataclass(frozen=True)
class DiscPressure:
    """Pressure in a disc.

    Attributes
    ----------
    pa : by Eq 6, Pa.
    dreischarf_pa : nominal pressure / 0.77, whatever the flexion, Pa.
    nominal_pa : compression over area, Pa.
    flexion : rad, flexion positive.
    """

    pa: float
    dreischarf_pa: float
    nominal_pa: float
    flexion: float

    @property
    def inside(self) -> bool:
        """Whether compression and flexion are in the range to which Eq 6 was fitted."""
        return 0.0 <= self.nominal_pa <= LARGEST_PA and 0.0 <= self.flexion <= LARGEST_FLEXION


def disc_pressure(compression: float, area: float, flexion: float) -> DiscPressure:
    """Pressure in a disc.

    Parameters
    ----------
    compression : N, compression positive. area : m2, of the person's disc.
    flexion : rad of the joint from the unloaded geometry, flexion positive.
    """
    nominal = compression / area
    p = np.asarray(nominal, dtype=float) / PA_PER_MPA
    theta = np.asarray(flexion, dtype=float) * DEG_PER_RAD
    eq6 = _ONE + _P * p + _T * theta + _PP * p**2 + _PT * p * theta + _TT * theta**2
    return DiscPressure(float(PA_PER_MPA * eq6), nominal / DREISCHARF, nominal, flexion)

"""Force of a muscle that is stretched, without any activity.

An exponential of the strain of the fibres (Thelen 2003; default of OpenSim).
Fibres are slack up to the length of the upright posture and take up all that the path gains; the
curve of Davis 2003, which the paper uses, is printed nowhere that we know of.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.facts import numbers
from spinepipe.muscles.trunk import Muscles

_CURVE = numbers(__name__, "passive_muscle")


def fibres_of(muscles: Muscles, rest: Array, share: float) -> Array:
    """(M,) m, the source's fibres, and where it has none a share of the path (M,) m at rest."""
    found: Array = np.where(muscles.fibre > 0.0, muscles.fibre, share * rest)
    return found


@dataclass(frozen=True)
class PassiveMuscle:
    """The curve.

    Attributes
    ----------
    strain : of the fibres at which the force is the largest active one.
    shape : how sharply it rises.
    factor : of the force.
    fibre_share : of the path upright that stretches, where the source has no length of the fibres.
    """

    strain: float = _CURVE["strain"]
    shape: float = _CURVE["shape"]
    factor: float = 1.0
    fibre_share: float = 1.0

    def forces(self, lengths: Array, rest: Array, fibres: Array, largest: Array) -> Array:
        """(M,) N of paths of so many m, upright `rest` m, fibres of so many m.

        Parameters
        ----------
        largest : (M,) N, largest active force at the stress of 0.6 MPa or whatever is stated.
        """
        strain = self._strain(lengths, rest, fibres)
        share = np.expm1(self.shape * strain / self.strain) / np.expm1(self.shape)
        found: Array = self.factor * largest * share
        return found

    def slopes(self, lengths: Array, rest: Array, fibres: Array, largest: Array) -> Array:
        """(M,) N/m, how fast it rises with the length."""
        strain = self._strain(lengths, rest, fibres)
        rate = self.shape / self.strain / fibres
        rising = rate * np.exp(self.shape * strain / self.strain) / np.expm1(self.shape)
        found: Array = np.where(strain > 0.0, self.factor * largest * rising, 0.0)
        return found

    @staticmethod
    def _strain(lengths: Array, rest: Array, fibres: Array) -> Array:
        """(M,) of the fibres, never below nought."""
        found: Array = np.maximum((lengths - rest) / fibres, 0.0)
        return found

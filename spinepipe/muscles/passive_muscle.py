"""Force of a muscle that is stretched, without any activity.

An exponential of the strain of the fibres (Thelen 2003, J Biomech Eng 125:70; default of OpenSim).
Fibres are slack up to the length of the upright posture and take up all that the path gains; the
curve of Davis 2003, which the paper uses, is printed nowhere that we know of.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array


@dataclass(frozen=True)
class PassiveMuscle:
    """The curve.

    Attributes
    ----------
    strain : of the fibres at which the force is the largest active one.
    shape : how sharply it rises.
    factor : of the force.
    """

    strain: float = 0.6
    shape: float = 5.0
    factor: float = 1.0

    def forces(self, lengths: Array, rest: Array, fibres: Array, largest: Array) -> Array:
        """(M,) N of paths of so many m, upright `rest` m, fibres of so many m (nought: the path).

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
        rate = self.shape / self.strain / np.where(fibres > 0.0, fibres, rest)
        rising = rate * np.exp(self.shape * strain / self.strain) / np.expm1(self.shape)
        found: Array = np.where(strain > 0.0, self.factor * largest * rising, 0.0)
        return found

    @staticmethod
    def _strain(lengths: Array, rest: Array, fibres: Array) -> Array:
        """(M,) of the fibres, never below nought."""
        found: Array = np.maximum((lengths - rest) / np.where(fibres > 0.0, fibres, rest), 0.0)
        return found

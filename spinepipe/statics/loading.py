"""What acts on the chain at one moment: the listed wrenches, and how much of the weight."""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase


@dataclass(frozen=True)
class Loading:
    """Wrenches at a case's slots and the share of gravity and load effects that is on.

    Attributes
    ----------
    forces, moments : (S, 3) N and N m, fixed in ground.
    share : 0 (weightless, load effects off) to 1.
    """

    forces: Array
    moments: Array
    share: float

    @property
    def key(self) -> bytes:
        """The same for the same loading of the same slots."""
        return self.forces.tobytes() + self.moments.tobytes() + np.float64(self.share).tobytes()

    def towards(self, other: "Loading", fraction: float) -> "Loading":
        """The loading that far on the straight way to another."""
        return Loading(
            self.forces + fraction * (other.forces - self.forces),
            self.moments + fraction * (other.moments - self.moments),
            self.share + fraction * (other.share - self.share),
        )


@dataclass(frozen=True)
class Slots:
    """The places at which a case loads the chain: body index and neutral point (3,) m in ground."""

    places: tuple[tuple[int, tuple[float, float, float]], ...]

    @classmethod
    def of(cls, case: LoadCase) -> "Slots":
        """Slots in order of first appearance in the case."""
        places = (
            (wrench.body, tuple(wrench.point.tolist()))
            for step in case.steps
            for wrench in step.wrenches
        )
        return cls(tuple(dict.fromkeys(places)))

    def unloaded(self) -> Loading:
        """No wrench and no weight: the neutral pose."""
        nothing = np.zeros((len(self.places), 3))
        return Loading(nothing, nothing, 0.0)

    def loading(self, wrenches: tuple[Wrench, ...]) -> Loading:
        """Wrenches of one step, summed per slot, with full weight."""
        forces, moments = np.zeros((2, len(self.places), 3))
        for wrench in wrenches:
            slot = self.places.index((wrench.body, tuple(wrench.point.tolist())))
            forces[slot] += wrench.force
            moments[slot] += wrench.moment
        return Loading(forces, moments, 1.0)

    def wrenches(self, loading: Loading) -> tuple[Wrench, ...]:
        """The loading as wrenches, for load effects that act on them."""
        return tuple(
            Wrench(body, np.array(point), force, moment)
            for (body, point), force, moment in zip(
                self.places, loading.forces, loading.moments, strict=True
            )
        )

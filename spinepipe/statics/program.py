"""How loads come on in time."""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.statics.loading import Loading


@dataclass(frozen=True)
class Program:
    """Loadings at times, straight lines in between, the last one held.

    Attributes
    ----------
    times : (T,) s, increasing, first 0.
    """

    times: tuple[float, ...]
    loadings: tuple[Loading, ...]

    @classmethod
    def constant(cls, loading: Loading) -> "Program":
        """The loading switched on at time zero and held."""
        return cls((0.0,), (loading,))

    def at(self, time: float) -> Loading:
        """Loading at a time in s."""
        later = int(np.searchsorted(self.times, time, side="right"))
        if later == len(self.times):
            return self.loadings[-1]
        start, end = self.times[later - 1], self.times[later]
        fraction = (time - start) / (end - start)
        return self.loadings[later - 1].towards(self.loadings[later], fraction)

    def corner_after(self, time: float) -> float:
        """The next time at which the load changes its rate; infinity after the last."""
        return next((t for t in self.times if t > time * (1.0 + 1e-12) + 1e-15), np.inf)


@dataclass(frozen=True)
class Course:
    """The time course of a load step: its load comes on, is held, and the pose is read.

    Attributes
    ----------
    duration_s : when the pose is read. ramp_s : how long the load grows, 0 for at once; weight
        acts from the start.
    steps_per_s : times per second at which the growing load is given, straight in between.
    """

    duration_s: float
    ramp_s: float = 0.0
    steps_per_s: float = 25.0

    def program(self, loading: Loading) -> Program:
        """The program that ends in a loading."""
        if self.ramp_s == 0.0:
            return Program.constant(loading)
        count = max(1, round(self.ramp_s * self.steps_per_s))
        weight = replace(loading, forces=0.0 * loading.forces, moments=0.0 * loading.moments)
        shares = np.linspace(0.0, 1.0, count + 1)
        loadings = tuple(weight.towards(loading, share) for share in shares)
        return Program(tuple((self.ramp_s * shares).tolist()), loadings)

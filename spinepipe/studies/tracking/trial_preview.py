"""One recorded trial beside the marker set: where markers are, and where they would be at rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.marker_turns import turns
from spinepipe.motion.skeleton import MarkerSet, MarkerTrial
from spinepipe.problems import InputProblem


@dataclass(frozen=True, eq=False)
class LoadedTrial:
    """A trial as it is checked.

    Attributes
    ----------
    trial : markers in the order of the set. markers : the set. neutral : (K, 3) m, its markers in
        ground while all coordinates are zero.
    axes : what forwards, up and right are in the axes of the file.
    file : of the motion. trials : name of the table of trials, line : of the trial in it.
    first : number of the trial's first frame in the file.
    """

    trial: MarkerTrial
    markers: MarkerSet
    neutral: Array
    axes: str
    file: str
    trials: str
    line: int
    first: int

    @cached_property
    def turned(self) -> tuple[Array, NDArray[np.bool_]]:
        """(F, 3, 3) how all markers together are turned against rest, and where they tell it."""
        return turns(self.neutral, self.trial.places, self.trial.seen)

    def frames(self, begin: int, end: int) -> str:
        """Frames from one to another, both of the trial and included, as a user finds them."""
        times = self.trial.time_s
        if begin == end:
            return f"frame {self.first + begin} ({times[begin]:.3f} s)"
        return (
            f"frames {self.first + begin} to {self.first + end} "
            f"({times[begin]:.3f} to {times[end]:.3f} s)"
        )

    def in_motion(self, marker: str | None, found: str, allowed: str, remedy: str) -> InputProblem:
        """A problem of the file of motion."""
        return InputProblem(self.file, None, marker, found, allowed, remedy)

    def in_table(self, column: str, found: str, allowed: str, remedy: str) -> InputProblem:
        """A problem of the trial's row."""
        return InputProblem(self.trials, self.line, column, found, allowed, remedy)


def runs(where: NDArray[np.bool_]) -> Sequence[tuple[int, int]]:
    """First and last of each run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]

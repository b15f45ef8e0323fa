"""What is asked of a motion: markers that it has to follow, and what else costs."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.skeleton import BODIES, JOINTS, MarkerSet, MarkerTrial, Skeleton
from spinepipe.motion.spline import KnotGrid
from spinepipe.units import ROTATIONS, TRANSLATIONS

ForceCost = Literal["squared", "minus_gravity", "level_difference"]

_NEAR = 0.5 + 1e-9
"""Steps to the nearest frame that saw a marker."""

SHAPE = (len(BODIES), len(TRANSLATIONS) + len(ROTATIONS))
"""Bodies and their coordinates."""


@dataclass(frozen=True)
class ResidualScales:
    """By what each kind of error is divided before it is squared: what counts as much as what.

    Attributes
    ----------
    marker_m : of a marker. moment_nm, force_n : of what muscles do at a joint.
    loads : how much all loads count beside markers.
    common_n : of the mean force over all joints, where forces are held against each other.
    own_skin_m, shared_skin_m : SD of how far skin slides over each vertebra and over all of them,
        at the whole bend (`skin`).
    turn_rad_per_s2, move_m_per_s2 : of accelerations, which are wanted small to be smooth.
    beyond_rad, beyond_m : of coordinates beyond their range.
    size, shape : SD of the logarithms of a passive element's A and B about the generic ones.
    frames : independent frames that a trial is worth; skin slides slowly, so they are few.
    """

    marker_m: float = 5e-3
    moment_nm: float = 10.0
    force_n: float = 200.0
    loads: float = 1.0
    common_n: float = 2000.0
    own_skin_m: float = 5e-3
    shared_skin_m: float = 10e-3
    turn_rad_per_s2: float = 10.0
    move_m_per_s2: float = 2.0
    beyond_rad: float = 0.02
    beyond_m: float = 1e-3
    size: float = 0.7
    shape: float = 0.35
    frames: float = 10.0

    @property
    def of_loads(self) -> Array:
        """(6,) N and N m, with their share."""
        return self._counted(np.array([self.force_n] * 3 + [self.moment_nm] * 3))

    @property
    def of_common(self) -> Array:
        """(6,) N and N m, of the mean over joints; a mean moment costs nothing."""
        return self._counted(np.array([self.common_n] * 3 + [np.inf] * 3))

    def _counted(self, each: Array) -> Array:
        found: Array = each / np.sqrt(self.loads) if self.loads > 0.0 else np.full(6, np.inf)
        return found

    @property
    def of_accelerations(self) -> Array:
        """(6,) m/s2 and rad/s2."""
        return np.array([self.move_m_per_s2] * 3 + [self.turn_rad_per_s2] * 3)

    @property
    def beyond(self) -> Array:
        """(6,) m and rad."""
        return np.array([self.beyond_m] * 3 + [self.beyond_rad] * 3)


@dataclass(frozen=True, eq=False)
class MotionObjective:
    """What a motion costs besides its markers.

    Attributes
    ----------
    free : (18, 6) which coordinates there are; the others stay zero.
    low, high : (18, 6) m and rad, range of each; infinite without.
    passive : passive elements, None for none.
    loads : whether loads cost at all. force_cost : which of them do, see
        `residual_terms.MuscleDemand`.
    smooth : whether accelerations cost.
    fitted : (17, 6) coordinates whose passive elements are calibrated.
    """

    free: NDArray[np.bool_] = field(default_factory=lambda: np.ones(SHAPE, dtype=bool))
    low: Array = field(default_factory=lambda: np.full(SHAPE, -np.inf))
    high: Array = field(default_factory=lambda: np.full(SHAPE, np.inf))
    passive: PassiveLaw | None = None
    loads: bool = True
    force_cost: ForceCost = "squared"
    smooth: bool = True
    fitted: NDArray[np.bool_] = field(
        default_factory=lambda: np.zeros((len(JOINTS), SHAPE[1]), dtype=bool)
    )
    sizes: ResidualScales = field(default_factory=ResidualScales)

    @property
    def parameters(self) -> int:
        """Logarithms of sizes, then of shapes."""
        return 2 * int(self.fitted.sum())


@dataclass(frozen=True, eq=False)
class SampledTrial:
    """A trial at the nodes of a grid: what markers were seen there.

    Attributes
    ----------
    places : (N + 1, K, 3) m. weight : (N + 1, K), zero where a marker was not seen.
    shares : (N + 1, 3 K, 3 K) by which places off are multiplied (`skin`); None: each marker by
        itself, by its weight.
    """

    skeleton: Skeleton
    markers: MarkerSet
    grid: KnotGrid
    places: Array
    weight: Array
    shares: Array | None = None

    def at(self, nodes: NDArray[np.int64]) -> "SampledTrial":
        """Some of the nodes, each by itself."""
        shares = None if self.shares is None else self.shares[nodes]
        return replace(self, places=self.places[nodes], weight=self.weight[nodes], shares=shares)


def sample_trial(
    skeleton: Skeleton, markers: MarkerSet, trial: MarkerTrial, intervals: int
) -> SampledTrial:
    """A trial at nodes from its first frame to its last, between the frames that saw a marker.

    A marker counts at a node if a frame saw it within half a step; of one frame there is one node.
    """
    times = trial.time_s
    first, span = float(times[0]), float(times[-1] - times[0])
    grid = KnotGrid.over(first, first + span, intervals) if span > 0.0 else KnotGrid(first, 1.0, 0)
    places = np.zeros((grid.intervals + 1, len(markers), 3))
    weight = np.zeros(places.shape[:2])
    for k, share in enumerate(markers.weight):
        seen = trial.seen[:, k]
        if not seen.any():
            continue
        apart = np.abs(grid.times_s[:, None] - times[seen]).min(axis=1)
        weight[:, k] = share * (apart <= _NEAR * grid.step_s)
        for axis in range(3):
            places[:, k, axis] = np.interp(grid.times_s, times[seen], trial.places[seen, k, axis])
    return SampledTrial(skeleton, markers, grid, places, weight)

"""What is asked of an analysis."""

from dataclasses import dataclass

from spinepipe.sensitivity.global_indices.design import Method

INDICES: dict[Method, tuple[str, ...]] = {
    Method.SOBOL: ("S1", "ST", "S2"),
    Method.MORRIS: ("mu", "mu_star", "sigma"),
    Method.FAST: ("S1", "ST"),
    Method.LATIN_HYPERCUBE: ("S1_RBD", "PAWN", "KS_low", "KS_high", "delta"),
}
"""All indices of each kind of design."""


@dataclass(frozen=True)
class Settings:
    """Settings of an analysis.

    Attributes
    ----------
    bootstraps : resamples for each interval. delta_bootstraps : the same for delta, of which
        one resample takes as long as a few hundred of the others.
    confidence : of the intervals.
    seed : of the resamples (0 is a seed like others).
    most_failed : share of lost base samples, trajectories or points above which no index is given.
    wanted : names of indices to compute; None for all that the design has.
    tail : share of the lowest and of the highest outputs that KS_low and KS_high look at.
    slices : conditioning intervals of PAWN.
    """

    bootstraps: int = 1000
    delta_bootstraps: int = 50
    confidence: float = 0.95
    seed: int = 0
    most_failed: float = 0.2
    wanted: tuple[str, ...] | None = None
    tail: float = 0.25
    slices: int = 10

    def __post_init__(self) -> None:
        if min(self.bootstraps, self.delta_bootstraps) < 2 or not 0.0 < self.confidence < 1.0:
            raise ValueError("at least 2 bootstraps and a confidence between 0 and 1 are needed")
        known = {name for names in INDICES.values() for name in names}
        if unknown := sorted(set(self.wanted or ()) - known):
            raise ValueError(f"no index {', '.join(unknown)}; there are {', '.join(sorted(known))}")

    def asks(self, index: str) -> bool:
        """Whether an index is wanted."""
        return self.wanted is None or index in self.wanted

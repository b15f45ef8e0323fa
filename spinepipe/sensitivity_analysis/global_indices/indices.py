"""All indices of a design's outputs, with status and message.

Where runs failed, what is left is told block by block.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Design, Method
from spinepipe.sensitivity_analysis.global_indices.estimates import (
    INDICES,
    NOTHING,
    IndexEstimates,
    IndexStatus,
    Masked,
    SensitivityIndex,
    Settings,
    masked,
)
from spinepipe.sensitivity_analysis.global_indices.given_data import given_data_indices
from spinepipe.sensitivity_analysis.global_indices.structured import (
    fast_indices,
    morris_indices,
    sobol_indices,
)

BLOCKS = {
    Method.SOBOL: "base samples",
    Method.LATIN_HYPERCUBE: "points",
    Method.MORRIS: "trajectories",
    Method.FAST: "curves",
}


@dataclass(frozen=True, eq=False)
class CompleteBlocks:
    """What is left of a design.

    Attributes
    ----------
    rows : (n,) bool, runs in blocks without a failure. blocks : (n / block,) bool.
    failed : number of runs that failed. message : what was lost; empty without a failure.
    """

    rows: NDArray[np.bool_]
    blocks: NDArray[np.bool_]
    failed: int
    message: str

    @property
    def lost(self) -> float:
        """Share of blocks that were lost."""
        return float(1.0 - self.blocks.mean())


def complete_blocks(design: Design, ok: NDArray[np.bool_]) -> CompleteBlocks:
    """A failed run takes its whole block with it: a base sample of Sobol, a trajectory of Morris,
    a curve of FAST; of a Latin hypercube itself.

    What is left speaks of those inputs only at which runs succeed.
    """
    blocks: NDArray[np.bool_] = np.all(ok.reshape(-1, design.block), axis=1)
    failed, lost = int((~ok).sum()), int((~blocks).sum())
    what = BLOCKS[design.method]
    message = f"{failed} failed runs: {lost} of {len(blocks)} {what} left out" if failed else ""
    return CompleteBlocks(np.repeat(blocks, design.block), blocks, failed, message)


def without_lost(design: Design, left: CompleteBlocks) -> Design:
    """The design's whole blocks alone; not for FAST, whose blocks are not alike."""
    return replace(design, unit=design.unit[left.rows], samples=int(left.blocks.sum()))


Name = tuple[str, str, str]
"""Index, factor or group, second one of a pair (else empty)."""


@dataclass(frozen=True, eq=False)
class Report:
    """All that is known of K outputs.

    Attributes
    ----------
    found : estimates of the outputs that vary. varies : (K,) bool.
    status, why : of all outputs alike; ``done`` where nothing stands against indices.
    """

    design: Design
    left: CompleteBlocks
    found: IndexEstimates
    varies: NDArray[np.bool_]
    status: IndexStatus
    why: str

    def index(self, name: Name) -> SensitivityIndex:
        """One index of all outputs."""
        status, message = self._statuses(name)
        at = self._at.get(name)
        known = self.varies & (at is not None)
        ends = None if self.found.ends is None or at is None else self.found.ends[:, at]
        low, high = (None, None) if ends is None else ends
        estimate = None if at is None else self.found.estimate[at]
        return SensitivityIndex(
            *name,
            self._spread_out(estimate, known),
            self._spread_out(low, known),
            self._spread_out(high, known),
            # of FAST an index rests on the one curve of its factor
            self.design.block if self.design.method is Method.FAST else int(self.left.rows.sum()),
            self.left.failed,
            status,
            message,
        )

    @cached_property
    def _at(self) -> dict[Name, int]:
        return {name: at for at, name in enumerate(self.found.names)}

    def _statuses(self, name: Name) -> tuple[tuple[IndexStatus, ...], tuple[str, ...]]:
        """Status and message of an index, for each output."""
        each: list[tuple[IndexStatus, str]]
        if self.status is not IndexStatus.DONE:
            each = [(self.status, self.why)] * len(self.varies)
        else:
            words = filter(None, (self.left.message, self.found.note))
            known: tuple[IndexStatus, str] = IndexStatus.DONE, "; ".join(words)
            if name not in self._at:
                lost = f"{self.left.message}, {name[1]}'s among them"
                known = IndexStatus.TOO_MANY_FAILED, lost
            constant = IndexStatus.CONSTANT, "the output is the same in all runs"
            each = [known if varies else constant for varies in self.varies]
        return tuple(status for status, _ in each), tuple(message for _, message in each)

    def _spread_out(self, part: Array | None, known: NDArray[np.bool_]) -> Masked:
        """(K,) of numbers for the outputs that vary, or of nothing."""
        values = np.zeros(len(known))
        if part is None:
            return masked(values, np.ones(len(known)))
        values[known] = part
        return masked(values, ~known)


def names_of(design: Design) -> list[Name]:
    """All indices a design has, in the order of tables."""
    found: list[Name] = []
    for index in INDICES[design.method]:
        if index == "S2":
            pairs = combinations(design.inputs, 2) if design.second_order else ()
            found += [(index, first, second) for first, second in pairs]
            continue
        # of Morris, groups of several have no sign, so no mean and SD of signed effects
        signed = design.method is Method.MORRIS and index != "mu_star"
        named = (name for name in design.inputs if not signed or design.groups.count(name) == 1)
        found += [(index, name, "") for name in named]
    return found


FEWEST = {Method.SOBOL: 8, Method.LATIN_HYPERCUBE: 50, Method.MORRIS: 4}
"""Whole base samples, points or trajectories below which no index is given."""

ROUNDING = 1e-12
"""An output that varies by less than this part of its size is constant but for rounding."""


def indices(
    design: Design,
    outputs: ArrayLike,
    ok: ArrayLike | None = None,
    settings: Settings | None = None,
    resolution: ArrayLike = 0.0,
) -> tuple[SensitivityIndex, ...]:
    """Indices of K outputs with intervals.

    Parameters
    ----------
    outputs : (n, K), finite where a run succeeded.
    ok : (n,) bool, which runs succeeded; None for all.
    resolution : (K,) or one, in the outputs' units: an output whose values lie closer together is
        taken for constant (a solver's tolerance).

    A failed run takes out its base sample (Sobol), trajectory (Morris), point (Latin hypercube) or
    the indices of its curve's factor (FAST); with more than `Settings.most_failed` of these lost
    (of FAST: with any) the status is ``too_many_failed``. A constant output has no indices. No
    estimate is ever NaN.

    Raises
    ------
    ValueError
        For outputs of another shape than the design's, or not finite where a run succeeded.
    """
    settings = settings or Settings()
    values, good = _checked(design, outputs, ok)
    left = complete_blocks(design, good)
    status, why = _for_all(design, left, settings)
    varies = np.zeros(values.shape[1], dtype=bool)
    if left.rows.any() and status is IndexStatus.DONE:
        # constant is what varies by less than rounding, or than its resolution
        size = ROUNDING * np.abs(values[left.rows]).max(axis=0)
        varies = np.ptp(values[left.rows], axis=0) > np.maximum(size, resolution)
    found = _found(design, values[:, varies], left, settings) if varies.any() else NOTHING
    report = Report(design, left, found, varies, status, why)
    return tuple(report.index(name) for name in names_of(design) if settings.asks(name[0]))


def _checked(
    design: Design, outputs: ArrayLike, ok: ArrayLike | None
) -> tuple[Array, NDArray[np.bool_]]:
    values: Array = np.asarray(outputs, dtype=np.float64)
    good = np.ones(design.n, dtype=bool) if ok is None else np.asarray(ok, dtype=bool)
    if values.ndim != 2 or len(values) != design.n or good.shape != (design.n,):
        raise ValueError(
            f"{design.n} runs need outputs ({design.n}, K) and ok ({design.n},), "
            f"found {values.shape} and {good.shape}"
        )
    if not np.isfinite(values[good]).all():
        raise ValueError("outputs must be finite where a run succeeded")
    return values, good


def _for_all(design: Design, left: CompleteBlocks, settings: Settings) -> tuple[IndexStatus, str]:
    """Status and message for all outputs alike; ``done`` where nothing stands against indices."""
    whole = int(left.blocks.sum())
    if design.method is Method.FAST:
        return (IndexStatus.DONE, "") if whole else (IndexStatus.TOO_MANY_FAILED, left.message)
    if left.lost > settings.most_failed:
        allowed = f"; at most {settings.most_failed:.0%} may be lost"
        return IndexStatus.TOO_MANY_FAILED, left.message + allowed
    if whole < FEWEST[design.method]:
        what = f"{whole} {BLOCKS[design.method]}; at least {FEWEST[design.method]} are needed"
        return IndexStatus.TOO_FEW, what
    return IndexStatus.DONE, ""


def _found(
    design: Design, values: Array, left: CompleteBlocks, settings: Settings
) -> IndexEstimates:
    if design.method is Method.FAST:
        return fast_indices(design, values, left.blocks)
    analyse = {
        Method.SOBOL: sobol_indices,
        Method.MORRIS: morris_indices,
        Method.LATIN_HYPERCUBE: given_data_indices,
    }[design.method]
    return analyse(without_lost(design, left), values[left.rows], settings)

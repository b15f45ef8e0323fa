"""Which runs are left when some failed, block by block."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spinepipe.sensitivity.global_indices.design import Design, Method

BLOCKS = {
    Method.SOBOL: "base samples",
    Method.LATIN_HYPERCUBE: "points",
    Method.MORRIS: "trajectories",
    Method.FAST: "curves",
}


@dataclass(frozen=True, eq=False)
class Kept:
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


def kept(design: Design, ok: NDArray[np.bool_]) -> Kept:
    """A failed run takes its whole block with it: a base sample of Sobol, a trajectory of Morris,
    a curve of FAST; of a Latin hypercube itself.

    What is left speaks of those inputs only at which runs succeed.
    """
    blocks: NDArray[np.bool_] = np.all(ok.reshape(-1, design.block), axis=1)
    failed, lost = int((~ok).sum()), int((~blocks).sum())
    what = BLOCKS[design.method]
    message = f"{failed} failed runs: {lost} of {len(blocks)} {what} left out" if failed else ""
    return Kept(np.repeat(blocks, design.block), blocks, failed, message)


def without_lost(design: Design, left: Kept) -> Design:
    """The design's whole blocks alone; not for FAST, whose blocks are not alike."""
    return replace(design, unit=design.unit[left.rows], samples=int(left.blocks.sum()))

"""What a design of tests sees of the effects: products of their signatures, no residual used.

Signatures are those of effects switched on a little in the base model (see `signatures`). Their
products are taken three times: in noise SD alone, with the base refitted, and with nuisances
beside it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.decomposition import orth
from spinepipe.effects.contract import Array
from spinepipe.statics import FreeParameter
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import Trials
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.studies.discrepancy.search.projected import (
    SEEN,
    UNSEEN,
    VariantColumn,
    columns_of,
    signatures_of_each,
)
from spinepipe.studies.discrepancy.search.screen import EffectColumns
from spinepipe.studies.discrepancy.search.whitening import Whitening


@dataclass(frozen=True)
class Candidates:
    """Effects that may be missing, all their columns one after the other.

    Attributes
    ----------
    starts : number of each effect's first column, and of all columns at the end.
    """

    trials: tuple[Trials, ...]
    indices: tuple[EffectColumns, ...]
    starts: tuple[int, ...]
    tests: tuple[str, ...]

    @property
    def columns(self) -> tuple[VariantColumn, ...]:
        """Columns of all effects."""
        return tuple(column for index in self.indices for column in index.columns)


def candidates(trials: Sequence[Trials], joints: int, tests: Sequence[str]) -> Candidates:
    """Columns of effects in a chain of that many joints."""
    indices = tuple(EffectColumns(columns_of(one, joints, tests)) for one in trials)
    ends = np.cumsum([0, *(len(index.columns) for index in indices)])
    return Candidates(tuple(trials), indices, tuple(ends.tolist()), tuple(tests))


@dataclass(frozen=True)
class SpecimenSignatures:
    """Products of the signatures in one specimen's tests; M columns in all, m of an effect.

    Attributes
    ----------
    raw, refitted : per effect (m, m), in noise SD: as they are, and after the base is refitted.
    left : (M, M) with nuisances taken out too.
    freedom : number of readings less that of fitted base parameters.
    """

    raw: tuple[Array, ...]
    refitted: tuple[Array, ...]
    left: Array
    freedom: int


def signature_products(
    solved: SolvedSpecimen,
    free: Sequence[FreeParameter],
    plain: Whitening,
    white: Whitening,
    those: Candidates,
) -> SpecimenSignatures:
    """What a specimen's tests see.

    Parameters
    ----------
    free : base parameters that are fitted. plain, white : without and with nuisances.
    """
    base = plain.noise_only(solved.by(solved.model, free))
    alone, beside_nuisances = orthonormal(base), orthonormal(white.shortened(base))
    raw, refitted, left = [], [], []
    groups = [index.columns for index in those.indices]
    for signature in signatures_of_each(solved, groups):
        moved = plain.noise_only(signature)
        raw.append(moved.T @ moved)
        rest = moved - alone @ (alone.T @ moved)
        refitted.append(rest.T @ rest)
        white_moved = white.shortened(moved)
        rest = white_moved - beside_nuisances @ (beside_nuisances.T @ white_moved)
        # what is left by rounding alone counts as nothing
        gone = np.sum(rest**2, axis=0) <= UNSEEN * np.diagonal(raw[-1])
        left.append(np.where(gone, 0.0, rest))
    together = np.concatenate(left, axis=1)
    freedom = plain.count - alone.shape[1]
    return SpecimenSignatures(tuple(raw), tuple(refitted), together.T @ together, freedom)


def specimen_signatures(
    grounds: BaselineFit, specimen: str, trials: Sequence[Trials]
) -> SpecimenSignatures:
    """What the tests of a specimen see, at the base fit."""
    model = grounds.fit.models[specimen]
    solved = SolvedSpecimen(model, grounds.readings[specimen].cases, grounds.noise.zeroed)
    white = grounds.setting.whitenings[specimen]
    those = candidates(trials, model.n_joints, grounds.tests)
    free = grounds.start.base[specimen]
    return signature_products(solved, free, grounds.plain[specimen], white, those)


def orthonormal(columns: Array) -> Array:
    """(N, p) orthonormal basis of columns, each counted by its direction alone."""
    sizes = np.linalg.norm(columns, axis=0)
    there = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    return orth(there, rcond=SEEN) if there.size else np.zeros((len(columns), 0))


@dataclass(frozen=True)
class CohortSignatures:
    """What all specimens' tests see of the candidates."""

    those: Candidates
    of: Mapping[str, SpecimenSignatures]

    @property
    def freedom(self) -> int:
        """Of all specimens."""
        return sum(one.freedom for one in self.of.values())

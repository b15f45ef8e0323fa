"""The linearised problem of a cohort: signatures with base, nuisances and named effects taken out.

A signature is what an effect, switched on a little, would do to the readings of a specimen: the
model carries every variant switched off, and the simulator's exact sensitivities to the strengths
are the signatures, one column for one strength at one place. What specimens have of their own is
projected out of each specimen; what they share (strengths and shapes of named effects) couples them
and is taken out of the sums.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from spinepipe.decomposition import pinvh, svd
from spinepipe.effects import EffectKind, PlaceSpread
from spinepipe.effects.contract import AcrossJoints, Array
from spinepipe.effects.dead_load import DeadLoad
from spinepipe.model import ScopedEffect
from spinepipe.statics import FreeParameter
from spinepipe.statics.batched import Acting, Idle, acts_here
from spinepipe.studies.discrepancy.search.hypothesis import Trials, Variant, shape_grid
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen

SEEN = 1e-8
"""Directions of a Jacobian with less than this share of its largest singular value are none."""

UNSEEN = 1e-6
"""A signature with less of its square left than this is nothing but what was taken out."""

EVERY_TEST = "*"


@dataclass(frozen=True)
class ProjectedOut:
    """What is taken out of a specimen's whitened readings.

    Attributes
    ----------
    own : (N, p) orthonormal, the specimen's own unknowns.
    shared : (N, a) the shared unknowns' columns, without what ``own`` holds of them.
    residual : (N,) measured less predicted, without what ``own`` holds of it.
    """

    own: Array
    shared: Array
    residual: Array

    def out_of(self, columns: Array) -> Array:
        """(N, m) columns without the specimen's own directions."""
        result: Array = columns - self.own @ (self.own.T @ columns)
        return result


@dataclass(frozen=True)
class Products:
    """Products of a specimen's M signatures.

    Attributes
    ----------
    gram : (M, M) F'F. moments : (M,) F'r.
    raw : (M,) squared norms in noise SDs before anything was taken out.
    shared : (M, a) F'A of the shared unknowns. gram_shared : (a, a) A'A.
    moments_shared : (a,) A'r.
    """

    gram: Array
    moments: Array
    raw: Array
    shared: Array
    gram_shared: Array
    moments_shared: Array


@dataclass(frozen=True)
class Linearised:
    """Products of all specimens; what they share, summed."""

    of: Mapping[str, Products]
    gram_shared: Array
    moments_shared: Array

    @cached_property
    def _inverse_shared(self) -> Array:
        return pinvh(self.gram_shared, rcond=1e-10)

    def without_shared(self, gram: Array, moments: Array, coupled: Array) -> tuple[Array, Array]:
        """Products (..., k, k), (..., k) of strengths less what shared unknowns take.

        ``coupled`` (..., k, a): products of the strengths with the shared unknowns.
        """
        # block elimination: the Schur complement in the shared unknowns
        if not coupled.shape[-1]:
            return gram, moments
        gain = coupled @ self._inverse_shared
        left = gram - gain @ np.swapaxes(coupled, -1, -2)
        return left, moments - gain @ self.moments_shared


@dataclass(frozen=True)
class VariantColumn:
    """One strength of a variant at one place.

    Attributes
    ----------
    sds : prior SDs of the shapes from their defaults. strength : column of the effect's values.
    joint : index, or None for an effect on the whole chain. test : name, or ``*``.
    scale : prior SD of the strength, of its logarithm where it is logarithmic.
    """

    variant: Variant
    sds: tuple[float, ...]
    strength: int
    joint: int | None
    test: str
    scale: float


def linearised(of: Mapping[str, Products]) -> Linearised:
    """The problem of a cohort from those of its specimens."""
    parts = list(of.values())
    gram = np.sum([part.gram_shared for part in parts], axis=0)
    return Linearised(of, gram, np.sum([part.moments_shared for part in parts], axis=0))


def taken_out(fit: JointFit) -> dict[str, ProjectedOut]:
    """What a fit takes out of each specimen."""
    owners: dict[int, set[str]] = {}
    for name, member in fit.hypothesis.members.items():
        for number in member.numbers:
            owners.setdefault(number, set()).add(name)
    common = sorted(number for number, names in owners.items() if len(names) > 1)
    found = {}
    for name, member in fit.hypothesis.members.items():
        jacobian, numbers = fit.jacobians[name], np.array(member.numbers)
        is_common = np.isin(numbers, common)
        own = _basis(jacobian[:, ~is_common])
        shared = np.zeros((len(jacobian), len(common)))
        places = [common.index(number) for number in numbers[is_common]]
        np.add.at(shared.T, places, jacobian[:, is_common].T)
        shared -= own @ (own.T @ shared)
        residual = -fit.residuals[name]  # measured less predicted: what a signature is to make
        found[name] = ProjectedOut(own, shared, residual - own @ (own.T @ residual))
    return found


def _basis(columns: Array) -> Array:
    """(N, p) orthonormal basis of columns."""
    if not columns.shape[1]:
        return np.zeros((len(columns), 0))
    # units differ: singular values tell only of columns of one length
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    left, sizes, _ = svd(scaled)
    seen: Array = left[:, sizes > SEEN * max(sizes.max(initial=0.0), SEEN)]
    return seen


def products(taken: ProjectedOut, white: Array, raw: Array) -> Products:
    """Products of whitened signatures (N, M) with themselves, the residual and what is shared."""
    left = taken.out_of(white)
    gram, moments = left.T @ left, left.T @ taken.residual
    gone = np.diagonal(gram) < UNSEEN * raw  # rounding error, and no direction of its own
    gram[gone], gram[:, gone], moments[gone] = 0.0, 0.0, 0.0
    shared = np.where(gone[:, None], 0.0, left.T @ taken.shared)
    own = taken.shared.T
    return Products(gram, moments, raw, shared, own @ taken.shared, own @ taken.residual)


def columns_of(trials: Trials, joints: int, tests: Sequence[str]) -> list[VariantColumn]:
    """Columns of all variants and shapes of one effect."""
    places = [EVERY_TEST]
    if any(form.spread is PlaceSpread.BY_TEST for form in trials.forms):
        places += list(tests)
    found = []
    for variant in trials.variants:
        effect = variant.create()
        rows: Iterable[int | None] = range(joints) if effect.per_joint else [None]
        for sds in shape_grid(variant):
            found += [
                VariantColumn(
                    variant, sds, strength, joint, test, effect.parameters[strength].prior_scale
                )
                for strength in variant.strengths
                for joint in rows
                for test in places
            ]
    return found


def signatures(solved: SolvedSpecimen, columns: Sequence[VariantColumn]) -> tuple[Array, ...]:
    """(T, J, 6, m) derivative of each test's readings by each column's strength, in prior SDs."""
    return next(signatures_of_each(solved, [columns]))


def signatures_of_each(
    solved: SolvedSpecimen, groups: Sequence[Sequence[VariantColumn]]
) -> Iterator[tuple[Array, ...]]:
    """The same for several effects; what differs by the test alone is derived once."""
    every = dict.fromkeys(_IdleStrength.of(column) for columns in groups for column in columns)
    parts: dict[Variant, list[_IdleStrength]] = {}
    for one in every:
        parts.setdefault(one.variant, []).append(one)
    # every strength once, effects that need a model of their own apart; then columns by number
    found, places = _derived(solved, list(parts.values()))
    whole = [np.concatenate(of_test, axis=-1) for of_test in zip(*found, strict=True)]
    for columns in groups:
        at = [places[_IdleStrength.of(column)] for column in columns]
        scales = np.array([column.scale for column in columns])
        yield tuple(
            by_x[..., at]
            * np.where([one.test in (EVERY_TEST, case.test) for one in columns], scales, 0.0)
            for by_x, case in zip(whole, solved.cases, strict=True)
        )


class _IdleStrength(NamedTuple):
    """A strength of an idle effect at one joint, or at all."""

    variant: Variant
    sds: tuple[float, ...]
    strength: int
    joint: int | None

    @classmethod
    def of(cls, column: VariantColumn) -> "_IdleStrength":
        """What moves for a column."""
        return cls(column.variant, column.sds, column.strength, column.joint)


def _derived(
    solved: SolvedSpecimen, parts: Sequence[Sequence[_IdleStrength]]
) -> tuple[list[tuple[Array, ...]], dict[_IdleStrength, int]]:
    """(T, J, 6, m) derivatives of each test's readings by strengths of idle variants.

    Parameters
    ----------
    parts : of one variant each.

    Returns
    -------
    columns in a few portions, and the place of each strength among all.
    """
    acting: list[tuple[Acting, Sequence[_IdleStrength]]] = []
    together: dict[object, list[_IdleStrength]] = {}
    for some in parts:
        effect = some[0].variant.create()
        if solved.answering is not None and acts_here(effect):
            acting.append((effect, some))
        else:
            # idle effects of one key may stand in one model: none knows of the others
            apart = effect.kind is EffectKind.MEASUREMENT
            apart = apart or isinstance(effect, DeadLoad | AcrossJoints)
            together.setdefault(effect.kind if apart else effect, []).extend(some)
    found = _answered(solved, acting) if acting else []
    found += [_by_model(solved, some) for some in together.values()]
    every = [one for some in (*(some for _, some in acting), *together.values()) for one in some]
    places = {one: place for place, one in enumerate(every)}
    return found or [_by_model(solved, [])], places


def _answered(
    solved: SolvedSpecimen, parts: Sequence[tuple[Acting, Sequence[_IdleStrength]]]
) -> list[tuple[Array, ...]]:
    """The same of what the solved runs answer as they are."""
    idle, at = [], []
    for effect, some in parts:
        variant = some[0].variant
        shapes = {sds: place for place, sds in enumerate(dict.fromkeys(one.sds for one in some))}
        values = np.stack([variant.off(sds) for sds in shapes])
        rows = np.array([(one.joint, shapes[one.sds], one.strength) for one in some]).T
        # by the logarithm of a parameter: its value times the derivative by itself
        logarithmic = np.array([p.logarithmic for p in effect.parameters])[rows[2]]
        at.append((*rows, np.where(logarithmic, values[rows[1], rows[2]], 1.0)))
        idle.append(Idle(effect, values))
    return [
        tuple(of_test[:, :, :, joint, shape, strength] * slope for of_test in by_test)
        for by_test, (joint, shape, strength, slope) in zip(
            solved.by_strengths(idle), at, strict=True
        )
    ]


def _by_model(solved: SolvedSpecimen, moved: Sequence[_IdleStrength]) -> tuple[Array, ...]:
    """The same of any effect, from a model that has it."""
    model = solved.model
    effects, free = list(model.effects), []
    scoped: dict[tuple[Variant, tuple[float, ...]], int] = {}
    for variant, sds, strength, joint in moved:
        if (variant, sds) not in scoped:
            scoped[variant, sds] = len(effects)
            effects.append(idle(variant, sds, model.n_joints))
        place = scoped[variant, sds]
        parameter = effects[place].effect.parameters[strength]
        rows = (0 if joint is None else joint,)
        free.append(FreeParameter("", place, strength, rows, parameter.logarithmic))
    return solved.by(model.with_effects(tuple(effects)), free)


def idle(variant: Variant, sds: Sequence[float], joints: int) -> ScopedEffect:
    """The effect on all joints, switched off."""
    effect = variant.create()
    rows = joints if effect.per_joint else 1
    return ScopedEffect(effect, tuple(range(joints)), np.tile(variant.off(sds), (rows, 1)))

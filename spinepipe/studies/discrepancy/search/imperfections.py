"""Imperfections: how large each nuisance is, most likely, and how much of chi2 it takes up.

With U the readings' moves by one prior SD of each nuisance (noise SD), J those by what is fitted
and r what the fit leaves, nuisances z ~ N(0, 1) and unknowns x (weak priors P) are jointly normal:
at the fit z = (I + U'U)^-1 U'r. Without nuisances chi2 would be larger by z' L z to first order, L
the precision of z with x free: each nuisance takes up ``z_i (L z)_i`` of it, and these add up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import norm
from scipy.stats import t as student

from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array, Indices
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap, whole_gap
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.nuisance import (
    COMMON_TO_JOINTS,
    KINDS,
    Label,
    nuisance_labels,
)
from spinepipe.studies.discrepancy.search.prediction import bushing_stiffness
from spinepipe.studies.discrepancy.search.refit import standing
from spinepipe.studies.discrepancy.store import PieceRunner

EVERYWHERE = "*"

BY_CHANCE = 0.01
"""How often a mean of random errors counts as no random one, over all means that are looked at."""

FEWEST_IN_COMMON = 2
LEAST_TOLD = 0.05
"""Share of a nuisance's prior variance that readings must tell at least, or it has no say."""

SHARED = tuple(KINDS.get(name, name) for name in COMMON_TO_JOINTS)
"""Kinds that may be common to all joints anyhow."""


@dataclass(frozen=True)
class NuisancePlace:
    """Which nuisance, and where; ``*`` stands for all. ``sd``: one prior SD in ``unit``, SI."""

    specimen: str
    kind: str
    component: str
    joint: str
    test: str
    sd: float
    unit: str


@dataclass(frozen=True)
class Imperfection:
    """A nuisance at its most likely value.

    Attributes
    ----------
    size, sd : mean and SD of what the readings say of it, in prior SDs.
    chi2 : what it takes up of chi2; may be negative where another takes up more for it.
    """

    at: NuisancePlace
    size: float
    sd: float
    chi2: float


@dataclass(frozen=True)
class InCommon:
    """The mean of a nuisance over the places that ``at`` leaves open, were it free.

    Attributes
    ----------
    size, sd : the mean and its standard error by the scatter of the places, in prior SDs.
    count : nuisances in the mean. chance : how often random errors make as large a mean.
    certain : whether that is too seldom, of all means that are looked at.
    """

    at: NuisancePlace
    size: float
    sd: float
    count: int
    chance: float
    certain: bool = False


@dataclass(frozen=True)
class AbsorbedGap:
    """What imperfections took up in one fit.

    Attributes
    ----------
    without : the gap without any, all refitted; None where that has no fit. beside : with them.
    each : all of them. common : means of several, those of most places first.
    """

    without: Gap | None
    beside: Gap
    each: tuple[Imperfection, ...]
    common: tuple[InCommon, ...]


def absorbed_gap(
    baseline: BaselineFit, fit: JointFit, joints: Sequence[str], run: PieceRunner
) -> AbsorbedGap:
    """What imperfections took up of what a fit would leave without them."""
    places = tuple(
        NuisancePlace(
            specimen,
            one.kind,
            one.component,
            EVERYWHERE if one.joint is None else joints[one.joint],
            one.test,
            one.sd,
            one.unit,
        )
        for specimen in baseline.readings
        for one in labels_of(baseline, specimen)
    )
    posterior = _posterior(fit, _parts(baseline, fit))
    return AbsorbedGap(
        run(gap_without, baseline, fit),
        whole_gap(baseline, fit),
        tuple(
            Imperfection(place, float(size), float(sd), float(chi2))
            for place, size, sd, chi2 in zip(
                places, posterior.size, np.sqrt(posterior.variance), posterior.chi2, strict=True
            )
        ),
        in_common(places, posterior.size, posterior.covariance),
    )


def gap_without(baseline: BaselineFit, fit: JointFit) -> Gap | None:
    """The gap with everything that was fitted fitted again, and no nuisance; None without a fit."""
    setting = Setting(baseline.readings, baseline.plain, baseline.noise.zeroed)
    again = joint_fit(baseline.suppose(standing(fit)), setting, fit.poses)
    if not again.usable:
        return None
    return whole_gap(replace(baseline, setting=setting), again)


def labels_of(baseline: BaselineFit, specimen: str) -> tuple[Label, ...]:
    """What the nuisances of a specimen's whitening are, in their order."""
    stiffness = bushing_stiffness(baseline.fit.models[specimen])
    one = baseline.readings[specimen]
    return nuisance_labels(baseline.priors, stiffness, one.cases, one.coordinates)


@dataclass(frozen=True)
class _SpecimenBlock:
    """A specimen: U (N, K), H = (I + U'U)^-1 (K, K), J (N, m) of all unknowns, r (N,)."""

    moves: Array
    inverse: Array
    jacobian: Array
    residual: Array


def _parts(baseline: BaselineFit, fit: JointFit) -> list[_SpecimenBlock]:
    found = []
    for name, member in fit.hypothesis.members.items():
        white = baseline.setting.whitenings[name]
        whole = member.among_all(white.lengthened(fit.jacobians[name]), len(fit.x))
        residual = -white.lengthened(fit.residuals[name])  # measured less predicted
        # (I + U'U)^-1 from U = P S Q': I + Q ((1 + S^2)^-1 - I) Q'
        shorter = (1.0 + white.shrink) ** 2 - 1.0
        inverse = np.eye(white.mixing.shape[1]) + (white.mixing.T * shorter) @ white.mixing
        found.append(_SpecimenBlock(white.moves, inverse, whole, residual))
    return found


@dataclass(frozen=True)
class _Posterior:
    """Of the nuisances of all specimens: mean (K,), what each takes up (K,), covariance (K, K)."""

    size: Array
    chi2: Array
    covariance: Array

    @property
    def variance(self) -> Array:
        return np.maximum(np.diagonal(self.covariance), 0.0)


def _posterior(fit: JointFit, parts: Sequence[_SpecimenBlock]) -> _Posterior:
    """Of all nuisances, with the unknowns of the fit free."""
    # z given x, then L z by the precision of z with x integrated out: I + U' (I - J (P + J'J)^-1
    # J') U applied to z
    prior = np.diag([u.sd**-2.0 for u in fit.hypothesis.unknowns])
    jacobians = [part.jacobian for part in parts]
    size = [part.inverse @ (part.moves.T @ part.residual) for part in parts]
    made = [part.moves @ z for part, z in zip(parts, size, strict=True)]
    plain = prior + sum(j.T @ j for j in jacobians)
    back = np.linalg.solve(plain, sum(j.T @ m for j, m in zip(jacobians, made, strict=True)))
    left = [
        z + part.moves.T @ (m - part.jacobian @ back)
        for part, z, m in zip(parts, size, made, strict=True)
    ]
    # the unknowns' share: shifts of x move z by -H U'J
    gains = np.concatenate([part.inverse @ (part.moves.T @ part.jacobian) for part in parts])
    within = [part.jacobian.T @ part.moves for part in parts]
    lost = sum(w @ part.inverse @ w.T for w, part in zip(within, parts, strict=True))
    of_unknowns = np.linalg.inv(plain - lost)
    covariance = block_diag(*(part.inverse for part in parts)) + gains @ of_unknowns @ gains.T
    whole = np.concatenate(size)
    return _Posterior(whole, whole * np.concatenate(left), covariance)


def in_common(
    places: Sequence[NuisancePlace], size: Array, covariance: Array
) -> tuple[InCommon, ...]:
    """Means over joints, specimens or both, those of the most places first.

    A mean is certain where random errors would hardly make it, and no wider one says it already.

    Parameters
    ----------
    size, covariance : (K,), (K, K) what the readings say of each place, in prior SDs.
    """
    found = [
        (one, set(numbers.tolist()))
        for at, numbers in _groups(places).items()
        if (one := _mean(at, size[numbers], covariance[np.ix_(numbers, numbers)])) is not None
    ]
    found.sort(key=lambda pair: -pair[0].count)
    said: list[set[int]] = []
    ended = []
    for one, numbers in found:
        wider = any(numbers <= wide for wide in said)
        certain = one.chance < BY_CHANCE / len(found) and not wider
        if certain:
            said.append(numbers)
        ended.append(replace(one, certain=certain))
    return tuple(ended)


def _mean(at: NuisancePlace, size: Array, covariance: Array) -> InCommon | None:
    """The mean of nuisances; None where readings say too little.

    Of random errors ``size`` is N(0, I - covariance): by their SDs as allowed for, and by their
    own scatter whatever their SDs.
    """
    # what all have in common, m, is shrunk to (I - covariance) m, as the sizes are posterior means:
    # generalised least squares for m in the eigenbasis
    values, vectors = eigh(np.eye(len(size)) - covariance)
    told = values > LEAST_TOLD
    ones = vectors[:, told].sum(axis=0) * np.sqrt(values[told])
    seen = vectors[:, told].T @ size / np.sqrt(values[told])
    weight, free = float(ones @ ones), int(told.sum()) - 1
    if weight < LEAST_TOLD * len(size) or free < 1:
        return None
    mean = float(ones @ seen) / weight
    scatter = float(np.linalg.norm(seen - mean * ones)) / np.sqrt(free)
    by_scatter = max(scatter, np.finfo(float).tiny) / np.sqrt(weight)
    chances = norm.sf(abs(mean) * np.sqrt(weight)), student.sf(abs(mean) / by_scatter, free)
    chance = min(1.0, 4.0 * float(min(chances)))  # two sides, two ways
    return InCommon(at, mean, float(by_scatter), len(size), chance)


def _groups(places: Sequence[NuisancePlace]) -> Mapping[NuisancePlace, Indices]:
    """Numbers of the nuisances of one kind and component that could be off together."""
    found: dict[NuisancePlace, list[int]] = {}
    for number, one in enumerate(places):
        if one.kind in SHARED:
            continue
        wider = {
            replace(one, specimen=EVERYWHERE, joint=EVERYWHERE, test=EVERYWHERE),
            replace(one, specimen=EVERYWHERE),
            replace(one, joint=EVERYWHERE, test=EVERYWHERE),
        }
        for at in sorted(wider - {one}, key=str):
            found.setdefault(at, []).append(number)
    # with one specimen or one joint several groups are the same: the first of them counts
    first: dict[tuple[int, ...], NuisancePlace] = {}
    for at, numbers in found.items():
        first.setdefault(tuple(numbers), at)
    return {at: np.array(n) for n, at in first.items() if len(n) >= FEWEST_IN_COMMON}

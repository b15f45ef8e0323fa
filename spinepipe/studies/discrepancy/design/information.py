"""What readings tell, as products that add up: readings that are there, and those of runs to come.

Readings in noise SD depend on effects that may be missing (F), on what is fitted (J, own to a
specimen or shared) and on nuisances (U, prior SD one): F'F and its like are all that is needed of
them. Rows of a run are put below those that are there by adding its products; a nuisance that both
have is one. With W the inverse of I + U U' (Woodbury), F'WF less what J takes up is what is left of
the effects: for one column, a difference of two models, it is the noncentrality of its chi2.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.decomposition import pinvh
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import LoadCase, RefusedModel, SpineModel
from spinepipe.studies.discrepancy.design.plans import PlannedTest, repeats_of, with_preloads
from spinepipe.studies.discrepancy.search.baseline import (
    PER_SPECIMEN,
    BaselineFit,
    base_parameters,
)
from spinepipe.studies.discrepancy.search.hypothesis import LOG_STIFFNESS_SD
from spinepipe.studies.discrepancy.search.imperfections import labels_of
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.nuisance import (
    Label,
    nuisance_labels,
    nuisance_signatures,
)
from spinepipe.studies.discrepancy.search.prediction import (
    NoEquilibrium,
    Simulated,
    SolvedSpecimen,
    bushing_stiffness,
)
from spinepipe.studies.discrepancy.search.projected import EVERY_TEST, SEEN, UNSEEN
from spinepipe.studies.discrepancy.search.screen import summation
from spinepipe.studies.discrepancy.search.whitening import Whitening, whitening
from spinepipe.units import COORDINATES, subtract_baseline

TRANSLATION_SD = 1e-4
"""m, of translations in tests where none were read and none is declared."""

Key = tuple[str, str, int | None, str]
"""What a nuisance is of (kind, component, joint, test); the same in all runs of one set-up."""

ModelChange = Callable[[SpineModel], SpineModel]
"""What a run does to a model, such as a preload."""

Effects = Callable[[ModelChange, Sequence[LoadCase]], Sequence[Array]]
"""(T, J, 6, M) m and rad in each case, not zeroed, of a specimen's models as changed."""


@dataclass(frozen=True)
class Bench:
    """Where runs are tried: the fit they stand on, and errors of single readings.

    Attributes
    ----------
    sd : (6,) m and rad, of coordinates that were not read as well.
    """

    grounds: BaselineFit
    sd: Array

    @classmethod
    def of(cls, grounds: BaselineFit, declared: Array | None) -> "Bench":
        """With declared SDs (6,) m and rad of what was not read; usual ones for None."""
        usual = np.full(6, TRANSLATION_SD) if declared is None else declared
        return cls(grounds, np.where(np.isfinite(grounds.noise.sd), grounds.noise.sd, usual))


@dataclass(frozen=True)
class ExpectedReadings:
    """Rows of readings: effects F (N, M), unknowns J (N, m), nuisances U (N, K) of these keys."""

    by_effects: Array
    by_unknowns: Array
    moves: Array
    keys: tuple[Key, ...]


@dataclass(frozen=True)
class Information:
    """Products of a specimen's rows.

    Attributes
    ----------
    readings : N. uu : (K, K) U'U. uj : (K, m) U'J. uf : (K, M) U'F. jj, jf, ff : J'J, J'F, F'F.
    """

    readings: int
    keys: tuple[Key, ...]
    uu: Array
    uj: Array
    uf: Array
    jj: Array
    jf: Array
    ff: Array

    @classmethod
    def of(cls, rows: ExpectedReadings) -> "Information":
        """Products of some rows."""
        u, j, f = rows.moves, rows.by_unknowns, rows.by_effects
        return cls(len(f), rows.keys, u.T @ u, u.T @ j, u.T @ f, j.T @ j, j.T @ f, f.T @ f)

    def plus(self, other: "Information") -> "Information":
        """Rows of both; nuisances of one key are one."""
        keys = tuple(dict.fromkeys((*self.keys, *other.keys)))
        a, b = self._among(keys), other._among(keys)
        return Information(
            self.readings + other.readings,
            keys,
            a.uu + b.uu,
            a.uj + b.uj,
            a.uf + b.uf,
            a.jj + b.jj,
            a.jf + b.jf,
            a.ff + b.ff,
        )

    def _among(self, keys: Sequence[Key]) -> "Information":
        """The same by these keys, those of its own among them."""
        place = {key: number for number, key in enumerate(keys)}
        onto = summation([place[key] for key in self.keys], len(keys))
        uu, uj, uf = onto @ self.uu @ onto.T, onto @ self.uj, onto @ self.uf
        return replace(self, keys=tuple(keys), uu=uu, uj=uj, uf=uf)

    @property
    def without_nuisances(self) -> tuple[Array, Array, Array]:
        """J'WJ (m, m), J'WF (m, M) and F'WF (M, M)."""
        inside = np.eye(len(self.keys)) + self.uu
        solved = np.linalg.solve(inside, np.concatenate([self.uj, self.uf], axis=1))
        of_j, of_f = np.split(solved, [self.uj.shape[1]], axis=1)
        return (
            self.jj - self.uj.T @ of_j,
            self.jf - self.uj.T @ of_f,
            self.ff - self.uf.T @ of_f,
        )

    @property
    def refitted(self) -> Array:
        """(M, M) F'F with what is fitted taken out, nuisances left aside."""
        return _taken_out(self.jj, self.jf, self.ff)

    @property
    def left(self) -> Array:
        """(M, M) F'WF with what is fitted taken out; what is left by rounding alone is nothing."""
        left = _taken_out(*self.without_nuisances)
        gone = np.diagonal(left) <= UNSEEN * np.diagonal(self.ff)
        left[gone], left[:, gone] = 0.0, 0.0
        return left

    @property
    def freedom(self) -> int:
        """Number of readings less that of what they tell of what is fitted."""
        return self.readings - int(np.count_nonzero(np.diagonal(self.jj)))


def _taken_out(jj: Array, jf: Array, ff: Array) -> Array:
    """F'F less the part in the span of J, whose columns count by their direction alone."""
    sizes = np.sqrt(np.diagonal(jj))
    seen = sizes > 0.0
    scaled = jj[np.ix_(seen, seen)] / np.outer(sizes[seen], sizes[seen])
    onto = jf[seen] / sizes[seen, None]
    result: Array = ff - onto.T @ pinvh(scaled, rcond=SEEN) @ onto
    return result


def rows_there(
    grounds: BaselineFit, fit: JointFit, name: str, effects: Sequence[Array]
) -> ExpectedReadings:
    """A specimen's readings beside a fit; ``effects`` (T, J, 6, M) per test, as they were read."""
    white = grounds.setting.whitenings[name]
    moved = grounds.plain[name].noise_only(effects)
    keys = tuple(_key_of(label) for label in labels_of(grounds, name))
    return ExpectedReadings(moved, white.lengthened(fit.jacobians[name]), white.moves, keys)


def added(
    place: Bench, fit: JointFit, name: str, menu: Sequence[PlannedTest], effects: Effects
) -> Iterator[tuple[PlannedTest, Information | str]]:
    """Products of each run of a specimen, or why it has no pose.

    Runs that change the model and read alike are solved together.
    """
    groups: dict[tuple[float, bytes], list[PlannedTest]] = {}
    for run in menu:
        read = run.count.any(axis=0).tobytes()
        groups.setdefault((run.preload, read), []).append(run)
    waiting = list(groups.values())[::-1]
    while waiting:
        group = waiting.pop()
        try:
            rows = rows_added(place, fit, name, group, effects)
        except (NoEquilibrium, RefusedModel) as trouble:
            # where one of a stack has no pose, it is found by halving the stack
            if len(group) == 1:
                yield group[0], str(trouble)
            else:
                middle = len(group) // 2
                waiting += [group[middle:], group[:middle]]
        else:
            yield from ((run, Information.of(one)) for run, one in zip(group, rows, strict=True))


def rows_added(
    place: Bench, fit: JointFit, name: str, group: Sequence[PlannedTest], effects: Effects
) -> list[ExpectedReadings]:
    """Readings of runs with one preload that read the same coordinates."""
    free = fit.hypothesis.members[name].free
    cases = [run.case for run in group]
    model = with_preloads(fit.models[name], group)
    by_x = Simulated(model, cases, False, free).at(np.zeros(len(free))).by_x
    moved = effects(lambda one: with_preloads(one, group), cases)
    seen_at = np.asarray(group[0].count.any(axis=0)).tolist()
    read = [n for n, there in zip(COORDINATES, seen_at, strict=True) if there]
    keys, moves = _nuisances(place.grounds, name, model, cases, read)
    found = []
    for run, *columns in zip(group, moved, by_x, moves, strict=True):
        white = whitening_of(place, run)
        by_effects, by_unknowns, by_nuisances = (
            white.noise_only([subtract_baseline(rows, run.zeroed)]) for rows in columns
        )
        own = [n for n, key in enumerate(keys) if key[-1] in (EVERY_TEST, run.case.test)]
        kept = tuple(keys[n] for n in own)
        found.append(ExpectedReadings(by_effects, by_unknowns, by_nuisances[:, own], kept))
    return found


def whitening_of(place: Bench, run: PlannedTest) -> Whitening:
    """Of the readings of one run, noise alone."""
    read = run.count.any(axis=0)
    noise = replace(place.grounds.noise, sd=np.where(read, place.sd, np.nan), zeroed=run.zeroed)
    return whitening([repeats_of(run)], noise)


def _nuisances(
    grounds: BaselineFit,
    name: str,
    model: SpineModel,
    cases: Sequence[LoadCase],
    read: Sequence[str],
) -> tuple[list[Key], tuple[Array, ...]]:
    """Nuisances of runs; stiffness in a coordinate that was not read before is one more."""
    solved, priors = SolvedSpecimen(model, cases, False), grounds.priors
    labels = nuisance_labels(priors, bushing_stiffness(model), cases, read)
    keys, moved = [_key_of(label) for label in labels], nuisance_signatures(solved, priors, read)
    fresh = [n for n in read if n not in grounds.readings[name].coordinates]
    if not fresh:
        return keys, moved
    free = base_parameters(model, PER_SPECIMEN, fresh)
    slopes = [LOG_STIFFNESS_SD * one for one in solved.by(model, free)]
    keys += [("stiffness", f"{p.effect} {p.column}", p.rows[0], EVERY_TEST) for p in free]
    return keys, tuple(np.concatenate(pair, axis=-1) for pair in zip(moved, slopes, strict=True))


def _key_of(label: Label) -> Key:
    return label.kind, label.component, label.joint, label.test


def noncentrality(
    of: Mapping[str, Information], numbers: Mapping[str, Indices], prior_sds: Array
) -> float:
    """What all specimens leave of one column: ``min |d - J x - U z|^2`` and priors.

    Parameters
    ----------
    numbers : of each specimen, which of all unknowns its own are. prior_sds : (X,) of all.
    """
    # generalised least squares: the unknowns' normal equations, summed over specimens
    jj, jd, dd = np.diag(prior_sds**-2.0), np.zeros(len(prior_sds)), 0.0
    for name, one in of.items():
        own_jj, own_jd, own_dd = one.without_nuisances
        at = numbers[name]
        # added, not set: several of a specimen's own parameters may be one unknown
        np.add.at(jj, np.ix_(at, at), own_jj)
        np.add.at(jd, at, own_jd[:, 0])
        dd += float(own_dd[0, 0])
    return max(0.0, dd - float(jd @ np.linalg.solve(jj, jd))) if len(jd) else max(0.0, dd)

"""How far one model of a cohort is from what another predicts, and how far it would be with more.

Were another model true, the readings would differ by d from what a fitted model says. The fitted
one may move its unknowns x (J, weak priors) and nuisances z (U, prior SD one) towards them. What
stays, ``min |d - J x - U z|^2 + |z|^2 + priors``, is the noncentrality of its chi2: twice the log
evidence by which it is expected to fall behind. Rows of an added run go below those that are there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.nuisance import Label

Key = tuple[str, str, int | None, str]
"""What a nuisance is of; the same in all runs of one set-up."""


def key_of(label: Label) -> Key:
    """Kind, component, joint and test."""
    return label.kind, label.component, label.joint, label.test


@dataclass(frozen=True)
class ExpectedReadings:
    """Readings in noise SDs: difference d (N,), by unknowns J (N, m), by nuisances U (N, K).

    ``keys`` (K,): what each nuisance is of.
    """

    difference: Array
    by_unknowns: Array
    moves: Array
    keys: tuple[Key, ...]


@dataclass(frozen=True)
class Sums:
    """Products of a specimen's rows: all that is needed of them.

    Attributes
    ----------
    uu : (K, K) U'U. uj : (K, m) U'J. ud : (K,) U'd. jj, jd, dd : J'J, J'd, d'd.
    """

    keys: tuple[Key, ...]
    uu: Array
    uj: Array
    ud: Array
    jj: Array
    jd: Array
    dd: float

    @classmethod
    def of(cls, rows: ExpectedReadings) -> "Sums":
        """Products of some rows."""
        u, j, d = rows.moves, rows.by_unknowns, rows.difference
        return cls(rows.keys, u.T @ u, u.T @ j, u.T @ d, j.T @ j, j.T @ d, float(d @ d))

    def plus(self, other: "Sums") -> "Sums":
        """Rows of both; nuisances of one key are one."""
        keys = tuple(dict.fromkeys((*self.keys, *other.keys)))
        a, b = self._among(keys), other._among(keys)
        return Sums(
            keys,
            a.uu + b.uu,
            a.uj + b.uj,
            a.ud + b.ud,
            a.jj + b.jj,
            a.jd + b.jd,
            a.dd + b.dd,
        )

    def _among(self, keys: Sequence[Key]) -> "Sums":
        onto = np.zeros((len(keys), len(self.keys)))
        place = {key: number for number, key in enumerate(keys)}
        onto[[place[key] for key in self.keys], np.arange(len(self.keys))] = 1.0
        uu, uj, ud = onto @ self.uu @ onto.T, onto @ self.uj, onto @ self.ud
        return Sums(tuple(keys), uu, uj, ud, self.jj, self.jd, self.dd)

    @property
    def without_nuisances(self) -> tuple[Array, Array, float]:
        """J'WJ (m, m), J'Wd (m,) and d'Wd with W the inverse of I + UU'."""
        inside = np.eye(len(self.keys)) + self.uu
        solved = np.linalg.solve(inside, np.column_stack([self.uj, self.ud]))
        of_j, of_d = solved[:, :-1], solved[:, -1]
        return (
            self.jj - self.uj.T @ of_j,
            self.jd - self.uj.T @ of_d,
            self.dd - float(self.ud @ of_d),
        )


def noncentrality(of: Mapping[str, Sums], prior_sds: Array) -> float:
    """What all specimens together leave between the models; unknowns (m,) are common to all."""
    parts = [one.without_nuisances for one in of.values()]
    jj = np.sum([part[0] for part in parts], axis=0) + np.diag(prior_sds**-2.0)
    jd = np.sum([part[1] for part in parts], axis=0)
    dd = sum(part[2] for part in parts)
    return max(0.0, dd - float(jd @ np.linalg.solve(jj, jd))) if len(jd) else max(0.0, dd)

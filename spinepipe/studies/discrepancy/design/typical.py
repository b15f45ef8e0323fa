"""A typical effect: its strengths at their declared defaults, and what a design sees of it.

Strengths whose bounds allow both sides of off are independent with mean off, so that several of
them neither add up nor cancel by a convention of signs.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.discrepancy.design.seen import Design
from spinepipe.discrepancy.evidence import Group
from spinepipe.discrepancy.forms import Form, Variant
from spinepipe.discrepancy.groups import Places
from spinepipe.effects.contract import Array, Indices

NO_TRACE = 1e-6
"""A typical effect whose squared signature sums to less, in noise SD, leaves no trace at all."""


@dataclass(frozen=True)
class Typical:
    """A form at its default shape, k strengths.

    Attributes
    ----------
    mean : (k,) prior SDs, of strengths that have one side. sd : (k,) of those that have two.
    signs : (k,) side of off that bounds allow, 0 for both.
    raw, refitted, left : (k, k) products of the strengths' signatures; see `Seen`.
    """

    form: Form
    places: Places
    mean: Array
    sd: Array
    signs: Array
    raw: Array
    refitted: Array
    left: Array

    def squared(self, gram: Array) -> float:
        """Expected squared signature at typical strength."""
        return float(self.mean @ gram @ self.mean + self.sd**2 @ np.diagonal(gram))

    @property
    def seen(self) -> bool:
        """Whether it leaves any trace in the readings."""
        return self.squared(self.raw) > NO_TRACE

    @property
    def absorbed(self) -> float:
        """Share of the squared signature that base and nuisances take up; 1 without a trace."""
        return self._taken(self.left)

    @property
    def absorbed_by_base(self) -> float:
        """Share that the base alone takes up."""
        return self._taken(self.refitted)

    def _taken(self, gram: Array) -> float:
        if not self.seen:
            return 1.0
        return float(np.clip(1.0 - self.squared(gram) / self.squared(self.raw), 0.0, 1.0))

    @property
    def group(self) -> Group:
        """Its strengths as a group on the screen."""
        return Group.of(self.left, self.signs)

    @property
    def directions(self) -> Array:
        """(k, d) strengths whose squares add up to the expected one."""
        both = np.column_stack([self.mean, np.diag(self.sd)])
        return both[:, np.any(both != 0.0, axis=0)]


def typical(design: Design, number: int, form: Form) -> Typical:
    """A form of effect ``number`` under a design."""
    index, start = design.those.indices[number], design.those.starts[number]
    middle = (0.0,) * len(form.variant.shapes)
    places, strengths = index.places(form, middle, tuple(design.of), design.those.tests)
    count = len(strengths)
    signs = index.signs(form, places, count)
    sizes = typical_strengths(form.variant)
    away = np.array([sizes[column] for column in strengths])
    raw, refitted, left = (np.zeros((count, count)) for _ in range(3))
    for specimen, columns, owners in places:
        part, here, onto = design.of[specimen], np.ix_(columns, columns), summing(owners, count)
        among_all = np.ix_(start + columns, start + columns)
        raw += onto @ part.raw[number][here] @ onto.T
        refitted += onto @ part.refitted[number][here] @ onto.T
        left += onto @ part.left[among_all] @ onto.T
    one_sided = signs != 0.0
    mean, sd = np.where(one_sided, away, 0.0), np.where(one_sided, 0.0, away)
    return Typical(form, places, mean, sd, signs, raw, refitted, left)


def summing(owners: Indices, count: int) -> Array:
    """(k, c) sums columns onto the strengths that own them."""
    onto = np.zeros((count, len(owners)))
    onto[owners, np.arange(len(owners))] = 1.0
    return onto


def typical_strengths(variant: Variant) -> dict[int, float]:
    """Default of each strength, in prior SDs from off, by its column."""
    found = {}
    for column in variant.strengths:
        p = variant.create().parameters[column]
        assert p.off is not None
        away = np.log(p.default / p.off) if p.logarithmic else p.default - p.off
        found[column] = float(away) / p.prior_scale
    return found

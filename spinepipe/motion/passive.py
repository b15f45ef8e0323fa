"""What stretched discs and ligaments do: two exponentials, of one slope where both begin.

A coordinate q is resisted by A (exp(B q) - 1), each side with its own A and B (Wang 2021 Eq 3 for
either side); where the exponent has grown to `STRAIGHT` the law goes on straight.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.effects.rounding import STRAIGHT


@dataclass(frozen=True, eq=False)
class PassiveLaw:
    """Passive elements of all joints.

    Attributes
    ----------
    a : (17, 6, 2) N or N m, for positive and for negative coordinates. b : (17, 6, 2) 1/m or 1/rad.
    rest : (17, 6) m and rad, where nothing is stretched; sides are counted from there.
    """

    a: Array
    b: Array
    rest: Array = field(default_factory=lambda: np.zeros(6))

    def scaled(self, size: Array, shape: Array) -> "PassiveLaw":
        """Times as large (17, 6), and with exponents as many times as large (17, 6), both sides."""
        return replace(self, a=self.a * size[..., None], b=self.b * shape[..., None])

    def forces(self, q: Array) -> Array:
        """(F, 17, 6) N and N m that resist coordinates (F, 17, 6) m and rad; of their sign."""
        return self.with_slopes(q)[0]

    def with_slopes(self, q: Array) -> tuple[Array, Array, Array]:
        """Forces (F, 17, 6), their slopes by the coordinate, and by the logarithm of both B.

        The slope by the logarithm of both A is the force itself.
        """
        q = q - self.rest
        side = (q < 0.0).astype(np.int64)[..., None]
        a, b = (
            np.take_along_axis(np.broadcast_to(one, (*q.shape, 2)), side, axis=-1)[..., 0]
            for one in (self.a, self.b)
        )
        exponent = b * np.abs(q)
        bent = np.minimum(exponent, STRAIGHT)
        grown, on = np.exp(bent), exponent - bent
        size = a * (grown - 1.0 + grown * on)
        by_shape = a * grown * exponent
        return np.sign(q) * size, a * b * grown, np.sign(q) * by_shape

    def curvatures(self, q: Array) -> tuple[Array, Array, Array]:
        """(F, 17, 6) each, second derivatives of forces: by the coordinate twice, by it and the
        logarithm of both B, and by that logarithm twice.

        Those with the logarithm of both A are the first derivatives themselves.
        """
        _, stiffness, by_shape = self.with_slopes(q)
        q = q - self.rest
        side = (q < 0.0).astype(np.int64)[..., None]
        b = np.take_along_axis(np.broadcast_to(self.b, (*q.shape, 2)), side, axis=-1)[..., 0]
        exponent = b * np.abs(q)
        bends = exponent < STRAIGHT
        by_both = 1.0 + bends * exponent
        return np.sign(q) * b * stiffness * bends, stiffness * by_both, by_shape * by_both

    def stiffness_at(self, load: Array) -> Array:
        """(17, 6, 2) N/m and N m/rad, slope where a side resists with a load: B (F + A)."""
        straight = self.a * (np.exp(STRAIGHT) - 1.0)
        found: Array = self.b * (np.minimum(load, straight) + self.a)
        return found

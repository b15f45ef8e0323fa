"""Fascicles of a trunk in a posture: how long they are and what they do to the bodies.

Straight lines and via points as the source has them. Fascicles that lie on the vertebrae they pass
run over bars behind those (`spinepipe.muscles.wrapping`). A bar stands at a share of the fascicle's
distance from the vertebra in the source's pose, so that it touches when the trunk bends; and no
nearer than the arches of the vertebrae let a muscle come, where the source's own line does.

Fascicles that end in the rectus sheath pull along it: the part of an internal oblique's pull along
the sheath draws the ribs down, that of an external oblique's relieves them, and the sheath cannot
push (Ghezelbash 2016 2.3). The part across the sheath is left to transversus and pressure.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.muscles.pose import BodyPoses, cross
from spinepipe.muscles.trunk import BODIES, NO_BODY, SIDES, SLICES, THORAX, Trunk, body_of
from spinepipe.muscles.trunk_source import backwards
from spinepipe.muscles.wrapping import wrap_paths

_SACRUM = 0


@dataclass(frozen=True)
class Standoff:
    """How far behind a vertebra's centre a fascicle is kept.

    Attributes
    ----------
    share : of its distance in the source's pose.
    least_m : but no less than that.
    """

    share: float = 0.9
    least_m: float = 0.04


@dataclass(frozen=True, eq=False)
class Bars:
    """What keeps strings off the vertebrae, in the source's pose, sorted by muscle and along it.

    Attributes
    ----------
    first : (M + 1,) where each muscle's bars begin. leg, body : (B,). at : (B, 3) m.
    """

    first: NDArray[np.int64]
    leg: NDArray[np.int64]
    body: NDArray[np.int64]
    at: Array


@dataclass(frozen=True, eq=False)
class Pulls:
    """What each of M fascicles does with 1 N of tension, in a posture.

    Attributes
    ----------
    lengths : (M,) m.
    forces, moments : (M, 8, 3) on every body, N and N m about the origin of ground.
    contacts : (M,) vertebrae that it lies on. pushes : (M,) sum of its pushes on them.
    along_sheath : (2, M) pull on the upper end of the right and left sheath, down positive.
    trace, traced : (M, Q, 3) m and (M,): points of its path, and how many there are.
    on : (M, Q) body that each of them lies on; those of the sheath count as the ribs'.
    """

    lengths: Array
    forces: Array
    moments: Array
    contacts: NDArray[np.int64]
    pushes: Array
    along_sheath: Array
    trace: Array
    traced: NDArray[np.int64]
    on: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Lines:
    """The fascicles of a trunk with all that does not depend on the posture."""

    trunk: Trunk
    bars: Bars

    @classmethod
    def of(cls, trunk: Trunk, rule: "Standoff", wrapping: bool = True) -> "Lines":
        """Lines of a trunk; without wrapping, fascicles run straight from point to point."""
        chosen = trunk.muscles.wraps if wrapping else np.zeros(len(trunk.muscles), dtype=bool)
        return cls(trunk, _bars(trunk, chosen, rule))

    def pulls(self, poses: BodyPoses) -> Pulls:
        """What the fascicles do in a posture."""
        muscles, bars = self.trunk.muscles, self.bars
        points = self._points(poses)
        turned = poses.rotations[bars.body]
        lengths, forces, moments, contacts, pushes, trace, traced, on = wrap_paths(
            points,
            muscles.body,
            bars.first,
            bars.leg,
            bars.body,
            poses.of(bars.body, bars.at),
            np.ascontiguousarray(turned[:, :, 2]),
            np.ascontiguousarray(-turned[:, :, 0]),
            len(BODIES),
        )
        along = self._sheath(poses, points, forces, moments)
        return Pulls(lengths, forces, moments, contacts, pushes, along, trace, traced, on)

    @cached_property
    def _in_sheath(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """Of the K fascicles that end in a sheath: which they are, their sides, and how far up the
        sheath they end."""
        muscles = self.trunk.muscles
        hung = np.flatnonzero(muscles.in_sheath)
        side = np.array([SIDES.index(muscles.sides[k]) for k in hung], dtype=np.int64)
        low, high = self.trunk.sheath[side].swapaxes(0, 1)
        line, arm = high - low, muscles.point[hung, 1] - low
        share = np.einsum("ki,ki->k", arm, line) / np.einsum("ki,ki->k", line, line)
        return hung, side, share

    def _points(self, poses: BodyPoses) -> Array:
        """(M, P, 3) m, points of the paths now; those in the sheath between pelvis and ribs."""
        muscles = self.trunk.muscles
        found = poses.of(np.maximum(muscles.body, 0), muscles.point)
        hung, _, share = self._in_sheath
        ends = muscles.point[hung, 1]
        low, high = (poses.of(np.full(len(hung), body), ends) for body in (_SACRUM, THORAX))
        found[hung, 1] = low + share[:, None] * (high - low)
        return found

    def _sheath(self, poses: BodyPoses, points: Array, forces: Array, moments: Array) -> Array:
        """Pull on the sheaths, (2, M); forces and moments of what hangs in them are set."""
        muscles, (hung, side, _) = self.trunk.muscles, self._in_sheath
        along = np.zeros((2, len(muscles)))
        low, high = (
            poses.of(np.full(2, body), self.trunk.sheath[:, end])
            for end, body in ((0, _SACRUM), (1, THORAX))
        )
        # the part of each pull along the sheath draws the sheath's end at the ribs
        up, ends = _unit(high - low)[side], points[hung, :2]
        line = _unit(ends[:, 1] - ends[:, 0])
        pull = np.einsum("ki,ki->k", line, up)
        along[side, hung] = pull
        down = pull[:, None] * up
        # an external oblique pulls its own end at the ribs too; the pelvis bears the opposite
        on_ribs = np.where((muscles.body[hung, 0] == THORAX)[:, None], line, 0.0)
        forces[hung], moments[hung] = 0.0, 0.0
        forces[hung, THORAX] = on_ribs - down
        moments[hung, THORAX] = cross(ends[:, 0], on_ribs) - cross(high[side], down)
        forces[hung, _SACRUM] = -forces[hung, THORAX]
        moments[hung, _SACRUM] = -moments[hung, THORAX]
        return along


def _unit(ways: Array) -> Array:
    """(K, 3) of length 1."""
    found: Array = ways / np.sqrt(np.einsum("ki,ki->k", ways, ways))[:, None]
    return found


def _bars(trunk: Trunk, chosen: NDArray[np.bool_], rule: Standoff) -> Bars:
    """Bars of the chosen muscles, each on a vertebra between the ends of a leg.

    A bar stands at the height of the vertebra's centre, as far to the side as the string, and
    behind the centre across the spine. Vertebrae that an end is fixed to are not passed, but those
    of the thorax, of which there are several, are where they lie below its point.
    """
    # legs (rows): whose they are, and where each starts, runs and ends
    muscles = trunk.muscles
    owner, leg = np.nonzero(chosen[:, None] & (muscles.body[:, 1:] != NO_BODY))
    ends, start = muscles.body[owner, leg], muscles.point[owner, leg]
    others, way = muscles.body[owner, leg + 1], muscles.point[owner, leg + 1] - start
    low, high = np.minimum(ends, others)[:, None], np.maximum(ends, others)[:, None]
    # all legs against all vertebrae (columns): how far up a leg each centre lies
    of = np.array([body_of(name) for name in SLICES])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (trunk.vertebrae[:, 1] - start[:, 1:2]) / way[:, 1:2]
    between = (low < of) & (of < high) | (of == high) & (of == THORAX) & (low != THORAX)
    row, number = np.nonzero(between & (share > 0.0) & (share < 1.0))
    # in order along each muscle
    share = share[row, number]
    order = np.lexsort((share, row))
    row, number, share = row[order], number[order], share[order]
    # as far behind the centre as the rule says of how far the string is
    string = start[row] + share[:, None] * way[row]
    centres = trunk.vertebrae
    centre, back = centres[number], backwards(centres)[number]
    distance = np.einsum("bi,bi->b", string - centre, back)
    at = centre + np.maximum(rule.share * distance, rule.least_m)[:, None] * back
    at[:, 2] += string[:, 2]
    return Bars(np.searchsorted(owner[row], np.arange(len(muscles) + 1)), leg[row], of[number], at)

"""Short extensors that a source of the lumbar spine lacks above L1: its multifidus, repeated.

MyoTorso's thorax is one body, so nothing there joins T11 to T12, and its multifidus ends at L1. The
trunk here bends at T11T12 and T12L1 and needs what bends them: real multifidus goes on upwards
level by level. The fascicles of L1 are repeated for T12 and T11, each point as it lies on its
vertebra, one and two levels up. Those that run on to the sacrum cannot go up with the others: their
cross-section goes to the longest that can, so that every level has as much of it as L1.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.muscles.fascicles import Fascicle
from spinepipe.muscles.trunk import BODIES

_SACRUM, _L1 = 0, BODIES.index("L1")


def multifidus_above_l1(
    fascicles: Sequence[Fascicle], joints: Array, tilts: Array
) -> tuple[list[Fascicle], str]:
    """The repeated fascicles, and a remark that says how many and how large.

    Parameters
    ----------
    joints : (7, 3) m, centres from L5S1 up. tilts : (7,) rad, extension of the vertebrae L5 to T11.
    """
    mine = [one for one in fascicles if one.group == "multifidus" and max(one.body) == _L1]
    found = []
    for body in range(_L1 + 1, len(BODIES)):
        for side in ("right", "left"):
            of_side = [one for one in mine if one.side == side]
            found += _raised(of_side, body - _L1, joints, tilts)
    area = 1e6 * sum(one.pcsa for one in found)
    remark = (
        f"the source's multifidus ends at L1 and nothing short spans T11T12: {len(found)} "
        f"fascicles of L1 are repeated for T12 and T11, {area:.0f} mm2 in all"
    )
    return found, remark


def _raised(mine: list[Fascicle], by: int, joints: Array, tilts: Array) -> list[Fascicle]:
    """Fascicles of one side, so many levels up; what ends on the sacrum is added to the longest."""
    short = [one for one in mine if min(one.body) > _SACRUM]
    longest = min(short, key=lambda one: min(one.body))
    rest = sum(one.pcsa for one in mine if min(one.body) == _SACRUM)
    return [
        replace(
            one,
            name=f"{one.name[:-2]}_at_{BODIES[_L1 + by]}{one.name[-2:]}",
            pcsa=one.pcsa + (rest if one is longest else 0.0),
            body=tuple(body + by for body in one.body),
            point=np.array(
                [
                    _moved(point, body, body + by, joints, tilts)
                    for body, point in zip(one.body, one.point, strict=True)
                ]
            ),
        )
        for one in short
    ]


def _moved(point: Array, body: int, to: int, joints: Array, tilts: Array) -> Array:
    """A point of a vertebra where it lies on another one, as seen from the joint below."""
    turn = rotation_zxy(tilts[to - 1] - tilts[body - 1], 0.0, 0.0)
    found: Array = joints[to - 1] + turn @ (point - joints[body - 1])
    return found

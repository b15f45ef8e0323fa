"""A made-up trunk as a cohort brings one: joints, muscles, bodies. Round numbers, nobody's.

Three muscles a side cross each joint from S1 to T11, behind it, before it and beside it, and three
a side run from the pelvis to the ribs.
"""

from itertools import pairwise

CHAIN = ("S1", "L5", "L4", "L3", "L2", "L1", *(f"T{n}" for n in range(12, 0, -1)))

MUSCLED = CHAIN[:8]
"""Up to T11, with which all above moves."""

LEVEL_MM = (34.0, 36.0, 36.0, 36.0, 34.0, 31.0, 28.0, *(24.0,) * 9, 20.0)
"""From each joint to the next one above."""

BESIDE = {
    "multifidus": (-45.0, 12.0, 300),
    "psoas": (25.0, 35.0, 450),
    "quadratus_lumborum": (-10.0, 70.0, 150),
}
"""Group: mm ahead of the spine, mm to the side, cross-section in mm2."""

LONG = {
    "longissimus_thoracis": ((-60.0, 30.0), (-65.0, 45.0), 1000),
    "external_oblique": ((40.0, 115.0), (20.0, 120.0), 800),
    "rectus_abdominis": ((75.0, 15.0), (70.0, 40.0), 600),
}
"""Group: ahead and beside at the pelvis, the same at the ribs, cross-section."""

SIDES = {"right": 1.0, "left": -1.0}

FRAMED = ("L3", 70.0)
"""A body whose points are told in a frame of its own, which lies so many mm above ground's."""

Table = list[list[str]]


def tables(specimens: tuple[str, ...]) -> dict[str, Table]:
    """Joints, muscles and their parameters, and the frames of bodies."""
    return {
        "joints": _joints(specimens),
        "muscles": _points(),
        "muscle_parameters": _parameters(),
        "body_frames": _frames(specimens),
    }


def _joints(specimens: tuple[str, ...]) -> Table:
    rows = ["specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"]
    for who in specimens:
        for (lower, upper), y in zip(pairwise(CHAIN), _heights(), strict=True):
            rows.append(f"{who},{upper}{lower},0,{y:g},0,0,0,0")
    return [row.split(",") for row in rows]


def _heights() -> list[float]:
    """Of joints, mm, from L5S1 up."""
    return [sum(LEVEL_MM[:k]) for k in range(len(CHAIN) - 1)]


def _points() -> Table:
    rows = ["muscle,point,body,x_mm,y_mm,z_mm"]
    heights = _heights()
    for side, sign in SIDES.items():
        for (lower, upper), y in zip(pairwise(MUSCLED), heights, strict=False):
            for group, (x, z, _) in BESIDE.items():
                for point, (body, at) in enumerate(((lower, y - 15.0), (upper, y + 15.0))):
                    own = at - FRAMED[1] * (body == FRAMED[0])
                    rows.append(f"{group}_{upper}_{side},{point},{body},{x:g},{own:g},{sign * z:g}")
        for group, (low, high, _) in LONG.items():
            name = f"{group}_{side}"
            rows.append(f"{name},0,pelvis,{low[0]:g},-20,{sign * low[1]:g}")
            rows.append(f"{name},1,T11,{high[0]:g},{heights[7] + 10:g},{sign * high[1]:g}")
    return [row.split(",") for row in rows]


def _parameters() -> Table:
    rows = ["muscle,group,side,pcsa_mm2,optimal_fibre_length_mm"]
    for side in SIDES:
        for upper in MUSCLED[1:]:
            rows += [f"{g}_{upper}_{side},{g},{side},{b[2]},60" for g, b in BESIDE.items()]
        rows += [f"{g}_{side},{g},{side},{ends[2]},150" for g, ends in LONG.items()]
    return [row.split(",") for row in rows]


def _frames(specimens: tuple[str, ...]) -> Table:
    rows = [
        "specimen,body,carried_by,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"
    ]
    for who in specimens:
        for body in ("pelvis", *CHAIN):
            carrier = "S1" if body == "pelvis" else body
            up = FRAMED[1] if body == FRAMED[0] else 0
            rows.append(f"{who},{body},{carrier},0,{up:g},0,0,0,0")
    return [row.split(",") for row in rows]

"""The marker set Plug-in-Gait above the legs: names, and what its markers tell of a person.

Vicon's manual says where they are placed: on the pelvis over both anterior and posterior superior
iliac spines (ASI, PSI); on the thorax over C7, T10, the jugular notch (CLAV), the xiphoid (STRN)
and the right shoulder blade (RBAK); four around the head; on each arm over the acromion (SHO), the
outer epicondyle (ELB), both styloids (WRA, WRB) and the knuckle of the second finger (FIN).

`PLACES` are rough: they tell names that are exchanged, and no motion. Where joints are inside,
regressions tell that were made for these landmarks (`facts.csv`): the centre of L5S1 by the width
of the pelvis, that of the shoulder by the depth of the thorax.
"""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from spinepipe.anatomy.segments import CENTRE, Sex, length_m
from spinepipe.effects.contract import Array
from spinepipe.facts import several
from spinepipe.muscles.subject import Subject

Places = Mapping[str, Array]
"""Places (..., 3) m of markers in ground by their names in the set."""

PELVIS = ("LASI", "RASI", "LPSI", "RPSI")
THORAX = ("C7", "T10", "CLAV", "STRN", "RBAK")
HEAD = ("LFHD", "RFHD", "LBHD", "RBHD")
ARMS = tuple(side + name for side in "LR" for name in ("SHO", "ELB", "WRA", "WRB", "FIN"))

NEEDED = (*PELVIS, "C7", "T10", "CLAV", "STRN", *HEAD, *ARMS)
"""RBAK tells left from right where markers are looked at; it may be left out."""

PLACES = several(__name__, "plug_in_gait_place")
"""Where markers of the trunk are on somebody who stands, of body height from L5S1."""

L5S1_OF_WIDTH = several(__name__, "lumbosacral_over_pelvis_width")
"""Forwards and up from the middle between both anterior spines, by sex."""

SHOULDER_OF_DEPTH = several(__name__, "shoulder_over_thorax_depth")[""]
"""Distance from the acromion over that from C7 to the jugular notch, and its angle to that line."""


def marker_places(names: Sequence[str]) -> dict[str, int]:
    """Place of each marker of the set among the names of a file, those that are found.

    Case, blanks, hyphens and underscores do not count, nor what stands before the name with a
    colon or an underscore, as `Anna:LASI` or `subject_lasi`. The exact name goes first.
    """
    spellings = (
        list(names),
        [re.sub(r"[\W_]", "", text).upper() for text in names],
        [re.split(r"[:_.]", text)[-1].strip().upper() for text in names],
    )
    found = {}
    for name in (*NEEDED, "RBAK"):
        fits = [one.index(name) for one in spellings if one.count(name) == 1]
        if fits:
            found[name] = fits[0]
    return found


def pelvis_axes(at: Places) -> Array:
    """(..., 3, 3) axes of the pelvis in columns: forwards, up, right (Wu 2002).

    To the right along both anterior spines; forwards in the plane of these and the middle between
    the posterior ones.
    """
    across = at["RASI"] - at["LASI"]
    middle = 0.5 * (at["LPSI"] + at["RPSI"])
    up = np.cross(at["RASI"] - middle, at["LASI"] - middle)
    axes = np.stack([np.cross(up, across), up, across], axis=-1)
    found: Array = axes / np.linalg.norm(axes, axis=-2, keepdims=True)
    return found


def l5s1_centre(at: Places, sex: Sex) -> Array:
    """(..., 3) m, centre of L5S1 of a person standing (Dumas and Wojtusch 2018)."""
    forwards, up = L5S1_OF_WIDTH[sex]
    width = np.linalg.norm(at["RASI"] - at["LASI"], axis=-1)
    axes = pelvis_axes(at)
    leg = forwards * axes[..., :, 0] + up * axes[..., :, 1]
    found: Array = 0.5 * (at["RASI"] + at["LASI"]) + width[..., None] * leg
    return found


def shoulder_centres(at: Places) -> dict[str, Array]:
    """(..., 3) m, centres of both shoulders (Reed 1999), by the first letter of the side.

    From each acromion in the plane of C7, T10 and the jugular notch.
    """
    share, angle = SHOULDER_OF_DEPTH
    deep = at["CLAV"] - at["C7"]
    depth = np.linalg.norm(deep, axis=-1, keepdims=True)
    ahead = deep / depth
    up = at["C7"] - at["T10"]
    up = up - np.einsum("...i,...i->...", up, ahead)[..., None] * ahead
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    leg = share * depth * (np.cos(angle) * ahead + np.sin(angle) * up)
    return {side: at[f"{side}SHO"] + leg for side in "LR"}


def head_centre(at: Places, subject: Subject) -> Array:
    """(..., 3) m, centre of mass of head and neck of a person standing.

    Its height is de Leva's share of the way from the vertex to C7; forwards and sideways it is in
    the middle of the band.
    """
    length = length_m("head", subject.sex, subject.height_m)
    middle = np.mean([at[name] for name in HEAD], axis=0)
    middle[..., 1] = at["C7"][..., 1] + (1.0 - CENTRE[f"head {subject.sex}"]) * length
    found: Array = middle
    return found

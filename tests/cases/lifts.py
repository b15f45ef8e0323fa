"""The measured lifts of the repository, and a person whose markers move as one rigid body."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.motion.plug_in_gait import PLACES
from spinepipe.motion.standing_spine import StandingSpine, usual_spine
from spinepipe.muscles.myo_sim import source_of_myo_sim
from spinepipe.muscles.subject import Subject
from spinepipe.studies.registry import every_form

FOLDER = Path(__file__).resolve().parents[2] / "config" / "cohorts" / "stoop_lift"
TRIALS = ("lift1", "lift2", "lift3")
MAN = Subject("male", 35.0, 1.73, 81.68)

MIRROR = np.array([1.0, 1.0, -1.0])

_HEAD = {"FHD": (0.067, 0.376, 0.022), "BHD": (-0.019, 0.373, 0.021)}
_ARM = {
    "ELB": (0.01, 0.06, 0.15),
    "WRA": (0.09, -0.08, 0.14),
    "WRB": (0.07, -0.09, 0.15),
    "FIN": (0.11, -0.12, 0.14),
}


@cache
def lifts() -> Cohort:
    return cohorts.read(FOLDER, every_form())


@cache
def spine() -> StandingSpine:
    return usual_spine(MAN, source_of_myo_sim().trunk)


def stance() -> dict[str, Array]:
    """All markers of the set on a man who stands, both sides alike, L5S1 near (0, 1, 0)."""
    places = {name: np.array(at) for name, at in PLACES.items()}
    for part, at in (_HEAD | _ARM).items():
        places |= {f"R{part}": np.array(at), f"L{part}": np.array(at) * MIRROR}
    return {name: MAN.height_m * at + [0.0, 1.0, 0.0] for name, at in places.items()}


def mirrored(places: dict[str, Array]) -> dict[str, Array]:
    """Left and right exchanged, names too; RBAK, which has no partner, is left out."""
    other = {"L": "R", "R": "L"}
    return {
        (other[name[0]] + name[1:] if name[0] in other else name): at * MIRROR
        for name, at in places.items()
        if name != "RBAK"
    }


def mirrored_spine(one: StandingSpine) -> StandingSpine:
    """A spine whose slices lie on the other side."""
    flip = np.diag(MIRROR)
    slices = tuple(
        replace(part, com=part.com * MIRROR, about_com=flip @ part.about_com @ flip)
        for part in one.slices
    )
    return replace(one, joints=one.joints * MIRROR, slices=slices)

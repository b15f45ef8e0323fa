"""Is a recorded trial what its row says: unit, axes, which way the trunk goes, and how far?"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.motion.marker_groups import rigid_rotations
from spinepipe.motion.reading import axes_of
from spinepipe.problems import InputProblem
from spinepipe.studies.checks_of_markers import LoadedTrial, marker_problems
from spinepipe.studies.recordings import MOVING, STANCE
from spinepipe.units import DEG_PER_RAD

LIKE_THE_SET = (0.4, 2.5)
"""Size of a cloud of markers over that of the set in the neutral pose: a child to a giant."""

MISTAKEN = {1000.0: ("mm", "m"), 10.0: ("mm", "cm"), 0.001: ("m", "mm"), 0.1: ("cm", "mm")}
"""By how large all comes out: the unit that numbers are in, and the one that the file tells."""

UPRIGHT_DEG = {True: 45.0, False: 75.0}
"""How far a trunk leans at most where a trial begins: of a stance, and of a motion."""

LEAST_DEG = 10.0
"""A motion that turns T1 less against the pelvis is cut off, or none (Wang 2021)."""

OUTDONE = 1.5
"""How many times as far another rotation goes, where a trial has another's name."""

ENOUGH = 3
"""Markers that tell how a part is turned."""

_LETTERS = np.array(["x", "y", "z"])


def motion_problems(look: LoadedTrial) -> Iterator[InputProblem]:
    """Everything that is wrong with a trial; wrong units or axes hide the rest."""
    size = _size(look)
    if size is not None and not LIKE_THE_SET[0] < size < LIKE_THE_SET[1]:
        # the nearest unit that is often mistaken
        nearest = min(MISTAKEN, key=lambda factor: abs(np.log(size / factor)))
        remedy = "check names and units of file and set"
        if LIKE_THE_SET[0] < size / nearest < LIKE_THE_SET[1]:
            held, told = MISTAKEN[nearest]
            remedy = f"is it in {held} and says {told}? or is {look.set} not in mm?"
        times = f"{size:.{0 if size >= 1 else 4}f} times"
        allowed = f"{LIKE_THE_SET[0]:g} to {LIKE_THE_SET[1]:g} times"
        wrong = f"markers spread {times} as far as in {look.set}"
        yield look.in_motion(None, wrong, allowed, remedy)
        return
    if (fault := _upright(look)) is not None:
        yield fault
        return
    found = list(marker_problems(look))
    yield from found
    if look.trial.kind != STANCE and not any("swapped" in p.found for p in found):
        yield from _cut_off_or_misnamed(look)


def _size(look: LoadedTrial) -> float | None:
    """Spread of the markers in sight over that of the set, at rest; None: fewer than three."""
    frame = int(np.argmax(look.trial.seen.sum(axis=1)))
    seen = look.trial.seen[frame]
    if seen.sum() < ENOUGH:
        return None
    clouds = (look.trial.places[frame, seen], look.neutral[seen])
    found, wanted = (float(np.linalg.norm(cloud - cloud.mean(axis=0))) for cloud in clouds)
    return found / wanted if wanted > 0.0 else None


def _upright(look: LoadedTrial) -> InputProblem | None:
    """What is wrong where the trunk does not stand along ground's y as the trial begins."""
    rotations, told = look.turned
    if not told.any():
        return None
    turn = rotations[int(np.argmax(told))]
    lean = DEG_PER_RAD * float(np.arccos(np.clip(turn[1, 1], -1.0, 1.0)))
    limit = UPRIGHT_DEG[look.trial.kind == STANCE]
    if lean <= limit:
        return None
    found = f"'{look.axes}', and the trunk is {lean:.0f} deg off upright as it begins"
    remedy = f"check which axis of the file is up; did you mean '{better_axes(look.axes, turn)}'?"
    return look.in_table("axes", found, f"at most {limit:g} deg", remedy)


def better_axes(axes: str, turn: Array) -> str:
    """Axes with which the markers would stand as in the set, to the nearest right angle."""
    # a signed permutation: the largest entry left, then none of its row and column
    nearest = np.zeros((3, 3))
    left = np.abs(turn)
    for _ in range(3):
        row, column = np.unravel_index(int(np.argmax(left)), left.shape)
        nearest[row, column] = np.sign(turn[row, column])
        left[row, :] = left[:, column] = -1.0
    wanted = nearest.T @ axes_of(axes)
    places = np.abs(wanted).argmax(axis=1)
    signs = ["-" if wanted[k, place] < 0.0 else "" for k, place in enumerate(places)]
    return " ".join(sign + letter for sign, letter in zip(signs, _LETTERS[places], strict=True))


def _cut_off_or_misnamed(look: LoadedTrial) -> Iterator[InputProblem]:
    """A motion that is cut off, or has another's name."""
    ranges = trunk_rotation_deg(look)
    if ranges is None:
        return
    farthest = int(np.argmax(ranges))
    own = float(ranges[MOVING.index(look.trial.kind)])
    if ranges[farthest] < LEAST_DEG:
        when = look.frames(0, len(look.trial.time_s) - 1)
        found = f"T1 turns {ranges[farthest]:.1f} deg against the pelvis in {when}"
        remedy = "the motion is cut off: check start_s and end_s, or leave the trial out"
        yield look.in_table("start_s", found, f"at least {LEAST_DEG:g} deg", remedy)
    elif ranges[farthest] > OUTDONE * own:
        found = (
            f"{look.trial.kind} of {own:.0f} deg, while {MOVING[farthest]} goes through "
            f"{ranges[farthest]:.0f} deg"
        )
        allowed = "the kind whose rotation goes farthest"
        yield look.in_table("kind", found, allowed, f"did you mean '{MOVING[farthest]}'?")


def trunk_rotation_deg(look: LoadedTrial) -> Array | None:
    """(3,) deg, how far the top turns against the bottom, in the order of `MOVING`.

    None where markers do not tell how either is turned.
    """
    bottom, top = (_group(look, from_top) for from_top in (False, True))
    if bottom is None or top is None:
        return None
    (low, low_told), (high, high_told) = (
        rigid_rotations(look.neutral[group], look.trial.places[:, group], look.trial.seen[:, group])
        for group in (bottom, top)
    )
    told = low_told & high_told
    if not told.any():
        return None
    against = np.einsum("fji,fjk->fik", low[told], high[told])
    found: Array = DEG_PER_RAD * np.ptp(zxy_angles(against), axis=0)
    return found


def _group(look: LoadedTrial, from_top: bool) -> NDArray[np.int64] | None:
    """Markers of as few bodies as have enough, from the lowest up or from the highest down."""
    bodies = sorted(set(look.markers.body.tolist()), reverse=from_top)
    for count in range(1, len(bodies) // 2 + 1):
        group = np.flatnonzero(np.isin(look.markers.body, bodies[:count]))
        if len(group) >= ENOUGH:
            return group
    return None

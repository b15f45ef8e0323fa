"""Rows of the tables of a made-up cohort: what is told of persons, and what is true of them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.generators.tracking.laws import (
    TRANSLATION_N_PER_M,
    Array,
    exponentials,
    stiffness,
)
from tests.generators.tracking.moved import Motion
from tests.generators.tracking.person import BODIES, JOINTS, Person
from tests.generators.tracking.seen import Told, Worn

Row = dict[str, Any]
TRUE_FRAMES = 21
TOLD_AT_NM = 3.0

_PLACE = ("x_mm", "y_mm", "z_mm")
_TURN = ("extension_deg", "right_bending_deg", "left_rotation_deg")
_INERTIA = ("ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "ixy_kg_m2", "ixz_kg_m2", "iyz_kg_m2")
FILES: dict[str, Sequence[str]] = {
    "specimens": ("specimen",),
    "subjects": ("specimen", "sex", "age_years", "height_cm", "mass_kg"),
    "joints": ("specimen", "joint", *_PLACE, *_TURN),
    "bodies": ("specimen", "vertebra", "mass_kg", "com_x_mm", "com_y_mm", "com_z_mm", *_INERTIA),
    "marker_set": ("specimen", "marker", "vertebra", *_PLACE, "weight", "cluster"),
    "trials": ("specimen", "trial", "kind", "file", "start_s", "end_s", "axes", "arms"),
    "centres": ("specimen", "vertebra", *_PLACE),
    "truth_centres": ("specimen", "trial", "time_s", "vertebra", *_PLACE, *_TURN),
    "hidden/truth": (
        "specimen",
        "joint",
        "coordinate",
        "side",
        "at_rest_nm_per_rad",
        "at_3_nm_nm_per_rad",
    ),
}
"""Columns of each file."""

PASSIVE = ("joint", "coordinate", "side", "a", "b", "lower", "upper", "source", "status")
_SIDES = ("positive", "negative")
_TURNING = ("extension", "right_bending", "left_rotation")
_MOVING = ("anterior", "superior", "right")
_HARDLY_PER_MM = 1e-3
"""B of translations, which resist straight."""


def told_rows(name: str, person: Person, known: Told, markers: Worn) -> Iterator[tuple[str, Row]]:
    """Rows of a person, each with the name of its table."""
    about = {"sex": person.sex, "age_years": round(person.age_years)}
    size = {"height_cm": _short(100.0 * person.height_m, 1), "mass_kg": _short(person.mass_kg, 1)}
    found: list[tuple[str, Row]] = [("specimens", {}), ("subjects", {**about, **size})]
    for k, joint in enumerate(JOINTS):
        angles = Rotation.from_matrix(known.turns[k]).as_euler("ZXY", degrees=True)
        found.append(("joints", {"joint": joint, **_at(known.places[k]), **_turned(angles)}))
    for k, body in enumerate(BODIES):
        found.append(("bodies", _body(known, k)))
        found.append(("centres", {"vertebra": body, **_at(_centre(person, k))}))
    for k, marker in enumerate(markers.names):
        on = {"marker": marker, "vertebra": BODIES[int(markers.body[k])]}
        counts = {"weight": 1, "cluster": markers.cluster[k]}
        found.append(("marker_set", {**on, **_at(markers.told[k]), **counts}))
    for table, row in found:
        yield table, {"specimen": name, **row}


def _body(known: Told, k: int) -> Row:
    about = known.about[k]
    each = [about[0, 0], about[1, 1], about[2, 2], about[0, 1], about[0, 2], about[1, 2]]
    return {
        "vertebra": BODIES[k],
        "mass_kg": _short(known.kg[k], 4),
        **{f"com_{axis}": value for axis, value in _at(known.com[k]).items()},
        **{key: _short(value, 7) for key, value in zip(_INERTIA, each, strict=True)},
    }


def _centre(person: Person, body: int) -> Array:
    """(3,) m, half way to the joint above; of T1 and the pelvis a little above the joint."""
    above = person.steps[body] if 0 < body < 17 else np.array([0.0, 0.018, 0.0])
    found: Array = 0.5 * above
    return found


def true_places(name: str, kind: str, person: Person, motion: Motion) -> Iterator[Row]:
    """Vertebral centres and turns in ground, at some frames."""
    frames = np.unique(np.linspace(0, len(motion.time_s) - 1, TRUE_FRAMES).astype(int))
    for frame in frames:
        turns = Rotation.from_matrix(motion.turns[frame]).as_euler("ZXY", degrees=True)
        for k, body in enumerate(BODIES):
            at = motion.places[frame, k] + motion.turns[frame, k] @ _centre(person, k)
            when = {"time_s": _short(motion.time_s[frame], 3), "vertebra": body}
            yield {"specimen": name, "trial": kind, **when, **_at(at), **_turned(turns[k])}


def true_stiffness(name: str, person: Person) -> Iterator[Row]:
    """Of rotations, at rest and at a load."""
    rest, loaded = (stiffness(person.curves_nm, moment) for moment in (0.0, TOLD_AT_NM))
    for level, axis, side in np.ndindex(rest.shape):
        yield {
            "specimen": name,
            "joint": JOINTS[level],
            "coordinate": _TURNING[axis],
            "side": _SIDES[side],
            "at_rest_nm_per_rad": _short(rest[level, axis, side], 2),
            "at_3_nm_nm_per_rad": _short(loaded[level, axis, side], 2),
        }


def true_passive(seed: int) -> Iterator[Row]:
    """Law of the control: N, N m; 1/mm, 1/deg."""
    sizes, rates = exponentials(seed)
    for level, joint in enumerate(JOINTS):
        for axis, side in np.ndindex(3, 2):
            straight = 1e-3 * TRANSLATION_N_PER_M[axis] / _HARDLY_PER_MM
            yield _element(joint, _MOVING[axis], side, straight, _HARDLY_PER_MM)
        for axis, side in np.ndindex(3, 2):
            rate = np.deg2rad(rates[level, axis, side])
            yield _element(joint, _TURNING[axis], side, sizes[level, axis, side], rate)


def _element(joint: str, coordinate: str, side: int, a: float, b: float) -> Row:
    row: Row = {"joint": joint, "coordinate": coordinate, "side": _SIDES[side]}
    row |= {"a": f"{a:.8g}", "b": f"{b:.8g}", "lower": "0.5", "upper": "2"}
    return row | {"source": "made up: the truth of these people", "status": "choice"}


def _at(place: Array) -> dict[str, str]:
    return {key: _short(1e3 * value, 3) for key, value in zip(_PLACE, place, strict=True)}


def _turned(angles: Array) -> dict[str, str]:
    return {key: _short(value, 4) for key, value in zip(_TURN, angles, strict=True)}


def _short(value: float, digits: int) -> str:
    return f"{round(float(value), digits) + 0.0:.{digits}f}"

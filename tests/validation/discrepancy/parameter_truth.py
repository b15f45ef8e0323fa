"""The generator's parameters in the words and definitions of spinepipe's effects, SI.

Each function takes a hidden effect and returns values by parameter name. Where definitions differ
the map is exact: a share that is lost against a ratio that is left, growth g = rate^2 of tangent
and cubic, relaxation at constant motion against retardation at constant load. Without counterpart,
and left out: a follower load or weight of another form, one misalignment for all tests (ours turns
about axes that depend on the test; by test it is the same), marker offsets, forms of another
coordinate or shape. Widths over which spinepipe rounds corners are no parameters.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

Hidden = Mapping[str, Any]
Options = Mapping[str, Any]
Values = dict[str, float]

AXES = {
    "flexion_extension": 2,
    "flexion": 2,
    "extension": 2,
    "lateral_bending": 0,
    "right_bending": 0,
    "left_bending": 0,
    "axial_rotation": 1,
    "left_rotation": 1,
    "right_rotation": 1,
}
"""Ground axis of a test's moment, x y z."""


def _stiffening(hidden: Hidden, options: Options) -> Values | None:
    if options["shape"] != hidden["shape"]["shape"]:
        return None
    rate = hidden["strength"]
    return {"rate": rate} if options["shape"] == "exponential" else {"growth": rate**2}


def _neutral_zone(hidden: Hidden, options: Options) -> Values | None:
    width = hidden["shape"]["half_width_rad"]
    return {"stiffness_ratio": 1.0 - hidden["strength"], "width": width}


def _asymmetry(hidden: Hidden, options: Options) -> Values | None:
    return {"asymmetry": hidden["shape"]["sign"] * hidden["strength"]}


def _coupling(hidden: Hidden, options: Options) -> Values | None:
    if set(options["pair"]) != {"right_bending", "left_rotation"}:
        return None
    return {"coupling": hidden["shape"]["sign"] * hidden["strength"]}


def _facet(hidden: Hidden, options: Options) -> Values | None:
    if options["side"] != ("positive" if hidden["shape"]["side"] > 0 else "negative"):
        return None
    return {"stiffness": hidden["strength"], "gap": hidden["shape"]["gap_rad"]}


def _laxity(hidden: Hidden, options: Options) -> Values | None:
    return {"fraction": hidden["strength"]}


def _preload(hidden: Hidden, options: Options) -> Values | None:
    return {"rise": hidden["strength"]}


def _hysteresis(hidden: Hidden, options: Options) -> Values | None:
    return {"moment": hidden["strength"], "yield_angle": hidden["shape"]["width_rad"]}


def _creep(hidden: Hidden, options: Options) -> Values | None:
    """Compliance grows by f over time T; stiffness falls by f / (1 + f) over T / (1 + f)."""
    grown = 1.0 + hidden["strength"]
    time = hidden["shape"]["time_s"] / grown
    return {"fraction": hidden["strength"] / grown, "time": time}


def _centre(hidden: Hidden, options: Options) -> Values | None:
    vector = hidden["strength"] * np.array(hidden["shape"]["direction"])
    return dict(zip(("anterior", "superior", "right"), vector.tolist(), strict=True))


def _migration(hidden: Hidden, options: Options) -> Values | None:
    vector = hidden["strength"] * np.array(hidden["shape"]["direction"])
    return {"anterior": float(vector[0]), "superior": float(vector[1])}


def _weight(hidden: Hidden, options: Options) -> Values | None:
    return {"mass": hidden["strength"]} if options["where"] == "each" else None


def _follower(hidden: Hidden, options: Options) -> Values | None:
    return {"force": hidden["strength"]} if options["guides"] == "centres" else None


def _offset(hidden: Hidden, options: Options) -> Values | None:
    moment = hidden["strength"] * np.array(hidden["shape"]["axis"])
    return {f"moment_{axis}": float(one) for axis, one in zip("xyz", moment, strict=True)}


def _marker(hidden: Hidden, options: Options) -> Values | None:
    """A tilt as Z-X'-Y'' angles."""
    if options["form"] != "tilt":
        return None
    turn = Rotation.from_rotvec(hidden["strength"] * np.array(hidden["shape"]["axis"]))
    names = ("tilt_extension", "tilt_right_bending", "tilt_left_rotation")
    return dict(zip(names, turn.as_euler("ZXY").tolist(), strict=True))


def tilts(hidden: Hidden, test: str) -> Values:
    """Two tilts of a test's moment: first about the axis after the next, then about the next."""
    turn = Rotation.from_rotvec(hidden["strength"] * np.array(hidden["shape"]["axis"]))
    main = AXES[test.removesuffix("_preloaded")]
    turned = turn.apply(np.eye(3)[main])
    along, first, second = (turned[(main + k) % 3] for k in range(3))
    return {"tilt_1": float(np.arctan2(-second, along)), "tilt_2": float(np.arcsin(first))}


TRUTHS: dict[str, Callable[[Hidden, Options], Values | None]] = {
    "nonlinear_stiffening": _stiffening,
    "neutral_zone": _neutral_zone,
    "flexion_extension_asymmetry": _asymmetry,
    "bending_rotation_coupling": _coupling,
    "facet_contact": _facet,
    "local_laxity": _laxity,
    "preload_stiffening": _preload,
    "hysteresis": _hysteresis,
    "creep": _creep,
    "joint_centre_offset": _centre,
    "joint_centre_migration": _migration,
    "segment_weight": _weight,
    "follower_load": _follower,
    "load_offset": _offset,
    "marker_bias": _marker,
}
"""All but level_dependence and load_misalignment, whose values differ by joint and by test."""

VECTORS = (
    "joint_centre_offset",
    "joint_centre_migration",
    "load_offset",
    "marker_bias",
    "load_misalignment",
)
"""Effects whose parameters are components: errors count against the length of the vector."""


def levels(hidden: Hidden) -> list[float]:
    """Ratio of each joint to the geometric mean of all."""
    return [float(np.exp(hidden["strength"] * step)) for step in hidden["shape"]["pattern"]]

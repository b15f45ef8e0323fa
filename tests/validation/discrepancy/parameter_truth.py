"""The generator's parameters in the words and definitions of spinepipe's effects, SI.

Each function takes a hidden effect and returns values by parameter name. Where definitions differ
the map is exact: a share that is lost against a ratio that is left, growth g = rate^2 of tangent
and cubic, relaxation at constant motion against retardation at constant load. Without counterpart,
and left out: formulas that spinepipe does not have, a follower load or weight of another form, one
misalignment for all tests (ours turns about axes that depend on the test; by test it is the same),
marker offsets, forms of another coordinate or shape. Widths over which spinepipe rounds corners are
no parameters.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.units import TRANSLATIONS

Hidden = Mapping[str, Any]
Options = Mapping[str, Any]
Values = dict[str, float]

FACET_REFERENCE = {"rad": float(np.deg2rad(2.0)), "m": 5e-4}
"""How far beyond the gap spinepipe states the stiffness of a stop."""

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


def formula(hidden: Hidden, usual: str) -> str:
    """The formula of a hidden effect."""
    return str(hidden["shape"].get("formula", usual))


def _stiffening(hidden: Hidden, options: Options) -> Values | None:
    named, rate = formula(hidden, "exponential"), hidden["strength"]
    if options["shape"] != named:
        return None
    if named == "bilinear":
        knee = hidden["shape"]["knee"]
        return {"gain": 1.0 / knee, "break_at": knee / rate}
    return {"rate": rate} if named == "exponential" else {"growth": rate**2}


def _neutral_zone(hidden: Hidden, options: Options) -> Values | None:
    if formula(hidden, "corner") != "corner" or options.get("zone", "centred") != "centred":
        return None
    width = hidden["shape"]["half_width"]
    return {"stiffness_ratio": 1.0 - hidden["strength"], "width": width}


def _asymmetry(hidden: Hidden, options: Options) -> Values | None:
    if formula(hidden, "sharp") != "sharp":
        return None
    return {"asymmetry": hidden["shape"]["sign"] * hidden["strength"]}


def _coupling(hidden: Hidden, options: Options) -> Values | None:
    if set(options["pair"]) != {"right_bending", "left_rotation"}:
        return None
    if formula(hidden, "linear") != "linear":
        return None
    return {"coupling": hidden["shape"]["sign"] * hidden["strength"]}


def _facet(hidden: Hidden, options: Options) -> Values | None:
    if options["side"] != ("positive" if hidden["shape"]["side"] > 0 else "negative"):
        return None
    named, gap = formula(hidden, "linear"), hidden["shape"]["gap"]
    if named == "linear":
        return {"stiffness": hidden["strength"], "gap": gap, "exponent": 1.0}
    if named == "hertz":
        deep = FACET_REFERENCE["m" if hidden["coordinate"] in TRANSLATIONS else "rad"]
        stiffness = hidden["strength"] * np.sqrt(deep / hidden["shape"]["width"])
        return {"stiffness": float(stiffness), "gap": gap, "exponent": 1.5}
    return None


def _laxity(hidden: Hidden, options: Options) -> Values | None:
    if formula(hidden, "share") != "share":
        return None
    return {"fraction": hidden["strength"]}


def _preload(hidden: Hidden, options: Options) -> Values | None:
    return {"rise": hidden["strength"]} if formula(hidden, "linear") == "linear" else None


def _hysteresis(hidden: Hidden, options: Options) -> Values | None:
    if formula(hidden, "dahl") != "dahl" or options.get("law", "dahl") != "dahl":
        return None
    force, far = hidden["strength"], hidden["shape"]["width"]
    if hidden["coordinate"] in TRANSLATIONS:
        return {"force": force, "yield_distance": far}
    return {"moment": force, "yield_angle": far}


def _creep(hidden: Hidden, options: Options) -> Values | None:
    """Compliance grows by f over time T; stiffness falls by f / (1 + f) over T / (1 + f)."""
    if formula(hidden, "kelvin") != "kelvin":
        return None
    grown = 1.0 + hidden["strength"]
    time = hidden["shape"]["time_s"] / grown
    return {"fraction": hidden["strength"] / grown, "time": time}


def _centre(hidden: Hidden, options: Options) -> Values | None:
    vector = hidden["strength"] * np.array(hidden["shape"]["direction"])
    return dict(zip(("anterior", "superior", "right"), vector.tolist(), strict=True))


def _migration(hidden: Hidden, options: Options) -> Values | None:
    if formula(hidden, "linear") != "linear":
        return None
    vector = hidden["strength"] * np.array(hidden["shape"]["direction"])
    return {"anterior": float(vector[0]), "superior": float(vector[1])}


def _weight(hidden: Hidden, options: Options) -> Values | None:
    same = options["where"] == "each" and formula(hidden, "each") == "each"
    return {"mass": hidden["strength"]} if same else None


def _follower(hidden: Hidden, options: Options) -> Values | None:
    """Of the cable behind the joints too: it is our own family."""
    if options["guides"] != "centres":
        return None
    behind = formula(hidden, "centres") == "behind"
    return {"force": hidden["strength"], "anterior": -BEHIND_M if behind else 0.0}


BEHIND_M = 0.008
"""How far behind the centres the hidden cable runs."""


def _offset(hidden: Hidden, options: Options) -> Values | None:
    """A moment, or the force of a cable: sideways, as large as makes the moment at 0.1 m."""
    cable = formula(hidden, "moment") == "cable"
    if cable != (options.get("applies") == "force"):
        return None
    moment = hidden["strength"] * np.array(hidden["shape"]["axis"])
    if cable:
        force = np.array([-moment[2], 0.0, moment[0]]) / 0.1
        return {f"force_{name}": float(f) for name, f in zip(TRANSLATIONS, force, strict=True)}
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


def _skin(hidden: Hidden, options: Options) -> Values | None:
    if options["neighbour"] != "above" or formula(hidden, "root") != "root":
        return None
    return {"share": hidden["strength"], "reach": hidden["shape"]["reach"]}


def _pose_drift(hidden: Hidden, options: Options) -> Values | None:
    if formula(hidden, "settling") != "settling":
        return None
    drift = hidden["shape"]["sign"] * hidden["strength"]
    return {"drift": drift, "pace": hidden["shape"]["pace"]}


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
    "soft_tissue_artefact": _skin,
    "neutral_pose_drift": _pose_drift,
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
    key = "trend" if formula(hidden, "drawn") == "trend" else "pattern"
    return [float(np.exp(hidden["strength"] * step)) for step in hidden["shape"][key]]

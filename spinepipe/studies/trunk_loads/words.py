"""Tasks, uncertain inputs and simplifications in plain words, for figures and sentences."""

from spinepipe.report.words import number, plain, short
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.settings import FACTOR_UNITS, Uncertain

ENDED = {
    Balanced.BEYOND_STRENGTH.value: "beyond the strength of the model's muscles",
    Balanced.NOT_CONVERGED.value: "not converged",
    Balanced.CYCLING.value: "going to and fro between answers",
    Balanced.TWO_ANSWERS.value: "with two answers, by where the search begins",
    Balanced.OUT_OF_REACH.value: "without a posture: the arms are too short",
}
"""How tasks ended that the model does not hold."""

REFUSED = {
    "weak": "{} take more",
    "arms": "{} ask for what lever arms make at no stress",
    "reach": "{} cannot be reached",
    "unsolved": "{} did not converge",
}
"""Why pairs of body and task are refused, by count."""

INPUTS = {
    "height_cm": "body height",
    "bmi": "body mass index",
    "age_years": "age",
    "hand_anterior_mm": "hand position",
    "pelvis_extension_deg": "pelvis tilt",
    "trunk_extension_deg": "trunk lean",
    "disc_area": "disc area",
    "pcsa": "muscle area",
    "passive_rotation": "joint stiffness",
    "passive_muscle": "passive muscle force",
    "trunk_mass_ahead": "trunk mass position",
    "pressure_kpa": "abdominal pressure",
    "largest_stress_mpa": "muscle strength",
}
"""Uncertain inputs, three words at most."""

STANDING = {
    "held": "is not held",
    "strong": "takes {share:unit} of the strength",
    "toned": "needs {tone:unit} muscle tone to be stable",
    "falls": "is not stable at any muscle tone",
    "unsought": "is not stable without muscle tone",
}
"""What relaxed standing lacks."""

SIMPLIFIED = {
    "no_feedback": "leaving the spine undeformed",
    "rigid_translations": "joints that only turn",
    "only_l5s1": "balance at L5–S1 alone",
    "no_wrapping": "straight muscles",
}
"""Simplifications."""

NO_BREAK = "\u00a0"

_UNITS = {"deg": "°", "kg/m2": f"{NO_BREAK}kg/m²"}


def assumed(uncertain: Uncertain, name: str) -> str:
    """The SD that the study assumed of an input: ``±10 %``, ``±2°``."""
    sd, unit = uncertain.factors[name].sd, FACTOR_UNITS[name]  # type: ignore[index]
    if not unit:
        return f"±{100.0 * sd:g}{NO_BREAK}%"
    return f"±{sd:g}{_UNITS.get(unit, NO_BREAK + unit)}"


def task_words(name: str) -> str:
    """A task or a body in a sentence."""
    return short(plain(name), 30)


def input_words(name: str) -> str:
    """An uncertain input."""
    return INPUTS.get(name, plain(name))


def newton(value: float) -> str:
    """A force to what such a model can tell: 3 digits."""
    return f"{number(value)} N"

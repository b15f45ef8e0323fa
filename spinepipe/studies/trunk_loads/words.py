"""Tasks, inputs, simplifications and endings in plain words, for figures and findings."""

from spinepipe.report.words import fixed, number, plain
from spinepipe.status import Balanced

ENDED = {
    Balanced.BEYOND_STRENGTH.value: "beyond the strength of the muscles",
    Balanced.NOT_CONVERGED.value: "unsettled",
    Balanced.CYCLING.value: "going to and fro between answers",
    Balanced.TWO_ANSWERS.value: "with two answers, by where the search begins",
    Balanced.OUT_OF_REACH.value: "out of reach, without a posture",
}
"""How tasks ended that did not converge."""

FACTORS = {
    "height_cm": "body height",
    "bmi": "body mass index",
    "age_years": "age",
    "hand_anterior_mm": "how far ahead the hands are",
    "pelvis_extension_deg": "turn of the pelvis",
    "trunk_extension_deg": "how far the trunk leans",
    "disc_area": "area of the disc",
    "pcsa": "cross-section of muscles",
    "passive_rotation": "stiffness of joints",
    "passive_muscle": "stiffness of stretched muscles",
    "trunk_mass_ahead": "how far ahead the trunk's mass is",
    "pressure_kpa": "pressure in the belly",
    "largest_stress_mpa": "largest stress of muscles",
}
"""Uncertain inputs."""

SIMPLIFIED = {
    "no_feedback": "forces do not move the spine",
    "rigid_translations": "joints only turn",
    "only_l5s1": "balance at L5S1 alone",
    "no_wrapping": "muscles run straight",
}
"""Simplifications."""

TIERS = {
    "untuned": "nothing fitted",
    "tuned": "fitted to the counted tasks",
    "left_out": "fitted to the other counted tasks",
}
"""What was fitted before pressures were compared."""


def factor(name: str) -> str:
    """An uncertain input."""
    return FACTORS.get(name, plain(name))


def newton(value: float) -> str:
    """A force to what such a model can tell: 3 digits."""
    return f"{number(value)} N"


def mpa(value: float) -> str:
    """A pressure."""
    return f"{fixed(value)} MPa"


def unbroken(sentence: str) -> str:
    """A sentence in which no line ends between a number and its percent sign."""
    return sentence.replace(" %", "\u00a0%")

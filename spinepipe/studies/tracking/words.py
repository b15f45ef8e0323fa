"""Approaches, measures, regions and verdicts in plain words, for figures and findings."""

from collections.abc import Iterable

from spinepipe.report.words import capital, number, plain
from spinepipe.studies.tracking.settings import APPROACHES, CONSTRAINED
from spinepipe.studies.tracking.tables import MEASURES

SHORT = {
    "ik": "inverse kinematics",
    "ik_smooth": "smooth, no dynamics",
    "ik_springs": "springs, frame by frame",
    "optk_zero": "dynamics, no passive elements",
    "optk_generic": "dynamics, generic",
    "optk_generic_lower": "dynamics, generic lower",
    "optk_generic_upper": "dynamics, generic upper",
    "optk_calibrated": "dynamics, calibrated",
    "optk_from_flexion": "dynamics, from flexion",
    "optk_from_bending": "dynamics, from bending",
    "optk_from_both": "dynamics, from both",
}
"""Approaches, short enough to stand beside an axis."""

PHRASES = {
    "ik": "inverse kinematics",
    "ik_smooth": "smooth curves without dynamics",
    "ik_springs": "inverse kinematics with springs",
    "optk_zero": "dynamics without passive elements",
    "optk_generic": "dynamics with generic passive elements",
    "optk_generic_lower": "dynamics with passive elements at the lower end of the generic range",
    "optk_generic_upper": "dynamics with passive elements at the upper end of the generic range",
    "optk_calibrated": "dynamics with passive elements calibrated on the motion itself",
    "optk_from_flexion": "dynamics with passive elements taken from flexion",
    "optk_from_bending": "dynamics with passive elements taken from bending",
    "optk_from_both": "dynamics with passive elements taken from flexion and bending together",
}
"""The same inside a sentence."""

VERDICTS = {
    "told": "markers tell it",
    "one_sided": "markers tell one end",
    "not_told": "markers do not tell it",
}
"""What a profile says of a stiffness."""


_AUTHORS = {"white_panjabi": "White and Panjabi"}
"""Names that are more than a name with a capital."""


def _ratios(approach: str) -> str:
    """``Christophy 2012`` of the approach with these ratios."""
    name, _, year = approach.removeprefix(CONSTRAINED).rpartition("_")
    return f"{_AUTHORS.get(name, capital(plain(name)))} {year}".strip()


def short_of(approach: str) -> str:
    """An approach beside an axis."""
    if approach.startswith(CONSTRAINED):
        return f"ratios of {_ratios(approach)}"
    return SHORT.get(approach, plain(approach))


def phrase(approach: str) -> str:
    """An approach inside a sentence."""
    if approach.startswith(CONSTRAINED):
        return f"inverse kinematics with the ratios of {_ratios(approach)}"
    return PHRASES.get(approach, plain(approach))


def sort_approaches(approaches: Iterable[str]) -> list[str]:
    """Approaches in the order of the settings; a cohort's own ratios follow the others."""
    place = {name: k for k, name in enumerate(APPROACHES)}
    last = max(k for k, name in enumerate(APPROACHES) if name.startswith(CONSTRAINED))
    return sorted(
        set(approaches), key=lambda name: (place.get(name, last), name not in place, name)
    )


def error_text(value: float, measure: str) -> str:
    """An error with its unit."""
    unit = MEASURES[measure][0]
    return f"{number(value)}{'°' if unit == 'deg' else ' mm'}"

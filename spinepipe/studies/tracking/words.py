"""Approaches in words, for figures and sentences."""

from collections.abc import Iterable

from spinepipe.report.words import capital, plain
from spinepipe.studies.tracking.settings import APPROACHES, CONSTRAINED

PHRASES = {
    "ik": "inverse kinematics",
    "ik_smooth": "smoothed inverse kinematics",
    "ik_springs": "inverse kinematics with stiffness",
    "optk_zero": "dynamics without stiffness",
    "optk_generic": "dynamics with generic stiffness",
    "optk_generic_lower": "dynamics with low generic stiffness",
    "optk_generic_upper": "dynamics with high generic stiffness",
    "optk_calibrated": "dynamics calibrated on similar motions",
    "optk_from_flexion": "dynamics calibrated on flexion",
    "optk_from_bending": "dynamics calibrated on bending",
    "optk_from_both": "dynamics calibrated on flexion and bending",
}
"""Approaches inside a sentence, in six words at most; stiffness is that of joints.

Similar motions are those of the same kind as the motion that is tracked, and that motion itself.
"""

SHORT = {
    **PHRASES,
    "ik_smooth": "smoothed kinematics",
    "ik_springs": "kinematics with stiffness",
    "optk_zero": "dynamics, no stiffness",
    "optk_generic": "dynamics, generic",
    "optk_generic_lower": "dynamics, low generic",
    "optk_generic_upper": "dynamics, high generic",
    "optk_calibrated": "calibrated, own motions",
    "optk_from_flexion": "calibrated on flexion",
    "optk_from_bending": "calibrated on bending",
    "optk_from_both": "calibrated on both",
}
"""The same beside an axis."""

_AUTHORS = {"white_panjabi": "White–Panjabi"}
"""Names that are more than a name with a capital."""


def _ratios(approach: str) -> str:
    """``Christophy 2012`` of the approach with these ratios."""
    name, _, year = approach.removeprefix(CONSTRAINED).rpartition("_")
    return f"{_AUTHORS.get(name, capital(plain(name)))} {year}".strip()


def short_of(approach: str) -> str:
    """An approach beside an axis."""
    if approach.startswith(CONSTRAINED):
        return f"{_ratios(approach)} ratios"
    return SHORT.get(approach, plain(approach))


def phrase(approach: str) -> str:
    """An approach inside a sentence."""
    if approach.startswith(CONSTRAINED):
        return f"fixed ratios ({_ratios(approach)})"
    return PHRASES.get(approach, plain(approach))


def sort_approaches(approaches: Iterable[str]) -> list[str]:
    """Approaches in the order of the settings; a cohort's own ratios follow the others."""
    place = {name: k for k, name in enumerate(APPROACHES)}
    last = max(k for k, name in enumerate(APPROACHES) if name.startswith(CONSTRAINED))
    return sorted(
        set(approaches), key=lambda name: (place.get(name, last), name not in place, name)
    )

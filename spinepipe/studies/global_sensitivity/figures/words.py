"""What figures and sentences call outputs and factors."""

from spinepipe.report.cohort.named import short
from spinepipe.report.discrepancy.words import capital, plain
from spinepipe.report.words import AXIS
from spinepipe.studies.global_sensitivity import DUMMY
from spinepipe.units import TRANSLATIONS

OUTPUT = {"motion": "motion", "joint_load": "joint load", "stiffness": "calibrated stiffness"}
"""Outputs in their order."""

_LONGEST = 34


def factor_name(factor: str, longest: int = _LONGEST) -> str:
    """``stiffness_L1L2_extension`` as ``stiffness L1L2 extension``."""
    return f"{DUMMY} (no effect)" if factor == DUMMY else short(plain(factor), longest)


def what(output: str, coordinate: str) -> str:
    """``motion in flexion–extension``; a load along a rotation is a moment."""
    return f"{kind(output, coordinate)} in {AXIS[coordinate].lower()}"


def kind(output: str, coordinate: str) -> str:
    """``motion``, ``force``, ``moment`` or ``stiffness``."""
    if output == "joint_load":
        return "force" if coordinate in TRANSLATIONS else "moment"
    return output


def where(test: str, joint: str) -> str:
    """``flexion, L1L2``: what there is of them."""
    return ", ".join(part for part in (capital(plain(test)), joint) if part)


def whole(n: int) -> str:
    """``20 480``."""
    return f"{n:,}".replace(",", "\u2009")

"""Which indices a study has, and how they are called."""

from dataclasses import dataclass

import pandas as pd

from spinepipe.report.style import BLUE, GREEN, VERMILLION
from spinepipe.report.words import unit
from spinepipe.units import TRANSLATIONS


@dataclass(frozen=True)
class Measures:
    """Indices of one kind of design.

    Attributes
    ----------
    main : the index that factors are put in order by. shown : those that are drawn, main first.
    of_variance : whether they are shares of the output's variance.
    in_units : whether they are in the output's unit.
    """

    main: str
    shown: tuple[str, ...]
    of_variance: bool = False
    in_units: bool = False


_KNOWN = (
    Measures("ST", ("ST", "S1"), of_variance=True),
    Measures("mu_star", ("mu_star", "sigma"), in_units=True),
    Measures("PAWN", ("PAWN", "delta", "S1_RBD")),
)
NAME = {
    "ST": "total index ST",
    "S1": "first-order index S1",
    "mu_star": "mean size of effects μ*",
    "sigma": "SD of effects σ",
    "PAWN": "PAWN",
    "delta": "δ",
    "S1_RBD": "S1 (RBD-FAST)",
}
COLORS = (BLUE, GREEN, VERMILLION)
"""Of the shown indices, the main one first."""

DONE = "done"


def measures_of(indices: pd.DataFrame) -> Measures | None:
    """The measures of a study's indices; None where none of them is known."""
    names = set(indices["index"])
    return next((known for known in _KNOWN if known.main in names), None)


def unit_of(output: str, coordinate: str) -> str:
    """Unit of an output as printed."""
    along = coordinate in TRANSLATIONS
    if output == "stiffness":
        return "N/m" if along else "N m/rad"
    if output == "joint_load":
        return "N" if along else "N m"
    return unit(coordinate)

"""What figures and findings call coordinates, units, numbers, load cases and lists of names."""

from collections.abc import Iterable
from math import floor, isfinite, log10

from spinepipe.units import TRANSLATIONS

AXIS = {
    "anterior": "Anterior–posterior",
    "superior": "Inferior–superior",
    "right": "Right–left",
    "extension": "Flexion–extension",
    "right_bending": "Lateral bending",
    "left_rotation": "Axial rotation",
}
"""Coordinate as a direction, without a sign."""

POSITIVE = {
    "anterior": "anterior",
    "superior": "superior",
    "right": "right",
    "extension": "extension",
    "right_bending": "to the right",
    "left_rotation": "to the left",
}
"""What a positive value of the coordinate is."""

_MINUS, _THIN_SPACE = "\u2212", "\u2009"
_LONGEST = 22
_MOST = 4
_PAIRS = {"flexion extension": "flexion–extension", "bending rotation": "bending–rotation"}


def unit(coordinate: str) -> str:
    """``mm`` or ``deg`` as printed."""
    return "mm" if coordinate in TRANSLATIONS else "°"


SIGNS = {"deg": "°", "mm": "mm"}
"""Units of motion as printed."""


def after_number(unit: str) -> str:
    """A unit of motion as it stands behind a number."""
    return SIGNS[unit] if unit == "deg" else f"\u00a0{SIGNS[unit]}"


def stiffness_unit(coordinate: str) -> str:
    """Unit of a stiffness as printed."""
    return "N/m" if coordinate in TRANSLATIONS else "N m/rad"


def number(value: float, digits: int = 3) -> str:
    """A number to so many significant digits: 20 600, 0.0134, −1.4; very large ones as 1.2e7."""
    if not isfinite(value):
        return "none"
    if value == 0.0:
        return "0"
    size = floor(log10(abs(value)))
    if size >= 6 or size < -4:
        text = f"{value:.{digits - 1}e}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
    else:
        rounded = round(value, digits - 1 - size)
        text = f"{rounded:,.{max(0, digits - 1 - size)}f}".replace(",", _THIN_SPACE)
    return text.replace("-", _MINUS)


def tick(value: float) -> str:
    """A number at an axis, no longer than it needs to be: 20, 0.5, 300 000, 1e7."""
    if abs(value) >= 1e6 or 0.0 < abs(value) < 1e-3:
        return f"{value:.0e}".replace("e+0", "e").replace("e-0", "e-").replace("-", _MINUS)
    return f"{value:,.10g}".replace(",", _THIN_SPACE).replace("-", _MINUS)


def fixed(value: float, decimals: int = 2) -> str:
    """A number with so many decimals and a true minus sign."""
    if not isfinite(value):
        return "none"
    text = f"{value:.{decimals}f}"
    zero = f"{0:.{decimals}f}"
    return zero if text == f"-{zero}" else text.replace("-", _MINUS)


def rounded_to(value: float, exponent: int) -> str:
    """A number rounded to a power of ten: 2 150 to 10², 0.05 to 10⁻²."""
    shown = round(value, -exponent) or 0.0  # never -0
    text = f"{shown:,.{max(0, -exponent)}f}"
    return text.replace(",", _THIN_SPACE).replace("-", _MINUS)


def percent(part: int, whole: int) -> str:
    """A share as a whole percentage; a share that is not quite 0 or 100 % is not rounded to it."""
    if not whole:
        return "none"
    share = 100.0 * part / whole
    if 0.0 < share < 1.0:
        return "<1 %"
    if 99.0 < share < 100.0:
        return ">99 %"
    return f"{share:.0f} %"


def count(n: int, one: str, many: str | None = None) -> str:
    """``1 pose``, ``500 poses``."""
    return f"{n:,} {one if n == 1 else many or one + 's'}".replace(",", _THIN_SPACE)


def plain(name: str) -> str:
    """A name of results without underscores."""
    words = name.replace("_", " ").strip()
    for apart, pair in _PAIRS.items():
        words = words.replace(apart, pair)
    return words


def capital(words: str) -> str:
    """With a capital letter at the beginning."""
    return words[:1].upper() + words[1:]


def case(test: str) -> str:
    """A load case in words: ``left_axial_rotation`` is ``Left axial rotation``."""
    return capital(plain(test))


def short(name: str, longest: int = _LONGEST) -> str:
    """A name that fits beside an axis; the middle of a longer one is left out."""
    if len(name) <= longest:
        return name
    tail = longest // 2
    return f"{name[: longest - 1 - tail]}…{name[-tail:]}"


def listed(names: Iterable[str], most: int = _MOST, last: str | None = "and") -> str:
    """``a, b and c``; of many the first, and how many more.

    Parameters
    ----------
    last : the word before the last name; None for a comma there too.
    """
    every = list(names)
    if len(every) > most:
        return f"{', '.join(every[:most])} and {len(every) - most} more"
    if len(every) < 2 or last is None:
        return ", ".join(every)
    return f"{', '.join(every[:-1])} {last} {every[-1]}"

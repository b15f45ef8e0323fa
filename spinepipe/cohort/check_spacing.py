"""Are neighbours as far apart as in a spine? Metres taken for millimetres show here."""

from collections.abc import Iterator

from spinepipe.problems import Problem

__all__ = ["spacing_problem"]

SMALLEST_MM = 0.1
LARGEST_MM = 1000.0


def spacing_problem(
    place: tuple[str, int | None, str | None], distance_mm: float, what: str
) -> Iterator[Problem]:
    """The problem of two neighbouring points, if their distance says the unit is wrong.

    Parameters
    ----------
    place : file, line and column to report.
    distance_mm : NaN, from a cell that is bad and reported there, is no problem here.
    what : which points.
    """
    if distance_mm < SMALLEST_MM or distance_mm > LARGEST_MM:
        found = f"{what} {distance_mm:.3g} mm apart"
        allowed = f"{SMALLEST_MM:g} mm to {LARGEST_MM:g} mm"
        yield Problem(*place, found, allowed, "give millimetres, and look for a misplaced point")

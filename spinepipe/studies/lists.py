"""Lists in study files: something in them, and nothing twice."""

from typing import Annotated, TypeVar

from pydantic import AfterValidator, Field, StringConstraints

from spinepipe.studies.coordinates import Coordinate

__all__ = ["Coordinates", "EachOnce", "Tests"]


def distinct(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names as they are.

    Raises
    ------
    ValueError
        For a name that stands there twice.
    """
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise ValueError(f"each name once ('{twice[0]}' stands there twice)")
    return names


Item = TypeVar("Item")
EachOnce = Annotated[tuple[Item, ...], Field(strict=False, min_length=1), AfterValidator(distinct)]
"""One item at least, and none twice."""

Tests = EachOnce[Annotated[str, StringConstraints(min_length=1)]]
"""Load cases of a cohort."""

Coordinates = EachOnce[Coordinate]
"""Coordinates of a joint."""

"""How the pieces of a search are run: at once, or through a store of what was done before.

A piece is a function of plain data, so that a store can know it by the content of its arguments.
"""

from collections.abc import Callable
from typing import ParamSpec, Protocol, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class Run(Protocol):
    """Runs a function on arguments and returns what it returns."""

    def __call__(self, function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's result, computed now or before."""


def at_once(function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
    """Run here and now, keep nothing."""
    return function(*args, **kwargs)

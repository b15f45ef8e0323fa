"""What long work says of itself: a line for each round, and every few seconds of a long one."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

T = TypeVar("T")

EVERY_S = 5.0
"""Between two lines of one round."""


def silent(line: str) -> None:
    """Say nothing."""


@dataclass
class Progress:
    """Says what is done, and an estimate of what is left.

    Attributes
    ----------
    say : given each line.
    """

    say: Callable[[str], None] = silent
    _last: float = field(default_factory=lambda: time.monotonic())

    def round(self, line: str) -> None:
        """A line of its own."""
        self._last = time.monotonic()
        self.say(line)

    def through(self, pieces: Sequence[T], what: str) -> Iterator[T]:
        """The pieces one after the other, with a line now and then."""
        begun = time.monotonic()
        for done, piece in enumerate(pieces):
            now = time.monotonic()
            if done and now - self._last > EVERY_S:
                left = (now - begun) / done * (len(pieces) - done)
                self.round(f"{what}, {done} of {len(pieces)} done, about {left:.0f} s left")
            yield piece

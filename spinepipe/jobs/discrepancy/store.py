"""A store of the pieces of a search: each is a content-hashed task, done once and kept.

A killed search finds what it had done; a repeated one only looks it up. The tasks are pydra's,
run in this process: they are known by a digest of code and arguments, and what they work on is
handed to them by that digest.
"""

import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from spinepipe.jobs.digest import code_digest

os.environ.setdefault("NO_ET", "1")  # pydra reports its use over the network unless told not to

from pydra.compose import python
from pydra.engine.submitter import Submitter

P = ParamSpec("P")
R = TypeVar("R")

_WAITING: dict[str, Callable[[], Any]] = {}


@python.define(outputs=["result"])  # type: ignore[untyped-decorator]
def Piece(token: str) -> Any:
    """The piece of that digest; its result is kept under it."""
    from spinepipe.jobs.discrepancy.store import waiting

    return waiting(token)()


def waiting(token: str) -> Callable[[], Any]:
    """What a digest stands for, in the process that is about to run it."""
    return _WAITING[token]


class Store:
    """Runs functions of plain data once per content of code and arguments."""

    def __init__(self, folder: str | Path, module: str) -> None:
        """``module`` is the job whose code, with all it imports, the results hang on."""
        self._folder, self._code = Path(folder), code_digest(module)
        self._folder.mkdir(parents=True, exist_ok=True)
        self._submitter = Submitter(cache_root=self._folder, worker="debug")

    def __call__(self, function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's result, computed now or before."""
        content = pickle.dumps((function.__qualname__, args, sorted(kwargs.items())), protocol=5)
        token = hashlib.sha256(self._code.encode() + content).hexdigest()
        _WAITING[token] = lambda: function(*args, **kwargs)
        try:
            with self._submitter as submitter:
                found: R = submitter(Piece(token=token)).outputs.result
        finally:
            del _WAITING[token]
        return found

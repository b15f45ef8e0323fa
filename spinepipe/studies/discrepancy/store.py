"""A store of the pieces of a search: each is a content-hashed task, done once and kept.

A killed search finds what it had done; a repeated one only looks it up. The tasks are pydra's,
run in this process: they are known by a digest of code and arguments, and what they work on is
handed to them by that digest. The folder may be deleted at any time: it only saves time.
"""

import hashlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from spinepipe.jobs.digest import code_digest
from spinepipe.jobs.discrepancy.content import content_digest
from spinepipe.jobs.provenance import versions

os.environ.setdefault("NO_ET", "1")  # pydra reports its use over the network unless told not to

from pydra.compose import python
from pydra.engine.submitter import Submitter

P = ParamSpec("P")
R = TypeVar("R")

_WAITING: dict[str, Callable[[], Any]] = {}

_DONE, _TASK = "_result.pklz", "_job.pklz"
"""Files of pydra: a result, and the task with its result once more."""


@python.define(outputs=["result"])  # type: ignore[untyped-decorator]
def Piece(token: str) -> Any:
    """The piece of that digest; its result is kept under it."""
    from spinepipe.jobs.discrepancy.store import waiting

    return waiting(token)()


def waiting(token: str) -> Callable[[], Any]:
    """What a digest stands for, in the process that is about to run it."""
    return _WAITING[token]


class Store:
    """Runs functions of plain data once per content of code and arguments.

    Only one process may use a folder at a time, which Snakemake sees to.
    """

    def __init__(self, folder: str | Path, module: str) -> None:
        """``module`` is the job whose code, with all it imports, the results hang on."""
        self._folder = Path(folder).absolute()
        self._made_by = f"{code_digest(module)} {sorted(versions().items())}".encode()
        self._asked: set[str] = set()

    def __call__(self, function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's result, computed now or before; what it raises is passed on."""
        content = content_digest((function, args, sorted(kwargs.items())))
        token = hashlib.sha256(self._made_by + content).hexdigest()
        self._asked.add(token)
        place = self._folder / token
        if not list(place.glob(f"*/{_DONE}")):  # else a killed run's lock would be waited for
            shutil.rmtree(place, ignore_errors=True)
        _WAITING[token] = lambda: function(*args, **kwargs)
        try:
            found: R = _done(token, place)
        except BaseException:
            shutil.rmtree(place, ignore_errors=True)
            raise
        finally:
            del _WAITING[token]
        return found

    def forget_the_rest(self) -> None:
        """Delete pieces that nobody asked for since the store was opened: other code or data."""
        for place in self._folder.iterdir() if self._folder.is_dir() else ():
            if place.name not in self._asked:
                shutil.rmtree(place, ignore_errors=True)


def _done(token: str, place: Path) -> Any:
    """The result of a piece, from its folder or put there."""
    place.mkdir(parents=True, exist_ok=True)
    os.environ["PYDRA_HASH_CACHE"] = str(place / "hashes")  # else in the user's home
    with Submitter(cache_root=place, worker="debug") as submitter:
        result = submitter(Piece(token=token))
    for copy in place.glob(f"*/{_TASK}"):
        copy.unlink()
    return result.outputs.result

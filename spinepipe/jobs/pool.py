"""Warm worker processes for many short jobs.

A job is a plain function called with plain strings and numbers, all by keyword, that writes its
result itself. Each worker serves one job at a time over its own pipe, so when a worker dies, the
job that killed it is known, and jobs in other workers go on undisturbed.

Workers are forked from a server that has imported the job modules already: a new one costs
milliseconds. They end with the process that started them, even when that one is killed outright.
"""

import contextlib
import errno
import gc
import importlib
import multiprocessing
import os
import queue
import resource
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import forkserver
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import ModuleType
from typing import Any

from spinepipe.jobs.digest import reading

_JOBS = Path(__file__).resolve().parent
_ONE_THREAD = ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR", "VECLIB_MAXIMUM")
_SECONDS_TO_DIE = 5
_STOPPED = 130
"""Exit code of a worker whose run has ended, by Ctrl-C most often."""

_MOST_GROWN_KB = 400_000
"""A worker that a job made larger by this serves no further one: its memory would stay taken."""

_REMEDIES = {
    errno.ENOSPC: "no space is left on the disk of {folder}; free some space",
    errno.EDQUOT: "your disk quota is used up in {folder}; free some space",
    errno.EFBIG: "a file in {folder} is larger than allowed here; raise the limit (ulimit -f)",
    errno.EACCES: "no permission to use {folder}; change its permissions or owner",
    errno.EPERM: "no permission to use {folder}; change its permissions or owner",
    errno.EROFS: "{folder} is on a read-only disk; run from a folder that can be written",
}
_FATES = {
    signal.SIGKILL: "it was killed from outside (SIGKILL), most often because memory ran out",
    signal.SIGTERM: "it was asked to end (SIGTERM) by another program",
    signal.SIGSEGV: "it crashed: segmentation fault (SIGSEGV) in compiled code",
    signal.SIGBUS: "it crashed: bus error (SIGBUS), often a full disk or memory",
    signal.SIGABRT: "it aborted itself (SIGABRT) in compiled code",
    signal.SIGFPE: "it crashed: arithmetic error (SIGFPE) in compiled code",
    signal.SIGILL: "it crashed: this processor lacks an instruction it used (SIGILL)",
}


class JobFailed(Exception):
    """A job raised an exception or its worker process died; the text says which and why."""


class WorkerDied(JobFailed):
    """Its worker process died."""


@dataclass(frozen=True)
class _Failure:
    """An exception on its way back from a worker, as plain text."""

    message: str
    trace: str
    errno: int | None = None
    path: str | None = None


@dataclass(frozen=True)
class _Worker:
    process: Any
    connection: Connection


_idle: "queue.LifoQueue[_Worker]" = queue.LifoQueue()
_starting = threading.Lock()
_CONTEXT = multiprocessing.get_context("forkserver")


def submit_and_wait(
    job: str, function: str, log: str, read: Sequence[str] = (), **arguments: Any
) -> None:
    """Run ``module:name`` in a worker and return when it is done.

    There are as many workers as calls that wait at the same time.

    Parameters
    ----------
    job
        Name of the job for messages, for example ``calibrate specimen=s1 pose=0003``.
    function
        ``package.module:name`` of the function.
    log
        File that gets the message and the traceback; written on failure only.
    read
        Files on whose marks hangs what the job writes, see `spinepipe.jobs.digest.reading`.
    arguments
        Passed to the function by keyword; plain strings, numbers and lists of them.

    Raises
    ------
    JobFailed
        With the name of the job, the cause in plain words and the log file; `WorkerDied` where it
        did not end by itself.
    """
    worker = _ready()
    try:
        worker.connection.send((function, read, arguments))
        wait([worker.connection, worker.process.sentinel])
        failure, grown_kb = worker.connection.recv()
    except (EOFError, OSError):
        _fail(job, log, _fate(worker), error=WorkerDied)
    if grown_kb < _MOST_GROWN_KB:
        _idle.put(worker)
    else:
        worker.connection.close()  # at which it ends: what a large job left behind goes with it
    if failure is not None:
        written = arguments.get("output") or arguments.get("svg") or ""
        folder = os.path.dirname(failure.path or str(written)) or "."
        _fail(job, log, _explain(failure, folder), failure.trace)


def warm_up(modules: Sequence[str] = ()) -> None:
    """Start the server that workers are forked from: its imports run while the caller goes on.

    Parameters
    ----------
    modules : of jobs that come by the hundreds; others are imported when first asked for.
    """
    with _starting, _environment():
        if modules:
            _CONTEXT.set_forkserver_preload(
                ["spinepipe.jobs.block", "spinepipe.jobs.draw", *modules]
            )
        forkserver.ensure_running()


def _ready() -> _Worker:
    """A worker that waits for a job, else a new one; who died while it waited harms no job."""
    while True:
        try:
            worker = _idle.get_nowait()
        except queue.Empty:
            return _start()
        if not worker.connection.poll():  # it says nothing unasked: there is an end to be read
            return worker
        worker.connection.close()


def _start() -> _Worker:
    """A new worker, and the server they are forked from unless it runs already."""
    warm_up()
    with _starting, _plain_main(), _environment():
        ours, theirs = _CONTEXT.Pipe()
        process = _CONTEXT.Process(target=_serve, args=(theirs,), daemon=True)
        process.start()
        theirs.close()
    return _Worker(process, ours)


@contextlib.contextmanager
def _plain_main() -> Iterator[None]:
    """Hide the running program: each worker would import it (all of Snakemake) again."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextlib.contextmanager
def _environment() -> Iterator[None]:
    """What the server must find at its start: one thread per worker, and this very package.

    The server imports before it learns the caller's `sys.path`, hence PYTHONPATH.
    """
    saved = dict(os.environ)
    os.environ.update({f"{name}_NUM_THREADS": "1" for name in _ONE_THREAD})
    path = [str(_JOBS.parents[1]), saved.get("PYTHONPATH", "")]
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, path))
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(saved)


def _serve(connection: Connection) -> None:
    """Life of a worker: answer one job after the other until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()  # what was imported stays: no need to look through it at each collection
    begun_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    end_with_parent()
    while True:
        try:
            function, read, arguments = connection.recv()
        except EOFError:
            return
        failure = _answer(function, read, arguments)
        largest_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        connection.send((failure, largest_kb - begun_kb))


def end_with_parent() -> None:
    """Let this process end when the one that started it does, even when that one is killed."""

    def wait_for_it() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(_STOPPED)

    threading.Thread(target=wait_for_it, daemon=True).start()


def _answer(function: str, read: Sequence[str], arguments: dict[str, Any]) -> _Failure | None:
    """Call the function; what it raises becomes text, since not every exception can be sent."""
    try:
        module, name = function.split(":")
        with reading(read):
            getattr(importlib.import_module(module), name)(**arguments)
    except BaseException as error:
        message = f"{type(error).__name__}: {error}"
        if isinstance(error, OSError):
            path = os.fsdecode(error.filename) if error.filename else None
            return _Failure(message, traceback.format_exc(), error.errno, path)
        return _Failure(message, traceback.format_exc())
    return None


def _fate(worker: _Worker) -> str:
    """How a worker process died, in plain words."""
    worker.process.join(_SECONDS_TO_DIE)
    code = worker.process.exitcode
    worker.connection.close()
    if code is None:
        worker.process.kill()
        return "its worker process stopped answering and was ended"
    if code == _STOPPED:
        return "it was stopped with the run; the same command goes on"
    if code >= 0:
        return f"its worker process ended itself in mid-job with exit code {code}"
    try:
        name = signal.Signals(-code)
    except ValueError:
        return f"its worker process died of signal {-code}"
    return "its worker process died: " + _FATES.get(name, f"signal {name.name}")


def _explain(failure: _Failure, folder: str) -> str:
    if failure.errno == errno.ENOENT and Path(folder).parts[:1] == ("results",):
        return (
            f"{failure.path or folder} is gone: it, or its folder, was removed while the run went "
            "on. Run the same command again (what is left is kept)"
        )
    if failure.errno not in _REMEDIES:
        return failure.message
    remedy = _REMEDIES[failure.errno].format(folder=folder)
    return f"{remedy}, then run the same command again (finished jobs are kept)"


def _fail(
    job: str, log: str, message: str, trace: str = "", error: type[JobFailed] = JobFailed
) -> None:
    text = f"job {job}: {message}"
    try:
        Path(log).parent.mkdir(parents=True, exist_ok=True)
        Path(log).write_text(f"{text}\n{trace}", encoding="utf-8")
    except OSError:
        raise error(text) from None
    raise error(f"{text}\n  log: {log}") from None

"""The program `spinepipe`: finds the command, and turns errors into one clear message.

A command is the module of that name in `spinepipe.cli`, with ``add_arguments(parser)`` and
``run(options)``, which returns the exit code. It is imported when it is called for, so that
`doctor` works where a library is missing.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from keyword import iskeyword
from pathlib import Path
from typing import cast

from spinepipe.files import cache_home, cache_of_project, refusal

COMMANDS = {
    "import": "make a cohort of a testing machine's files",
    "check": "say everything that is wrong with studies and cohorts",
    "show": "print a specimen and write a page of it: curves, geometry",
    "doctor": "test whether this computer can run the studies",
    "export": "write a specimen's model as an OpenSim file",
    "index": "write the page of all studies, results/index.html, and say which are up to date",
    "compare": "set two studies side by side: what changed",
    "plan": "say before an experiment which effects its tests could name",
    "why": "say why an effect is named by a study, or why not",
    "archive": "pack a computed study as a zip, for the supplement of a paper",
    "docs": "write the generated parts of the documentation",
}
"""Each command with the line that help says of it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 well, 1 a problem.

    Wrong usage ends the program with exit code 2, and `--help` with 0 (`SystemExit`, by argparse).

    Parameters
    ----------
    arguments : what is typed after `spinepipe`; None for that of the command line.
    """
    if arguments is None and sys.getfilesystemencoding() != "utf-8":
        # where the locale is not UTF-8 (ASCII, say), bytes of a path that it cannot read stand in
        # Python's texts as surrogates: they are printed as the same bytes, all else as UTF-8
        for stream in (sys.stdout, sys.stderr):
            cast(TextIOWrapper, stream).reconfigure(encoding="utf-8", errors="surrogateescape")
    # this parser finds the command alone; its own arguments are read by a second one in `_run`
    parser = argparse.ArgumentParser(
        prog="spinepipe",
        description="Spine models calibrated on measured motion.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="commands:\n"
        + "\n".join(f"  {name:8} {what}" for name, what in COMMANDS.items())
        + "\n\n`spinepipe COMMAND --help` says more.",
    )
    _add_root(parser, Path.cwd())
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND", help="see below")
    parser.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    found = parser.parse_args(arguments)
    return _run(found.command, found.rest, found.root)


def _add_root(parser: argparse.ArgumentParser, default: Path) -> None:
    """Let ``--root`` stand before the command as well as after it; what stands after it counts."""
    parser.add_argument(
        "--root",
        type=Path,
        default=default,
        metavar="FOLDER",
        help="folder of the Snakefile (default: where you are)",
    )


def _run(command: str, rest: Sequence[str], root: Path) -> int:
    """Run a command with its own arguments and return its exit code.

    Parameters
    ----------
    rest : what is typed after the command. root : folder of the Snakefile, unless told in ``rest``.
    """
    try:
        # `import` is a word of Python, so its module is `import_`
        module = import_module(f"spinepipe.cli.{command}{'_' if iskeyword(command) else ''}")
    except ImportError as error:
        return _fail(command, f"{error}; `spinepipe doctor` says what is missing")
    parser = argparse.ArgumentParser(f"spinepipe {command}", description=COMMANDS[command])
    _add_root(parser, root)
    module.add_arguments(parser)
    options = parser.parse_args(rest)
    options.root = options.root.resolve()
    # where the user's cache folder cannot be written, Matplotlib gets one inside the project; not
    # under `doctor`, which looks at that folder itself and says what to do
    if command != "doctor" and refusal(cache_home()):
        os.environ["MPLCONFIGDIR"] = str(cache_of_project(options.root) / "matplotlib")
    try:
        code: int = module.run(options)
    except BrokenPipeError:  # the reader of a pipe, such as `head`, has seen enough
        # what is still to be printed goes nowhere, or Python would complain at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        from spinepipe.marks import DamagedFile
        from spinepipe.model.spine import RefusedModel
        from spinepipe.problems import InputError

        # these say what the user can mend, in one line; any other is a fault of ours, and is shown
        # with its traceback
        if not isinstance(error, DamagedFile | InputError | RefusedModel | OSError | ImportError):
            raise
        if isinstance(error, OSError) and error.filename:
            return _fail(command, f"{error.filename}: {error.strerror}")
        return _fail(command, str(error))
    return code


def _fail(command: str, message: str) -> int:
    """Print a message to stderr; exit code 1."""
    print(f"spinepipe {command}: {message}", file=sys.stderr)
    return 1

"""The program `spinepipe`: finds the command, and turns errors into one clear message.

A command is a module of `spinepipe.cli` with a function ``command``, whose annotated parameters
typer reads, and which returns the exit code (None: 0). It is imported when it is called for: help
is at once there, and `doctor` works where a library is missing.
"""

import os
import platform
import sys
from collections.abc import Callable, Sequence
from functools import wraps
from importlib import import_module
from io import TextIOWrapper
from keyword import iskeyword
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from typer.core import TyperGroup
from typer.main import get_command

from spinepipe import __version__
from spinepipe.files import cache_home, cache_of_project, refusal

COMMANDS = {
    "Start": {
        "import": "make a cohort from files of a testing machine, C3D, OpenSim",
    },
    "Look": {
        "check": "say what is wrong with cohorts and studies",
        "show": "show measured data: curves, geometry, summary",
        "plan": "say before an experiment which effects its tests could name",
    },
    "Compute": {
        "index": "write the page of all studies, and say which are up to date",
        "why": "say why an effect is named by a study, or why not",
    },
    "Use": {
        "compare": "set two studies side by side",
        "export": "write a specimen's model as an OpenSim file",
        "cite": "give a paragraph of methods, references, versions",
        "archive": "pack a computed study as a zip, for the supplement of a paper",
    },
    "Help": {
        "doctor": "test this installation",
        "docs": "write the generated parts of the documentation",
    },
}
"""Commands in groups, each with the line that help says of it."""

FINE, PROBLEM, USAGE, FAILED, STOPPED = 0, 1, 2, 3, 130
"""Exit codes: all well, a problem in the input, wrong usage, a job failed, stopped by Ctrl-C."""

CONFIG = Path("config") / "config.yaml"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    arguments : what is typed after `spinepipe`; None for that of the command line.
    """
    if arguments is None and sys.getfilesystemencoding() != "utf-8":
        # where the locale is not UTF-8 (ASCII, say), bytes of a path that it cannot read stand in
        # Python's texts as surrogates: they are printed as the same bytes, all else as UTF-8
        for stream in (sys.stdout, sys.stderr):
            cast(TextIOWrapper, stream).reconfigure(encoding="utf-8", errors="surrogateescape")
    given = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    if "--root" in given:  # it may stand behind the command too
        at = given.index("--root")
        given = [*given[at : at + 2], *given[:at], *given[at + 2 :]]
    try:
        _app(args=given, prog_name="spinepipe")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else FINE
    return FINE


class _Commands(TyperGroup):
    """Commands that are imported when they are called for, in groups."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [name for group in COMMANDS.values() for name in group]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.list_commands(ctx):
            return None
        # `import` is a word of Python, so its module is `import_`
        module = f"spinepipe.cli.{cmd_name}{'_' if iskeyword(cmd_name) else ''}"
        try:
            function = import_module(module).command
        except ImportError as error:
            _fail(cmd_name, f"{error}; `spinepipe doctor` says what is missing")
            raise typer.Exit(PROBLEM) from None
        own = typer.Typer(add_completion=False, rich_markup_mode=None)
        own.command(name=cmd_name)(_guarded(cmd_name, function))
        return get_command(own)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        for group, commands in COMMANDS.items():
            with formatter.section(group):
                formatter.write_dl(list(commands.items()))


def _guarded(name: str, function: Callable[..., int | None]) -> Callable[..., None]:
    """A command whose errors that a user can mend end in one message."""

    @wraps(function)
    def run(*args: Any, **given: Any) -> None:
        from spinepipe.marks import DamagedFile
        from spinepipe.model.spine import RefusedModel
        from spinepipe.problems import InputError

        try:
            code = function(*args, **given) or FINE
        except KeyboardInterrupt:
            code = STOPPED
        except BrokenPipeError:  # the reader of a pipe, such as `head`, has seen enough
            # what is still to be printed goes nowhere, or Python would complain at its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            code = FINE
        except (DamagedFile, InputError, RefusedModel, OSError, ImportError) as error:
            # these say what the user can mend, in one line; any other is a fault of ours, and is
            # shown with its traceback
            named = isinstance(error, OSError) and error.filename
            code = _fail(name, f"{error.filename}: {error.strerror}" if named else str(error))
        raise typer.Exit(code)

    return run


def _version(given: bool) -> None:
    if given:
        print(f"spinepipe {__version__} (Python {platform.python_version()}, {platform.system()})")
        raise typer.Exit()


def project_root(start: Path) -> Path:
    """The nearest folder upwards with config/config.yaml; the start where there is none."""
    return next((one for one in (start, *start.parents) if (one / CONFIG).is_file()), start)


_app = typer.Typer(
    cls=_Commands,
    help="How stiff spinal joints are, how sure that is, and what a model is missing.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@_app.callback()
def _begin(
    context: typer.Context,
    root: Annotated[
        Path | None,
        typer.Option(
            "-C",
            "--root",
            metavar="DIR",
            help="project folder (default: the nearest with config/config.yaml)",
        ),
    ] = None,
    version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=_version, help="show the version"),
    ] = False,
) -> None:
    context.obj = (root or project_root(Path.cwd())).resolve()
    # where the user's cache folder cannot be written, Matplotlib gets one inside the project; not
    # under `doctor`, which looks at that folder itself and says what to do
    if context.invoked_subcommand != "doctor" and refusal(cache_home()):
        os.environ["MPLCONFIGDIR"] = str(cache_of_project(context.obj) / "matplotlib")


def _fail(command: str, message: str) -> int:
    """Print a message to stderr; the exit code of a problem."""
    print(f"spinepipe {command}: {message}", file=sys.stderr)
    return PROBLEM

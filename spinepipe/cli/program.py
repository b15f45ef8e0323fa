"""The program `spinepipe`: finds the command, and turns errors into one clear message.

A command is a module of `spinepipe.cli` with a function ``command``, whose annotated parameters
typer reads, and which returns the exit code (None: 0). What ``--json`` prints it
puts into ``context.meta["data"]``. It is imported when it is called for: help
is at once there, and `doctor` works where a library is missing.
"""

import io
import json
import os
import platform
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout
from functools import wraps
from importlib import import_module
from io import TextIOWrapper
from keyword import iskeyword
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException
from typer.main import get_command

import spinepipe
from spinepipe.files import cache_home, cache_of_project, project_root, refusal
from spinepipe.problems import InputError, nearest

COMMANDS = {
    "Start": {
        "init": "make a project folder (with --demo: with an example, computed)",
        "import": "make a cohort from files of a testing machine, C3D, OpenSim",
        "new": "write a cohort or study to fill in; say what a cohort can answer",
    },
    "Look": {
        "check": "say what is wrong with cohorts and studies",
        "show": "show measured data: curves, geometry, summary",
        "plan": "say what a run will do, and how long it takes",
    },
    "Compute": {
        "run": "compute studies and write their reports",
        "index": "write the page of all studies, and say which are up to date",
        "why": "say why a study is stale or failed, or why an effect is named or not",
    },
    "Use": {
        "compare": "set two studies side by side",
        "export": "write tables as CSV, or a specimen's model as an OpenSim file",
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

OF_ALL = {
    "--json": "--json",
    "--quiet": "--quiet",
    "-q": "--quiet",
    "--verbose": "--verbose",
    "-v": "--verbose",
}
"""Options of every command, which may stand behind its name too."""

MOST_PROBLEMS = 10
"""That are told of one input; of more their number is."""


class WrongUsage(Exception):
    """Something typed that cannot be meant: what it is, and what to type."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what}\n  {remedy}")


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
    own = given[: given.index("--")] if "--" in given else given
    rest, first = given[len(own) :], [OF_ALL[one] for one in own if one in OF_ALL]
    own = [one for one in own if one not in OF_ALL]
    if "--root" in own:  # it may stand behind the command too
        at = own.index("--root")
        own = [*own[at : at + 2], *own[:at], *own[at + 2 :]]
    # what stands behind `--` is for Snakemake: typer would take it for names
    given = [*first, *own]
    try:
        code: object = _app(args=given, prog_name="spinepipe", standalone_mode=False, obj=rest[1:])
    except TyperException as error:  # an option or a value that no command has
        words = error.format_message().removesuffix(".")
        of = getattr(error, "ctx", None)
        path = "spinepipe" if of is None else of.command_path
        _fail(f"{words[:1].lower()}{words[1:]}\n  {path} --help  says what there is")
        return USAGE
    except WrongUsage as error:
        _fail(str(error))
        return USAGE
    return code if isinstance(code, int) else FINE


class _Commands(TyperGroup):
    """Commands that are imported when they are called for, in groups."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [name for group in COMMANDS.values() for name in group]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        known = self.list_commands(ctx)
        if cmd_name not in known:
            near = nearest(cmd_name, known)
            remedy = f"did you mean {' or '.join(near)}?" if near else "spinepipe --help lists all"
            raise WrongUsage(f'there is no command "{cmd_name}"', remedy)
        # `import` is a word of Python, so its module is `import_`
        module = f"spinepipe.cli.{cmd_name}{'_' if iskeyword(cmd_name) else ''}"
        try:
            function = import_module(module).command
        except ImportError as error:
            _fail(f"{error}\n  `spinepipe doctor` says what is missing")
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

        mendable = (DamagedFile, InputError, RefusedModel, WrongUsage, OSError, ImportError)
        asked = given["context"].find_root().params
        said = io.StringIO()
        hidden = redirect_stdout(said) if asked["json"] or asked["quiet"] else nullcontext()
        data: Any = {}
        try:
            with hidden:
                if given["context"].meta["rest"] and name != "run":
                    raise WrongUsage(
                        f"{name} hands nothing to Snakemake", "leave out what follows --"
                    )
                code = function(*args, **given) or FINE
            data = given["context"].meta.get("data")
            if asked["json"] and data is None:
                raise WrongUsage(f"{name} has no --json", "leave it out")
            if asked["quiet"] and code and not asked["json"]:  # what is wrong, and no more
                lines = said.getvalue().splitlines()
                print("\n".join(one for one in lines if one[:4] not in ("ok  ", "warn")))
        except (KeyboardInterrupt, typer.Abort):  # Ctrl-C, and a question that nobody answers
            code = STOPPED
        except BrokenPipeError:  # the reader of a pipe, such as `head`, has seen enough
            # what is still to be printed goes nowhere, or Python would complain at its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            code = FINE
        except mendable as error:
            # these say what the user can mend; any other is a fault of ours, and is shown with its
            # traceback
            words = str(error)
            if isinstance(error, OSError) and error.filename:
                words = f"{error.filename}: {error.strerror}"
            told = [words]
            if isinstance(error, InputError):
                told = ["\n  ".join(one.lines) for one in error.problems[:MOST_PROBLEMS]]
            for one in told:
                _fail(one)
            if isinstance(error, InputError) and (more := len(error.problems) - len(told)):
                print(f"and {more} more", file=sys.stderr)
            data = {"error": words}
            code = USAGE if isinstance(error, WrongUsage) else PROBLEM
        if asked["json"]:
            print(json.dumps(data, ensure_ascii=False, default=str, indent=1))
        raise typer.Exit(code)

    return run


def _version(given: bool) -> None:
    if given:
        python = f"Python {platform.python_version()}, {platform.system()}"
        print(f"spinepipe {spinepipe.__version__} ({python})")
        raise typer.Exit()


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
    json: Annotated[bool, typer.Option("--json", help="machine-readable output")] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="errors only")] = False,
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="more detail")] = False,
    version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=_version, help="show the version"),
    ] = False,
) -> None:
    context.meta["rest"] = context.obj
    context.obj = (root or project_root(Path.cwd())).resolve()
    # where the user's cache folder cannot be written, Matplotlib gets one inside the project; not
    # under `doctor`, which looks at that folder itself and says what to do
    if context.invoked_subcommand != "doctor" and refusal(cache_home()):
        os.environ["MPLCONFIGDIR"] = str(cache_of_project(context.obj) / "matplotlib")


def _fail(message: str) -> None:
    """Print to stderr what is wrong, and below it what to do."""
    print(f"error: {message}", file=sys.stderr)

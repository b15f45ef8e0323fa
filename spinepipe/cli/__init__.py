"""The command line: `spinepipe import`, `check`, `show`, `doctor`, `export` and `docs`."""

from spinepipe.cli.program import main

__all__ = ["main"]

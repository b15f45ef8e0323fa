"""Digest of a module's code by its meaning, with everything of spinepipe that it imports.

Snakemake does not see imported modules. What a file imports and means is worked out once and kept
beside Snakemake's own state, known by size and time of change as Python knows its bytecode.
"""

import ast
import atexit
import hashlib
import json
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from spinepipe.files import appearing, stamp

_ROOT = Path(__file__).resolve().parents[2]
_PACKAGE = "spinepipe"
_DATA_SUFFIXES = (".toml", ".csv", ".yaml", ".json", ".html", ".css")
_KEPT = _ROOT / ".snakemake" / "spinepipe-code.json"
"""What is known of files; may be deleted at any time."""


@cache
def code_digest(module: str) -> str:
    """sha256 over a module and everything of spinepipe that it imports, directly or not.

    Comments, docstrings, layout and the version number do not count. The data files that lie
    beside an imported module (published values) do. Imports are followed where they are written,
    also inside functions; of modules loaded by a computed name only those are seen that a package
    takes in by going through its own folder.

    Parameters
    ----------
    module
        Dotted name, for example ``spinepipe.jobs.calibrate``.

    Raises
    ------
    ModuleNotFoundError
        When the module is not part of this package.
    """
    if _source(module) is None:
        raise ModuleNotFoundError(f"no module {module!r} in {_ROOT / _PACKAGE}")
    found = closure(module)
    lines = [f"{name} {_file(name).meaning}" for name in sorted(found)]
    lines += [_bytes_digest(path) for path in _data_files(found)]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


@cache
def closure(module: str) -> frozenset[str]:
    """The module, its packages and all spinepipe modules they import in turn."""
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(_imports(name))
    return frozenset(found)


@cache
def _source(module: str) -> Path | None:
    """The file of a module of this package, or None if there is no such module."""
    base = _ROOT.joinpath(*module.split("."))
    for path in (base / "__init__.py", base.with_suffix(".py")):
        if path.is_file():
            return path
    return None


class _File(NamedTuple):
    """What a file imports, by full names that need not exist, and a digest of what it means."""

    imports: tuple[str, ...]
    meaning: str


@cache
def _imports(module: str) -> frozenset[str]:
    """Modules of spinepipe named in the import statements of one module, and its packages."""
    names = {*_parents(module), *_file(module).imports}
    if "*" in names:
        names.update(_modules_of(module))
    ours = {name for name in names if name.split(".")[0] == _PACKAGE}
    with_packages = ours | {parent for name in ours for parent in _parents(name)}
    return frozenset(name for name in with_packages if _source(name))


@cache
def _file(module: str) -> _File:
    path = _source(module)
    if path is None:
        return _File((), "")
    _, size, time = stamp(path)
    place, state = path.relative_to(_ROOT).as_posix(), [size, time]
    kept = _known().get(place)
    if kept is None or kept[0] != state:
        kept = _known()[place] = [state, *_read(module, path)]
        _keep_at_exit()
    return _File(tuple(kept[1]), kept[2])


def _read(module: str, path: Path) -> _File:
    """A file's imports (`*` for all of its own folder) and its meaning, from its syntax tree.

    Docstrings, comments, layout and version number have none.
    """
    tree = ast.parse(path.read_bytes())
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(module, node)
            names.update((base, *(f"{base}.{alias.name}" for alias in node.names)))
        elif isinstance(node, ast.Name) and node.id == "__path__":
            names.add("*")
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [entry for entry in body if not _is_cosmetic(entry)]  # type: ignore[attr-defined]
    ours = sorted(name for name in names if name == "*" or name.split(".")[0] == _PACKAGE)
    return _File(tuple(ours), hashlib.sha256(ast.dump(tree).encode()).hexdigest())


@cache
def _known() -> dict[str, list[Any]]:
    """What was known of files when the last process ended, by this version of Python."""
    with suppress(OSError, ValueError, TypeError, KeyError):
        kept = json.loads(_KEPT.read_text("utf-8"))
        if kept["python"] == sys.version:
            return dict(kept["files"])
    return {}


@cache
def _keep_at_exit() -> None:
    atexit.register(_keep)


def _keep() -> None:
    """Write down what is known, where there is a place for it."""
    if _KEPT.parent.is_dir():
        with suppress(OSError), appearing(_KEPT) as temporary:
            temporary.write_text(json.dumps({"python": sys.version, "files": _known()}), "utf-8")


def _modules_of(package: str) -> list[str]:
    """The modules in the folder of a package."""
    path = _source(package)
    assert path is not None
    return [f"{package}.{file.stem}" for file in sorted(path.parent.glob("[!_]*.py"))]


def _parents(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[:count]) for count in range(1, len(parts))]


def _absolute(module: str, node: ast.ImportFrom) -> str:
    """The full name of what `from ... import` names, with leading dots resolved."""
    if not node.level:
        return node.module or ""
    path = _source(module)
    drop = node.level - (1 if path and path.name == "__init__.py" else 0)
    parts = module.split(".")
    return ".".join(parts[: len(parts) - drop] + ([node.module] if node.module else []))


def _is_cosmetic(node: ast.stmt) -> bool:
    """A bare string (docstring) or the assignment of ``__version__``."""
    if isinstance(node, ast.Assign):
        return any(isinstance(to, ast.Name) and to.id == "__version__" for to in node.targets)
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _data_files(modules: frozenset[str]) -> list[Path]:
    """Data files beside the modules, in a fixed order."""
    folders = {path.parent for name in modules if (path := _source(name))}
    files = (file for folder in folders for file in folder.iterdir())
    return sorted(file for file in files if file.suffix in _DATA_SUFFIXES)


@cache
def _bytes_digest(path: Path) -> str:
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return f"{path.relative_to(_ROOT).as_posix()} {digest}"

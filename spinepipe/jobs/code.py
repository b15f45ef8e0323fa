"""Digest of a module's code by its meaning, with what it uses of spinepipe.

Imports are followed where they are written. Of a file that declares result tables only the tables
that are imported count, and of these no wording. An effect counts where its name is written, or
where all of them are asked for; a row of `facts.csv` where its fact is named, without its source.

Snakemake does not see imported modules. What a file imports and means is worked out once and kept
beside Snakemake's own state, known by size and time of change as Python knows its bytecode.
"""

import ast
import atexit
import csv
import hashlib
import json
import re
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from spinepipe.facts import FILE as FACTS
from spinepipe.files import appearing, stamp

_ROOT = Path(__file__).resolve().parents[2]
_PACKAGE = "spinepipe"
_EFFECTS = "spinepipe.effects"
_ALL_EFFECTS = f"{_EFFECTS}.registered"
_SCHEMA = "spinepipe.tables.schema"
_DATA_SUFFIXES = (".toml", ".csv", ".yaml", ".json", ".html", ".css")
_KEPT = _ROOT / ".snakemake" / "spinepipe-used-code.json"
"""What is known of files; may be deleted at any time."""


@cache
def code_digest(module: str) -> str:
    """sha256 over a module and everything of spinepipe that it uses, directly or not.

    Comments, docstrings, layout and the version number do not count. The data files that lie
    beside a module (published values) do, and of `facts.csv` the rows that the code names. Imports
    inside functions are followed too; modules loaded by a computed name are not seen.

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
    lines = [f"{name} {_piece(name).meaning}" for name in sorted(found)]
    words = {word for name in found for word in _piece(name).uses}
    for path in _data_files(found):
        lines += _facts_named(path, words) if path.name == FACTS else [_bytes_digest(path)]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


@cache
def closure(module: str) -> frozenset[str]:
    """All that a module uses, itself too; of files that declare tables, parts (``module.NAME``)."""
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(_used(name))
    return frozenset(found)


@cache
def _source(module: str) -> Path | None:
    """The file of a module of this package, or None if there is no such module."""
    base = _ROOT.joinpath(*module.split("."))
    for path in (base / "__init__.py", base.with_suffix(".py")):
        if path.is_file():
            return path
    return None


class _Piece(NamedTuple):
    """A file or a part: full names used, words that may name effects or facts, a digest."""

    uses: list[str]
    meaning: str


class _File(NamedTuple):
    """A file as a whole, and where it declares tables its parts, by the names they bind."""

    whole: _Piece
    parts: dict[str, _Piece]


def _piece(name: str) -> _Piece:
    base, _, part = name.rpartition(".")
    return _file(name).whole if _source(name) else _file(base).parts[part]


@cache
def _used(name: str) -> frozenset[str]:
    """What a module or a declared table uses of spinepipe, and the packages these are in."""
    found: set[str] = set()
    for used in _piece(name).uses:
        base, _, last = used.rpartition(".")
        if used == _ALL_EFFECTS:
            found.update(effect_modules().values())
        elif not base:
            found.update([effect_modules()[used]] if used in effect_modules() else [])
        elif _source(used):
            found.add(used)
        elif _source(base):
            found.add(used if last in _file(base).parts else base)
    packages = {parent for used in (name, *found) for parent in _parents(used)}
    return frozenset(found | {package for package in packages if not _file(package).parts})


@cache
def effect_modules() -> dict[str, str]:
    """Module of each effect, by the name of its file."""
    folder = _ROOT.joinpath(*_EFFECTS.split("."))
    return {file.stem: f"{_EFFECTS}.{file.stem}" for file in sorted(folder.glob("[!_]*.py"))}


@cache
def _file(module: str) -> _File:
    path = _source(module)
    if path is None:
        return _File(_Piece([], ""), {})
    _, size, time = stamp(path)
    place, state = path.relative_to(_ROOT).as_posix(), [size, time]
    kept = _known().get(place)
    if kept is None or kept[0] != state:
        kept = _known()[place] = [state, *_read(module, path)]
        _keep_at_exit()
    return _File(_Piece(*kept[1]), {name: _Piece(*part) for name, part in kept[2].items()})


def _read(module: str, path: Path) -> _File:
    """A file from its syntax tree: docstrings, comments, layout and version number mean nothing."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [entry for entry in body if not _is_cosmetic(entry)]  # type: ignore[attr-defined]
    imported = {
        alias.asname or alias.name: f"{_absolute(module, node)}.{alias.name}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    parts = {}
    if not {f"{_SCHEMA}.Column", f"{_SCHEMA}.Table"}.isdisjoint(imported.values()):
        tree = _WithoutWording().visit(tree)
        local = {name: entry for entry in tree.body for name in _bound(entry)}
        places = {**imported, **{name: f"{module}.{name}" for name in local}}
        parts = {name: _digested(entry, places) for name, entry in local.items()}
    return _File(_digested(tree, imported), parts)


def _digested(tree: ast.AST, places: Mapping[str, str]) -> _Piece:
    """Code with what it uses: modules, `places`, and words that may name effects or facts."""
    used: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            used.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            used.update(places[alias.asname or alias.name] for alias in node.names)
        elif isinstance(node, ast.Name) and node.id in places:
            used.add(places[node.id])
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            used.update(_NAME.findall(node.value))
    ours = sorted(name for name in used if "." not in name or name.split(".")[0] == _PACKAGE)
    return _Piece(ours, hashlib.sha256(ast.dump(tree).encode()).hexdigest())


_NAME = re.compile(r"\A[a-z]+(?:_[a-z]+)*\Z")
"""How names of effects and facts look."""

_FEWEST_WORDS = 4
"""In a declaration of tables, a text of so many words is wording whatever is called with it."""


class _WithoutWording(ast.NodeTransformer):
    """Tables without what a reader is told; names, types, units and keys stay."""

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Column: no meaning, of `null` only whether it is there; Table: no `about`."""
        self.generic_visit(node)
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        wording = {"Column": ("meaning", 2), "Table": ("about", 1)}.get(called)
        if wording:
            name, place = wording
            node.args[place : place + 1] = [ast.Constant("")] * (len(node.args) > place)
            node.keywords = [one for one in node.keywords if one.arg != name]
        nulls = [one for one in node.keywords if one.arg == "null"]
        for one in nulls:
            one.value = ast.Constant(not _is_none(one.value))
        if called == "Column" and len(node.args) > _PLACE_OF_NULL:
            node.args[_PLACE_OF_NULL] = ast.Constant(not _is_none(node.args[_PLACE_OF_NULL]))
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """No text of several words."""
        long = isinstance(node.value, str) and len(node.value.split()) >= _FEWEST_WORDS
        return ast.Constant("") if long else node


_PLACE_OF_NULL = 4


def _is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def _bound(entry: ast.stmt) -> list[str]:
    """Names that a statement binds: constants, functions and classes."""
    if isinstance(entry, ast.FunctionDef | ast.ClassDef):
        return [entry.name]
    targets = entry.targets if isinstance(entry, ast.Assign) else []
    return [to.id for to in targets if isinstance(to, ast.Name)]


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
    atexit.register(keep)


def keep() -> None:
    """Write down what is known, where there is a place for it: workers read no file again then."""
    if _KEPT.parent.is_dir():
        with suppress(OSError), appearing(_KEPT) as temporary:
            temporary.write_text(json.dumps({"python": sys.version, "files": _known()}), "utf-8")


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


def _data_files(names: frozenset[str]) -> list[Path]:
    """Data files beside the modules, in a fixed order."""
    sources = (_source(name) or _source(name.rpartition(".")[0]) for name in names)
    files = (
        file for folder in {path.parent for path in sources if path} for file in folder.iterdir()
    )
    return sorted(file for file in files if file.suffix in _DATA_SUFFIXES)


def _facts_named(path: Path, words: set[str]) -> list[str]:
    """What rows of facts mean, of those that are named: not their sources."""
    rows = [row for row in _rows(path) if row["fact"] in words]
    return [" ".join(row[name] for name in ("fact", "of", "values", "unit")) for row in rows]


@cache
def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as text:
        return list(csv.DictReader(text))


@cache
def _bytes_digest(path: Path) -> str:
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return f"{path.relative_to(_ROOT).as_posix()} {digest}"

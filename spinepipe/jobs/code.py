"""Digest of a module's code by its meaning, with what it uses of spinepipe.

Imports are followed where they are written. Of a file that names the tables of a ``tables.csv``
only the names that are imported count, and of that file the rows of these tables, without words: a
result hangs on what its own columns are called and hold, not on what they mean to a reader. An
effect counts where its name is written, or where all of them are asked for; a row of ``facts.csv``
where its fact is named, without its source; ``forms.yaml`` without its words. What reads and checks
studies and cohorts does not count (`DIGESTED`).

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

from spinepipe.documents.form import FILE as FORMS
from spinepipe.documents.form import WORDS
from spinepipe.documents.yaml_text import packaged_yaml
from spinepipe.facts import FILE as FACTS
from spinepipe.files import appearing, stamp
from spinepipe.schema.table import FILE, read_tables

_ROOT = Path(__file__).resolve().parents[2]
_PACKAGE = "spinepipe"
_EFFECTS = "spinepipe.effects"
_ALL_EFFECTS = f"{_EFFECTS}.registered"
_DECLARED = "spinepipe.schema.declared"
_ALL_DECLARED = "spinepipe.schema.all_declared"
_TABLE = "#"
"""Between a folder and a table of its ``tables.csv``, or ``*`` for all of them."""

DIGESTED = frozenset(
    f"spinepipe.{name}" for name in ("studies.read", "cohort.read", "jobs.digest", "jobs.code")
)
"""Modules that are not followed: settings and cohort count as they were read, value by value, so
that a check or its words may change and nothing is computed again. What tells digests decides of
no result.
"""

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
    lines = [f"{name} {_meaning(name)}" for name in sorted(found)]
    words = {word for name in found if _TABLE not in name for word in _piece(name).uses}
    # data files beside the modules, in a fixed order; of facts the named ones, not their sources
    folders = {path.parent for path in code_files(module)}
    for path in sorted(file for folder in folders for file in folder.iterdir()):
        if path.name == FACTS:
            named = [row for row in _rows(path) if row["fact"] in words]
            lines += [" ".join(r[key] for key in ("fact", "of", "values", "unit")) for r in named]
        elif path.suffix in _DATA_SUFFIXES and path.name != FILE:
            lines.append(_data_digest(path))
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


@cache
def closure(module: str) -> frozenset[str]:
    """All that a module uses, itself too.

    Of files that name tables they are parts (``module.NAME``), and the tables (``folder#table``).
    """
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(_used(name))
    return frozenset(found)


def code_files(module: str) -> set[Path]:
    """Files of code that the digest of a module holds, whole or in part."""
    names = (name for name in closure(module) if _TABLE not in name)
    found = (_source(name) or _source(name.rpartition(".")[0]) for name in names)
    return {path for path in found if path is not None}


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
    """A file as a whole, and where it names tables its parts, by the names they bind."""

    whole: _Piece
    parts: dict[str, _Piece]


def _piece(name: str) -> _Piece:
    base, _, part = name.rpartition(".")
    return _file(name).whole if _source(name) else _file(base).parts[part]


def _meaning(name: str) -> str:
    if _TABLE not in name:
        return _piece(name).meaning
    folder, _, table = name.partition(_TABLE)
    tables = _layouts(_ROOT.joinpath(*folder.split("."), FILE))
    return str(list(tables.values()) if table == "*" else tables[table])


@cache
def _layouts(path: Path) -> dict[str, list[object]]:
    """What decides of each table of a file."""
    return {name: table.layout for name, table in read_tables(path).items()}


@cache
def _used(name: str) -> frozenset[str]:
    """What a module or a part of one uses of spinepipe, and the packages these are in."""
    if _TABLE in name:
        return frozenset()
    found: set[str] = set()
    for used in _piece(name).uses:
        base, _, last = used.rpartition(".")
        if used in DIGESTED or base in DIGESTED:
            continue
        if _TABLE in used:
            found.add(used)
        elif used == _ALL_EFFECTS:
            found.update(effect_modules().values())
        elif not base:
            found.update([effect_modules()[used]] if used in effect_modules() else [])
        elif _source(used):
            found.add(used)
        elif _source(base):
            found.add(used if last in _file(base).parts else base)
    # the packages they are in, without `spinepipe` itself, which names what notebooks use
    packages = set()
    for parts in (used.split(".") for used in (name, *found)):
        packages |= {".".join(parts[:count]) for count in range(2, len(parts))}
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
    folder, parts = module if path.stem == "__init__" else module.rpartition(".")[0], {}
    if not {_DECLARED, _ALL_DECLARED}.isdisjoint(imported.values()):
        local = {name: entry for entry in tree.body for name in _bound(entry)}
        places = {**imported, **{name: f"{module}.{name}" for name in local}}
        parts = {name: _digested(entry, places, folder) for name, entry in local.items()}
    return _File(_digested(tree, imported, folder), parts)


def _digested(tree: ast.AST, places: Mapping[str, str], folder: str) -> _Piece:
    """Code with what it uses: modules, names of `places`, tables, words that may name effects or
    facts.
    """
    used: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            called = places.get(node.func.id)
            if called == _ALL_DECLARED:
                used.add(f"{folder}{_TABLE}*")
            elif called == _DECLARED:
                used.add(f"{folder}{_TABLE}{ast.literal_eval(node.args[1])}")
        elif isinstance(node, ast.Import):
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


def _bound(entry: ast.stmt) -> list[str]:
    """Names that a statement binds: constants, functions and classes."""
    if isinstance(entry, ast.FunctionDef | ast.ClassDef):
        return [entry.name]
    targets = entry.targets if isinstance(entry, ast.Assign) else []
    return [to.id for target in targets for to in ast.walk(target) if isinstance(to, ast.Name)]


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


@cache
def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as text:
        return list(csv.DictReader(text))


@cache
def _data_digest(path: Path) -> str:
    told = str(_without_words(packaged_yaml(path))).encode() if path.name == FORMS else None
    digest = hashlib.sha256(path.read_bytes() if told is None else told).hexdigest()
    return f"{path.relative_to(_ROOT).as_posix()} {digest}"


def _without_words(told: Any) -> Any:
    """What forms declare, no text that they tell people; columns may have names of such fields."""
    if isinstance(told, dict):
        of_words = {key for key, one in told.items() if key in WORDS and isinstance(one, str)}
        return {key: _without_words(one) for key, one in told.items() if key not in of_words}
    return [_without_words(one) for one in told] if isinstance(told, list) else told

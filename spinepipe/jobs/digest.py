"""Digests that decide what must be computed again: of code, by its meaning, and of values.

Snakemake sees neither imported modules nor parts of a configuration, so the rules carry these
digests in their `params`.

Where a result file comes from: digests, seed and versions, for its Parquet metadata.
"""

import ast
import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.marks import KEY
from spinepipe.studies.registry import PACKAGE, kind_of, place_of
from spinepipe.studies.study import Study

_ROOT = Path(__file__).resolve().parents[2]
_PACKAGE = "spinepipe"
_DATA_SUFFIXES = (".toml", ".csv", ".yaml", ".json", ".html", ".css")


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
    lines = [f"{name} {_meaning(name)}" for name in sorted(found)]
    lines += [_bytes_digest(path) for path in _data_files(found)]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def value_digest(*values: Any) -> str:
    """sha256 over plain values (what JSON can hold), independent of the order of keys."""
    text = json.dumps(values, sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


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


@cache
def _tree(module: str) -> ast.Module:
    path = _source(module)
    return ast.parse(path.read_bytes()) if path else ast.Module(body=[], type_ignores=[])


@cache
def _imports(module: str) -> frozenset[str]:
    """Modules of spinepipe named in the import statements of one module, and its packages."""
    names: set[str] = set(_parents(module))
    for node in ast.walk(_tree(module)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(module, node)
            names.add(base)
            names.update(f"{base}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Name) and node.id == "__path__":
            names.update(_modules_of(module))
    ours = {name for name in names if name.split(".")[0] == _PACKAGE}
    with_packages = ours | {parent for name in ours for parent in _parents(name)}
    return frozenset(name for name in with_packages if _source(name))


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


@cache
def _meaning(module: str) -> str:
    """Digest of one module's syntax tree without docstrings and version number."""
    tree = _tree(module)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [entry for entry in body if not _is_cosmetic(entry)]  # type: ignore[attr-defined]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


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


_LIBRARIES = (
    *("numpy", "scipy", "pandas", "pyarrow", "pybullet", "SALib", "scikit-learn", "statsmodels"),
    *("matplotlib", "plotly", "Jinja2", "spinepipe"),
)


@cache
def versions() -> dict[str, str]:
    """Version of Python and of each library that results depend on."""
    found = {f"version_{name.lower()}": version(name) for name in _LIBRARIES}
    return {"version_python": platform.python_version(), **found}


def settings_of(study: Study, ignored: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a study but for what is ignored of them, as plain values."""
    return study.model_dump(mode="json", exclude=dict(ignored))


def digest_of(
    job: str,
    study: Study,
    cohort: Cohort,
    specimens: Sequence[str] | None = None,
    others: Sequence[str] = (),
) -> str:
    """The mark of a file that a job of the study's kind writes: all that it hangs on.

    Parameters
    ----------
    specimens : those that the job reads; none of them, the cohort's header alone; None, all.
    others : what else it reads that decides, such as the mark of another file.
    """
    return value_digest(
        _code(study, job),
        settings_of(study, kind_of(study.kind).job(job).ignores),
        _data_digest(cohort, specimens),
        list(others),
    )


def figure_digest(figure: str, study: Study, cohort: Cohort) -> str:
    """The mark of a figure."""
    kind = kind_of(study.kind)
    module = f"{PACKAGE}.{study.kind}.{kind.figure(figure).at.partition(':')[0]}"
    code = [code_digest("spinepipe.jobs.draw"), code_digest(module)]
    ignored = dict.fromkeys(kind.ignored_by_figures, True)
    return value_digest(code, settings_of(study, ignored), cohort.digest)


def report_digest(study: Study, cohort: Cohort) -> str:
    """The mark of a report, which prints all settings."""
    module = f"{PACKAGE}.{study.kind}.page"
    titles = [figure.title for figure in kind_of(study.kind).figures]
    code = [code_digest("spinepipe.jobs.report"), code_digest(module), titles]
    return value_digest(code, settings_of(study, {}), cohort.digest)


def provenance(
    job: str,
    study: Study,
    cohort: Cohort,
    specimens: Sequence[str] | None = None,
    others: Sequence[str] = (),
) -> dict[str, str]:
    """Metadata of a file that a job of the study's kind writes, its mark among it.

    ``config_digest`` covers the settings that the job depends on, no others; ``specimens_digest``
    stands for ``cohort_digest`` where not all of the cohort is read. Parameters as in `digest_of`.
    """
    settings = settings_of(study, kind_of(study.kind).job(job).ignores)
    name = "cohort_digest" if specimens is None else "specimens_digest"
    return {
        "study": study.study,
        "kind": study.kind,
        "seed": str(getattr(study, "seed", "")),
        name: _data_digest(cohort, specimens),
        "config_digest": value_digest(settings),
        "code_digest": _code(study, job),
        KEY: digest_of(job, study, cohort, specimens, others),
        **versions(),
    }


def _code(study: Study, job: str) -> str:
    return code_digest(place_of(study.kind, job).partition(":")[0])


def _data_digest(cohort: Cohort, specimens: Sequence[str] | None) -> str:
    return cohort.digest if specimens is None else cohort.digest_of(specimens)

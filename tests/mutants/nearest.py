"""Which test files are near a file of the library: those that reach it in fewest imports."""

import re
from collections import deque
from collections.abc import Iterable
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NEVER = ("workflow", "validation", "mutants", "generators", "cases")
"""Folders of tests that run whole studies, or that are no tests."""

_IMPORT = re.compile(r"^\s*(?:import ([\w., ]+)|from ([\w.]+) import (\([^)]*\)|[\w, ]+))", re.M)
"""Looked for in the text, as a thousand syntax trees take a quarter of a minute."""

HELPERS = ROOT / "tests" / "cases"


def nearest(path: str, count: int, beyond: int = 0) -> list[str]:
    """Test files near a file, the nearest first; of equally near ones those that import least.

    A file named like the module is nearest of all. Effects are asked for by name, so that a test
    which names one is near to it, and to a module that this effect alone reaches.

    Parameters
    ----------
    beyond : how many of the nearest are left out.
    """
    module, stem = path.removesuffix(".py").replace("/", "."), Path(path).stem
    ranked, called = [], {stem, *_effects_on(module)}
    for test in _tests():
        steps = _steps(test)
        if module in steps:
            named = test.stem in (f"test_{stem}", f"test_{stem}s")
            ranked.append((not named, steps[module], len(steps), _name(test)))
        elif often := sum(_text(test).count(name) for name in called):
            far = 4 if "studies" in test.parts else 3  # these try many effects
            ranked.append((True, far, -often, _name(test)))
    return [name for *_, name in sorted(ranked)][beyond : beyond + count]


@cache
def _text(test: Path) -> str:
    """A test file, and the cases that it takes from beside."""
    cases = [HELPERS / f"{name}.py" for name, steps in _steps(test).items() if steps == 1]
    return "\n".join(path.read_text() for path in (test, *cases) if path.is_file())


@cache
def _effects_on(module: str) -> tuple[str, ...]:
    """Names of the effects that are built on a module of their room."""
    room = ROOT / "spinepipe" / "effects"
    return tuple(path.stem for path in sorted(room.glob("*.py")) if module in _imports(path))


@cache
def _tests() -> tuple[Path, ...]:
    found = sorted((ROOT / "tests").rglob("test_*.py"))
    return tuple(path for path in found if not {*path.relative_to(ROOT).parts} & {*NEVER})


def _name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def _steps(test: Path) -> dict[str, int]:
    """How many imports each module is from a test file."""
    found: dict[str, int] = {}
    waiting = deque([(name, 1) for name in _imports(test)])
    while waiting:
        name, steps = waiting.popleft()
        path = _source(name)
        if path is None or name in found:
            continue
        found[name] = steps
        # a package hands on what its modules define
        further = steps if path.name == "__init__.py" else steps + 1
        waiting.extend((one, further) for one in _imports(path))
    return found


@cache
def _source(name: str) -> Path | None:
    base = ROOT.joinpath(*name.split("."))
    for path in (base / "__init__.py", base.with_suffix(".py"), HELPERS / f"{name}.py"):
        if path.is_file():
            return path
    return None


@cache
def _imports(path: Path) -> tuple[str, ...]:
    return tuple(dict.fromkeys(_named(path.read_text())))


def _named(text: str) -> Iterable[str]:
    """Modules that a text imports, and what it takes from them, which may be modules too."""
    for line, module, names in _IMPORT.findall(text):
        yield from (one.split()[0] for one in line.split(",") if one.strip())
        yield from (f"{module}.{name}" for name in re.findall(r"(\w+)(?: as \w+)?", names))
        if module:
            yield module

"""The house keeps its plan: who imports whom, and what no tracked file may hold.

Rooms stand as in the plan of the house, but for three: `report` comes before `jobs`, which draw its
figures, `tables` after `statics`, whose status they store, and `statistics` has left `sensitivity`.
"""

import ast
import re
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "spinepipe"

ROOMS = (
    *("units", "problems", "decomposition", "files", "marks", "frames", "anatomy"),
    *("effects", "model", "world", "statics"),
    *("calibrate", "designs", "statistics", "sensitivity"),
    *("tables", "comparison", "cohort", "studies", "discrepancy", "report", "jobs", "cli"),
)
"""Ground floor first; a room imports only itself and rooms before it."""

MODULES = sorted((ROOT / PACKAGE).rglob("*.py"))
LOCKS = sorted(ROOT.glob("requirements*.lock"))

LARGEST_BYTES = 1_500_000
LARGE_ON_PURPOSE: frozenset[str] = frozenset()
"""Tracked files that may be larger, as paths from the root."""

# Put together here, so that this file does not itself hold what it forbids.
REGISTRY_HOSTS = re.compile(
    "|".join(
        re.escape(".".join(parts))
        for parts in (
            ("pypi", "org"),
            ("python" + "hosted", "org"),
            ("anaconda", "org"),
            ("npmjs", "org"),
            ("proxy", "golang", "org"),
            ("crates", "io"),
        )
    ),
    re.IGNORECASE,
)
MACHINE_PATHS = re.compile(
    r"(?<![\w.$}*])/(?:" + "|".join(("wo" + "rk", "ro" + "ot", "ho" + "me", "Us" + "ers")) + r")/\w"
)
DECOMPOSING = re.compile(
    r"numpy\.linalg\.(svd|svdvals|lstsq|pinv|matrix_rank|cond|eigh)"
    r"|scipy\.linalg\.(svd|svdvals|lstsq|pinv|pinvh|orth|null_space|polar|eigh|subspace_angles"
    r"|orthogonal_procrustes)"
    r"|scipy\.optimize\.(least_squares|lsq_linear|curve_fit)"
    r"|numpy\.polyfit|numpy\.polynomial\.\w+\.\w+fit|scipy\.stats\.multivariate_normal"
)
"""Functions that take apart matrices by divide and conquer, which can give up."""
PINNED = re.compile(r"[A-Za-z0-9._-]+(\[[^\]]+\])?==\S+")
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}")


def room_of(module: str) -> str | None:
    """The room of a dotted name inside the package, None outside it and for the package itself."""
    parts = module.split(".")
    return parts[1] if parts[0] == PACKAGE and len(parts) > 1 else None


def dotted(path: Path) -> str:
    """The dotted name of a file of the package; a package's own file counts as the package."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path: Path) -> Iterator[tuple[int, str]]:
    """Line and full name of everything a file imports, also inside functions."""
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: write the full name of the module"
            base = node.module or ""
            if base == PACKAGE:
                yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)
            else:
                yield node.lineno, base


def decompositions(tree: ast.Module) -> list[str]:
    """``line n: full name`` of every use of `DECOMPOSING`, and of norms by singular values."""
    known: dict[str, str] = {}
    found: set[tuple[int, str]] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                name = alias.asname or alias.name.split(".")[0]
                known[name] = alias.name if alias.asname else name
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                name = known[alias.asname or alias.name] = f"{node.module}.{alias.name}"
                found |= {(node.lineno, name)} if DECOMPOSING.fullmatch(name) else set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and DECOMPOSING.fullmatch(name := full(node, known)):
            found.add((node.lineno, name))
        elif isinstance(node, ast.Call) and full(node.func, known).endswith("linalg.norm"):
            words = {word.arg: word.value for word in node.keywords}
            order = [*node.args[1:2], *(words[name] for name in ("ord",) if name in words)]
            if "axis" not in words and order and ast.unparse(order[0]) in ("2", "-2", "'nuc'"):
                found.add((node.lineno, f"numpy.linalg.norm of order {ast.unparse(order[0])}"))
    return [f"line {line}: {name}" for line, name in sorted(found)]


def full(node: ast.expr, known: Mapping[str, str]) -> str:
    """The full name of an expression of dots only; empty for any other."""
    if isinstance(node, ast.Name):
        return known.get(node.id, node.id)
    if isinstance(node, ast.Attribute) and (before := full(node.value, known)):
        return f"{before}.{node.attr}"
    return ""


def tracked() -> list[str]:
    """Paths from the root of all tracked files that are there."""
    command = ["git", "-C", str(ROOT), "ls-files", "-z"]
    try:
        listed = subprocess.run(command, capture_output=True, check=True).stdout.decode()
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git working copy")
    return [name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def matches(pattern: re.Pattern[str]) -> list[str]:
    """``file:line: text`` of every match in a tracked file."""
    return [
        f"{name}:{number}: {found.group()}"
        for name in tracked()
        for number, line in enumerate((ROOT / name).read_text("latin-1").splitlines(), start=1)
        if (found := pattern.search(line))
    ]


def test_every_module_lives_in_a_known_room() -> None:
    strangers = {room for path in MODULES if (room := room_of(dotted(path)))} - set(ROOMS)
    assert not strangers, "give the room its place in ROOMS"


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_a_room_knows_only_rooms_before_it(path: Path) -> None:
    room = room_of(dotted(path))
    allowed = ROOMS[: ROOMS.index(room) + 1] if room else ()
    wrong = [
        f"line {line}: {name}"
        for line, name in imports(path)
        if (other := room_of(name)) is not None and other not in allowed
    ]
    assert not wrong


@pytest.mark.parametrize("name", ["tests", "benchmarks", "snakemake"])
def test_the_library_does_not_know(name: str) -> None:
    users = [
        f"{dotted(path)}:{line}"
        for path in MODULES
        for line, found in imports(path)
        if found.split(".")[0] == name
    ]
    assert not users


def test_only_world_imports_pybullet() -> None:
    users = {
        dotted(path)
        for path in MODULES
        for _, name in imports(path)
        if name.split(".")[0].startswith("pybullet")
    }
    assert users == {f"{PACKAGE}.world"}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import numpy as np\nnp.linalg.svd(a)", ["line 2: numpy.linalg.svd"]),
        ("import numpy\nnumpy.linalg.pinv(a)", ["line 2: numpy.linalg.pinv"]),
        ("import numpy.linalg\nnumpy.linalg.cond(a)", ["line 2: numpy.linalg.cond"]),
        ("from numpy import linalg as la\n\nla.lstsq(a, b)", ["line 3: numpy.linalg.lstsq"]),
        ("from numpy.linalg import eigh as e", ["line 1: numpy.linalg.eigh"]),
        ("from scipy.linalg import det, polar", ["line 1: scipy.linalg.polar"]),
        ("from scipy import optimize\noptimize.nnls(a)", []),
        ("from scipy.optimize import lsq_linear", ["line 1: scipy.optimize.lsq_linear"]),
        ("import numpy as np\nnp.polyfit(a, b, 1)", ["line 2: numpy.polyfit"]),
        ("import numpy as np\nnp.linalg.norm(a)\nnp.linalg.solve(a, b)\nsvd(a)", []),
        ("import numpy as np\nnp.linalg.norm(a, 2)", ["line 2: numpy.linalg.norm of order 2"]),
        (
            "import numpy as np\nnp.linalg.norm(a, ord='nuc')",
            ["line 2: numpy.linalg.norm of order 'nuc'"],
        ),
        ("import numpy as np\nnp.linalg.norm(a, ord=2, axis=1)", []),
    ],
)
def test_decompositions_are_seen_by_whatever_name(text: str, found: list[str]) -> None:
    assert decompositions(ast.parse(text)) == found


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_only_one_module_decomposes(path: Path) -> None:
    """Others would fail on some processors: see `spinepipe.decomposition`."""
    if dotted(path) != f"{PACKAGE}.decomposition":
        assert decompositions(ast.parse(path.read_bytes())) == []


def test_no_tracked_file_names_a_package_registry() -> None:
    assert matches(REGISTRY_HOSTS) == []


def test_no_tracked_file_names_a_path_of_one_machine() -> None:
    assert matches(MACHINE_PATHS) == []


def test_no_tracked_file_is_large() -> None:
    sizes = {name: (ROOT / name).stat().st_size for name in tracked()}
    large = {name for name, size in sizes.items() if size > LARGEST_BYTES}
    assert large <= LARGE_ON_PURPOSE


def test_there_are_lock_files() -> None:
    assert [path.name for path in LOCKS] == ["requirements-dev.lock", "requirements.lock"]


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.name)
def test_a_lock_file_has_hashes_and_no_address(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "://" not in text
    lines = text.replace("\\\n", " ").splitlines()
    entries = [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    assert entries
    assert [entry for entry in entries if not PINNED.match(entry)] == []
    assert [entry.split()[0] for entry in entries if not HASH.search(entry)] == []

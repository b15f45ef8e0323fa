"""The house keeps its plan (docs/decisions/0015): who imports whom, what no tracked file holds.

One loop for each rule, which lists every place that breaks it.

Catches an import upwards or across kinds, and machine paths, hosts or large files that get
tracked.
"""

import ast
import re
import subprocess
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
from sweeps import sweep

from spinepipe.jobs.code import closure
from spinepipe.studies.registry import kind_names, kind_of, place_of

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "spinepipe"

ROOMS = (
    *(
        "shipped",
        "status",
        "units",
        "problems",
        "schema",
        "documents",
        "facts",
        "files",
        "progress",
        "frames",
        "decomposition",
        "experiment",
        "marks",
        "anatomy",
    ),
    *("effects", "model", "world", "statics", "calibration", "muscles", "motion"),
    *(
        "designs",
        "statistics",
        "sensitivity_analysis",
        "cohort",
        "plausibility",
        "tables",
        "comparison",
    ),
    *(
        "studies",
        "report",
        "jobs",
        "tidy",
        "citing",
        "imports",
        "testing_machine",
        "kinds",
        "api",
        "reference",
        "cli",
    ),
)
"""Ground floor first; a room imports only itself and rooms before it.

`studies` are the files beside the folders of the kinds, `kinds` those folders.
"""

KINDS = kind_names()
MODULES = sorted((ROOT / PACKAGE).rglob("*.py"))
LOCKS = sorted(ROOT.glob("requirements*.lock"))

LARGEST_BYTES = 1_500_000
LARGE_ON_PURPOSE: frozenset[str] = frozenset()
"""Tracked files that may be larger, as paths from the root."""

CHANGING = ("progress.Progress", "studies.trunk_loads.tune.Volunteer")
"""Dataclasses that are not frozen."""

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
    if parts[0] != PACKAGE or len(parts) == 1:
        return None
    return "kinds" if kind_named(module) else parts[1]


def kind_named(module: str) -> str | None:
    """The kind of study of a dotted name, None in all other rooms."""
    parts = module.split(".")
    inside = parts[:2] == [PACKAGE, "studies"] and len(parts) > 2 and parts[2] in KINDS
    return parts[2] if inside else None


def dotted(path: Path) -> str:
    """The dotted name of a file of the package; a package's own file counts as the package."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def nodes_of(path: Path) -> list[ast.AST]:
    """The syntax of a file, flat: every rule goes over it."""
    return list(ast.walk(ast.parse(path.read_bytes())))


@cache
def imports(path: Path) -> list[tuple[int, str]]:
    """Line and full name of everything a file imports, also inside functions."""
    found: list[tuple[int, str]] = []
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: write the full name of the module"
            base = node.module or ""
            if base == PACKAGE:
                found += [(node.lineno, f"{base}.{alias.name}") for alias in node.names]
            else:
                found.append((node.lineno, base))
    return found


def decompositions(nodes: list[ast.AST]) -> list[str]:
    """``line n: full name`` of every use of `DECOMPOSING`, and of norms by singular values."""
    known: dict[str, str] = {}
    found: set[tuple[int, str]] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                name = alias.asname or alias.name.split(".")[0]
                known[name] = alias.name if alias.asname else name
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                name = known[alias.asname or alias.name] = f"{node.module}.{alias.name}"
                found |= {(node.lineno, name)} if DECOMPOSING.fullmatch(name) else set()
    for node in nodes:
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


@cache
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


def test_a_room_knows_only_rooms_before_it() -> None:
    wrong = []
    for path in MODULES:
        room = room_of(dotted(path))
        allowed = ROOMS[: ROOMS.index(room) + 1] if room else ROOMS  # what notebooks use
        wrong += [
            f"{dotted(path)}:{line}: {name}"
            for line, name in imports(path)
            if (other := room_of(name)) is not None and other not in allowed
        ]
    assert not wrong


def test_a_kind_knows_no_other_kind() -> None:
    others = [
        f"{dotted(path)}:{line}: {name}"
        for path in MODULES
        for line, name in imports(path)
        if kind_named(name) not in (None, kind_named(dotted(path)))
        and room_of(dotted(path)) != "api"  # a notebook may ask any kind
    ]
    assert not others, "kinds meet through files; what two need sinks into the core"


def test_the_core_names_no_kind() -> None:
    named = [
        f"{dotted(path)}:{node.lineno}: {node.value}"
        for path in MODULES
        if kind_named(dotted(path)) is None
        for node in nodes_of(path)
        if isinstance(node, ast.Constant) and node.value in KINDS
    ]
    assert not named, "a kind is found by its folder (spinepipe/studies/registry.py)"


def modules_of_jobs(kind: str) -> set[str]:
    """Full names of the files that hold jobs of a kind."""
    return {place_of(kind, job.name).partition(":")[0] for job in kind_of(kind).jobs}


@sweep("kind", KINDS)
def test_within_a_kind_nobody_imports_upwards(kind: str) -> None:
    base = f"{PACKAGE}.studies.{kind}"
    jobs = modules_of_jobs(kind)
    order = [
        lambda name: name.startswith((f"{base}.settings", f"{base}.tables")),
        lambda name: name == f"{base}.checks",
        lambda name: name in jobs,
        lambda name: name.startswith(f"{base}.figures"),
        lambda name: name == f"{base}.page",
        lambda name: name == f"{base}.kind",
    ]

    def floor(name: str) -> int | None:
        return next((floor for floor, there in enumerate(order) if there(name)), None)

    wrong = []
    for path in (path for path in MODULES if kind_named(dotted(path)) == kind):
        here = floor(dotted(path))
        for line, name in imports(path):
            there = floor(name)
            if here is None or there is None or name == dotted(path):
                continue
            if there > here or (name in jobs and dotted(path) in jobs):
                wrong.append(f"{dotted(path)}:{line}: {name}")
    assert not wrong


@sweep("kind", KINDS)
def test_the_folder_of_a_kind_hands_nothing_on(kind: str) -> None:
    tree = ast.parse((ROOT / PACKAGE / "studies" / kind / "__init__.py").read_bytes())
    assert not [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]


def parts_of_kinds() -> Iterator[tuple[str, str]]:
    """Every kind with the full name of each file that a digest begins with."""
    for name in KINDS:
        yield from ((name, module) for module in sorted(modules_of_jobs(name)))
        base = f"{PACKAGE}.studies.{name}"
        yield from (
            (name, f"{base}.{figure.at.partition(':')[0]}") for figure in kind_of(name).figures
        )
        yield name, f"{base}.page"


@sweep("kind, module", lambda: sorted(set(parts_of_kinds())))
def test_a_digest_hangs_on_its_own_kind_alone(kind: str, module: str) -> None:
    others = {name for name in closure(module) if kind_named(name) not in (None, kind)}
    assert not others


def test_no_result_hangs_on_the_words_of_warnings() -> None:
    warnings = f"{PACKAGE}.plausibility.warnings"
    hang = {m for _, m in parts_of_kinds() if any(n.startswith(warnings) for n in closure(m))}
    assert not hang, "a warning that is reworded would have them all computed again"


SOLVING = {
    "cohort_stiffness": {"fit", "literature", "left_out", "pool", "experiment"},
    "discrepancy": {"search"},
    "global_sensitivity": {"base", "respond", "calibrate"},
    "joint_pose_sensitivity": {
        *("calibrate", "simulate", "bootstrap", "landmark_errors", "fit_by_method"),
        *("over_load_point", "posterior"),
    },
    "range_of_motion": {"simulate"},
    "scoliosis": {"personalise", "population", "variants", "accuracy_without_top"},
    "trunk_loads": {"hold", "simplify", "tune", "respond"},
}
"""Jobs that solve equilibria."""


@sweep("kind", KINDS)
def test_what_solves_nothing_does_not_hang_on_the_engine(kind: str) -> None:
    solving = {place_of(kind, job).partition(":")[0] for job in SOLVING.get(kind, ())}
    others = {module for name, module in parts_of_kinds() if name == kind} - solving
    others |= {f"{PACKAGE}.jobs.{job}" for job in ("collect", "draw", "report")}
    assert not [module for module in sorted(others) if f"{PACKAGE}.world" in closure(module)]


@sweep("kind", KINDS)
def test_what_a_kind_declares_is_there(kind: str) -> None:
    declared = kind_of(kind)
    for job in declared.jobs:
        module, _, function = place_of(kind, job.name).partition(":")
        assert callable(getattr(import_module(module), function))
        assert set(job.writes) <= {table.name for table in declared.tables}
    for figure in declared.figures:
        module, _, function = figure.at.partition(":")
        assert callable(getattr(import_module(f"{PACKAGE}.studies.{kind}.{module}"), function))
    page = import_module(f"{PACKAGE}.studies.{kind}.page")
    assert callable(page.page)
    assert set(page.READ) <= {table.name for table in declared.tables} | {"poses"}


def test_the_library_knows_neither_its_tests_nor_its_engine() -> None:
    users = [
        f"{dotted(path)}:{line}: {found}"
        for path in MODULES
        for line, found in imports(path)
        if found.split(".")[0] in ("tests", "benchmarks", "snakemake")
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


@sweep(
    "text, found",
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
    assert decompositions(list(ast.walk(ast.parse(text)))) == found


def test_only_one_module_decomposes() -> None:
    """Others would fail on some processors: see `spinepipe.decomposition`."""
    wrong = {dotted(path): found for path in MODULES if (found := decompositions(nodes_of(path)))}
    assert set(wrong) <= {f"{PACKAGE}.decomposition"}, wrong


def test_data_are_frozen() -> None:
    """All dataclasses but those that are for being changed: progress, and what is filled once."""
    changing = {f"{PACKAGE}.{name}" for name in CHANGING}
    found = {
        f"{dotted(path)}.{node.name}"
        for path in MODULES
        for node in nodes_of(path)
        if isinstance(node, ast.ClassDef)
        for by in node.decorator_list
        if "dataclass" in ast.unparse(by) and "frozen=True" not in ast.unparse(by)
    }
    assert found == changing


def test_no_test_passes_over_what_the_dev_lock_holds() -> None:
    """A peer that is missing or broken must fail its tests: only data of others may be missing."""
    skipped = re.compile("import" + r"orskip\(")
    assert [one for one in matches(skipped) if one.startswith("tests/")] == []


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


@sweep("path", LOCKS)
def test_a_lock_file_has_hashes_and_no_address(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "://" not in text
    lines = text.replace("\\\n", " ").splitlines()
    entries = [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    assert entries
    assert [entry for entry in entries if not PINNED.match(entry)] == []
    assert [entry.split()[0] for entry in entries if not HASH.search(entry)] == []

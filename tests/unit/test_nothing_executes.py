"""Nothing that lies on disk as data is executed: no file of the library knows how (0036).

Catches a library call that runs what a data file holds.
"""

import ast
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import planted
import pytest
from cohort_cases import swap, text, write
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.documents.yaml_text import read_yaml
from spinepipe.imports.registry import read as read_mapping
from spinepipe.marks import DamagedFile, read_json
from spinepipe.model.file import read_model
from spinepipe.problems import InputError
from spinepipe.studies.read import names_by_kind, read, read_selection
from spinepipe.tables import read_frame

ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted((ROOT / "spinepipe").rglob("*.py"))
RULES = [ROOT / "Snakefile", *sorted((ROOT / "workflow").rglob("*.smk"))]

MODULES_THAT_RUN = re.compile(
    r"_?pickle|cPickle|dill|cloudpickle|joblib|shelve|marshal|dbm|runpy|code|codeop|imp|jsonpickle"
    r"|pty|builtins"
)
CALLS_THAT_RUN = re.compile(r"eval|exec|compile|__import__|breakpoint")
ATTRIBUTES_THAT_RUN = re.compile(
    r"(?!re\.)\w+\.(read_pickle|to_pickle|eval|unpack_archive|extractall|load_module|exec_module"
    r"|(unsafe|full)_load(_all)?|UnsafeLoader|FullLoader|spec_from_file_location)"
    r"|os\.(system|popen|exec\w+|spawn\w+|posix_spawn\w*|startfile)"
    r"|yaml\.load(_all)?|(np|numpy)\.load"
)
SUSPICIOUS = re.compile(
    r"pickle|dill|joblib|shelve|marshal|dbm|runpy|codeop|(import|from) (code|imp|pty)\b"
    r"|builtins|\beval\b|\bexec\b|(?<!re\.)\bcompile\b|__import__|breakpoint|unpack_archive|extractall"
    r"|\.load(_all|_module)?\b|(unsafe|full)_load|(Unsafe|Full)Loader|exec_module|spec_from_file|shell"
    r"|\bos\.(system|popen|exec|spawn|posix_spawn|startfile)",
    re.MULTILINE,
)
"""Words without which a file need not be looked at closely."""

PROGRAMS = {
    "cli/doctor.py": "starts this very Python, to see whether the engine crashes",
    "cli/slurm.py": "Slurm's own sinfo, scontrol and sacct, which say what a cluster allows",
    "citing/cite.py": "git, for the commit of the code",
    "jobs/start.py": "Snakemake, by this very Python",
    "jobs/if_changed.py": "starts the command that it is given, which is Snakemake",
}
"""Files that start a program, and why."""

BY_NAME = {
    "__init__.py": "what notebooks use, by names written there",
    "effects/__init__.py": "every file of its own folder",
    "comparison/papers.py": "the engine in the folder beside the package",
    "studies/registry.py": "folders of kinds, by a name that is one of them, and what they declare",
    "api/result.py": "the sentences of a kind, by the kind of a result",
    "cohort/cohort.py": "its arrays for notebooks, which load xarray",
    "jobs/block.py": "the job of a kind that makes the files of a block",
    "jobs/pool.py": "jobs, by names that the rules write",
    "jobs/report.py": "the page of a kind",
    "cli/program.py": "commands, each a file of its folder",
    "imports/registry.py": "what reads a settings file, by its kind, which is one written there",
    "studies/discrepancy/codec.py": "classes of data of spinepipe, see its tests",
}
"""Files that import modules by a name, and whose names these are."""


def runs(tree: ast.AST) -> Iterator[str]:
    """``line n: what`` of everything that runs what it is given, or may."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = getattr(node, "module", None)
            names = [module] if module else [alias.name for alias in node.names]
            found = [name for name in names if MODULES_THAT_RUN.fullmatch(name.split(".")[0])]
        elif isinstance(node, ast.Name):
            found = [node.id] if CALLS_THAT_RUN.fullmatch(node.id) else []
        elif isinstance(node, ast.Attribute):
            before = getattr(node.value, "id", "_")
            name = f"{before}.{node.attr}"
            found = [name] if ATTRIBUTES_THAT_RUN.fullmatch(name) else []
        elif isinstance(node, ast.keyword) and node.arg in ("allow_pickle", "shell"):
            off = isinstance(node.value, ast.Constant) and node.value.value is False
            found = [] if off else [str(node.arg)]
        else:
            continue
        yield from (f"line {getattr(node, 'lineno', 0)}: {one}" for one in found)


@sweep(
    "text, count",
    [
        ("import pickle", 1),
        ("from joblib import load", 1),
        ("import numpy as np\nnp.load(a)\nnp.load(a, allow_pickle=True)", 3),
        ("np.savez(a, allow_pickle=False)\nnp.loadtxt(a)", 0),
        ("eval('1')\nexec(a)\n__import__(b)", 3),
        ("from builtins import eval as e", 1),
        ("yaml.load(a)\nyaml.unsafe_load(a)\nyaml.load(a, Loader=yaml.FullLoader)", 4),
        ("yaml.safe_load(a)\nre.compile(a)", 0),
        ("subprocess.run(a, shell=True)\nsubprocess.run(a)", 1),
        ("os.system(a)\npd.read_pickle(a)\nframe.eval('a + b')\nself.system(a)", 3),
        ("torch.load(a)\nspec = u.spec_from_file_location(a)", 1),
    ],
)
def test_what_runs_is_seen(text: str, count: int) -> None:
    assert len(list(runs(ast.parse(text)))) == count
    assert not count or SUSPICIOUS.search(text)


def test_no_file_of_the_library_runs_what_it_reads() -> None:
    found = {}
    for path in MODULES:
        content = path.read_text(encoding="utf-8")
        what = list(runs(ast.parse(content))) if SUSPICIOUS.search(content) else []
        found |= {path.relative_to(ROOT / "spinepipe").as_posix(): what} if what else {}
    assert found == {}


def test_no_rule_runs_what_it_reads() -> None:
    """Rules are no Python, so by words; `execute` and `exec_` are names of ours and Snakemake's."""
    words = re.compile(
        r"\b(import|from) (pickle|joblib|shelve|marshal)|\b(pickle|joblib|shelve|marshal)\.\w*load"
        r"|\b(eval|exec|__import__|import_module)\(|\bos\.system|popen"
        r"|shell\s*=\s*True|^\s*shell:|yaml\.load|\bscript:|\bnotebook:|\bwrapper:",
        re.MULTILINE,
    )
    found = {path.name: words.findall(path.read_text(encoding="utf-8")) for path in RULES}
    assert {name for name, uses in found.items() if uses} == set()


def test_programs_and_modules_by_name_are_few_and_known() -> None:
    starts, imports = set(), set()
    for path in MODULES:
        content = path.read_text(encoding="utf-8")
        name = path.relative_to(ROOT / "spinepipe").as_posix()
        starts |= {name} if re.search(r"\bsubprocess\b|\bos\.fork\b", content) else set()
        imports |= {name} if "import_module(" in content else set()
    assert starts == set(PROGRAMS)
    assert imports == set(BY_NAME)


@pytest.fixture
def sprung(tmp_path: Path) -> Iterator[Path]:
    """A folder that is there if something was executed."""
    yield tmp_path / "sprung"
    assert not (tmp_path / "sprung").exists()


def test_the_traps_work(tmp_path: Path) -> None:
    """Else those below would show nothing."""
    pickle.loads(planted.a_pickle(tmp_path / "one"))
    assert (tmp_path / "one").is_dir()


def test_tags_in_yaml_build_nothing(tmp_path: Path, sprung: Path) -> None:
    tag = planted.a_tag(sprung)
    folder = tmp_path / "config"
    (folder / "studies").mkdir(parents=True)
    for name in ("config.yaml", "studies/a.yaml", "model.yaml", "machine.yaml"):
        (folder / name).write_text(f"study: a\nkind: {tag}\nstudies: {tag}\neffects: {tag}\n")
    assert read_yaml(folder / "config.yaml", "config.yaml")[0] is None
    assert names_by_kind(tmp_path) == {}
    for reader, path in (
        (lambda _: read_selection(tmp_path), folder),
        (lambda path: read(path, tmp_path), folder / "studies" / "a.yaml"),
        (read_model, folder / "model.yaml"),
        (read_mapping, folder / "machine.yaml"),
    ):
        with pytest.raises(InputError, match="tag"):
            reader(path)
    with pytest.raises(InputError, match="tag"):
        cohorts.read(write(tmp_path / "small", swap("cohort.yaml", "small", tag)))


def test_a_pickle_in_place_of_a_table_is_no_table(tmp_path: Path, sprung: Path) -> None:
    content = planted.a_pickle(sprung)
    folder = write(tmp_path / "small", text("loads.csv", content), text("bodies.csv", content))
    with pytest.raises(InputError):
        cohorts.read(folder)
    for name, reader in (("x.parquet", read_frame), ("x.json", read_json)):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(DamagedFile, match="is damaged"):
            reader(tmp_path / name)


def test_a_column_of_python_s_own_type_is_read_as_what_it_is(tmp_path: Path, sprung: Path) -> None:
    planted.a_python_type(tmp_path / "x.parquet", sprung)
    assert list(read_frame(tmp_path / "x.parquet")["specimen"]) == ["a"]
    np.testing.assert_array_equal(read_frame(tmp_path / "x.parquet").shape, (1, 1))

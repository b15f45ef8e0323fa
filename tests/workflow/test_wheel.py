"""The wheel holds all that a project needs, and works offline outside of the repository.

Catches a file of the workflow, a profile, an example or a template that does not get into the
wheel, and code that looks for such files in the repository.
"""

import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path
from zipfile import ZipFile

import pytest

import spinepipe

ROOT = Path(__file__).resolve().parents[2]
BESIDE = ("Snakefile", "requirements.lock", "config", "papers", "profiles", "workflow")
FOR_A_BUILD = ("setup.py", "MANIFEST.in", "pyproject.toml", "requirements.in", "LICENSE")
PLUGIN = "snakemake_logger_plugin_spinepipe"
_HANGS_S = 1200

BUILD = "import sys, setuptools.build_meta as build; getattr(build, sys.argv[1])(sys.argv[2])"


def run(*command: str | Path, cwd: Path, more: dict[str, str] | None = None) -> str:
    """What a program that ends well says on both streams, without the repository on its path."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [*map(str, command)],
        cwd=cwd,
        env={**kept, **(more or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=_HANGS_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built of a source package, which is built of a copy of the repository; no network."""
    folder = tmp_path_factory.mktemp("wheel")
    copy = folder / "copy"
    copy.mkdir()
    for name in (*BESIDE, *FOR_A_BUILD, "README.md", "spinepipe"):
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, copy / name)
    run(sys.executable, "-c", BUILD, "build_sdist", folder, cwd=copy)
    (source,) = folder.glob("*.tar.gz")
    with tarfile.open(source) as packed:
        packed.extractall(folder, filter="data")
    source_folder = folder / source.name.removesuffix(".tar.gz")
    # what an earlier build left is no part
    (source_folder / "build/lib/spinepipe").mkdir(parents=True)
    (source_folder / "build/lib/spinepipe/stale.py").touch()
    run(sys.executable, "-c", BUILD, "build_wheel", folder, cwd=source_folder)
    (built,) = folder.glob("*.whl")
    return built


def files_below(folder: Path, *left_out: str) -> set[str]:
    """Paths of files from the folder's parent, but for those below folders of these names."""
    return {
        path.relative_to(folder.parent).as_posix()
        for path in ([folder] if folder.is_file() else folder.rglob("*"))
        if path.is_file() and not {"__pycache__", *left_out} & set(path.parts)
    }


def test_the_wheel_holds_the_workflow_and_nothing_else(wheel: Path) -> None:
    beside = {name for part in BESIDE for name in files_below(ROOT / part, "plugins")}
    expected = files_below(ROOT / "spinepipe") | {f"spinepipe/beside/{name}" for name in beside}
    expected |= files_below(ROOT / "workflow/plugins" / PLUGIN)
    with ZipFile(wheel) as packed:
        held = set(packed.namelist())
        (about,) = (name for name in held if name.endswith("/METADATA"))
        told = packed.read(about).decode()
    assert {name for name in held if ".dist-info/" not in name} == expected
    assert f"\nVersion: {spinepipe.__version__}\n" in told
    assert "\nRequires-Dist: pybullet==3.2.7\n" in told
    assert "\nProvides-Extra: slurm\n" in told
    assert "\nProvides-Extra: notebook\n" in told


@pytest.mark.slow
@pytest.mark.full
def test_a_first_answer_offline_and_outside_of_the_repository(wheel: Path, tmp_path: Path) -> None:
    python = tmp_path / "env/bin/python"
    run(sys.executable, "-m", "venv", "--without-pip", tmp_path / "env", cwd=tmp_path)
    ours = ("pip", "--python", python, "install", "--no-deps", "--no-index", wheel)
    run(sys.executable, "-m", *ours, cwd=tmp_path)
    # libraries of the environment of the tests; what is installed there as editable is not seen
    (site,) = (tmp_path / "env/lib").glob("*/site-packages")
    libraries = [path for path in sys.path if path.endswith("site-packages")]
    (site / "libraries.pth").write_text("\n".join(libraries))

    asked = ["unshare", "--map-root-user", "--net"]
    can = shutil.which("unshare") and subprocess.run([*asked, "true"], check=False).returncode == 0
    offline = asked if can else []
    program = tmp_path / "env/bin/spinepipe"
    assert run(program, "--version", cwd=tmp_path).startswith(f"spinepipe {spinepipe.__version__} ")
    said = run(*offline, program, "init", "my", "--demo", cwd=tmp_path)
    assert "nonlinear stiffening" in said.splitlines()[-3]
    assert said.splitlines()[-2] == f"Report: {tmp_path / 'my/results/l4l5_disc/report.html'}"
    assert said.splitlines()[-1] == "Next: cd my; spinepipe import YOUR_FILE.csv"
    assert (tmp_path / "my/results/l4l5_disc/report.html").is_file()
    asks = (
        "from spinepipe.comparison.papers import beside; from spinepipe.shipped import SHIPPED; "
        "print(SHIPPED, beside())"
    )
    told = run(python, "-c", asks, cwd=tmp_path / "my")
    assert told.split() == [f"{site.resolve() / 'spinepipe/beside'}", "True"]
    # plain Snakemake agrees, and the examples are sound where they are all written
    again = run(
        *offline,
        python,
        "-m",
        "snakemake",
        "-n",
        "results/l4l5_disc/report.html",
        cwd=tmp_path / "my",
    )
    assert "Nothing to be done" in again
    run(program, "init", "all", "--examples", "--slurm", cwd=tmp_path)
    planned = run(
        python, "-m", "snakemake", "-n", "--quiet", "all", "-j1", "all", cwd=tmp_path / "all"
    )
    assert "cohort_stiffness_against_gould_2024b" in planned

"""Benchmarks and validation stand outside of the suite: what they name by words must be there.

Catches a benchmark or validation that is named and no longer there, or that cannot be started.
"""

import ast
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.validation.made_by import made_by

ROOT = Path(__file__).resolve().parents[2]


def jobs_measured() -> list[str]:
    """Modules whose memory per row is measured, as `benchmarks.sensitivity` names them."""
    tree = ast.parse((ROOT / "benchmarks" / "sensitivity.py").read_text(encoding="utf-8"))
    return [
        str(node.args[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and getattr(node.func, "id", "") == "per_row"
        and isinstance(node.args[0], ast.Constant)
    ]


def test_jobs_whose_memory_is_measured_are_there() -> None:
    found = jobs_measured()
    assert found
    assert [name for name in found if find_spec(f"spinepipe.{name}") is None] == []


def test_they_start_without_the_paths_of_the_suite() -> None:
    """As `make bench` and `make validate` do."""
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, "-c", "import benchmarks.__main__, tests.validation.__main__"]
    ended = subprocess.run(command, cwd=ROOT, env=plain, capture_output=True, check=False)
    assert ended.returncode == 0, ended.stderr.decode()


def test_validation_knows_what_its_results_were_made_by() -> None:
    assert made_by("fit", "pool") != made_by("fit")
    with pytest.raises(ModuleNotFoundError):
        made_by("no_such_job")

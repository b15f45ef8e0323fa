"""Files that tell others about this repository agree with it.

Catches a version that stands in two places, an integration that runs something else than `.ci/run`,
a hook that fetches tools of other versions, and a citation that tools cannot read.
"""

import re
import tomllib
from pathlib import Path

import yaml

import spinepipe

ROOT = Path(__file__).resolve().parents[2]


def read(name: str) -> str:
    return (ROOT / name).read_text("utf-8")


def test_the_version_stands_in_one_place() -> None:
    project = tomllib.loads(read("pyproject.toml"))
    assert "version" in project["project"]["dynamic"]
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "spinepipe.__version__"}
    for name in ("pyproject.toml", "CITATION.cff", "README.md", "docs/install.md", "Makefile"):
        assert f'"{spinepipe.__version__}"' not in read(name), name
        assert f"spinepipe-{spinepipe.__version__}" not in read(name), name


def test_pythons_are_told_as_they_are() -> None:
    (least,) = re.findall(r'requires-python = ">=(3\.\d+),<3\.\d+"', read("pyproject.toml"))
    assert f"Python {least}" in read("docs/install.md")
    assert f"python{least}" in read("Makefile")
    assert f'python-version: "{least}"' in read(".github/workflows/ci.yml")


def test_the_integration_runs_what_anybody_runs() -> None:
    (job,) = yaml.safe_load(read(".github/workflows/ci.yml"))["jobs"].values()
    assert [step["run"] for step in job["steps"] if "run" in step][-1] == ".ci/run"


def test_hooks_are_local() -> None:
    told = yaml.safe_load(read(".pre-commit-config.yaml"))["repos"]
    assert {one["repo"] for one in told} == {"local"}
    for hook in (hook for one in told for hook in one["hooks"]):
        assert hook["language"] == "system"
        tool = re.fullmatch(r"\.venv/bin/(\w+).*", hook["entry"])
        assert tool
        assert re.search(rf"^{tool[1]}==", read("requirements-dev.lock"), re.MULTILINE)


def test_the_citation_has_what_the_format_asks_for() -> None:
    told = yaml.safe_load(read("CITATION.cff"))
    assert told["cff-version"] == "1.2.0"
    known = {"cff-version", "message", "title", "authors", "abstract", "type", "license"}
    assert set(told) <= known | {"keywords"}
    assert {"message", "title", "authors"} <= set(told)
    assert all(set(author) <= {"name", "given-names", "family-names"} for author in told["authors"])
    assert told["type"] in ("software", "dataset")
    assert told["license"] == tomllib.loads(read("pyproject.toml"))["project"]["license"]
    assert len(set(told["keywords"])) == len(told["keywords"])

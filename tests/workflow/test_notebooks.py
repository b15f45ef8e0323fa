"""Notebooks of the documentation run from top to bottom, and are those of their scripts."""

import nbformat
import pytest

from docs.notebooks import make


@pytest.mark.parametrize("name", make.SCRIPTS)
def test_a_notebook_is_that_of_its_script(name: str) -> None:
    path = (make.HERE / name).with_suffix(".ipynb")
    stored = nbformat.read(path, as_version=4)
    assert [one.source for one in stored.cells] == [
        one.source for one in make.notebook(make.HERE / name).cells
    ]
    assert path.stat().st_size < 300_000


@pytest.mark.full
@pytest.mark.parametrize("name", make.SCRIPTS)
@pytest.mark.filterwarnings("default")
def test_a_notebook_runs(name: str) -> None:
    assert make.executed(make.HERE / name).cells[-1].outputs

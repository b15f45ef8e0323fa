"""`python -m docs.notebooks.make`: executes the scripts beside it, writes notebooks.

Cells begin with `# %%`, text with `# %% [markdown]`.
"""

import re
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
SCRIPTS = ("own_data.py", "sensitivity.py")
SECONDS = 600


def notebook(script: Path) -> NotebookNode:
    """The cells of a script, none executed; the same script makes the same notebook."""
    cells = []
    for part in script.read_text("utf-8").split("# %%")[1:]:
        kind, _, text = part.partition("\n")
        if "markdown" in kind:
            cells.append(new_markdown_cell(re.sub(r"^# ?", "", text, flags=re.MULTILINE).strip()))
        else:
            cells.append(new_code_cell(text.strip()))
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"
    return new_notebook(cells=cells)


def executed(script: Path) -> NotebookNode:
    """The same with outputs; an error in a cell is raised."""
    made = notebook(script)
    NotebookClient(made, timeout=SECONDS, resources={"metadata": {"path": ROOT}}).execute()
    for cell in made.cells:
        cell.metadata.pop("execution", None)  # when it ran
    made.metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    return made


def main() -> int:
    """Write all."""
    for name in SCRIPTS:
        nbformat.write(executed(HERE / name), HERE / Path(name).with_suffix(".ipynb"))
    return 0


if __name__ == "__main__":
    sys.exit(main())

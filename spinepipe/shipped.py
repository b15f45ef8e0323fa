"""Where that lies which comes along with the code: Snakefile, workflow, profiles, examples, papers.

In a clone it lies beside this package, at the top of the repository. A wheel holds it inside, where
`setup.py` puts it.
"""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_INSIDE = _PACKAGE / "beside"

IN_A_CLONE = not _INSIDE.is_dir()

SHIPPED = _PACKAGE.parent if IN_A_CLONE else _INSIDE
"""The folder of the Snakefile."""

"""The ranking of stiffness sets that `rank` wrote, as other jobs read it."""

from typing import Any

from spinepipe.marks import read_json


def ranking(path: str) -> dict[str, list[dict[str, Any]]]:
    """Specimen to its best stiffness sets, from ``best.json``.

    Raises
    ------
    DamagedFile
        For a file that is not as it was written.
    """
    found: dict[str, list[dict[str, Any]]] = read_json(path)
    return found

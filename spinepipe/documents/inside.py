"""Files that a folder names: none leads out of it, by its name or by a link."""

import os
from pathlib import Path

from spinepipe.problems import InputProblem

ALLOWED_FILE = "a file in this folder, or a link to one in it"


def leads_out(path: Path, folder: Path) -> bool:
    """Whether a file is outside of a folder, all links on the way to both of them followed.

    The folder itself may be a link: who names it says which is meant.
    """
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def outside(
    path: Path, folder: Path, place: tuple[str, int | None, str | None], name: str
) -> InputProblem | None:
    """A problem where a file of a folder leads out of it; None where it does not.

    Parameters
    ----------
    place : file, line and column or key that name it. name : as it is written there.
    """
    if not leads_out(path, folder):
        return None
    found = f"'{name}', which leads out of the folder to {os.path.realpath(path)}"
    remedy = "copy the file into the folder; the folder as a whole may be a link"
    return InputProblem(*place, found, ALLOWED_FILE, remedy)

"""What a model file says of itself, for the mark of what is computed with it."""

from hashlib import sha256
from pathlib import Path

from spinepipe.marks import read_mark
from spinepipe.studies.base_model import made_by


def base_marks(root: str, model: str | None) -> list[str]:
    """The mark of a model file among a study's results, else the digest of its bytes.

    Nothing without a file.

    Parameters
    ----------
    model : the file, absolute or relative to ``root``.
    """
    if model is None:
        return []
    path = Path(root) / model
    mark = read_mark(path) if made_by(path, Path(root)) else ""
    return [mark or sha256(path.read_bytes()).hexdigest()]

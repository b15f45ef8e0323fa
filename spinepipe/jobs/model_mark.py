"""What a model file says of itself, for the mark of what is computed with it."""

from hashlib import sha256
from pathlib import Path

from spinepipe.marks import read_mark
from spinepipe.studies.base_model import made_by


def base_marks(root: str, model: str | None) -> list[str]:
    """The mark of a model file that a study makes, else the digest of its bytes; none without one.

    Parameters
    ----------
    model : the file, absolute or relative to ``root``.
    """
    if model is None:
        return []
    path = Path(root) / model
    if made_by(path, Path(root)):
        return [read_mark(path)]
    return [sha256(path.read_bytes()).hexdigest()]

"""What a model file says of itself, for the mark of what is computed with it."""

from hashlib import sha256
from pathlib import Path

from spinepipe.jobs.code import code_digest, effect_modules
from spinepipe.marks import read_mark
from spinepipe.studies.base_model import made_by


def base_marks(root: str, model: str | None) -> list[str]:
    """The mark of a model file among a study's results, else digests of its bytes and its effects.

    Nothing without a file. The mark of a result covers the code of the effects in it already.

    Parameters
    ----------
    model : the file, absolute or relative to ``root``.
    """
    if model is None:
        return []
    path = Path(root) / model
    mark = read_mark(path) if made_by(path, Path(root)) else ""
    if mark:
        return [mark]
    raw = path.read_bytes()
    named = effect_modules()
    used = sorted(name for name in named if name.encode() in raw)
    return [sha256(raw).hexdigest(), *(code_digest(named[name]) for name in used)]

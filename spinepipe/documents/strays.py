"""Files and folders that nobody put there on purpose: editors' locks and copies, hidden things."""

from pathlib import Path


def is_hidden(name: str) -> bool:
    """Whether a name is that of a hidden file (``.#x``, ``._x``, ``.x.swp``) or a copy (``x~``)."""
    return name.startswith((".", "#", "~")) or name.endswith(("~", ".bak", ".tmp"))


def files_in(folder: Path, ending: str) -> list[Path]:
    """Files of a folder with that ending, in order; no hidden ones, no folders, no dead links."""
    return [path for path in _seen(folder) if path.suffix == ending and path.is_file()]


def folders_in(folder: Path) -> list[Path]:
    """Folders of a folder, in order; no hidden ones."""
    return [path for path in _seen(folder) if path.is_dir()]


def strays_in(folder: Path, ending: str) -> list[Path]:
    """What has that ending, or one like it, and is no file to be read: folders, dead links."""
    like = {ending, ".yml"}
    return [
        path
        for path in _seen(folder)
        if path.suffix.casefold() in like and (path.suffix != ending or not path.is_file())
    ]


def _seen(folder: Path) -> list[Path]:
    """What is in a folder but hidden things; nothing where there is no such folder."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if not is_hidden(path.name))

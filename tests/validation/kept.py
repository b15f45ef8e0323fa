"""What a validation has measured so far, so that one that was cut off goes on.

Kept in `results/validation/<part>`, one line a piece, as long as the files that it hangs on stay
the same to the byte.
"""

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PLACE = ROOT / "results/validation"


class Kept:
    """Pieces of a part by name.

    Attributes
    ----------
    known : what was measured, as JSON has it.
    """

    def __init__(self, part: str, hangs_on: Iterable[str]) -> None:
        """``hangs_on`` : patterns of files, from the root."""
        found = hashlib.sha256()
        for path in sorted(path for pattern in hangs_on for path in ROOT.glob(pattern)):
            if path.is_file():
                found.update(path.read_bytes())
        self._file = PLACE / part / f"{found.hexdigest()[:12]}.jsonl"
        self._file.parent.mkdir(parents=True, exist_ok=True)
        text = self._file.read_text(encoding="utf-8") if self._file.exists() else ""
        whole = text[: text.rfind("\n") + 1]
        self.known: dict[str, Any] = dict(map(json.loads, whole.splitlines()))
        if whole != text:  # killed in mid-line
            self._file.write_text(whole, encoding="utf-8")

    def add(self, name: str, piece: Any) -> None:
        """Keep a piece; it is on the disk when this returns."""
        with self._file.open("a", encoding="utf-8") as out:
            out.write(json.dumps([name, piece]) + "\n")
        self.known[name] = piece

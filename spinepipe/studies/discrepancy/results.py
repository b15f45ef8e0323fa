"""What a search for missing effects leaves behind, before it is written to files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from spinepipe.model.file import ModelFile

Row = dict[str, Any]
Rows = Mapping[str, Sequence[Row]]


@dataclass(frozen=True)
class Results:
    """Everything that the files of a study hold.

    Attributes
    ----------
    verdict : content of ``verdict.json``. rows : of each table by its name; a table that is not
        there has no rows. model_base, model_with_effects : the two model files.
    """

    verdict: Mapping[str, Any]
    rows: Rows
    model_base: ModelFile
    model_with_effects: ModelFile

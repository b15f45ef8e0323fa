"""The rows of many files as one table."""

from collections.abc import Mapping, Sequence

from spinepipe.jobs.code import code_digest
from spinepipe.jobs.digest import value_digest
from spinepipe.marks import KEY
from spinepipe.schema import Table
from spinepipe.tables import arrow_schema, join, metadata_of, read

NO_MARK = "none"


class StaleFile(ValueError):
    """A file to be joined that hangs on other settings, data or code than the table does."""


def join_files(table: Table, marks: Mapping[str, str], output: str) -> None:
    """Join files of a table.

    Parameters
    ----------
    marks : the files, with the mark that each must have.

    Raises
    ------
    StaleFile
        For a file with another mark.
    """
    parts = [read(path) for path in marks]
    found = [metadata_of(part) for part in parts]
    for (path, wanted), metadata in zip(marks.items(), found, strict=True):
        _check(path, wanted, metadata.get(KEY, ""))
    mark = joined_digest(table, list(marks), list(marks.values()))
    join(table, parts, output, {**_together(found), KEY: mark})


def joined_digest(table: Table, parts: Sequence[str], marks: Sequence[str]) -> str:
    """The mark of a file of a table joined from others of these names and marks."""
    code = code_digest("spinepipe.jobs.collect")
    return value_digest(code, str(arrow_schema(table)), list(table.key), list(parts), list(marks))


def _check(path: str, wanted: str, found: str) -> None:
    if found != wanted:
        raise StaleFile(
            f"{path}: found the mark {found or NO_MARK}, expected {wanted}: the file was made with "
            "other settings, data or code than it is joined for. Run again: it counts as lost and "
            "is computed anew"
        )


def _together(found: Sequence[dict[str, str]]) -> dict[str, str]:
    """Metadata of all parts: of a digest that differs the digest of all, else all that is said."""
    together = {}
    for key in sorted({key for one in found for key in one}):
        values = sorted({one[key] for one in found if key in one})
        several = value_digest(values) if key.endswith("_digest") else ", ".join(values)
        together[key] = values[0] if len(values) == 1 else several
    return together

"""Places in a study file, and what all kinds of studies check of the tests it names."""

from collections.abc import Iterator, Sequence

from spinepipe.cohort.read_yaml import Document
from spinepipe.problems import Problem, did_you_mean, one_of

__all__ = ["at", "unknown_names", "unknown_tests"]


def at(document: Document, key: str) -> tuple[str, int | None, str]:
    """File, line and key of a setting."""
    return document.file, document.line_of(key), key


def unknown_tests(
    document: Document, tests: Sequence[str] | None, known: Sequence[str]
) -> Iterator[Problem]:
    """Tests that a study names and its cohort does not have."""
    for index, name in enumerate(tests or ()):
        if name not in known:
            remedy = did_you_mean(name, known, "delete it or add its loads")
            place = at(document, f"tests.{index}")
            yield Problem(*place, f"unknown test '{name}'", one_of(known), remedy)


def unknown_names(
    document: Document, key: str, what: str, names: Sequence[str] | None, known: Sequence[str]
) -> Iterator[Problem]:
    """Names in the list of a key that its cohort does not have.

    Parameters
    ----------
    what : kind of the names, in words.
    """
    for index, name in enumerate(names or ()):
        if name not in known:
            remedy = did_you_mean(name, known, "delete it or correct its name")
            place = at(document, f"{key}.{index}")
            yield Problem(*place, f"unknown {what} '{name}'", one_of(known), remedy)

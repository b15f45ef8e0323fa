"""What a paper says of a study: the methods of its page, its references, versions."""

import csv
import json
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from importlib.resources import files
from pathlib import Path

from spinepipe.report.conclusions import Told

_CODE = Path(__file__).resolve().parents[2]
_CODE_PARTS = ("Snakefile", "spinepipe", "workflow", "papers", "profiles", "requirements.lock")

_CSL = {"id": "id", "title": "title", "volume": "volume", "pages": "page", "doi": "DOI"}
_CSL |= {"journal": "container-title"}
_NOT_TOLD = ("id", "keyword")


def methods(conclusions: Iterable[Told], made_by: str) -> str:
    """A paragraph: what the page says of methods, and the version that computed it."""
    said = [one.text for one in conclusions if one.place == "methods"]
    return " ".join([*said, f"Computed with spinepipe {made_by}."])


def references(paragraph: str) -> list[dict[str, str]]:
    """Articles that a methods paragraph calls for: it has their keyword, or they have none."""
    with files(__package__).joinpath("references.csv").open(encoding="utf-8") as text:
        return [one for one in csv.DictReader(text) if one["keyword"].strip("*") in paragraph]


def csl_json(entries: Sequence[Mapping[str, str]]) -> str:
    """References as CSL-JSON, which Zotero, Pandoc and others read."""
    told = []
    for one in entries:
        names = [name.split(", ") for name in one["author"].split("; ")]
        fields = {theirs: one[ours] for ours, theirs in _CSL.items() if one[ours]}
        authors = [{"family": family, "given": given} for family, given in names]
        issued = {"date-parts": [[int(one["year"])]]}
        told.append({**fields, "type": "article-journal", "author": authors, "issued": issued})
    return json.dumps(told, indent=1, ensure_ascii=False)


def bibtex(entries: Sequence[Mapping[str, str]]) -> str:
    """References as BibTeX."""
    told = []
    for one in entries:
        shown = {key: cell for key, cell in one.items() if cell and key not in _NOT_TOLD}
        shown["author"] = shown["author"].replace("; ", " and ")
        lines = "".join(f"  {key} = {{{cell}}},\n" for key, cell in shown.items())
        told.append(f"@article{{{one['id']},\n{lines}}}\n")
    return "\n".join(told)


def versions(metadata: Mapping[str, str]) -> dict[str, str]:
    """What made a table, as its file says; of now the commit, where spinepipe runs from a clone."""
    found = {key.removeprefix("version_"): value for key, value in metadata.items()}
    with suppress(CommitUnknown):
        commit, changed = commit_of_code()
        found["commit now"] = commit + "-dirty" * bool(changed)
    return found


class CommitUnknown(Exception):
    """Why the commit of the code is not known, in a sentence."""


def commit_of_code() -> tuple[str, str]:
    """The commit of the code that runs, and what of it was changed since, as git lists it.

    Raises
    ------
    CommitUnknown
        Where the code was not read from its own repository, or without git.
    """

    def git(*arguments: str) -> str:
        command = ["git", "--no-optional-locks", "-C", str(_CODE), *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.rstrip()

    try:
        if Path(git("rev-parse", "--show-toplevel")).resolve() != _CODE:
            why = "The commit is not known: the code lies in the repository of something else."
            raise CommitUnknown(why)
        return git("rev-parse", "HEAD"), git("status", "--porcelain", "--", *_CODE_PARTS)
    except (OSError, subprocess.CalledProcessError):
        why = "The commit is not known: the code was not read from its repository, or without git."
        raise CommitUnknown(why) from None

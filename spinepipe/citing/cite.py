"""What a paper says of a study: the methods of its page, its references, versions."""

import csv
import json
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import spinepipe
from spinepipe.report.conclusions import Told

_CSL = {"id": "id", "title": "title", "volume": "volume", "pages": "page", "doi": "DOI"}
_CSL |= {"journal": "container-title"}
_NOT_TOLD = ("id", "keyword")


def methods(conclusions: Iterable[Told], made_by: str = spinepipe.__version__) -> str:
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
    clone = Path(spinepipe.__file__).parents[1]
    if (clone / ".git").exists():
        asked = ["git", "-C", str(clone), "describe", "--always", "--dirty", "--exclude=*"]
        done = subprocess.run(asked, capture_output=True, text=True, check=False)
        found |= {"commit now": done.stdout.strip()} if done.returncode == 0 else {}
    return found

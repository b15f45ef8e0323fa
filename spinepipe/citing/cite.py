"""What a paper says of a study: the methods of its page, its references, versions."""

import json
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

import spinepipe
from spinepipe.report.conclusions import Told

_FIELDS = {"title": "title", "container-title": "journal", "volume": "volume", "page": "pages"}
"""BibTeX's names of fields of CSL."""


def methods(conclusions: Iterable[Told], made_by: str = spinepipe.__version__) -> str:
    """A paragraph: what the page says of methods, and the version that computed it."""
    said = [one.text for one in conclusions if one.place == "methods"]
    return " ".join([*said, f"Computed with spinepipe {made_by}."])


def references(paragraph: str) -> list[dict[str, Any]]:
    """Entries of CSL data that a methods paragraph calls for."""
    return [
        {**one, "issued": {"date-parts": [[one["issued"]]]}}
        for one in _entries()
        if any(word == "*" or word in paragraph for word in one["keyword"].split("|"))
    ]


def csl_json(entries: Sequence[Mapping[str, Any]]) -> str:
    """Entries as CSL-JSON, which Zotero, Pandoc and others read."""
    plain = [{key: value for key, value in one.items() if key != "keyword"} for one in entries]
    return json.dumps(plain, indent=1, ensure_ascii=False)


def bibtex(entries: Sequence[Mapping[str, Any]]) -> str:
    """Entries as BibTeX."""
    told = []
    for one in entries:
        authors = " and ".join(f"{name['family']}, {name['given']}" for name in one["author"])
        fields = {"author": authors, "year": one["issued"]["date-parts"][0][0]}
        fields |= {_FIELDS[key]: one[key].replace("&", r"\&") for key in _FIELDS if key in one}
        fields |= {"doi": one["DOI"]} if "DOI" in one else {}
        lines = "".join(f"  {key} = {{{value}}},\n" for key, value in fields.items())
        told.append(f"@article{{{one['id']},\n{lines}}}\n")
    return "\n".join(told)


def versions(metadata: Mapping[str, str]) -> dict[str, str]:
    """What made a table, as its file says; of now the commit, where spinepipe runs from a clone.

    Parameters
    ----------
    metadata : of a table, with versions of libraries and digests of code, settings and data.
    """
    found = {key.removeprefix("version_"): value for key, value in metadata.items()}
    clone = Path(spinepipe.__file__).parents[1]
    if (clone / ".git").exists():
        asked = ["git", "-C", str(clone), "describe", "--always", "--dirty", "--exclude=*"]
        done = subprocess.run(asked, capture_output=True, text=True, check=False)
        found |= {"commit now": done.stdout.strip()} if done.returncode == 0 else {}
    return found


@cache
def _entries() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = yaml.safe_load(
        files(__package__).joinpath("references.yaml").read_text("utf-8")
    )
    return found

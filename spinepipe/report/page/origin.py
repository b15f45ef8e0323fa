"""Where results come from: what a page tells of the run that made them."""

from collections.abc import Mapping
from dataclasses import dataclass

import yaml

from spinepipe.marks import KEY
from spinepipe.studies.study import Study

_VERSION = "version_"
"""Before the name of a library, in metadata that tell its version."""
_OF_A_TABLE = ("code_digest", "config_digest", "data_digest", "specimens_digest", KEY)
"""Metadata that differ from table to table, and are not told as facts of the whole run."""


@dataclass(frozen=True)
class Origin:
    """What was run: by which code, with which settings and on which data the tables were made.

    Attributes
    ----------
    facts : name and value of what all tables agree on; where they do not, every value.
    digests : of each table its name, the digest (sha256) of the code that made it, and that of the
        settings that it hangs on.
    settings : all settings of the study as YAML.
    """

    facts: tuple[tuple[str, str], ...]
    digests: tuple[tuple[str, str, str], ...]
    settings: str


def origin(study: Study, metadata: Mapping[str, Mapping[str, str]]) -> Origin:
    """What the metadata of all tables say, in alphabetical order; versions of libraries last."""
    settings = yaml.safe_dump(study.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
    digests = tuple(
        (name, found.get("code_digest", ""), found.get("config_digest", ""))
        for name, found in sorted(metadata.items())
    )
    return Origin(tuple(_facts(metadata)), digests, settings)


def _facts(metadata: Mapping[str, Mapping[str, str]]) -> list[tuple[str, str]]:
    """See `Origin.facts`."""
    names = sorted({name for found in metadata.values() for name in found})
    plain = [name for name in names if not name.startswith(_VERSION)]
    versions = [name for name in names if name.startswith(_VERSION)]
    facts = []
    for name in [*plain, *versions]:
        # `pandas`: that library's own notes on the columns of a file, which say nothing of a run
        if name in _OF_A_TABLE or name == "pandas":
            continue
        values = sorted({found[name] for found in metadata.values() if name in found})
        label = name.removeprefix(_VERSION) if name in versions else name.replace("_", " ")
        facts.append((label, ", ".join(values)))
    return facts

"""What was run: settings, seed, versions and digests, from the files of the tables."""

from collections.abc import Mapping
from dataclasses import dataclass

import yaml

from spinepipe.studies import JointPoseSensitivity, Study

_VERSION = "version_"


@dataclass(frozen=True)
class Origin:
    """Where the tables come from.

    Attributes
    ----------
    facts : name and value of what all tables agree on; where they do not, every value.
    digests : table, digest of the code that made it and digest of its settings.
    settings : all settings of the study as YAML.
    """

    facts: tuple[tuple[str, str], ...]
    digests: tuple[tuple[str, str, str], ...]
    settings: str


def origin(study: Study, metadata: Mapping[str, Mapping[str, str]]) -> Origin:
    """What the metadata of all tables say, in alphabetical order."""
    settings = yaml.safe_dump(study.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
    digests = tuple(
        (name, found.get("code_digest", ""), found.get("config_digest", ""))
        for name, found in sorted(metadata.items())
    )
    return Origin(tuple(_facts(metadata)), digests, settings)


def left_out(study: JointPoseSensitivity) -> tuple[str, ...]:
    """Optional parts that the settings leave out, each with the setting that does."""
    parts = (
        ("bootstrap over start values", "start_bootstrap: sets", study.start_bootstrap.sets),
        ("bootstrap over damping", "damping_bootstrap: sets", study.damping_bootstrap.sets),
        ("comparison of ways of fitting", "methods: poses", study.methods.poses),
        ("landmark precision", "landmark_precision: poses", study.landmark_precision.poses),
    )
    return tuple(f"{part} ({setting}: 0)" for part, setting, number in parts if not number)


def _facts(metadata: Mapping[str, Mapping[str, str]]) -> list[tuple[str, str]]:
    names = sorted({name for found in metadata.values() for name in found})
    plain = [name for name in names if not name.startswith(_VERSION)]
    versions = [name for name in names if name.startswith(_VERSION)]
    facts = []
    for name in [*plain, *versions]:
        if name in ("code_digest", "config_digest", "pandas"):
            continue
        values = sorted({found[name] for found in metadata.values() if name in found})
        label = name.removeprefix(_VERSION) if name in versions else name.replace("_", " ")
        facts.append((label, ", ".join(values)))
    return facts

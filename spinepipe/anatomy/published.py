"""Read the published reference values that ship with the package."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

PAPERS = ("gould_2024a", "gould_2024b")
"""Names that `published` knows; each is a TOML file beside this one."""


@cache
def published(name: str) -> Mapping[str, Any]:
    """Reference values of one paper, as a read-only nested mapping.

    Units are in the key names (``anterior_n_per_m``, ``extension_deg``). Every table has a
    ``where`` key or stands below one that has it; the top level has ``doi``. Rows that a paper
    prints in one table share one TOML table.

    Parameters
    ----------
    name : one of `PAPERS`.

    Raises
    ------
    ValueError
        If the name is not one of `PAPERS`.
    """
    if name not in PAPERS:
        raise ValueError(f"no published values {name!r}; allowed: {', '.join(PAPERS)}")
    text = files("spinepipe.anatomy").joinpath(f"{name}.toml").read_text(encoding="utf-8")
    return MappingProxyType({key: _frozen(value) for key, value in tomllib.loads(text).items()})


def _frozen(value: Any) -> Any:
    if isinstance(value, dict):
        return MappingProxyType({key: _frozen(item) for key, item in value.items()})
    if isinstance(value, list):
        return tuple(_frozen(item) for item in value)
    return value


@dataclass(frozen=True)
class Reproduction:
    """A paper whose cohort was rebuilt: its numbers stand beside results of that cohort alone.

    Attributes
    ----------
    paper : name of its numbers, one of `PAPERS`.
    cohort : name of the cohort that was rebuilt from it.
    cited : the paper as figures and captions name it.
    """

    paper: str
    cohort: str
    cited: str

    def stands_for(self, cohort: str) -> bool:
        """Whether this cohort was rebuilt from it: only then may results be held against it."""
        return cohort == self.cohort

    def beside(self, cohort: str) -> tuple[str, Mapping[str, Any]] | None:
        """How it is cited, and its numbers, for the cohort that was rebuilt from it, else None."""
        return (self.cited, published(self.paper)) if self.stands_for(cohort) else None

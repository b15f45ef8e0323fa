"""Spines of rigid vertebrae: how stiff joints are, how sure that is, which physics is missing.

What a notebook uses is named here and read when first asked for; all else may change.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from spinepipe.api import plot
    from spinepipe.api.cohorts import check, read_cohort
    from spinepipe.api.machine import import_machine
    from spinepipe.api.missing_effects import find_missing_effects
    from spinepipe.api.results import compare, open_results, run
    from spinepipe.api.sensitivity import sensitivity
    from spinepipe.api.simulation import simulate
    from spinepipe.api.stiffness import calibrate
    from spinepipe.problems import InputError

__version__ = "0.2.0"

__all__ = [
    "InputError",
    "calibrate",
    "check",
    "compare",
    "find_missing_effects",
    "import_machine",
    "open_results",
    "plot",
    "read_cohort",
    "run",
    "sensitivity",
    "simulate",
]

_PLACES = {
    "InputError": "spinepipe.problems",
    "calibrate": "spinepipe.api.stiffness",
    "check": "spinepipe.api.cohorts",
    "compare": "spinepipe.api.results",
    "find_missing_effects": "spinepipe.api.missing_effects",
    "import_machine": "spinepipe.api.machine",
    "open_results": "spinepipe.api.results",
    "read_cohort": "spinepipe.api.cohorts",
    "run": "spinepipe.api.results",
    "sensitivity": "spinepipe.api.sensitivity",
    "simulate": "spinepipe.api.simulation",
}


def __getattr__(name: str) -> Any:
    """Import on use: engine and drawing take a second to load."""
    if name == "plot":
        return import_module("spinepipe.api.plot")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)

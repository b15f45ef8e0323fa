"""Models, films and measures in plain words, for figures and findings."""

from collections.abc import Iterable

from spinepipe.studies.scoliosis.settings import MODELS

IN_WORDS = {
    "tangent": "tangent, as published",
    "tangent_fitted": "tangent, fitted",
    "linear_regions": "linear by region",
    "linear_per_segment": "linear by segment",
    "uniform": "uniform",
}
"""Models, short enough to stand beside an axis."""

TOLD = {
    "tangent": "the published tangent model",
    "tangent_fitted": "the fitted tangent model",
    "linear_regions": "the model that is linear by region",
    "linear_per_segment": "the model that is linear by segment",
    "uniform": "the uniform model",
}
"""The same inside a sentence."""

OF_FILMS = {"fitted": "Fitted films", "held_out": "Held-out films"}


def in_order(models: Iterable[str]) -> list[str]:
    """Models in the order of the settings."""
    there = set(models)
    return [name for name in MODELS if name in there]

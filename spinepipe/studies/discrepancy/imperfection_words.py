"""Imperfections in sentences: what those allowed for took up, and which are no random errors."""

from spinepipe.studies.discrepancy.verdict import Verdict
from spinepipe.studies.discrepancy.words import readable


def imperfection_sentences(verdict: Verdict) -> list[str]:
    """What a reader should know of the imperfections; nothing where the base has no fit."""
    told = verdict.imperfections
    return [] if told is None else [readable(told.message)]

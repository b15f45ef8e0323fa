"""The verdict of a search for missing effects."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum


class Answer(StrEnum):
    """What the search came to."""

    NAMED = "NAMED"
    SET = "SET"
    NULL = "NULL"
    UNKNOWN = "UNKNOWN"


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval, both None where there is none.

    Attributes
    ----------
    name : with the places it is of behind it: ``width@L4L5@s01``.
    at_bound : whether it ended at a bound, and its value says no more than that.
    """

    name: str
    value: float | None
    unit: str
    low: float | None
    high: float | None
    at_bound: bool = False


@dataclass(frozen=True)
class Rival:
    """Another name, and by how much log evidence it is behind."""

    name: str
    margin: float | None


@dataclass(frozen=True)
class Missing:
    """An effect that is missing, or one that may be.

    Attributes
    ----------
    scope : joints, coordinates, specimens and tests; ``*`` stands for all.
    log_evidence : against the model without it, None where it was not told.
    options : of its variant, in words, but for its coordinates. spread : how values may differ.
    """

    name: str
    kind: str
    scope: Mapping[str, tuple[str, ...]]
    parameters: tuple[Estimate, ...]
    log_evidence: float | None
    rivals: tuple[Rival, ...]
    options: tuple[str, ...] = ()
    spread: str = ""


@dataclass(frozen=True)
class NotTestable:
    """An effect that these tests cannot show, why, and the test that would."""

    name: str
    why: str
    test_that_would_tell: str


@dataclass(frozen=True)
class Detectable:
    """The smallest gap, noise SD, at which an effect would be named."""

    name: str
    gap: float


@dataclass(frozen=True)
class Suspicion:
    """Readings that look like an error of the data."""

    where: str
    what: str
    evidence: str


@dataclass(frozen=True)
class Before:
    """One measure of the misfit in noise SD: of fits and held out, before and with the effects."""

    base: float | None
    with_effects: float | None
    held_out_base: float | None
    held_out_with_effects: float | None
    held_out_closed: float | None


@dataclass(frozen=True)
class Noise:
    """What counts as noise, and how that is known: from repeats, or declared."""

    source: str
    rotation_sd_deg: float | None
    translation_sd_mm: float | None
    serial_correlation: float | None


@dataclass(frozen=True)
class Verdict:
    """All that a search says in a few words; see docs/studies/discrepancy.md."""

    cohort: str
    answer: Answer
    why: str
    effects: tuple[Missing, ...]
    candidates: tuple[Missing, ...]
    not_testable: tuple[NotTestable, ...]
    smallest_detectable: tuple[Detectable, ...]
    suspicions: tuple[Suspicion, ...]
    noise: Noise
    rms_residual: Before
    gap: Before
    unknown_where: str
    unknown_shape: str
    threshold: float | None
    false_alarm: float | None
    draws: int | None
    detected_from: str

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing for certain."""
        return tuple(effect.name for effect in self.effects)

    @property
    def in_set(self) -> tuple[str, ...]:
        """Names of those that cannot be told apart, each once."""
        return tuple(dict.fromkeys(one.name for one in self.candidates))

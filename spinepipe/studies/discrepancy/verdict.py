"""The verdict of a search for missing effects: what ``verdict.json`` holds, written and read.

Fields are the keys of the file, in its order. Sentences are for people: what a program asks has a
field of its own.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

EVERY = ("*",)
"""All joints, coordinates or specimens."""

REPEATS, DECLARED = "repeats", "declared"
"""Where the noise is known from."""

UNIT = "noise sd"


class Answer(StrEnum):
    """What a search came to.

    NAMED: these effects are missing and nothing else. PART: these are, and more stays. SET: one of
    several, which cannot be told apart. NULL: nothing above the noise. UNKNOWN: none that is known.
    """

    NAMED = "NAMED"
    PART = "PART"
    SET = "SET"
    NULL = "NULL"
    UNKNOWN = "UNKNOWN"


class Reason(StrEnum):
    """Why no name is given where something is missing."""

    NO_BASE = "no_base"
    DATA_ERRORS = "data_errors"
    NO_KNOWN_EFFECT = "no_known_effect"
    A_PART_STAYS = "a_part_stays"
    MOST_STAYS = "most_stays"
    IMITATED_TOGETHER = "imitated_together"
    NONE_KEEPS_ITS_PLACE = "none_keeps_its_place"
    STIFFNESS_OF_EACH_JOINT = "stiffness_of_each_joint"
    RIVALS_UNKNOWN = "rivals_unknown"
    NOT_PROVEN = "not_proven"


@dataclass(frozen=True)
class Scope:
    """Where an effect acts; ``*`` stands for all."""

    joints: tuple[str, ...] = EVERY
    coordinates: tuple[str, ...] = EVERY
    specimens: tuple[str, ...] = EVERY


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter with its 95 % interval.

    Attributes
    ----------
    name : with the places it is of behind it: ``width@L4L5@s01``.
    at_bound : whether it ended at a bound, and its value says no more than that.
    """

    name: str
    value: float
    unit: str
    ci95: tuple[float, float]
    at_bound: bool = False


@dataclass(frozen=True)
class Rival:
    """Another name, and by how much log evidence it is behind."""

    name: str
    log_evidence_margin: float


@dataclass(frozen=True)
class FieldNumber:
    """A number that a tester reads off the curve of a joint, whatever the formula of its law.

    Attributes
    ----------
    name : of `spinepipe.effects.field_numbers.NUMBERS`; minus and plus are the sides of the load.
    specimens : whose mean it is. load : at which it is told, N m or N.
    unit : N m/deg, deg, N m deg of rotations, N/mm, mm, J of translations, 1 for a share.
    ci95 : by the errors of all fitted values; None where the number comes and goes within them.
    """

    name: str
    joint: str
    coordinate: str
    specimens: int
    load: float
    value: float
    unit: str
    ci95: tuple[float, float] | None


@dataclass(frozen=True)
class Missing:
    """An effect that is missing.

    Attributes
    ----------
    variant : its options. spread : how values may differ between places.
    log_evidence : against the model without it. rivals : best first.
    field_numbers : of the joints it acts on, with all that the model has there; means over the
        specimens. Those of each are in field_numbers.parquet.
    """

    name: str
    kind: str
    scope: Scope
    variant: Mapping[str, Any]
    spread: str
    parameters: tuple[Estimate, ...]
    log_evidence: float
    rivals: tuple[Rival, ...]
    field_numbers: tuple[FieldNumber, ...] = ()


@dataclass(frozen=True)
class NotTestable:
    """An effect that these tests cannot show, why, and the test that would; empty: none tried."""

    name: str
    why: str
    test_that_would_tell: str


@dataclass(frozen=True)
class Noise:
    """SDs of one reading, None where none was read, and how they are known."""

    source: str = ""
    rotation_sd_deg: float | None = None
    translation_sd_mm: float | None = None
    serial_correlation: float = 0.0
    outliers_left_out: int = 0


@dataclass(frozen=True)
class Sizes:
    """A measure of the misfit, in fits and held out, without and with the effects."""

    unit: str = field(default=UNIT, init=False)
    base: float | None = None
    with_effects: float | None = None
    held_out_base: float | None = None
    held_out_with_effects: float | None = None


@dataclass(frozen=True)
class Gaps(Sizes):
    """The gap; ``held_out_closed`` is the share of it that the effects close held out."""

    held_out_closed: float | None = None


@dataclass(frozen=True)
class SmallestDetectable:
    """The smallest gap, noise SD, at which an effect would be found."""

    name: str
    gap: float


@dataclass(frozen=True)
class FormulaTerm:
    """One term of a formula.

    Attributes
    ----------
    joint, specimen : ``*`` for all. acts : load or reading. term : what the coefficient multiplies,
        in words; of : the motions that it is a product of, empty for other terms.
    explained : share of what is above the noise that the term adds to those before it.
    """

    specimen: str
    joint: str
    coordinate: str
    acts: str
    term: str
    coefficient: float
    sd: float
    unit: str
    explained: float
    of: tuple[str, ...] = ()


@dataclass(frozen=True)
class Formula:
    """What would describe a discrepancy that has no name; it is no effect.

    Attributes
    ----------
    terms : as they entered. text : a line for each place. explained : share of what is above the
        noise, in the fit. held_out_closed : of that in readings left out; None where none tells.
    threshold : drop of chi2 that noise alone seldom shows for the best of all terms.
    """

    terms: tuple[FormulaTerm, ...]
    text: str
    explained: float
    held_out_closed: float | None
    threshold: float


@dataclass(frozen=True)
class Tabulated:
    """Tables in the model file in the place of effects that have no name.

    Attributes
    ----------
    place : what is tabulated, and where, in words. gap : noise SD, in the fit with them.
    held_out_closed : share of what is above the noise in readings left out that they close; None
        where none tells.
    """

    place: str
    gap: float
    held_out_closed: float | None


@dataclass(frozen=True)
class Unknown:
    """What is missing without a name.

    Attributes
    ----------
    where : the largest gaps, in words. shape : as generic shapes see it, None without evidence.
    reason : why there is no name. coordinate : of the shape; None without one.
    formula : what would describe it; it is no name either.
    """

    where: str
    shape: str | None
    reason: Reason
    coordinate: str | None = None
    formula: Formula | None = None


@dataclass(frozen=True)
class Part:
    """What stays beside effects that are certain.

    Attributes
    ----------
    left_gap : noise SD, with the effects; None where it was not told.
    left_where : the largest gaps that stay, in words. left_shape : None without evidence.
    reasons : why it is not said that nothing else is missing.
    coordinate : of the shape; None without one. formula : what would describe what stays.
    """

    left_gap: float | None
    left_where: str
    left_shape: str | None
    reasons: tuple[str, ...] = ()
    coordinate: str | None = None
    formula: Formula | None = None


@dataclass(frozen=True)
class KindOfImperfection:
    """What a kind of imperfection takes up of chi2, all joints, tests and specimens together."""

    kind: str
    taken_chi2: float


@dataclass(frozen=True)
class LargeImperfection:
    """The most likely size of one imperfection, in prior SDs and in ``unit``."""

    kind: str
    where: str
    in_prior_sds: float
    value: float
    unit: str


@dataclass(frozen=True)
class CommonImperfection:
    """An imperfection that is alike in so many places that it is no random error.

    Attributes
    ----------
    mean_in_prior_sds, se : the mean, and its standard error by the scatter of the places.
    """

    kind: str
    where: str
    mean_in_prior_sds: float
    se: float
    value: float
    unit: str


@dataclass(frozen=True)
class Imperfections:
    """What the small imperfections took up that the study allows for.

    Attributes
    ----------
    gap_without, gap_with : noise SD, of the model that the verdict stands for; the first refitted
        without any, None where that has no fit. by_kind, largest : most first.
    common : those that are no random errors. message : all this in sentences.
    """

    gap_without: float | None
    gap_with: float
    by_kind: tuple[KindOfImperfection, ...]
    largest: tuple[LargeImperfection, ...]
    common: tuple[CommonImperfection, ...]
    message: str


@dataclass(frozen=True)
class WithheldEffect:
    """An effect without a name, as it is no larger than an imperfection that is allowed for.

    Attributes
    ----------
    imperfection : its kind. allowed : its prior SD, in ``unit``; 1 is a share.
    known_to : largest SD at which the effect would be evident; None where knowing this kind alone
        does not do, or it would have to be known better than anybody can.
    log_evidence : as things are. log_evidence_if_known : were the imperfection known exactly.
    """

    name: str
    imperfection: str
    allowed: float
    known_to: float | None
    unit: str
    log_evidence: float
    log_evidence_if_known: float


@dataclass(frozen=True)
class SuspectedError:
    """A mistake that the data point to; nothing is corrected.

    Attributes
    ----------
    where : specimens, and joint, coordinate or test. what : the mistake. evidence : with numbers.
    """

    where: str
    what: str
    evidence: str


@dataclass(frozen=True)
class Threshold:
    """Log evidence that an effect must exceed, how often noise does, and the draws behind it."""

    log_evidence: float | None = None
    false_alarm: float | None = None
    draws: int | None = None


@dataclass(frozen=True)
class Verdict:
    """All that a search says in a few words; see docs/studies/discrepancy.md.

    Attributes
    ----------
    effects : missing for certain. candidates_in_set : names that cannot be told apart.
    families : sets of effects that these tests cannot tell apart.
    imperfections : what those allowed for took up; None where the base has no fit.
    tabulated : of UNKNOWN and PART, what the model with effects has besides; None for nothing.
    withheld : effects that imperfections hide, one for each kind of imperfection that does.
    """

    cohort: str
    verdict: Answer
    why: str = ""
    effects: tuple[Missing, ...] = ()
    candidates_in_set: tuple[str, ...] = ()
    not_testable: tuple[NotTestable, ...] = ()
    noise: Noise = field(default_factory=Noise)
    rms_residual: Sizes = field(default_factory=Sizes)
    gap: Gaps = field(default_factory=Gaps)
    smallest_detectable: tuple[SmallestDetectable, ...] = ()
    unknown: Unknown | None = None
    part: Part | None = None
    suspected_data_errors: tuple[SuspectedError, ...] = ()
    threshold: Threshold = field(default_factory=Threshold)
    families: tuple[tuple[str, ...], ...] = ()
    imperfections: Imperfections | None = None
    tabulated: Tabulated | None = None
    withheld: tuple[WithheldEffect, ...] = ()

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing for certain."""
        return tuple(effect.name for effect in self.effects)

    @property
    def reason(self) -> Reason | None:
        """Why no name is given, where something is missing."""
        return None if self.unknown is None else self.unknown.reason


_FORM = TypeAdapter(Verdict)


def verdict_of(data: Mapping[str, Any]) -> Verdict:
    """The verdict as plain data hold it.

    Raises
    ------
    ValueError
        For data that are no verdict: key, what was found, what is allowed.
    """
    return _FORM.validate_python(data)


def read_verdict(path: str | Path) -> Verdict:
    """Read ``verdict.json``.

    Raises
    ------
    ValueError
        As `verdict_of` does.
    """
    return verdict_of(json.loads(Path(path).read_text(encoding="utf-8")))


def plain_data(verdict: Verdict) -> dict[str, Any]:
    """The verdict as JSON can hold it."""
    return asdict(verdict)

"""The verdict of a search for missing effects: what ``verdict.json`` holds, written and read.

Fields are the keys of the file, in its order. Sentences are for people: what a program asks has a
field of its own.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from math import sqrt
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from spinepipe.files import appearing
from spinepipe.marks import read_json, with_mark
from spinepipe.studies.discrepancy.verdict_unnamed import (
    Reason,
    Tabulated,
    UnnamedMisfit,
    UnnamedRest,
)

EVERY = ("*",)
"""All joints, coordinates or specimens."""

REPEATS, DECLARED = "repeats", "declared"
"""Where the noise is known from."""

UNIT = "noise sd"


class Conclusion(StrEnum):
    """What a search came to.

    NAMED: these effects are missing and nothing else. PART: these are, and more stays. SET: one of
    several, which cannot be told apart. NULL: nothing above the noise. UNKNOWN: none that is known.
    """

    NAMED = "NAMED"
    PART = "PART"
    SET = "SET"
    NULL = "NULL"
    UNKNOWN = "UNKNOWN"


@dataclass(frozen=True)
class VerdictScope:
    """Where an effect acts; ``*`` stands for all."""

    joints: tuple[str, ...] = EVERY
    coordinates: tuple[str, ...] = EVERY
    specimens: tuple[str, ...] = EVERY


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter with its 95 % interval, by profile likelihood.

    Attributes
    ----------
    name : with the places it is of behind it: ``width@L4L5@s01``.
    ci95 : low and high; None where that end is open.
    at_bound : whether it ended at a bound, and its value says no more than that.
    open_below, open_above : the readings allow the bound there, and what may lie beyond.
    identifiable : whether both ends are known; else the readings do not tell the value. None in a
        file of before this was asked.
    """

    name: str
    value: float
    unit: str
    ci95: tuple[float | None, float | None]
    at_bound: bool = False
    open_below: bool = False
    open_above: bool = False
    identifiable: bool | None = None


@dataclass(frozen=True)
class RivalName:
    """Another name, and by how much log evidence it is behind.

    ``coordinates`` : those that its best form loads; ``*`` where it names none.
    """

    name: str
    log_evidence_margin: float
    coordinates: tuple[str, ...] = ("*",)


@dataclass(frozen=True)
class Candidate:
    """One name of a set.

    Attributes
    ----------
    coordinates : those it would load; ``*`` where it names none.
    behind : log evidence by which it is behind the likeliest; None where nothing recorded tells.
    """

    name: str
    coordinates: tuple[str, ...]
    behind: float | None


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
    scope: VerdictScope
    variant: Mapping[str, Any]
    spread: str
    parameters: tuple[Estimate, ...]
    log_evidence: float
    rivals: tuple[RivalName, ...]
    field_numbers: tuple[FieldNumber, ...] = ()


@dataclass(frozen=True)
class NotTestable:
    """An effect that these tests cannot show, why, and the test that would; empty: none tried."""

    name: str
    why: str
    test_that_would_tell: str


@dataclass(frozen=True)
class ReportedNoise:
    """SDs of one reading, None where none was read, and how they are known."""

    source: str = ""
    rotation_sd_deg: float | None = None
    translation_sd_mm: float | None = None
    serial_correlation: float = 0.0
    outliers_left_out: int = 0


@dataclass(frozen=True)
class MisfitSizes:
    """A measure of the misfit, in fits and held out, without and with the effects."""

    unit: str = field(default=UNIT, init=False)
    base: float | None = None
    with_effects: float | None = None
    held_out_base: float | None = None
    held_out_with_effects: float | None = None


def share_of_gap(excess: float) -> float:
    """Share of the gap that goes with this share of the excess misfit, whose root the gap is."""
    return 1.0 - sqrt(max(0.0, 1.0 - excess))


@dataclass(frozen=True)
class Gaps(MisfitSizes):
    """The gap.

    Attributes
    ----------
    held_out_closed : share of the excess misfit (chi2) that the effects take away held out.
    held_out_gap_closed : share of the gap, which is the root of it, that they close.
    """

    held_out_closed: float | None = None
    held_out_gap_closed: float | None = None


@dataclass(frozen=True)
class LeftOut:
    """What folds of one kind say together.

    Attributes
    ----------
    kind : test, specimen or steps. folds : that were scored. base, with_effects : gaps, noise SD.
    excess_closed, gap_closed : shares of the excess misfit (chi2), and of the gap; None where noise
        may be all.
    """

    kind: str
    folds: int
    base: float
    with_effects: float
    excess_closed: float | None
    gap_closed: float | None


@dataclass(frozen=True)
class SmallestDetectable:
    """The smallest gap, noise SD, at which an effect would be found, in a set or by its own name.

    ``by_name`` : from which no other effect is as good; None where one always is.
    """

    name: str
    gap: float
    by_name: float | None = None


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
class Verdict:
    """All that a search says in a few words; see docs/studies/discrepancy.md.

    Attributes
    ----------
    effects : missing for certain. candidates_in_set : names that cannot be told apart.
    candidates : the same with their coordinates, once for each.
    families : sets of effects that these tests cannot tell apart.
    imperfections : what those allowed for took up; None where the base has no fit.
    tabulated : of UNKNOWN and PART, what the model with effects has besides; None for nothing.
    withheld : effects that imperfections hide, one for each kind of imperfection that does.
    left_out : what is told held out, tests and specimens apart.
    """

    cohort: str
    verdict: Conclusion
    why: str = ""
    effects: tuple[Missing, ...] = ()
    candidates_in_set: tuple[str, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    not_testable: tuple[NotTestable, ...] = ()
    noise: ReportedNoise = field(default_factory=ReportedNoise)
    rms_residual: MisfitSizes = field(default_factory=MisfitSizes)
    gap: Gaps = field(default_factory=Gaps)
    smallest_detectable: tuple[SmallestDetectable, ...] = ()
    unknown: UnnamedMisfit | None = None
    part: UnnamedRest | None = None
    suspected_data_errors: tuple[SuspectedError, ...] = ()
    threshold: Threshold = field(default_factory=Threshold)
    families: tuple[tuple[str, ...], ...] = ()
    imperfections: Imperfections | None = None
    tabulated: Tabulated | None = None
    withheld: tuple[WithheldEffect, ...] = ()
    left_out: tuple[LeftOut, ...] = ()

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing for certain."""
        return tuple(effect.name for effect in self.effects)

    @property
    def in_set(self) -> tuple[Candidate, ...]:
        """Names that cannot be told apart, with their coordinates where the file has them."""
        names = (Candidate(name, EVERY, None) for name in self.candidates_in_set)
        return self.candidates or tuple(names)

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
        As `verdict_of` does, and for a file that is not as it was written.
    """
    return verdict_of(read_json(path))


def plain_data(verdict: Verdict) -> dict[str, Any]:
    """The verdict as JSON can hold it."""
    return asdict(verdict)


def write_verdict(verdict: Verdict, path: str | Path, digest: str) -> None:
    """Write ``verdict.json`` with its marks; it appears whole or not at all."""
    data = with_mark(plain_data(verdict), digest)
    with appearing(path) as temporary:
        temporary.write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")

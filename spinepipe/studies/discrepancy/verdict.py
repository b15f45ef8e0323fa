"""The verdict of a search for missing effects: what ``verdict.json`` holds, written and read.

Fields are the keys of the file, in its order. Sentences are for people: what a program asks has a
field of its own.

Words. chi2 is the sum of squared residuals in noise SD, whitened: 1 for each degree of freedom
where only noise is left. *Excess misfit* is chi2 beyond that, chi2 - dof. The *gap* is its root for
each degree of freedom, ``sqrt(max(0, chi2 / dof - 1))``, in noise SD. *Log evidence* is the natural
logarithm of a ratio of marginal likelihoods. *Base* is the model without the effects looked for.
*Held out* are readings predicted by fits that did not see them.
"""

import json
from collections.abc import Collection, Mapping
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
"""Where the noise is known from: repeated cycles of a test, or the cohort's ``measurement_sd``."""

SOMETHING_ELSE, NOTHING = "something_else", "nothing"
"""Among the probabilities: that a law without a name is missing, and that nothing is."""

SURE = 0.95
"""Probability from which a name is said for certain."""

EVEN = 0.5
"""Probability from which something else is said to be there, or a further name."""

LEAST_PROBABLE = 0.005

NOT_LISTED = "something that is in no list"

UNIT = "noise sd"
"""Of `MisfitSizes`, as the file has it: SDs of the noise of one reading."""


class VerdictKind(StrEnum):
    """What a search came to.

    NAMED: these effects are missing and nothing else. PART: these are, and more stays, unnamed.
    SET: one of several is missing, which these tests cannot tell apart. NULL: nothing is missing
    above the noise. UNKNOWN: something is missing and has no name (`Verdict.reason` tells why),
    also where the data look wrong or the base has no fit.
    """

    NAMED = "NAMED"
    PART = "PART"
    SET = "SET"
    NULL = "NULL"
    UNKNOWN = "UNKNOWN"


def likeliest_beside(
    probabilities: Mapping[str, float], told: Collection[str]
) -> tuple[str, float]:
    """What is likeliest of all that is not told, and its probability; nothing among it."""
    others = {name: p for name, p in probabilities.items() if name not in told}
    return max(others.items(), key=lambda one: (one[1], one[0]), default=(NOTHING, 0.0))


class SearchEnd(StrEnum):
    """What ended a search: that no fit mattered any more, its number of fits, or the clock."""

    DONE = "done"
    FITS = "fits"
    MINUTES = "minutes"


@dataclass(frozen=True)
class SearchExtent:
    """How far a search came.

    Attributes
    ----------
    ended : by what. A search that the clock ended hangs on the computer, so that its answer is
        compared with no other.
    fits : how many were made. open : probability that may lie in sets of effects that were not
        fitted, at most.
    not_fitted : the likeliest of these sets, each as the names of its effects, `SOMETHING_ELSE`
        among them; none where no fit mattered any more.
    """

    ended: SearchEnd = SearchEnd.DONE
    fits: int = 0
    open: float = 0.0
    not_fitted: tuple[tuple[str, ...], ...] = ()


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
    name : the parameter, and behind each ``@`` a place it belongs to (joint, specimen, test):
        ``width@L4L5@s01``.
    value : in ``unit``, that of tables (deg, mm).
    ci95 : low and high; None where that end is open.
    at_bound : whether the fit ended at a limit of the parameter; the value says no more than that.
    open_below, open_above : whether the readings allow the limit on that side, so that the interval
        has no end there.
    identifiable : whether both ends are known; else the readings do not tell the value. None in
        files written before the key existed.
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
    """Another name in the place of an effect, and how much less log evidence it has there.

    ``log_evidence_margin`` : positive where the rival is the less likely; 3 is odds of 20 to 1.
    ``coordinates`` : those that its best form loads; ``*`` where it names none.
    """

    name: str
    log_evidence_margin: float
    coordinates: tuple[str, ...] = ("*",)


@dataclass(frozen=True)
class Candidate:
    """One name of a set of names that cannot be told apart.

    Attributes
    ----------
    coordinates : those it would load; ``*`` where it names none.
    behind : log evidence by which it is behind the likeliest; None where nothing recorded tells.
    """

    name: str
    coordinates: tuple[str, ...]
    behind: float | None


@dataclass(frozen=True)
class Missing:
    """An effect that is missing.

    Attributes
    ----------
    kind : as `spinepipe.effects.contract.EffectKind` writes it (``joint law``).
    variant : its options. spread : between which places (joints, specimens, tests) its values may
        differ.
    log_evidence : against the model without it. rivals : best first.
    """

    name: str
    kind: str
    scope: VerdictScope
    variant: Mapping[str, Any]
    spread: str
    parameters: tuple[Estimate, ...]
    log_evidence: float
    rivals: tuple[RivalName, ...]


@dataclass(frozen=True)
class NotTestable:
    """An effect that these tests cannot show, and why.

    ``test_that_would_tell`` : the first of a menu of additions that would show it; empty where none
    of them would.
    """

    name: str
    why: str
    test_that_would_tell: str


@dataclass(frozen=True)
class ReportedNoise:
    """SDs of one reading, before zeroing, and how they are known.

    Attributes
    ----------
    source : `REPEATS` or `DECLARED`; empty where neither is there.
    rotation_sd_deg, translation_sd_mm : root mean square over the coordinates that were read; None
        where none was.
    serial_correlation : between neighbouring load steps of a cycle.
    outliers_left_out : how many readings.
    accuracy_rotation_deg, accuracy_translation_mm : SD of the error that all cycles of a test
        share, in the same way. accuracy_assumed : whether nobody told it; None in older files.
    """

    source: str = ""
    rotation_sd_deg: float | None = None
    translation_sd_mm: float | None = None
    serial_correlation: float = 0.0
    outliers_left_out: int = 0
    accuracy_rotation_deg: float | None = None
    accuracy_translation_mm: float | None = None
    accuracy_assumed: bool | None = None


@dataclass(frozen=True)
class MisfitSizes:
    """A measure of the misfit, in fits and held out, without and with the effects.

    As `Verdict.rms_residual` it is ``sqrt(chi2 / dof)``, 1 where only noise is left; as `Gaps` it
    is the gap, 0 there. None where there is no fit, or nothing was scored.
    """

    unit: str = field(default=UNIT, init=False)
    base: float | None = None
    with_effects: float | None = None
    held_out_base: float | None = None
    held_out_with_effects: float | None = None


def share_of_gap(excess: float) -> float:
    """Share by which the gap shrinks when this share of the excess misfit is taken away.

    The gap is the root of the excess misfit: 1 - sqrt(1 - excess). Negative where the effects make
    it worse.
    """
    return 1.0 - sqrt(max(0.0, 1.0 - excess))


@dataclass(frozen=True)
class Gaps(MisfitSizes):
    """The gap; held out, beyond what a right model would leave there.

    Attributes
    ----------
    held_out_closed : share of the base's excess misfit (chi2) that the effects take away held out;
        None where noise may be all of it.
    held_out_gap_closed : the same as a share of the gap, see `share_of_gap`.
    """

    held_out_closed: float | None = None
    held_out_gap_closed: float | None = None


@dataclass(frozen=True)
class LeftOut:
    """What folds of one kind say together. A fold is a set of readings held out at once.

    Attributes
    ----------
    kind : of what is left out: test, specimen or steps.
    folds : how many were scored. base, with_effects : held-out gaps, noise SD.
    excess_closed, gap_closed : as `Gaps.held_out_closed` and `Gaps.held_out_gap_closed`, of these
        folds alone.
    """

    kind: str
    folds: int
    base: float
    with_effects: float
    excess_closed: float | None
    gap_closed: float | None


@dataclass(frozen=True)
class SmallestDetectable:
    """How large a gap an effect must make to be found in nine data sets of ten.

    ``gap`` : noise SD, to be found at all, if only in a set. ``by_name`` : noise SD, from which it
    leads over every other effect; None where another always is as good.
    """

    name: str
    gap: float
    by_name: float | None = None


@dataclass(frozen=True)
class SuspectedError:
    """A mistake that the data point to; nothing is corrected.

    Attributes
    ----------
    where : specimens, and joint, coordinate or test. what : the mistake. evidence : for it, in
        words and numbers.
    """

    where: str
    what: str
    evidence: str


@dataclass(frozen=True)
class Threshold:
    """``log_evidence`` from which a single effect is sure; None where the base has no fit."""

    log_evidence: float | None = None


@dataclass(frozen=True)
class Imperfections:
    """What the small imperfections took up that the study allows for.

    An imperfection is a small error of the set-up or its description (joint centre, axes, direction
    or size of a load, ...), a nuisance of the fit with a prior SD of its own. How large each is
    stands in imperfections.parquet.

    Attributes
    ----------
    gap_with : noise SD, of the model that the verdict stands for. gap_without : the same model
        refitted with no imperfection allowed for; None where that has no fit.
    """

    gap_without: float | None
    gap_with: float


@dataclass(frozen=True)
class Verdict:
    """All that a search says in a few words; see docs/studies/discrepancy.md.

    Attributes
    ----------
    why : the conclusion's reason, one sentence.
    effects : missing for certain.
    candidates_in_set : names that these data cannot tell apart.
    candidates : the same, each with the coordinates it would load.
    withheld : of files written by versions before; empty now.
    unknown : why nothing is named, and what is missing; None where there is no such reason.
    part : of PART, what stays beside ``effects``.
    imperfections : what those allowed for took up; None where the base has no fit.
    tabulated : of UNKNOWN and PART, tables in the model file for what has no name; None for none.
    left_out : held-out gaps by what was left out, tests and specimens apart.
    probabilities : that each effect is missing, `SOMETHING_ELSE` is, and `NOTHING`; those below
        `LEAST_PROBABLE` are not told. Empty in files written before the key existed.
    search : how far the search came; None in such files, and where the base has no fit.
    """

    cohort: str
    verdict: VerdictKind
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
    imperfections: Imperfections | None = None
    tabulated: Tabulated | None = None
    withheld: tuple[Mapping[str, Any], ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    probabilities: Mapping[str, float] = field(default_factory=dict)
    search: SearchExtent | None = None

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing for certain."""
        return tuple(effect.name for effect in self.effects)

    @property
    def in_set(self) -> tuple[Candidate, ...]:
        """Names that cannot be told apart, with their coordinates.

        Files without ``candidates`` have the names alone: each then acts on ``*``.
        """
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
        For data that are no verdict; the text has key, what was found and what is allowed.
    """
    return _FORM.validate_python(data)


def read_verdict(path: str | Path) -> Verdict:
    """Read ``verdict.json``.

    Raises
    ------
    ValueError
        As `verdict_of` does, and for a file whose marks do not fit: it was changed or cut off.
    """
    return verdict_of(read_json(path))


def plain_data(verdict: Verdict) -> dict[str, Any]:
    """The verdict as JSON can hold it."""
    return asdict(verdict)


def write_verdict(verdict: Verdict, path: str | Path, digest: str) -> None:
    """Write ``verdict.json`` with its marks; it appears whole or not at all.

    ``digest`` : of all that it was made from, see `spinepipe.marks.with_mark`.
    """
    data = with_mark(plain_data(verdict), digest)
    with appearing(path) as temporary:
        temporary.write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")

"""What a verdict says of small imperfections allowed for: what they take up, and what they hide."""

from dataclasses import dataclass


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

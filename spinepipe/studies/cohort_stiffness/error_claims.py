"""Which errors are compared to decide about a finding, and what is claimed of them."""

from dataclasses import dataclass

from spinepipe.jobs.cohort_stiffness.claims import Claim
from spinepipe.report.stage_errors import (
    FITTED,
    LEFT_OUT_CASE,
    LEFT_OUT_SPECIMEN,
    LITERATURE,
)

QUANTITY = (
    "error with {} less that with {}: root mean square of all measured rotations, mean over "
    "specimens, t interval"
)


@dataclass(frozen=True)
class Errors:
    """Errors of one representation in one stage.

    Attributes
    ----------
    single : whether of fits to single load cases, as published, or to all of them.
    """

    words: str
    representation: str
    stage: str
    single: bool = True


@dataclass(frozen=True)
class Comparison:
    """The claim that one error is larger than another.

    Attributes
    ----------
    own_readings : whether only the smaller one is of stiffness fitted to the very readings by
        which both are judged.
    """

    finding: str
    statement: str
    larger: Errors
    smaller: Errors
    own_readings: bool = False

    @property
    def claim(self) -> Claim:
        """The claim in words."""
        quantity = QUANTITY.format(self.larger.words, self.smaller.words)
        return Claim(self.finding, self.statement, quantity, "deg")


PUBLISHED = Errors("published stiffness", "literature", LITERATURE)
PUBLISHED_LEVELS = Errors("published stiffness of the levels", "literature_levels", LITERATURE)
UNIFORM = Errors("one stiffness per specimen", "per_specimen", FITTED)
UNIFORM_OF_OTHERS = Errors(
    "median of the other specimens, one stiffness for all joints",
    *("per_specimen", LEFT_OUT_SPECIMEN),
)
UNIFORM_OF_CASES = Errors(
    "one stiffness per specimen from its other load cases", "per_specimen", LEFT_OUT_CASE
)
RATIO = Errors("published ratio of levels, scaled", "level_ratio", FITTED)
RATIO_OF_OTHERS = Errors(
    "median of the other specimens, published ratio of levels", "level_ratio", LEFT_OUT_SPECIMEN
)
RATIO_OF_CASES = Errors(
    "published ratio of levels, scaled by the other load cases", "level_ratio", LEFT_OUT_CASE
)

PUBLISHED_FINDINGS = (
    Comparison(
        "optimised_beats_literature",
        "One stiffness per specimen, fitted to a load case, describes that load case better than "
        "the published stiffness.",
        *(PUBLISHED, UNIFORM, True),
    ),
    Comparison(
        "optimised_beats_literature_left_out_case",
        "One stiffness per specimen predicts a load case it was not fitted to better than the "
        "published stiffness.",
        *(PUBLISHED, UNIFORM_OF_CASES),
    ),
    Comparison(
        "cross_validation_beats_literature",
        "The median stiffness of the other specimens predicts a specimen better than the "
        "published stiffness.",
        *(PUBLISHED, UNIFORM_OF_OTHERS),
    ),
    Comparison(
        "optimised_beats_cross_validation",
        "A specimen's own stiffness describes it better than the median of the others.",
        *(UNIFORM_OF_OTHERS, UNIFORM, True),
    ),
    Comparison(
        "optimised_level_ratio_beats_literature",
        "Scaling the published stiffness of the levels to a specimen describes it better than "
        "leaving it as published.",
        *(PUBLISHED_LEVELS, RATIO, True),
    ),
    Comparison(
        "wrong_level_ratio_worse_than_uniform",
        "The published ratio of levels, scaled to a specimen, describes it worse than one "
        "stiffness for all joints.",
        *(RATIO, UNIFORM),
    ),
    Comparison(
        "wrong_level_ratio_worse_than_uniform_left_out_specimen",
        "The published ratio of levels predicts a specimen from the others worse than one "
        "stiffness for all joints.",
        *(RATIO_OF_OTHERS, UNIFORM_OF_OTHERS),
    ),
    Comparison(
        "wrong_level_ratio_worse_than_uniform_left_out_case",
        "The published ratio of levels predicts a load case from the others worse than one "
        "stiffness for all joints.",
        *(RATIO_OF_CASES, UNIFORM_OF_CASES),
    ),
)

WORDS = {
    "per_specimen": "one stiffness for all joints",
    "level_ratio": "the published ratio of levels",
    "per_joint": "a stiffness for each joint",
    "partially_pooled": "partially pooled stiffness",
}
HELD_OUT = {
    LEFT_OUT_SPECIMEN: "a specimen from the others",
    LEFT_OUT_CASE: "a load case from the others",
}
CONTESTS = (
    ("per_joint", "per_specimen"),
    ("per_joint", "level_ratio"),
    ("partially_pooled", "per_specimen"),
    ("partially_pooled", "level_ratio"),
    ("partially_pooled", "per_joint"),
)
"""Pairs of representations of which the first is claimed to predict better what is held out."""


def _contest(better: str, worse: str, stage: str) -> Comparison:
    first, second = WORDS[better], WORDS[worse]
    statement = f"{first[0].upper()}{first[1:]} predicts {HELD_OUT[stage]} better than {second}."
    return Comparison(
        f"{better}_beats_{worse}_{stage}",
        statement,
        Errors(second, worse, stage, single=False),
        Errors(first, better, stage, single=False),
    )


COMPARISONS = (
    *PUBLISHED_FINDINGS,
    *(_contest(better, worse, stage) for better, worse in CONTESTS for stage in HELD_OUT),
)

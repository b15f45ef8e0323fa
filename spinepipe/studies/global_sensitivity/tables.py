"""Tables of studies of kind global_sensitivity: the design, what it led to, and the indices."""

from spinepipe.tables.schema import (
    JOINT,
    MESSAGE,
    SPECIMEN,
    Column,
    Table,
    coordinates,
    status,
    stiffness_unit,
)
from spinepipe.tables.shared import NO_EQUILIBRIUM
from spinepipe.units import COORDINATES, TRANSLATIONS

INDEX_MEANINGS = {
    "S1": "share of the variance that the factor explains by itself",
    "ST": "share of the variance in which the factor has a part",
    "S2": "share that two factors explain only together",
    "mu": "mean elementary effect, in units of the output per range of the factor",
    "mu_star": "mean size of the elementary effects",
    "sigma": "standard deviation of the elementary effects",
    "PAWN": "median Kolmogorov-Smirnov distance between the output's distribution and that given "
    "a slice of the factor",
    "delta": "mean area between the output's density and that given the factor, halved",
    "S1_RBD": "S1 by random balance designs",
    "KS_low": "distance between the factor's distributions where the output is lowest and where "
    "it is not",
    "KS_high": "the same of the highest outputs",
}
"""What each index says."""

EVERY = "*"
"""All tests, or all joints: of stiffness."""

OUTPUTS = ("motion", "joint_load", "stiffness")

INDEX_STATUS = ("done", "constant", "too_many_failed", "too_few")
"""Whether an index could be computed."""

_SAMPLE = Column("sample", "integer", "number of the sample, from 0: a row of the design", low=0)
_FACTOR = Column("factor", "text", "factor; dummy: the one that changes nothing")
_NO_INDEX = "no index, see status"
_OF_STIFFNESS = "for stiffness, which is fitted to all of them"

DESIGN = Table(
    "design",
    "Values of all factors: one row per sample and factor, the same for all specimens.",
    ("sample", "factor"),
    (
        _SAMPLE,
        _FACTOR,
        Column(
            "value",
            "number",
            "its value: an offset from the cohort's own, or a multiplier",
            "see unit",
        ),
        Column("group", "text", "group that gets an index; the factor's own name without one"),
        Column("unit", "text", "unit of the value; 1: a multiplier", allowed=("mm", "deg", "1")),
    ),
)


def _load(coordinate: str) -> Column:
    """Generalised load that a joint carries."""
    along = coordinate in TRANSLATIONS
    name = coordinate.replace("_", " ")
    meaning = f"{'force' if along else 'moment'} conjugate to {name}, positive as {name} is"
    suffix, unit = ("n", "N") if along else ("nm", "N m")
    return Column(f"load_{coordinate}_{suffix}", "number", meaning, unit, NO_EQUILIBRIUM)


RESPONSES = Table(
    "responses",
    "What each sample leads to: one row per specimen, sample, test, load step and joint. Motion "
    "counts from step 0 where the cohort was zeroed there, otherwise from the neutral pose; loads "
    "are those that the joint carries.",
    ("specimen", "sample", "test", "step", "joint"),
    (
        SPECIMEN,
        _SAMPLE,
        Column("test", "text", "test"),
        Column("step", "integer", "load step", low=0),
        JOINT,
        *coordinates("predicted", "motion", NO_EQUILIBRIUM),
        *(_load(name) for name in COORDINATES),
        status("solve"),
        MESSAGE,
    ),
)

_NO_FIT = "no result, see status"

CALIBRATED = Table(
    "calibrated",
    "Stiffness fitted to the measured motion, once per sample: one row per specimen and sample.",
    ("specimen", "sample"),
    (
        SPECIMEN,
        _SAMPLE,
        *(
            Column(
                f"{name}_{suffix}",
                "number",
                f"stiffness against {name.replace('_', ' ')}",
                unit,
                _NO_FIT,
                low=0.0,
            )
            for name, (suffix, unit) in ((name, stiffness_unit(name)) for name in COORDINATES)
        ),
        status("fit"),
        MESSAGE,
    ),
)

_OUTPUT = (
    SPECIMEN,
    Column("output", "text", "what is explained", allowed=OUTPUTS),
    Column("test", "text", f"test; * {_OF_STIFFNESS}"),
    Column("step", "integer", f"load step; 0 {_OF_STIFFNESS}", low=0),
    Column("joint", "text", "joint; * for stiffness that all joints share"),
    Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES),
    Column(
        "index",
        "text",
        "; ".join(f"{name}: {meaning}" for name, meaning in INDEX_MEANINGS.items()),
        allowed=tuple(INDEX_MEANINGS),
    ),
    Column("factor", "text", "factor or group of factors; dummy: the one that changes nothing"),
)
_OTHER = Column("other", "text", "second factor of S2; empty for every other index")


def _numbers(no_interval: str) -> tuple[Column, ...]:
    return (
        Column("estimate", "number", "estimate of the index", "see index", _NO_INDEX),
        Column(
            "ci_low", "number", "lower end of its confidence interval", "see index", no_interval
        ),
        Column(
            "ci_high", "number", "upper end of its confidence interval", "see index", no_interval
        ),
    )


INDICES = Table(
    "indices",
    "How much of each output is due to each factor: one row per output, index and factor (S2: pair "
    "of factors). mu, mu_star and sigma have the unit of the output, other indices have none.",
    ("specimen", "output", "test", "step", "joint", "coordinate", "index", "factor", "other"),
    (
        *_OUTPUT,
        _OTHER,
        *_numbers("no index, or one without an interval"),
        Column(
            "mean",
            "number",
            "mean of the output over all runs that have it",
            "of the output",
            "no run has it",
        ),
        Column(
            "sd",
            "number",
            "standard deviation of the output over all runs that have it",
            "of the output",
            "no run has it",
            low=0.0,
        ),
        Column(
            "noise_floor",
            "number",
            "upper end of the interval of the same index of the factor that changes nothing",
            "see index",
            "no such factor, index or interval",
        ),
        Column(
            "above_floor",
            "flag",
            "whether the lower end of the interval is above that floor",
            null="no floor, or no interval",
        ),
        Column("runs", "integer", "runs that the index rests on", low=0),
        Column("failed", "integer", "runs of the design that failed", low=0),
        Column("status", "text", "whether there is an index", allowed=INDEX_STATUS),
        MESSAGE,
    ),
)

CONVERGENCE = Table(
    "convergence",
    "Indices over growing parts of the design: one row per output, index, factor and number of "
    "samples.",
    ("specimen", "output", "test", "step", "joint", "coordinate", "index", "factor", "samples"),
    (
        *_OUTPUT,
        Column("samples", "integer", "base samples of the design that were used", low=1),
        Column("runs", "integer", "runs that the index rests on", low=0),
        *_numbers("no index, or one without an interval"),
    ),
)

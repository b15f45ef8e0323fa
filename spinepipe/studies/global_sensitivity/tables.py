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


SOURCES = ("given", "fitted", "not_free", "at_bound", "no_fit")
"""Where a base stiffness comes from."""

BASE_STIFFNESS = Table(
    "base_stiffness",
    "Stiffness from which the factors start: one row per specimen, joint and coordinate.",
    ("specimen", "joint", "coordinate"),
    (
        SPECIMEN,
        Column("joint", "text", "joint, or * for all that have no row of their own"),
        Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES),
        Column("unit", "text", "unit of the numbers", allowed=("N/m", "N m/rad")),
        Column(
            "source",
            "text",
            "given: by the study file; fitted: to the measured motion; start, where there is a fit "
            "that did not decide: not_free: not asked for, at_bound: ran to a bound, so the others "
            "were fitted anew without it, no_fit: the fit failed",
            allowed=SOURCES,
        ),
        Column("start", "number", "value before any fit", "see unit", low=0.0),
        Column("stiffness", "number", "value from which the factors start", "see unit", low=0.0),
        *(
            Column(
                name,
                "number",
                f"{which} end of its 95 % region, all others fitted anew",
                "see unit",
                "not fitted, or open: the data allow the bound",
                low=0.0,
            )
            for name, which in (("low", "lower"), ("high", "upper"))
        ),
        *(
            Column(name, "flag", f"whether the region reaches the {which} bound", null="not fitted")
            for name, which in (("open_below", "lower"), ("open_above", "upper"))
        ),
        Column(
            "identifiable",
            "flag",
            "whether the data hold it: both ends lie inside the bounds and its standard error is "
            "small",
            null="not fitted",
        ),
        status("fit"),
        MESSAGE,
    ),
)

VERDICTS = ("near", "far", "not_measured", "no_equilibrium")
"""How the base moves beside what was measured."""

BASE_MOTION = Table(
    "base_motion",
    "Motion of the base, before any factor changes it, beside what was measured: one row per "
    "specimen, test, joint and coordinate, at the largest load. Joint * is the mean over the "
    "joints that were measured.",
    ("specimen", "test", "joint", "coordinate"),
    (
        SPECIMEN,
        Column("test", "text", "test"),
        Column("step", "integer", "load step", low=0),
        Column("joint", "text", "joint, or * for the mean over the measured ones"),
        Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES),
        Column("unit", "text", "unit of the numbers", allowed=("mm", "deg")),
        Column("loaded", "flag", "whether it is the coordinate that the test loads most"),
        Column("predicted", "number", "motion of the base", "see unit", NO_EQUILIBRIUM),
        Column("measured", "number", "motion that was measured", "see unit", "not measured"),
        Column(
            "noise",
            "number",
            "SD of the measured number by measurement_sd; 0 where the cohort states none",
            "see unit",
            low=0.0,
        ),
        Column(
            "ratio",
            "number",
            "predicted over measured",
            null="no pose, not measured, or measured within 2 noise of 0",
        ),
        Column(
            "verdict",
            "text",
            "near: between half and twice the measured number, 2 noise more allowed on either "
            "side; far: not",
            allowed=VERDICTS,
        ),
        status("solve"),
        MESSAGE,
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
            "upper end of the interval of the same index over factors that change nothing; of mu "
            "its size",
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
        Column(
            "noise_floor_low",
            "number",
            "lower end of that interval",
            "see index",
            "no such factor, index or interval",
        ),
        Column("floor_replicates", "integer", "factors that change nothing, drawn for it", low=0),
        Column(
            "negligible",
            "flag",
            "whether the upper end of the total index' interval is below 0.01: the factor may be "
            "fixed anywhere in its spread",
            null="no total index, or no interval",
        ),
        Column(
            "conditional",
            "flag",
            "whether runs failed: the index then speaks only of inputs at which the others stand",
        ),
    ),
)

PLACES = ("lowest_third", "highest_third", "nowhere")
"""Where failed runs lie."""

FAILED_RUNS = Table(
    "failed_runs",
    "Where in the space of factors runs failed: one row per specimen, test and factor.",
    ("specimen", "test", "factor"),
    (
        SPECIMEN,
        Column("test", "text", "test; * for fits of stiffness, which are to all of them"),
        _FACTOR,
        Column("unit", "text", "unit of the factor's values", allowed=("mm", "deg", "1")),
        Column("runs", "integer", "runs of the design", low=0),
        Column("failed", "integer", "runs that failed in some load step", low=0),
        *(
            Column(name, "integer", f"of these, runs that {how}", low=0)
            for name, how in (
                ("tipped", "have no stable equilibrium"),
                ("not_converged", "did not converge"),
                ("refused", "make no spine"),
            )
        ),
        Column("left_out", "integer", "runs that no index rests on because of them", low=0),
        *(
            Column(f"{name}_third", "integer", f"failed runs in the {which} third", low=0)
            for name, which in (
                ("low", "lowest"),
                ("middle", "middle"),
                ("high", "highest"),
            )
        ),
        *(
            Column(
                name, "number", f"{name} value of the factor at a failed run", "see unit", "none"
            )
            for name in ("lowest", "highest")
        ),
        Column(
            "p",
            "number",
            "chance of as many failed runs in that third if failing had nothing to do with the "
            "factor, times the number of thirds and factors looked at; of runs that stand or fall "
            "together one counts",
            null="no run failed",
            low=0.0,
            high=1.0,
        ),
        Column(
            "mostly",
            "text",
            "third in which more than half of the failed runs lie with p below 0.05; else nowhere",
            allowed=PLACES,
        ),
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

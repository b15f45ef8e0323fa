"""Fits in the joint poses of the paper, section 3.1, and both bootstraps (Tables 2 and 3)."""

from collections.abc import Callable, Iterator
from itertools import product

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    exactly,
    factor_of_two,
    within_width,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    FITTED,
    MEASURED_JOINTS,
    MOTION_KEY,
    NO_RAW_DATA,
    PAPER,
    STIFFNESS_KEY,
    measured,
    summary_cell,
    summary_largest,
    summary_median,
    summary_value,
)
from spinepipe.units import COORDINATE_UNITS, STIFFNESS_UNITS

_SOURCE = {"part": "damping_bootstrap", "loading": "equilibrium", "dataset": "all"}
"""Fits in the cohort's own poses from the study's start; at rest damping does not enter."""

CONTRADICTED_NOMINAL_PERCENT = {"extension": "A11"}

_OPTIMISER = "what spread the paper's optimiser adds cannot be told without its runs"
TABLE = {"damping": "Table 2", "start": "Table 3"}

SETS = {"damping": "sets of damping", "start": "start values"}

LOADINGS = ("quasi_static", "dynamic")

CONTRADICTED_PERCENT = {
    **{(what, load, "anterior"): "A12" for what, load in product(TABLE, LOADINGS)},
    **{("damping", load, "superior"): "A13" for load in LOADINGS},
    ("damping", "dynamic", "extension"): "A14",
}
"""Printed percentages that the printed errors and motion do not give."""

CLOSE = 0.01
"""Relative distance from the median within which fits are counted in the notes."""

SAME = 1e-4
"""Spread relative to the median below which fits count as ended in the same stiffness."""


def slowest_s() -> float:
    """Longest time constant of a joint's spring and damper in the paper, s."""
    start, best = PAPER["start_stiffness"], PAPER["best_model"]["stiffness"]
    translation = min(float(best["anterior_n_per_m"]), float(start["right_n_per_m"]))
    return max(
        float(PAPER["damping"]["translation_n_s_per_m"]) / translation,
        float(PAPER["damping"]["rotation_nm_s_per_rad"]) / float(best["extension_nm_per_rad"]),
    )


SPREAD = {
    ("start", "quasi_static"): "sets differ in the stiffnesses that are not fitted too, so each "
    f"is a problem of its own; {_OPTIMISER}",
    ("start", "dynamic"): "sets differ in the stiffnesses that are not fitted too, so each is a "
    f"problem of its own; {_OPTIMISER}",
    ("damping", "quasi_static"): "the paper's range of damping is not published; with its start "
    f"values joints settle with time constants up to {slowest_s():.2f} s, far below the "
    f"{float(PAPER['settling']['time_s']):g} s of a run (A37), with ten times that damping up to "
    f"{10.0 * slowest_s():.1f} s",
    ("damping", "dynamic"): "the paper's range of damping is not published, and what is read at "
    "the end of a ramp hangs on damping",
}
"""Reasons by what is sampled and the loading."""


def claims_of_nominal() -> Iterator[Claim]:
    """Largest error of a joint, and the same in percent."""
    for name in FITTED:
        where = {**_SOURCE, "quantity": "error", "coordinate": name}
        paper = float(PAPER["nominal_model_error"][MOTION_KEY[name]])
        yield Claim(
            f"nominal_model.{name}.error",
            "section 3.1",
            f"{name} error in the cohort's own joint poses, larger of two joints",
            COORDINATE_UNITS[name],
            paper,
            factor_of_two(paper),
            summary_largest("median", MEASURED_JOINTS, **where),
            NO_RAW_DATA,
        )
        percent = float(PAPER["nominal_model_error_percent"][name])
        check = CONTRADICTED_NOMINAL_PERCENT.get(name)
        yield Claim(
            f"nominal_model.{name}.error_percent",
            "section 3.1",
            f"{name} error in the cohort's own joint poses, larger of two joints",
            "% of measured",
            percent,
            factor_of_two(percent),
            summary_largest("percent_of_measured", MEASURED_JOINTS, **where),
            NO_RAW_DATA,
            contradicted=""
            if check is None
            else f"{check}: {_implied_nominal(paper, percent, name)}",
            also=_windows(_nominal_percents(paper, name)),
        )


def _implied_nominal(error: float, percent: float, name: str) -> str:
    parts = [f"{share:.1f}" for share in _nominal_percents(error, name)]
    return (
        f"{error:g} {COORDINATE_UNITS[name]} are {' or '.join(parts)} % of the printed motion, "
        f"not {percent:g} %"
    )


def _nominal_percents(error: float, name: str) -> list[float]:
    """The printed error in percent of the printed motion of either joint."""
    return [100.0 * error / measured(joint, name) for joint in MEASURED_JOINTS]


def _windows(values: list[float]) -> tuple[Range, ...]:
    """Ranges about what the paper's other numbers make of a contradicted one."""
    return tuple(factor_of_two(value) for value in values)


def claims_of_bootstraps() -> Iterator[Claim]:
    """Cells of both tables, then their pattern."""
    for what, loading in product(TABLE, LOADINGS):
        for joint, name in product(MEASURED_JOINTS, FITTED):
            yield from _cell(what, loading, joint, name)
        for name in FITTED:
            yield _percent(what, loading, name)
    yield _lower_when_quasi_static()


def _cell(what: str, loading: str, joint: str, name: str) -> Iterator[Claim]:
    """Median and range of one error."""
    printed = PAPER[f"{what}_bootstrap_error"][loading][joint]
    median, width = (float(printed[kind][MOTION_KEY[name]]) for kind in ("median", "range"))
    where = {**where_of(what, loading), "quantity": "error", "joint": joint, "coordinate": name}
    words, key = f"{name} error at {joint}, {loading}", f"{what}_bootstrap.{loading}.{joint}.{name}"
    yield Claim(
        f"{key}.median",
        TABLE[what],
        f"median {words}, over {SETS[what]}",
        COORDINATE_UNITS[name],
        median,
        within_width(median, width, "range"),
        summary_median(**where),
        NO_RAW_DATA,
    )
    yield Claim(
        f"{key}.range",
        TABLE[what],
        f"range of {words}, over {SETS[what]}",
        COORDINATE_UNITS[name],
        width,
        factor_of_two(width),
        summary_cell("range", **where),
        SPREAD[what, loading],
    )


def where_of(what: str, loading: str, dataset: str = "all") -> dict[str, str]:
    """Keys of the summary's rows of one bootstrap."""
    return {"part": f"{what}_bootstrap", "loading": loading, "dataset": dataset}


def _percent(what: str, loading: str, name: str) -> Claim:
    printed = PAPER[f"{what}_bootstrap_error"][loading]
    paper = float(printed["largest_percent"][name])
    check = CONTRADICTED_PERCENT.get((what, loading, name))
    return Claim(
        f"{what}_bootstrap.{loading}.{name}.largest_percent",
        TABLE[what],
        f"largest median {name} error of a joint, {loading}, over {SETS[what]}",
        "% of measured",
        paper,
        factor_of_two(paper),
        summary_largest(
            "percent_of_measured",
            MEASURED_JOINTS,
            **where_of(what, loading),
            quantity="error",
            coordinate=name,
        ),
        NO_RAW_DATA,
        contradicted="" if check is None else f"{check}: {_implied(what, loading, name)}",
        also=_windows(_percents_of_medians(what, loading, name)),
    )


def _implied(what: str, loading: str, name: str) -> str:
    """What the printed errors make of the printed motion."""
    printed = PAPER[f"{what}_bootstrap_error"][loading]
    percents = _percents_of_medians(what, loading, name)
    return (
        f"the printed medians are {percents[0]:.0f} and {percents[1]:.0f} % of the motion of "
        f"section 3.1, printed is {float(printed['largest_percent'][name]):g} %"
    )


def _percents_of_medians(what: str, loading: str, name: str) -> list[float]:
    """The printed medians in percent of the printed motion of either joint."""
    printed = PAPER[f"{what}_bootstrap_error"][loading]
    return [
        100.0 * float(printed[joint]["median"][MOTION_KEY[name]]) / measured(joint, name)
        for joint in MEASURED_JOINTS
    ]


def _lower_when_quasi_static() -> Claim:
    """Errors and ranges said to be lower under quasi-static loading."""
    return Claim(
        "bootstraps.quasi_static_is_lower",
        "section 3.1, Tables 2, 3",
        "share of medians and ranges of error that are lower quasi-static than dynamic",
        "%",
        100.0,
        exactly(100.0),
        _share_lower,
        NO_RAW_DATA,
        also=(Range(_printed_lower(), 100.0, "from what Tables 2 and 3 have to all"),),
        contradicted=f"A16: in Tables 2 and 3 themselves {_printed_lower():.0f} % are",
    )


def _printed_lower() -> float:
    lower = []
    for what, joint, name, kind in _cells():
        tables = [PAPER[f"{what}_bootstrap_error"][loading] for loading in LOADINGS]
        quasi_static, dynamic = (table[joint][kind][MOTION_KEY[name]] for table in tables)
        lower.append(quasi_static < dynamic)
    return 100.0 * sum(lower) / len(lower)


def _share_lower(run: Run) -> Ours:
    lower = []
    for what, joint, name, kind in _cells():
        where = {"quantity": "error", "joint": joint, "coordinate": name}
        quasi_static, dynamic = (
            summary_value(run, kind, **where_of(what, loading), **where) for loading in LOADINGS
        )
        lower.append(quasi_static < dynamic)
    return Ours(100.0 * sum(lower) / len(lower))


def _cells() -> Iterator[tuple[str, str, str, str]]:
    yield from product(TABLE, MEASURED_JOINTS, FITTED, ("median", "range"))


def claims_of_stiffness_ranges() -> Iterator[Claim]:
    """Ranges, and those over start values in those over damping."""
    for name in FITTED:
        yield from _stiffness_ranges(name)
        yield _start_against_damping(name)


def _stiffness_ranges(name: str) -> Iterator[Claim]:
    for key, what, dataset, words in (
        ("damping", "damping", "all", "over sets of damping"),
        ("start", "start", "all", "over start values"),
        ("start_without_outliers", "start", "reduced", "over start values, outliers left out"),
    ):
        paper = float(PAPER["bootstrap_stiffness_range"][key][STIFFNESS_KEY[name]])
        yield Claim(
            f"stiffness_range.{key}.{name}",
            "section 3.1",
            f"range of fitted {name} stiffness {words}, quasi-static",
            STIFFNESS_UNITS[name],
            paper,
            factor_of_two(paper),
            _stiffness_range(what, dataset, name),
            SPREAD[what, "quasi_static"],
        )


def _stiffness_range(what: str, dataset: str, name: str) -> Callable[[Run], Ours]:
    """Range in the summary, with how many fits end close to the median."""

    def ours(run: Run) -> Ours:
        where = {"quantity": "stiffness", "joint": "*", "coordinate": name}
        where |= where_of(what, "quasi_static", dataset)
        middle = summary_value(run, "median", **where)
        fits = run.rows("bootstrap", bootstrap=what, loading="quasi_static")
        values = fits.groupby("set")[STIFFNESS_KEY[name]].first().dropna()
        close = int(((values - middle).abs() <= CLOSE * abs(middle)).sum())
        which = "" if dataset == "all" else ", outliers counted,"
        share = f"{100.0 * CLOSE:g} % of the median"
        note = f"ours: {close} of {len(values)} fits{which} within {share}"
        return Ours(summary_value(run, "range", **where), note=note)

    return ours


def _start_against_damping(name: str) -> Claim:
    ranges = PAPER["bootstrap_stiffness_range"]
    paper = float(ranges["start"][STIFFNESS_KEY[name]] / ranges["damping"][STIFFNESS_KEY[name]])
    return Claim(
        f"stiffness_range.start_over_damping.{name}",
        "section 3.1",
        f"range of {name} stiffness over start values, in those over sets of damping",
        "ratio",
        paper,
        Range(1.0, None, "start values matter more than damping: above 1"),
        _start_over_damping(name),
        SPREAD["damping", "quasi_static"],
    )


def _start_over_damping(name: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        where = {"quantity": "stiffness", "joint": "*", "coordinate": name}
        start, damping = (
            summary_value(run, "range", **where_of(what, "quasi_static"), **where)
            for what in ("start", "damping")
        )
        middle = summary_value(run, "median", **where_of("damping", "quasi_static"), **where)
        if max(start, damping) < SAME * middle or damping == 0.0:
            told = f"their ranges are {start / middle:.1e} and {damping / middle:.1e} of the median"
            raise NotComputed(f"all fits end in the same stiffness, {told}: no ratio has a meaning")
        return Ours(start / damping)

    return ours

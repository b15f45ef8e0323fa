"""The paper's load and start values, and how many fits succeed (sections 2.1 to 3.2)."""

from collections.abc import Callable, Iterator
from math import radians

from spinepipe.comparison.claim import (
    FEWEST_OF_A_RATE,
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    binomial,
    exactly,
    wilson_percent,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    COUNTS,
    MEASURED_JOINTS,
    PAPER,
    REDUCED,
    SAMPLES,
    STIFFNESS_KEY,
    measured,
)
from spinepipe.units import MM_PER_M

_EXACT = (
    "fits are solved at rest with exact derivatives here; by this rule other ways of fitting may "
    "succeed as often without arriving at the optimum, see success_by_method"
)

_EMULATED = (
    "an emulation of the published way (forward run, differences) on another engine and other "
    "data; tolerances and bounds of the paper's optimiser are not published"
)

METHODS = {
    "exact": "fits with exact derivatives",
    "forward_run_default_step": "forward runs, differences with an optimiser's default step",
    "forward_run_sane_step": "forward runs, differences with a step chosen with care",
    "forward_run_raw_units": "forward runs, default step, on stiffness in N/m and N m/rad",
}

FORCE_N = float(PAPER["load"]["largest_compression_n"])

BEST_STIFFNESS = PAPER["best_model"]["stiffness"]


def claims_of_experiment() -> Iterator[Claim]:
    """Load, moment, lever arm, start values."""
    yield from _moments()
    for name in ("anterior", "right"):
        yield _outside_box(
            "start_stiffness",
            "section 2.2, Table 1",
            "A6",
            name,
            float(PAPER["start_stiffness"][STIFFNESS_KEY[name]]),
        )
    yield _outside_box(
        "best_model",
        "section 3.3, Table 1",
        "A7",
        "anterior",
        float(BEST_STIFFNESS["anterior_n_per_m"]),
    )


def _moments() -> Iterator[Claim]:
    printed = float(PAPER["load"]["flexion_moment_nm"])
    offset = float(PAPER["bodies"]["top_offset_mm"])
    moment = FORCE_N * offset / MM_PER_M
    yield _closed(
        "load.moment",
        "sections 2.1, 2.2",
        f"moment of the load at {offset:g} mm",
        "N m",
        printed,
        moment,
        f"A1: {FORCE_N:g} N at {offset:g} mm make {moment:.2f} N m, "
        f"printed is about {printed:g} N m",
    )
    arm = MM_PER_M * printed / FORCE_N
    yield _closed(
        "load.lever_arm",
        "sections 2.1, 2.2",
        "lever arm of the load",
        "mm",
        offset,
        arm,
        f"A2: {printed:g} N m of {FORCE_N:g} N need {arm:.1f} mm; printed are {offset:g} mm, and "
        f"{PAPER['load']['offset_percent_of_disc_depth']:g} % of a disc's depth",
    )
    spring = float(BEST_STIFFNESS["extension_nm_per_rad"])
    for joint in MEASURED_JOINTS:
        angle = measured(joint, "extension")
        carried = spring * radians(angle)
        yield _closed(
            f"load.spring_moment.{joint}",
            "sections 2.1, 3.1, 3.3",
            f"moment that the best model's spring carries at {joint}",
            "N m",
            printed,
            carried,
            f"A3: {spring:g} N m/rad turned by {angle:g} deg carry {carried:.2f} N m, "
            f"the load is said to be about {printed:g} N m",
        )


def _closed(
    name: str, where: str, quantity: str, unit: str, paper: float, ours: float, reason: str
) -> Claim:
    """Numbers of the paper alone that exclude each other."""
    return Claim(
        name,
        where,
        quantity,
        unit,
        paper,
        exactly(paper),
        lambda run: Ours(ours),
        "",
        note="ours: recomputed from the paper's other numbers",
        contradicted=reason,
    )


def _outside_box(of: str, where: str, check: str, name: str, value: float) -> Claim:
    box = PAPER["start_stiffness_box"]
    low, high = (float(box[end][STIFFNESS_KEY[name]]) for end in ("low", "high"))
    reason = f"{check}: {value:g} N/m lies outside Table 1, {low:g} to {high:g} N/m"
    return Claim(
        f"{of}.{name}_in_box",
        where,
        f"{name} stiffness against the box of start values",
        "N/m",
        value,
        Range(low, high, "the box of Table 1"),
        lambda run: Ours(value),
        "",
        note="ours: the paper's own number again",
        contradicted=reason,
    )


def claims_of_counts() -> Iterator[Claim]:
    """Shares of successful fits."""
    successful = int(COUNTS["pose_samples_successful"])
    yield _share(
        "pose_samples_successful",
        "section 3.2",
        "sampled joint poses fitted",
        successful,
        SAMPLES,
        _successful("poses", "equilibrium"),
    )
    yield _share(
        "pose_samples_reduced",
        "section 3.2",
        "sampled joint poses in the reduced set",
        REDUCED,
        SAMPLES,
        _reduced,
    )
    for part, words in (("start", "start stiffness"), ("damping", "damping")):
        key = f"{part}_stiffness_sets" if part == "start" else f"{part}_sets"
        yield _share(
            f"{key}_successful",
            "section 3.1",
            f"sets of {words} fitted, quasi-static",
            int(COUNTS[f"{key}_successful"]),
            int(COUNTS[key]),
            _successful(f"{part}_bootstrap", "quasi_static"),
        )
    for method, words in METHODS.items():
        yield Claim(
            f"success.{method}",
            "section 3.2",
            f"sampled joint poses fitted: {words}",
            "%",
            100.0 * successful / SAMPLES,
            binomial(successful, SAMPLES),
            _by_method(method),
            _EXACT if method == "exact" else _EMULATED,
        )


def _share(
    name: str, where: str, words: str, count: int, of: int, ours: Callable[[Run], Ours]
) -> Claim:
    paper: Range = binomial(count, of)
    return Claim(f"counts.{name}", where, words, "%", 100.0 * count / of, paper, ours, _EXACT)


def _successful(part: str, loading: str) -> Callable[[Run], Ours]:
    """Solved and moved away from the start, outliers included, as the paper counts."""

    def ours(run: Run) -> Ours:
        row = run.row("counts", part=part, loading=loading)
        failed = int(row[f"near_start_{run.asked['failed_when']}"])
        return _percent(int(row["solved"]) - failed, int(row["fits"]))

    return ours


def _reduced(run: Run) -> Ours:
    row = run.row("counts", part="poses", loading="equilibrium")
    return _percent(int(row["reduced"]), int(row["fits"]))


def _by_method(method: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        row = run.row("success_by_method", method=method)
        return _percent(int(row["successful"]), int(row["fits"]))

    return ours


def _percent(count: int, of: int) -> Ours:
    if of == 0:
        raise NotComputed("this run tried no such fit")
    if of < FEWEST_OF_A_RATE:
        low, high = wilson_percent(count, of)
        raise NotComputed(
            f"too few for a rate: {count} of {of} fits, 95 % interval {low:.0f} to {high:.0f} %; "
            f"at least {FEWEST_OF_A_RATE} are needed"
        )
    return Ours(100.0 * count / of, *wilson_percent(count, of), f"ours: {count} of {of}")

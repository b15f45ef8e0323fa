"""Ranges of motion, sharing, markers and time: what a run found beside what the paper did."""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, at_most
from spinepipe.motion.skeleton import JOINTS, LUMBAR
from spinepipe.studies.tracking.wang_2021.found import (
    BEST,
    FE,
    LB,
    SETS,
    first_of,
    numbers,
    of_kind,
    spanned,
)
from spinepipe.studies.tracking.wang_2021.paper import (
    OTHER_PERSONS,
    Value,
    missing,
    not_comparable,
    put_in,
    spread,
    yes_no,
)

LUMBAR_JOINTS = JOINTS[LUMBAR]
THORACIC = JOINTS[LUMBAR.stop :]
RMSE = {"ik": 4.8, "optk": 7.7}
RMSE_LIMIT_MM = 20.0
WHOLE = "20-80"


def claims_of_motions() -> Iterator[Claim]:
    """Ranges, sharing, markers, time."""
    yield from _ranges()
    yield from _sharing()
    yield from _markers()
    yield from _clusters()
    yield from _time()


def _by_joint(
    run: Run, kind: str, approach: str, coordinate: str, joints: tuple[str, ...]
) -> "pd.Series[float]":
    """Mean over persons of each joint's range."""
    rows = of_kind(run, "ranges", kind, approach=approach, coordinate=coordinate)
    rows = rows[rows["joint"].isin(joints)]
    if rows.empty:
        raise NotComputed("this run has no ranges of these joints")
    means: pd.Series[float] = rows.groupby("joint", observed=True)["range"].mean()
    return means


def _ranges() -> Iterator[Claim]:
    yield _window(
        "rom_thoracic_fe_optk",
        "Results",
        "largest extension of a thoracic joint over a motion, dynamics",
        "deg",
        at_most(3.15),
        _largest_thoracic(BEST),
    )
    yield _window(
        "rom_thoracic_fe_ik",
        "Results",
        "extension of a thoracic joint over a motion, inverse kinematics, largest",
        "deg",
        Range(9.38, 63.42, "the paper's range over joints, which it calls unrealistic"),
        _largest_thoracic(("ik",)),
    )
    yield _window(
        "rom_ik_cons3",
        "Fig 6",
        "largest rotation of a joint over a motion, inverse kinematics with ratios",
        "deg",
        Range(100.0, None, "over the paper's bound, of the third of its three sets"),
        _largest_constrained,
    )
    for key, low, high, note in (
        ("axial_translation_range", 5.0, 12.0, ""),
        ("axial_translation_in_vivo", 4.0, 9.0, "of other authors, in living persons"),
    ):
        yield _window(
            key,
            "Results",
            "how far lumbar vertebrae move along the spine in flexion and extension",
            "mm",
            Range(low, high, "the paper's range over vertebrae"),
            _along,
            note,
        )
    yield missing(
        "results.rom_lateral_outside_1sd",
        "Results",
        "joint whose range sideways is more than an SD off that of living persons",
        "",
        None,
        "L1L2; ranges of living persons are in a figure alone",
    )


def _window(
    key: str, where: str, quantity: str, unit: str, allowed: Range, ours: Value, note: str = ""
) -> Claim:
    return Claim(f"results.{key}", where, quantity, unit, None, allowed, ours, OTHER_PERSONS, note)


def _largest_thoracic(approaches: tuple[str, ...]) -> Value:
    def ours(run: Run) -> Ours:
        approach = first_of(run, "ranges", approaches)
        found = _by_joint(run, FE, approach, "extension", THORACIC)
        return spanned(np.asarray(found, dtype=np.float64), approach, float(found.max()))

    return ours


def _largest_constrained(run: Run) -> Ours:
    rows = run.rows("ranges", unit="deg")
    rows = rows[rows["approach"].isin(SETS)]
    if rows.empty:
        raise NotComputed("this study has no approach with ratios")
    largest = rows.iloc[int(rows["range"].to_numpy(float).argmax())]
    return Ours(float(largest["range"]), note=f"{largest['approach']}, {largest['joint']}")


def _along(run: Run) -> Ours:
    approach = first_of(run, "ranges", BEST)
    found = _by_joint(run, FE, approach, "superior", LUMBAR_JOINTS)
    return spanned(np.asarray(found, dtype=np.float64), approach)


def _sharing() -> Iterator[Claim]:
    for key, kind, paper in (
        ("cmc_flexion_extension", FE, 0.41),
        ("cmc_lateral_bending", LB, 0.84),
    ):
        yield not_comparable(
            f"results.{key}",
            "Results",
            f"likeness of persons' sharing, {kind.replace('_', ' ')}",
            "",
            paper,
            _likeness(kind),
        )
    yield yes_no(
        "results.largest_msr_lateral",
        "Results",
        "L2L3 has the largest share of lumbar bending sideways",
        _largest_sideways,
    )
    for kind in (FE, LB):
        yield yes_no(
            f"results.msr_trend.{kind}",
            "Results",
            f"shares become smaller from L1L2 down to L4L5, {kind.replace('_', ' ')}",
            _decreasing(kind),
        )


def _likeness(kind: str) -> Value:
    def ours(run: Run) -> Ours:
        approach = first_of(run, "similarity", BEST)
        rows = of_kind(run, "similarity", kind, approach=approach, window=WHOLE)
        return Ours(float(numbers(rows, "cmc").mean()), note=approach)

    return ours


def _shares(run: Run, kind: str) -> "pd.Series[float]":
    """Mean share of each lumbar joint, from below."""
    approach = first_of(run, "sharing", BEST)
    rows = of_kind(run, "sharing", kind, approach=approach, window=WHOLE).dropna(subset=["share"])
    if rows.empty:
        raise NotComputed("nobody's lumbar spine turns enough")
    means = rows.groupby("joint", observed=True)["share"].mean().astype(float)
    found: pd.Series[float] = means.reindex(list(LUMBAR_JOINTS))
    return found


def _largest_sideways(run: Run) -> tuple[bool, str]:
    shares = _shares(run, LB)
    return shares.idxmax() == "L2L3", f"ours: {shares.idxmax()}, {shares.max():.2f}"


def _decreasing(kind: str) -> Callable[[Run], tuple[bool, str]]:
    def found(run: Run) -> tuple[bool, str]:
        shares = _shares(run, kind)
        down = shares[["L1L2", "L2L3", "L3L4", "L4L5"]]
        told = ", ".join(f"{name} {value:.2f}" for name, value in down.items())
        return bool((np.diff(down) < 0.0).all()), f"ours: {told}"

    return found


def _rmse(run: Run, approach: str) -> float:
    """Mean over persons and motions that move."""
    rows = pd.concat([of_kind(run, "fits", kind, approach=approach) for kind in (FE, LB)])
    return float(numbers(rows, "marker_rmse_mm").mean())


def _rmse_of(approaches: tuple[str, ...]) -> Value:
    def ours(run: Run) -> Ours:
        approach = first_of(run, "fits", approaches)
        return Ours(_rmse(run, approach), note=approach)

    return ours


def _markers() -> Iterator[Claim]:
    for name, approaches in (("ik", ("ik",)), ("optk", BEST)):
        yield not_comparable(
            f"results.marker_rmse_{name}",
            "Results",
            f"root mean square distance of markers, {name}",
            "mm",
            RMSE[name],
            _rmse_of(approaches),
        )
    yield yes_no(
        "order.marker_rmse",
        "Results",
        "markers are followed less closely with dynamics than by inverse kinematics",
        _less_closely,
        f"{RMSE['ik']:g} and {RMSE['optk']:g} mm",
    )
    yield Claim(
        "results.marker_rmse_limit",
        "Results",
        "root mean square distance of markers, dynamics",
        "mm",
        None,
        at_most(RMSE_LIMIT_MM),
        _rmse_of(BEST),
        OTHER_PERSONS,
        "what the paper cites as acceptable",
    )


def _less_closely(run: Run) -> tuple[bool, str]:
    approach = first_of(run, "fits", BEST)
    one, other = _rmse(run, "ik"), _rmse(run, approach)
    return one < other, f"ours: {one:.3g} and {other:.3g} mm ({approach})"


def _clusters() -> Iterator[Claim]:
    for key, column, unit, mean, sd in (
        ("inter_marker_variability", "variability_mm", "mm", 0.27, 0.04),
        ("inter_marker_variability_relative", "variability_percent", "%", 0.58, 0.10),
    ):
        yield put_in(
            f"results.{key}",
            "Results",
            "how much distances between markers of a cluster vary",
            unit,
            mean,
            _varies(column),
            spread(mean, sd),
            "a made-up cohort has what its cameras were given",
        )


def _varies(column: str) -> Value:
    return lambda run: spanned(numbers(run.rows("clusters"), column))


def _time() -> Iterator[Claim]:
    yield Claim(
        "results.computation_time",
        "Results",
        "processor time of a motion, passive elements calibrated",
        "s",
        None,
        Range(2100.0, 9210.0, "the paper's range over motions"),
        _seconds,
        "another way of solving it, and another machine",
    )


def _seconds(run: Run) -> Ours:
    approach = first_of(run, "fits", ("optk_calibrated", *BEST))
    rows = pd.concat([of_kind(run, "fits", kind, approach=approach) for kind in (FE, LB)])
    return spanned(numbers(rows, "cpu_s"), approach)

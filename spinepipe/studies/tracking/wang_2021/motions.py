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
    LEAST_PERSONS,
    SETS,
    farthest,
    filled,
    first_of,
    numbers,
    of_kind,
    over_persons,
    spanned,
)
from spinepipe.studies.tracking.wang_2021.paper import (
    OTHER_PERSONS,
    Value,
    beside,
    missing,
    not_comparable,
    put_in,
    spread,
    yes_no,
)

LUMBAR_JOINTS = JOINTS[LUMBAR]
DOWN = ("L1L2", "L2L3", "L3L4", "L4L5")
THORACIC = JOINTS[LUMBAR.stop :]
RMSE = {"ik": 4.8, "optk": 7.7}
RMSE_LIMIT_MM = 20.0
WHOLE = "20-80"

SLIDES = Range(5.0, 12.0, "the paper's range over vertebrae")
SLIDES_IN_VIVO = Range(4.0, 9.0, "the paper's range over vertebrae")
SECONDS = (2100.0, 9210.0)
"""Of the paper's motions, least and most."""


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
    yield beside(
        "results.rom_thoracic_fe_ik",
        "Results",
        "extension of a thoracic joint over a motion, inverse kinematics, largest",
        "deg",
        Range(9.38, 63.42, "the paper's range over joints, which it calls unrealistic"),
        _largest_thoracic(("ik",)),
        "how far errors of markers throw joints about is a matter of skin and of markers",
    )
    yield yes_no(
        "order.rom_thoracic",
        "Results",
        "the thoracic joint that extends most does so by more with inverse kinematics than with "
        "dynamics",
        _thrown_about,
        "9.38 to 63.42 deg and less than 3.15 deg",
    )
    yield _window(
        "rom_ik_cons3",
        "Fig 6",
        "largest rotation of a joint over a motion, inverse kinematics with the third set of "
        "ratios, taken to be that of Shojaei 2017",
        "deg",
        Range(100.0, None, "over the paper's bound"),
        _largest_of_third,
    )
    for key, window, note in (
        ("axial_translation_range", SLIDES, ""),
        ("axial_translation_in_vivo", SLIDES_IN_VIVO, "of other authors, in living persons"),
    ):
        yield _window(
            key,
            "Results",
            "how far a lumbar vertebra moves along the spine in flexion and extension, of the one "
            "farthest from the range's middle",
            "mm",
            window,
            _along(window),
            "; ".join(part for part in (note, _ALONG) if part),
        )
    yield missing(
        "results.rom_lateral_outside_1sd",
        "Results",
        "joint whose range sideways is more than an SD off that of living persons",
        "",
        None,
        "L1L2; ranges of living persons are in a figure alone",
    )


_ALONG = "no marker tells it: it follows from loads, and from stiffness that no motion calibrates"


def _window(
    key: str, where: str, quantity: str, unit: str, allowed: Range, ours: Value, note: str = ""
) -> Claim:
    return Claim(f"results.{key}", where, quantity, unit, None, allowed, ours, OTHER_PERSONS, note)


def _largest_thoracic(approaches: tuple[str, ...]) -> Value:
    def ours(run: Run) -> Ours:
        approach = first_of(run, "ranges", approaches)
        found = _by_joint(run, FE, approach, "extension", THORACIC)
        note = f"{approach}, {found.idxmax()}; means over persons"
        return spanned(np.asarray(found, dtype=np.float64), note, float(found.max()))

    return ours


def _thrown_about(run: Run) -> tuple[bool, str]:
    one, other = (
        _largest_by_person(run, first_of(run, "ranges", names)) for names in (("ik",), BEST)
    )
    told = f"ours: {one.mean():.3g} and {other.mean():.3g} deg, means over persons"
    apart = (one - other).dropna()
    return bool(apart.mean() > 0.0), over_persons(apart, told, "deg")


def _largest_by_person(run: Run, approach: str) -> "pd.Series[float]":
    rows = of_kind(run, "ranges", FE, approach=approach, coordinate="extension")
    rows = rows[rows["joint"].isin(THORACIC)]
    found: pd.Series[float] = rows.groupby("specimen", observed=True)["range"].max()
    return found


def _largest_of_third(run: Run) -> Ours:
    rows = run.rows("ranges", unit="deg")
    rows = rows[rows["approach"] == SETS[-1]]
    if rows.empty:
        raise NotComputed("these ratios are printed in no text at hand, and no other set is theirs")
    largest = rows.iloc[int(rows["range"].to_numpy(float).argmax())]
    return Ours(float(largest["range"]), note=f"{largest['approach']}, {largest['joint']}")


def _along(window: Range) -> Value:
    def ours(run: Run) -> Ours:
        approach = first_of(run, "ranges", BEST)
        by_joint = _by_joint(run, FE, approach, "superior", LUMBAR_JOINTS)
        found = np.asarray(by_joint, dtype=np.float64)
        inside = sum(window.holds(float(value)) for value in found)
        note = f"{approach}; {inside} of {len(found)} joints inside"
        return spanned(found, note, farthest(found, window))

    return ours


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
    return _by_level(_share_rows(run, kind))


def _share_rows(run: Run, kind: str) -> pd.DataFrame:
    approach = first_of(run, "sharing", BEST)
    rows = of_kind(run, "sharing", kind, approach=approach, window=WHOLE).dropna(subset=["share"])
    if rows.empty:
        raise NotComputed("nobody's lumbar spine turns enough")
    return rows


def _by_level(rows: pd.DataFrame) -> "pd.Series[float]":
    means = rows.groupby("joint", observed=True)["share"].mean().astype(float)
    found: pd.Series[float] = means.reindex(list(LUMBAR_JOINTS))
    return found


def _largest_sideways(run: Run) -> tuple[bool, str]:
    shares = _shares(run, LB)
    told = f"ours: {shares.idxmax()}, {shares.max():.2f}"
    return shares.idxmax() == "L2L3", f"{told}; {_agreeing(run, LB, _largest_is)}"


def _decreasing(kind: str) -> Callable[[Run], tuple[bool, str]]:
    def found(run: Run) -> tuple[bool, str]:
        shares = _shares(run, kind)
        told = ", ".join(f"{name} {value:.2f}" for name, value in shares[list(DOWN)].items())
        return _goes_down(shares), f"ours: {told}; {_agreeing(run, kind, _goes_down)}"

    return found


def _largest_is(shares: "pd.Series[float]") -> bool:
    return bool(shares.idxmax() == "L2L3")


def _goes_down(shares: "pd.Series[float]") -> bool:
    return bool((np.diff(shares[list(DOWN)]) < 0.0).all())


def _agreeing(run: Run, kind: str, holds: Callable[["pd.Series[float]"], bool]) -> str:
    """In how many persons something holds of the shares of their lumbar joints."""
    rows = _share_rows(run, kind)
    persons = [_by_level(own) for _, own in rows.groupby("specimen", observed=True)]
    whole = [shares for shares in persons if shares.notna().all()]
    few = "" if len(whole) >= LEAST_PERSONS else ", too few to tell it"
    return f"so in {sum(map(holds, whole))} of {len(whole)} persons{few}"


def _rmse(run: Run, approach: str) -> "pd.Series[float]":
    """Mean over motions that move, by person."""
    rows = pd.concat([of_kind(run, "fits", kind, approach=approach) for kind in (FE, LB)])
    kept = filled(rows, "marker_rmse_mm").astype({"marker_rmse_mm": float})
    found: pd.Series[float] = kept.groupby("specimen", observed=True)["marker_rmse_mm"].mean()
    return found


def _rmse_of(approaches: tuple[str, ...]) -> Value:
    def ours(run: Run) -> Ours:
        approach = first_of(run, "fits", approaches)
        return spanned(np.asarray(_rmse(run, approach), dtype=np.float64), approach)

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
    told = f"ours: {one.mean():.3g} and {other.mean():.3g} mm ({approach})"
    apart = (one - other).dropna()
    return bool(apart.mean() < 0.0), over_persons(apart, told, "mm")


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
        "processor time of a motion, passive elements calibrated: no longer than the paper's",
        "s",
        None,
        Range(None, SECONDS[1], f"up to the longest of its {SECONDS[0]:g} to {SECONDS[1]:g} s"),
        _seconds,
        "another way of solving it, and another machine",
        "less is better; the calibration, a job of its own, is not counted in ours",
    )


def _seconds(run: Run) -> Ours:
    approach = first_of(run, "fits", ("optk_calibrated", *BEST))
    rows = pd.concat([of_kind(run, "fits", kind, approach=approach) for kind in (FE, LB)])
    found = numbers(rows, "cpu_s")
    factor = SECONDS[0] / float(found.mean())
    faster = f"{factor:.0f} times faster than the paper's fastest" if factor > 1.0 else ""
    return spanned(found, "; ".join(part for part in (approach, faster) if part))

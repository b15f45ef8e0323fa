"""Selectors for Wang et al. 2021 (OptK), doi 10.1007/s10439-021-02774-3, beside tracked motions.

Its persons and X-rays are not published. Single numbers of theirs, without a spread, are shown
without a verdict; what holds of approaches whoever was tracked, orders and ranges that it prints,
is compared. An order that persons here do not tell has no verdict.

Tables that are no results: `subjects`, `trials` and `marker_set`, rows of the cohort's folder, and
`generic`, the passive elements that calibrations begin with.
"""

from typing import Any

import numpy as np
import pandas as pd

from papers.run import Computed, NotComputed, StudyRun
from papers.selectors import filled, named

CONSTRAINED = "ik_constrained_"
SETS = tuple(f"{CONSTRAINED}{name}" for name in ("christophy_2012", "bruno_2015", "shojaei_2017"))
"""The paper's three sets of ratios, in its order."""

LEAST_PERSONS = 3
"""Fewer tell no order of persons."""

DOWN = ("L1L2", "L2L3", "L3L4", "L4L5")
LUMBAR = ("L5S1", "L4L5", "L3L4", "L2L3", "L1L2", "T12L1")

FASTEST_S = 2100.0
"""Of the paper's motions."""

HARDLY = 0.02
"""Share by which stiffness differs that markers left where it was."""

SIDE = ["joint", "coordinate", "side"]
LOW_MOMENT_NM = 0.1


def of_kind(run: StudyRun, table: str, kind: str, **where: Any) -> pd.DataFrame:
    """Rows of motions of a kind, at least one."""
    rows = run.rows(table, **where)
    trials = run.rows("trials", kind=kind)[["specimen", "trial"]].drop_duplicates()
    on = [name for name in ("specimen", "trial") if name in rows]
    found = rows.merge(trials[on].drop_duplicates(), on=on)
    if found.empty:
        raise NotComputed(f"this run's table {table} has no trial of kind {kind}")
    return found


def several(names: Any) -> tuple[str, ...]:
    """One name or more, as a row has them."""
    return names if isinstance(names, tuple) else (names,)


def first_of(run: StudyRun, table: str, names: Any, column: str = "approach") -> str:
    """The first approach, or calibration, of which a table has rows: it stands for the paper's."""
    there = set(run.rows(table)[column])
    for name in several(names):
        if name in there:
            return name
    raise NotComputed(f"this run's table {table} has none of {', '.join(several(names))}")


# --- errors against X-rays in stance --------------------------------------------------------------


def error_in_stance(run: StudyRun, measure: str, approaches: Any, best: bool = True) -> Computed:
    """Our error of what stands for an approach, the best or the worst of several, and whose it is.

    Means over persons and stances. Where the run has none of the paper's sets of ratios, others
    stand for them.
    """
    rows = of_kind(run, "accuracy", "stance", measure=measure)
    there = {
        str(name): float(filled(own, "mean").mean())
        for name, own in rows.groupby("approach", observed=True)
    }
    named = [name for name in there if name in several(approaches)]
    if not named and several(approaches)[0].startswith(CONSTRAINED):
        named = [name for name in there if name.startswith(CONSTRAINED)]
    if not named:
        wanted = ", ".join(several(approaches))
        raise NotComputed(f"this run has no {wanted} in stance with a truth")
    name = (min if best else max)(named, key=lambda name: there[name])
    return Computed(there[name], note="; ".join(part for part in (name, _ratios(name)) if part))


def _ratios(name: str) -> str:
    """How a set of ratios stands to the paper's; nothing of an approach without."""
    if not name.startswith(CONSTRAINED):
        return ""
    which = "one of" if name in SETS else "another than"
    return (
        f"the ratios {name.removeprefix(CONSTRAINED)} are {which} the paper's three, those of "
        "Christophy 2012, Bruno 2015 and Shojaei 2017, and it does not say whose error it prints"
    )


def range_of_errors(run: StudyRun, measure: str, approaches: Any) -> Computed:
    """The worst approach less the best."""
    low, high = (error_in_stance(run, measure, approaches, best).value for best in (True, False))
    return Computed(high - low)


def smaller_error(
    run: StudyRun,
    measure: str,
    one: Any,
    other: Any,
    one_best: bool = True,
    other_best: bool = True,
) -> Computed:
    """Whether an approach has a smaller error than another, where persons tell it."""
    unit = measure.rpartition("_")[2]
    first = error_in_stance(run, measure, one, one_best)
    second = error_in_stance(run, measure, other, other_best)
    names = [found.note.partition(";")[0] for found in (first, second)]
    told = f"ours: {first.value:.3g} {unit} ({names[0]}) and {second.value:.3g} {unit} ({names[1]})"
    told = "; ".join(part for part in (told, *map(_ratios, names)) if part)
    if names[0] == names[1]:
        raise NotComputed(f"the same approach stands for both; {told}")
    means = []
    for name in names:
        rows = of_kind(run, "errors", "stance", measure=measure, approach=name)
        means.append(rows.groupby("specimen", observed=True)["mean"].mean())
    return _told(first.value < second.value, (means[0] - means[1]).dropna(), told, unit)


def _told(holds: bool, apart: "pd.Series[float]", told: str, unit: str) -> Computed:
    """What an order hangs on: means of ours, as told, and by how much persons (N,) differ.

    Raises
    ------
    NotComputed
        Where so few persons, or a difference smaller than its spread, do not tell it.
    """
    count = len(apart)
    mean, sd = float(apart.mean()), float(apart.std(ddof=1)) if count > 1 else 0.0
    found = f"{told}; difference {mean:.2g} {unit}, SD {sd:.2g} over {count} persons"
    if count < LEAST_PERSONS:
        raise NotComputed(f"fewer than {LEAST_PERSONS} persons tell no order; {told}")
    if abs(mean) < sd:
        raise NotComputed(f"not told: the difference is smaller than its spread; {found}")
    return Computed(float(holds), note=found)


# --- motions --------------------------------------------------------------------------------------


def _of_approach(
    run: StudyRun,
    table: str,
    column: str,
    kinds: Any,
    approaches: Any,
    by: str,
    how: str,
    **where: Any,
) -> tuple["pd.Series[float]", str]:
    """A column of the first approach that is there, by person or joint; and which it is."""
    approach = first_of(run, table, approaches)
    rows = pd.concat(
        [of_kind(run, table, kind, approach=approach, **where) for kind in several(kinds)],
        ignore_index=True,
    )
    rows = rows.assign(**{column: filled(rows, column)}).dropna(subset=[column])
    values = rows.groupby(by, observed=True)[column].agg(how) if by else rows[column]
    return values.astype(float), approach


def motion(
    run: StudyRun,
    table: str,
    column: str,
    kinds: Any,
    approaches: Any,
    by: str = "",
    value: str = "mean",
    **where: Any,
) -> Computed:
    """Mean or largest of a column, means over persons or joints first; its ends."""
    found, approach = _of_approach(run, table, column, kinds, approaches, by, "mean", **where)
    note = f"{approach}, {found.idxmax()}; means over persons" if value == "max" else approach
    return Computed(float(found.agg(value)), float(found.min()), float(found.max()), note)


def likeness(run: StudyRun, kind: str, approaches: Any) -> Computed:
    """How alike persons share a motion among joints."""
    found, approach = _of_approach(
        run, "similarity", "cmc", kind, approaches, "", "mean", window="20-80"
    )
    return Computed(float(found.mean()), note=approach)


def seconds(run: StudyRun, approaches: Any) -> Computed:
    """Processor time of a motion, and how much faster than the paper's fastest."""
    kinds = ("flexion_extension", "lateral_bending")
    found = motion(run, "fits", "cpu_s", kinds, approaches)
    factor = FASTEST_S / found.value
    faster = f"; {factor:.0f} times faster than the paper's fastest" if factor > 1.0 else ""
    return Computed(found.value, found.low, found.high, found.note + faster)


def along_the_spine(run: StudyRun, low: float, high: float, approaches: Any) -> Computed:
    """How far a lumbar vertebra slides, of the joint farthest outside a window with two ends."""
    found, approach = _of_approach(
        *(run, "ranges", "range", "flexion_extension", approaches, "joint", "mean"),
        coordinate="superior",
        joint=LUMBAR,
    )
    inside = int(found.between(low, high).sum())
    note = f"{approach}; {inside} of {len(found)} joints inside"
    return Computed(_farthest(found, low, high), float(found.min()), float(found.max()), note)


def _farthest(values: Any, low: float, high: float) -> float:
    """The value that is farthest outside a window, else nearest to one of its ends."""
    sizes = np.asarray(values, dtype=float)
    return float(sizes[int(np.argmax(np.maximum(low - sizes, sizes - high)))])


def differs(
    run: StudyRun,
    table: str,
    column: str,
    kinds: Any,
    approaches: Any,
    how: str,
    sign: float,
    unit: str,
    **where: Any,
) -> Computed:
    """Whether persons have more (sign 1) or less (-1) by inverse kinematics than by dynamics."""
    (one, _), (other, approach) = (
        _of_approach(run, table, column, kinds, names, "specimen", how, **where)
        for names in ("ik", approaches)
    )
    apart = (one - other).dropna()
    told = f"ours: {one.mean():.3g} and {other.mean():.3g} {unit} ({approach}), means over persons"
    return _told(bool(sign * apart.mean() > 0.0), apart, told, unit)


def largest_of_third_set(run: StudyRun) -> Computed:
    """Largest rotation of a joint with the third set of ratios, taken as Shojaei 2017."""
    rows = run.rows("ranges", unit="deg")
    rows = rows[rows["approach"] == SETS[-1]]
    if rows.empty:
        raise NotComputed("these ratios are printed in no text at hand, and no other set is theirs")
    largest = rows.iloc[int(rows["range"].to_numpy(float).argmax())]
    return Computed(float(largest["range"]), note=f"{largest['approach']}, {largest['joint']}")


def shares(run: StudyRun, kind: str, approaches: Any, pattern: str) -> Computed:
    """Whether a pattern holds of lumbar joints' mean shares: `largest_L2L3`, or `down`."""
    approach = first_of(run, "sharing", approaches)
    rows = of_kind(run, "sharing", kind, approach=approach, window="20-80")
    rows = rows.dropna(subset=["share"])
    if rows.empty:
        raise NotComputed("nobody's lumbar spine turns enough")

    def by_level(own: pd.DataFrame) -> "pd.Series[float]":
        return own.groupby("joint", observed=True)["share"].mean().astype(float).reindex(LUMBAR)

    def holds(own: "pd.Series[float]") -> bool:
        if pattern == "down":
            return bool((np.diff(own[list(DOWN)]) < 0.0).all())
        return bool(own.idxmax() == "L2L3")

    mean = by_level(rows)
    told = ", ".join(f"{name} {mean[name]:.2f}" for name in DOWN)
    told = told if pattern == "down" else f"{mean.idxmax()}, {mean.max():.2f}"
    persons = [by_level(own) for _, own in rows.groupby("specimen", observed=True)]
    whole = [own for own in persons if own.notna().all()]
    few = "" if len(whole) >= LEAST_PERSONS else ", too few to tell it"
    agreeing = f"so in {sum(map(holds, whole))} of {len(whole)} persons{few}"
    return Computed(float(holds(mean)), note=f"ours: {told}; {agreeing}")


# --- passive elements -----------------------------------------------------------------------------


def _beside_generic(run: StudyRun, laws: Any) -> pd.DataFrame:
    """Sides that were loaded, with columns of the generic ones ending in `_generic`."""
    law = first_of(run, "stiffness", laws, "law")
    rows = run.rows("stiffness", law=law)
    rows = rows[rows["coordinate"].isin(("extension", "right_bending"))]
    rows = rows.dropna(subset=["a", "high_moment_nm"])
    both = rows.merge(run.rows("generic"), on=SIDE, suffixes=("", "_generic"))
    if both.empty:
        raise NotComputed(f"no joint was loaded in the motions of {law}")
    return both


def multiplier(run: StudyRun, laws: Any, low: float, high: float) -> Computed:
    """Parameter A or B over the generic one, the one farthest outside a window."""
    rows = _beside_generic(run, laws)
    found = np.concatenate([rows[name] / rows[f"{name}_generic"] for name in ("a", "b")])
    note = f"median {np.median(found):.3g}; sides that were loaded, {rows['law'].iloc[0]}"
    value = float(np.exp(_farthest(np.log(found), np.log(low), np.log(high))))
    return Computed(value, float(found.min()), float(found.max()), note)


def mostly_softer(run: StudyRun, laws: Any) -> Computed:
    """Whether most sides are less stiff at a low moment than generic ones, k = B (F + A)."""
    rows = _beside_generic(run, laws)
    a, b = rows["a_generic"], rows["b_generic"]
    own = rows["at_low_moment"].to_numpy(float)
    usual, lowest = (
        (b * (LOW_MOMENT_NM + a * factor)).to_numpy(float) for factor in (1.0, rows["lower"])
    )
    ratio, below = own / usual, float(np.mean(own < lowest))
    return _most(ratio < 1.0, ratio, f"; {below:.0%} below the lower end of generic ones")


def mostly_stiffer(run: StudyRun, laws: Any) -> Computed:
    """Whether most sides are stiffer at a high moment than generic ones."""
    ratio = _beside_generic(run, laws)["ratio_to_generic"].to_numpy(float)
    return _most(ratio > 1.0, ratio, "")


def _most(holds: Any, ratio: Any, further: str) -> Computed:
    share, alike = float(np.mean(holds)), float(np.mean(np.abs(ratio - 1.0) < HARDLY))
    note = (
        f"ours: {share:.0%} of {len(ratio)} sides that were loaded{further}; ratio "
        f"{np.median(ratio):.3g} (median), {ratio.min():.3g} to {ratio.max():.3g}; "
        f"{alike:.0%} differ by less than {HARDLY:.0%}"
    )
    return Computed(float(share > 0.5), note=note)


def low_moment(run: StudyRun) -> Computed:
    """Passive moment at which the low stiffness is read, k / B - A, N m."""
    rows = run.rows("stiffness").dropna(subset=["at_low_moment"])
    rows = rows[rows["b"] > 0.0]
    if rows.empty:
        raise NotComputed("this run has no stiffness at a low moment")
    found = rows["at_low_moment"] / rows["b"] - rows["a"]
    return Computed(float(found.median()), float(found.min()), float(found.max()))


# --- cohort ---------------------------------------------------------------------------------------


def all_motions(run: StudyRun) -> Computed:
    """Whether each person stands, bends forwards and back, and sideways."""
    kinds = run.rows("trials").groupby("specimen")["kind"].agg(set)
    wanted = {"stance", "flexion_extension", "lateral_bending"}
    return Computed(float(all(wanted <= own for own in kinds)))


def markers(run: StudyRun, vertebra: str) -> Computed:
    """Markers of the first person on a vertebra; none is no fault."""
    return Computed(float((_first(run)["vertebra"] == vertebra).sum()))


def marked_vertebrae(run: StudyRun) -> Computed:
    """Vertebrae of the first person that have a marker."""
    return Computed(float(len(set(_first(run)["vertebra"].dropna()) - {"S1"})))


def _first(run: StudyRun) -> pd.DataFrame:
    rows = run.rows("marker_set")
    return rows[rows["specimen"] == rows["specimen"].iloc[0]]


def moving(run: StudyRun, approaches: Any) -> Computed:
    """Coordinates of a joint that move."""
    rows = run.rows("ranges", approach=first_of(run, "ranges", approaches))
    return Computed(float(rows[rows["range"] > 0.0]["coordinate"].nunique()))


SELECTORS = named(
    *(error_in_stance, range_of_errors, smaller_error, motion, likeness, seconds, differs),
    *(along_the_spine, largest_of_third_set, shares, multiplier, mostly_softer, mostly_stiffer),
    *(low_moment, all_motions, markers, marked_vertebrae, moving),
)

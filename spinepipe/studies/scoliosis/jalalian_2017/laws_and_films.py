"""The paper's laws as this study has them: ends, enlargements, what sizes them, poses."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, binomial, exactly
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.jalalian_2017.paper import (
    BENDING,
    BEST_ENLARGEMENT,
    COVERED_PERCENT,
    DISPLACEMENTS,
    ENLARGEMENT,
    ENLARGEMENTS_TESTED,
    FILMS,
    GROUP,
    LARGEST_MOMENT_NM,
    OTHER_TRUTH,
    PHANTOM,
    TANGENT,
    UNSEEN,
    nearly,
    put_in,
)
from spinepipe.studies.scoliosis.tables_of_errors import RANGES
from spinepipe.studies.scoliosis.tangent_laws import SMALLEST_END
from spinepipe.units import DEG_PER_RAD

BELOW_PERCENT = 77.0
"""Of the displacements of neutral and traction films, those below 0.8 of the published end."""

BELOW = tuple(name for name, (_, high) in RANGES.items() if high <= 0.8)

_BEST = (
    "which enlargement does best hangs on where the segments' true ends are, and these are made up"
)


def claims_of_laws() -> Iterator[Claim]:
    """Ends, what they were chosen from, size of the laws, poses, and how far films come."""
    yield from _ends()
    yield from _enlargements()
    yield from _size()
    yield from _poses()
    yield from _shares()
    yield Claim(
        "results.ais_prevalence",
        "section 1",
        "adolescents who have the disease",
        "%",
        None,
        Range(2.0, 3.0, "the literature's range, as the paper tells it"),
        _no_population,
        "",
    )


def _no_population(run: Run) -> Ours:
    raise NotComputed("a cohort of patients has no healthy ones")


def _ends() -> Iterator[Claim]:
    for key, which, column, position in (
        ("asymptote_right", "right", "upper_end_deg", RIGHT),
        ("asymptote_left", "left", "lower_end_deg", LEFT),
    ):
        yield put_in(
            f"equations.{key}",
            "section 2.3",
            f"{which} end over the rotation on the film that bends there, median over segments",
            "ratio",
            ENLARGEMENT,
            _end_over_rotation(column, position),
            nearly(ENLARGEMENT),
        )
    yield put_in(
        "equations.asymptote_if_opposite",
        "section 2.3",
        "ends of segments that turn against a bend, over their larger rotation, median",
        "ratio",
        ENLARGEMENT,
        _opposite_ends,
        nearly(ENLARGEMENT),
    )
    yield put_in(
        "results.range_enlargement",
        "section 2.3",
        "ends over the rotations of the bending films, as the study asks for",
        "ratio",
        ENLARGEMENT,
        lambda run: Ours(asked(run, "enlargement")),
    )


def asked(run: Run, name: str) -> float:
    """A setting of the study."""
    if run.asked.get(name) is None:
        raise NotComputed(f"this study states no {name}")
    return float(run.asked[name])


def _rotations(run: Run, position: str) -> pd.DataFrame:
    rows = run.rows("displacements", model=TANGENT, position=position)
    return rows.set_index(["specimen", "joint"])


def _laws(run: Run, opposite: bool) -> pd.DataFrame:
    """Laws whose ends the films decide, and not the step in which these are read."""
    laws = run.rows("laws", model=TANGENT, opposite=opposite).set_index(["specimen", "joint"])
    least = laws[["upper_end_deg", "lower_end_deg"]].abs().min(axis=1)
    return laws[least > DEG_PER_RAD * SMALLEST_END * (1.0 + 1e-9)]


def _ratios(values: "pd.Series[Any]") -> Ours:
    if values.empty:
        raise NotComputed("no law has such an end")
    ends = float(values.median()), float(values.min()), float(values.max())
    return Ours(*ends, note=f"ours: {len(values)} segments, without those that stand still")


def _end_over_rotation(column: str, position: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        laws, turned = _laws(run, False), _rotations(run, position)["measured_deg"]
        return _ratios(laws[column] / turned.reindex(laws.index))

    return ours


def _opposite_ends(run: Run) -> Ours:
    laws = _laws(run, True)
    right, left = (_rotations(run, one)["measured_deg"].abs() for one in (RIGHT, LEFT))
    larger = pd.concat([right, left], axis=1).max(axis=1).reindex(laws.index)
    both = [laws["upper_end_deg"] / larger, -laws["lower_end_deg"] / larger]
    return _ratios(pd.concat(both))


def _enlargements() -> Iterator[Claim]:
    for percent in ENLARGEMENTS_TESTED:
        yield put_in(
            f"results.enlargements_tested.{percent}",
            "Appendix",
            f"{percent} % is among the enlargements that are tried",
            "%",
            float(percent),
            _tried(float(percent)),
        )
    for key, table, by, ours in (
        ("laws", "variants", "the laws' rotations under the two forces", _best_of_laws),
        ("poses", "variation", "the rotations of the simulated bending films", _best_of_poses),
    ):
        yield Claim(
            f"results.enlargements_tested.best_of_{key}",
            "Appendix, Fig 8",
            f"enlargement by which the error is smallest of {by}",
            "%",
            float(BEST_ENLARGEMENT),
            exactly(float(BEST_ENLARGEMENT)),
            ours,
            _BEST,
            f"{PHANTOM}; by table {table}",
        )


def _tried(percent: float) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        values = run.rows("variation", varied="enlargement")["value"].to_numpy(float)
        return Ours(float(values[np.argmin(np.abs(values - percent))]))

    return ours


def _best_of_laws(run: Run) -> Ours:
    rows = run.rows("variants", varied="enlargement").drop_duplicates(["specimen", "value"])
    return _least(rows.groupby("value")["law_rmse_deg"].mean())


def _best_of_poses(run: Run) -> Ours:
    rows = run.rows("variation", varied="enlargement", films=GROUP[BENDING])
    return _least(rows.set_index("value")["rotation_rmse_deg"])


def _least(by_value: "pd.Series[Any]") -> Ours:
    known = by_value.astype(float).dropna()
    if known.empty:
        raise NotComputed("no enlargement has an error")
    told = ", ".join(f"{value:g} % {error:.3g}" for value, error in known.items())
    return Ours(float(known.index[int(np.argmin(known))]), note=f"ours: {told} deg")


def _size() -> Iterator[Claim]:
    for key, where in (("results.moment_upper_bound", "Eq 5"), ("equations.A_selection", "Eq 5")):
        yield put_in(
            key,
            where,
            "largest moment about the apical disc, from which the size of all A is taken",
            "N m",
            LARGEST_MOMENT_NM,
            lambda run: Ours(asked(run, "apical_moment_nm")),
            outside="this study states another moment",
        )
    yield Claim(
        "results.moment_coverage",
        "section 2.3",
        f"share of disc moments below {LARGEST_MOMENT_NM:g} N m",
        "%",
        COVERED_PERCENT,
        exactly(COVERED_PERCENT),
        _no_moments,
        "",
    )
    yield Claim(
        "equations.A",
        "Eq 4",
        "how A follows from the pairs",
        "",
        None,
        Range(None, None, "any: Eq 4 is not in the text"),
        _lost_equation,
        "",
        "ours: regression of the moments through the origin, right moments negative",
    )


def _no_moments(run: Run) -> Ours:
    raise NotComputed("J11: neither mean nor SD of the moments is printed, so it cannot be checked")


def _lost_equation(run: Run) -> Ours:
    raise NotComputed("there is no number to compare")


def _poses() -> Iterator[Claim]:
    for name, column, unit in (("place", "missed_mm", "mm"), ("tilt", "missed_deg", "deg")):
        yield put_in(
            f"results.imposed_motion.{name}",
            "section 2.4",
            f"largest distance of T2 from its {name} on a film, models with tangent laws",
            unit,
            0.0,
            _missed(column),
            nearly(0.0, 1e-6),
            "a film asks for more length than locked translations have",
        )
    yield Claim(
        "results.joint_type",
        "section 2.4",
        "ways in which a joint moves: it turns about three axes",
        "count",
        3.0,
        exactly(3.0),
        _not_in_a_table,
        "",
    )
    for positions, group in GROUP.items():
        yield put_in(
            f"results.n_displacements_per_position_pair.{positions}",
            "section 3.1",
            f"rotations that are compared, {FILMS[group]}",
            "count",
            float(DISPLACEMENTS),
            _compared(group),
            outside="a patient has no pose on one of the films",
        )


def _missed(column: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(float(run.rows("positions", model=TANGENT)[column].max()))


def _not_in_a_table(run: Run) -> Ours:
    raise NotComputed("no table tells of what joints are made; ours turn about three axes")


def _compared(group: str) -> Callable[[Run], Ours]:
    where = {"films": group, "measure": "rotation", "model": TANGENT}
    return lambda run: Ours(run.number("accuracy", "n", **where))


def _shares() -> Iterator[Claim]:
    yield put_in(
        "results.bending_displacement_fraction_of_R",
        "section 3.1",
        "rotations on the bending films over the ends, median of segments that turn with the bend",
        "ratio",
        0.8,
        _share_on_bending_films,
        Range(0.8, 1.0, "more than the paper's bound, and no more than the end"),
    )
    count = round(BELOW_PERCENT / 100.0 * DISPLACEMENTS)
    yield Claim(
        "results.vertebrae_below_0.8R_neutral_traction",
        "section 3.1",
        f"rotations below 0.8 of the published end, {FILMS[GROUP[UNSEEN]]}",
        "%",
        BELOW_PERCENT,
        binomial(count, DISPLACEMENTS),
        _below,
        OTHER_TRUTH,
        f"{PHANTOM}; rotations of one patient hang together, the interval takes them as apart",
    )


def _share_on_bending_films(run: Run) -> Ours:
    rows = run.rows("displacements", model=TANGENT, fitted=True)
    against = rows["opposite"].astype(bool)
    shares = rows["share_of_range"].astype(float)
    if against.all():
        raise NotComputed("no segment turns with both bends")
    with_it = shares[~against]
    ends = float(with_it.median()), float(with_it.min()), float(with_it.max())
    note = ""
    if against.any():
        above = 100.0 * float((shares[against] > 0.8).mean())
        note = (
            f"ours: of segments that turn against a bend {above:.0f} % of rotations are above 0.8"
        )
    return Ours(*ends, note=note)


def _below(run: Run) -> Ours:
    rows = run.rows("by_range", films=GROUP[UNSEEN], model=TANGENT)
    counts = rows.groupby("range")["n"].sum()
    if not counts["all"]:
        raise NotComputed("nothing was held out")
    beyond = f"{int(counts['beyond'])} of {int(counts['all'])} beyond the end"
    share = 100.0 * float(counts.reindex(BELOW).sum()) / float(counts["all"])
    return Ours(share, note=f"ours: {beyond}")

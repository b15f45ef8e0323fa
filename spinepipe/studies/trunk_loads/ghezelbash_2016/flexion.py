"""Bending forwards (task 7): Fig 6, what the global extensors do; Fig 9, four persons' loads."""

from collections.abc import Callable, Iterator
from itertools import combinations
from typing import NamedTuple

import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, exactly
from spinepipe.muscles.fascicles import GLOBAL_EXTENSORS
from spinepipe.studies.trunk_loads.ghezelbash_2016.found import filled, forward, numbered, settled
from spinepipe.studies.trunk_loads.ghezelbash_2016.own_numbers import base_n
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import (
    NO_EMG,
    OTHER_MODEL,
    PAPER,
    PERSONS,
    as_persons_differ,
    missing,
    yes_no,
)

FIG_9 = PAPER["fig_9"]

BENDER = PERSONS["D"]
"""Whose flexion Fig 6 is about: the mean of the men of Arjmand 2009 and 2010."""

RELAXED_PERCENT = 10.0
"""What is left of the active force of muscles that are said to be relaxed, at most, of its peak."""

_HEAVIER, _LIGHTER = PERSONS["A"], PERSONS["D"]
_PAIR = f"{_HEAVIER} over {_LIGHTER}"


def claims_of_flexion() -> Iterator[Claim]:
    """Fig 6, then Fig 9."""
    for group in GLOBAL_EXTENSORS:
        yield from _muscle(group)
    yield missing("fig_6.emg", "Fig 6", "activities beside EMG", "", None, NO_EMG)
    for name, column in (
        ("compression", "l4l5_compression_n"),
        ("shear", "l4l5_shear_n"),
    ):
        yield from _persons(name, column)


class Course(NamedTuple):
    """Forces of a muscle's two sides, N, by flexion, deg: active, passive and against bone."""

    active: "pd.Series[float]"
    passive: "pd.Series[float]"
    contact: "pd.Series[float]"


def _course(run: Run, group: str) -> Course:
    """From upright to full flexion, task 5, in settled tasks."""
    settled(numbered(run, 5, specimen=BENDER))
    tasks = forward(run, BENDER).set_index("task")["flexion_deg"]
    rows = run.rows("muscles", specimen=BENDER, group=group)
    rows = rows[rows["task"].isin(tasks.index)]
    if rows["task"].nunique() < max(len(tasks), 3):
        raise NotComputed(f"this run's table muscles has no {group} in some task of flexion")
    forces = pd.DataFrame(
        {
            "flexion_deg": rows["task"].map(tasks),
            "active": filled(rows, "force_n") - filled(rows, "passive_n"),
            "passive": filled(rows, "passive_n"),
            "contact": filled(rows, "contact_n"),
        }
    )
    summed = forces.groupby("flexion_deg").sum().sort_index()
    return Course(summed["active"], summed["passive"], summed["contact"])


def _muscle(group: str) -> Iterator[Claim]:
    name = group.replace("_", " ")
    yield yes_no(
        f"fig_6.{group}.active.rises_then_falls",
        "Fig 6, 3.3",
        f"active force of {name} is largest between upright and full flexion",
        lambda run: _peaks_between(_course(run, group)),
    )
    yield Claim(
        f"fig_6.{group}.active.left_at_full_flexion",
        "Fig 6, 3.3",
        f"active force of {name} at full flexion over its largest (flexion relaxation)",
        "%",
        None,
        Range(
            None,
            RELAXED_PERCENT,
            f"up to {RELAXED_PERCENT:g} %, chosen here for what the paper calls relaxed",
        ),
        lambda run: _left(_course(run, group)),
        OTHER_MODEL,
    )
    yield yes_no(
        f"fig_6.{group}.passive.rises",
        "Fig 6, 3.3",
        f"passive force of {name} is largest at full flexion",
        lambda run: _largest_at_full(_course(run, group), "passive"),
    )
    yield yes_no(
        f"fig_6.{group}.contact.rises",
        "Fig 6, 3.3",
        f"{name} is pushed hardest by vertebrae at full flexion",
        lambda run: _largest_at_full(_course(run, group), "contact"),
        f"how hard muscles lie on vertebrae hangs on how far off they run; {OTHER_MODEL}",
    )


def _peaks_between(course: Course) -> bool:
    inner = course.active.iloc[1:-1].max()
    return bool(inner > course.active.iloc[0] and inner > course.active.iloc[-1])


def _left(course: Course) -> Ours:
    largest = float(course.active.max())
    if largest <= 0.0:
        raise NotComputed("the muscle pulls at no angle")
    return Ours(100.0 * float(course.active.iloc[-1]) / largest)


def _largest_at_full(course: Course, name: str) -> bool:
    force = getattr(course, name)
    return bool(force.iloc[-1] > 0.0 and force.iloc[-1] >= force.max())


class Apart(NamedTuple):
    """Where two persons' loads are farthest apart: angle, deg, both loads, N."""

    flexion_deg: float
    one_n: float
    other_n: float
    n_angles: int

    @property
    def newton(self) -> float:
        """One less the other."""
        return self.one_n - self.other_n

    def percent(self) -> float:
        """That of the other's load."""
        if self.other_n <= 0.0:
            raise NotComputed(f"the load that is compared with is {self.other_n:.3g} N")
        return 100.0 * self.newton / self.other_n

    def told(self) -> str:
        """Angle and loads."""
        return (
            f"ours: {self.one_n:.4g} and {self.other_n:.4g} N at {self.flexion_deg:g} deg of "
            f"flexion, where they differ most of {self.n_angles} angles that settled"
        )


def _loads(run: Run, column: str, person: str) -> "pd.Series[float]":
    """A load by flexion of task 7, upright and full flexion."""
    rows = forward(run, person)
    return filled(rows, column).set_axis(rows["flexion_deg"].round(6))


def _apart(run: Run, column: str, one: str, other: str) -> Apart:
    both = pd.concat([_loads(run, column, who) for who in (one, other)], axis=1, join="inner")
    if len(both) < 2:
        raise NotComputed(f"{one} and {other} share fewer than two angles of flexion")
    loads = both.to_numpy(float)
    at = int((loads[:, 0] - loads[:, 1]).argmax())
    return Apart(
        float(both.index.to_numpy(float)[at]), float(loads[at, 0]), float(loads[at, 1]), len(both)
    )


def _farthest(run: Run, column: str) -> Apart:
    """Of all pairs of the four, the larger load first."""
    pairs = [
        _apart(run, column, *pair)
        for two in combinations(PERSONS.values(), 2)
        for pair in (two, two[::-1])
    ]
    return max(pairs, key=lambda apart: apart.newton)


def _persons(name: str, column: str) -> Iterator[Claim]:
    percent, newton = float(FIG_9[f"{name}_percent"]), float(FIG_9[f"{name}_n"])

    def pair(value: Callable[[Apart], float]) -> Callable[[Run], Ours]:
        def ours(run: Run) -> Ours:
            apart = _apart(run, column, _HEAVIER, _LIGHTER)
            return Ours(value(apart), note=apart.told())

        return ours

    def of_four(run: Run) -> Ours:
        apart = _farthest(run, column)
        return Ours(apart.percent(), note=apart.told())

    for key, where, quantity, unit, paper, ours in (
        (
            f"results.max_{name}_difference",
            "3.4",
            f"largest difference of {name} of L4L5 between two of four persons, of the smaller",
            "%",
            percent,
            of_four,
        ),
        (
            f"results.max_{name}_difference.pair",
            "4.2",
            f"{name} of L4L5, {_PAIR}, where they differ most",
            "%",
            percent,
            pair(Apart.percent),
        ),
        (
            f"results.max_{name}_difference_n",
            "4.2",
            f"{name} of L4L5, {_PAIR}, where they differ most",
            "N",
            newton,
            pair(lambda apart: apart.newton),
        ),
        (
            f"fig_9.base_{name}_n",
            "4.2 (G9)",
            f"{name} of L4L5 of {_LIGHTER} there, which both printed numbers imply",
            "N",
            base_n(name),
            pair(lambda apart: apart.other_n),
        ),
    ):
        yield Claim(key, where, quantity, unit, paper, as_persons_differ(paper), ours, OTHER_MODEL)
    yield from _order(name, column)


def _order(name: str, column: str) -> Iterator[Claim]:
    """Who bears more, and where it shows."""
    yield Claim(
        f"fig_9.{name}.heavier_bears_more",
        "4.2, Fig 9",
        f"angles at which {name} of L4L5 is larger for {_HEAVIER} than for {_LIGHTER}",
        "%",
        100.0,
        exactly(100.0),
        lambda run: _bears_more(run, column),
        "the taller and heavier of the two bears less at some angle",
    )
    yield yes_no(
        f"fig_9.{name}.grows_with_flexion",
        "3.4, Fig 9",
        f"{name} of L4L5 of {_PAIR} differs more at the largest angle than upright, in N",
        lambda run: _grows(run, column),
    )


def _difference(run: Run, column: str) -> "pd.Series[float]":
    one, other = (_loads(run, column, who) for who in (_HEAVIER, _LIGHTER))
    found = (one - other).dropna()
    if len(found) < 2:
        raise NotComputed(f"{_HEAVIER} and {_LIGHTER} share fewer than two angles of flexion")
    return found


def _bears_more(run: Run, column: str) -> Ours:
    difference = _difference(run, column)
    return Ours(100.0 * float((difference > 0.0).mean()), note=f"ours: {len(difference)} angles")


def _grows(run: Run, column: str) -> bool:
    size = _difference(run, column).abs()
    return bool(size.iloc[-1] > size.iloc[0])

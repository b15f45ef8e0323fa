"""Errors of the two models and by how much the one is better, beside those of a phantom.

Whatever the verdict, these rows say nothing of the patients: the phantom's spines are made up, and
a window of half to twice is chosen for want of any printed uncertainty.
"""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, at_most, exactly
from spinepipe.studies.scoliosis.errors import of_group, of_rotations
from spinepipe.studies.scoliosis.jalalian_2017.paper import (
    BENDING,
    ERRORS,
    EXAMPLE,
    EXAMPLE_SMALLER_PERCENT,
    FERGUSON,
    FILMS,
    GROUP,
    LINEAR,
    MEASURE,
    MODEL,
    OPPOSITE,
    OTHER_TRUTH,
    PHANTOM,
    PLACE,
    REDUCTION,
    REDUCTION_BY_RANGE,
    ROTATION,
    TANGENT,
    TILT,
    UNIT,
    UNSEEN,
    Printed,
    implied,
    printed_reduction,
    spread,
    window,
    window_of_percent,
)

OF_PATIENTS = (PLACE, TILT)
"""Printed as mean and SD over patients of their root mean square errors; the others are pooled."""

ACCEPTABLE_FERGUSON_DEG = 5.0

_NOT_SAID = "the paper does not say of which positions; mean and SD of the errors without sign"
_BY_HOW_MUCH = "by how much tangent is below linear_regions, "
_OF_BOTH = (
    "the paper's is of fitted and held-out films together; ours the mean of the two reductions"
)


def claims_of_errors() -> Iterator[Claim]:
    """Errors as printed, then reductions."""
    for (positions, quantity, model), printed in ERRORS.items():
        if positions == OPPOSITE:
            for group in GROUP.values():
                yield from _opposite(group, model, printed)
        else:
            yield from _error(positions, quantity, model, printed)
    yield from _example()
    yield _acceptable()
    yield from _reductions()


def _claim(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    allowed: Range,
    ours: Callable[[Run], Ours],
    note: str = "",
) -> Claim:
    """A number of patients beside that of a phantom."""
    told = f"{PHANTOM}; {note}" if note else PHANTOM
    return Claim(key, where, quantity, unit, paper, allowed, ours, OTHER_TRUTH, told)


def _error(positions: str, quantity: str, model: str, printed: Printed) -> Iterator[Claim]:
    key = f"errors.{positions}.{quantity}.{model}"
    group, unit = GROUP[positions], UNIT[quantity]
    where = {"films": group, "measure": MEASURE[quantity], "model": MODEL[model]}
    of = "mean over patients" if quantity in OF_PATIENTS else "root mean square"
    words = f"{MEASURE[quantity]} error, {FILMS[group]}, {MODEL[model]}"
    note = ""
    if printed.value is None:
        value = implied(positions, quantity)
        allowed, note = window(value), f"graph only; the range is about {value:.2f}, after J4"
    elif printed.sd is not None:
        allowed = spread(printed.value, printed.sd)
    else:
        allowed = window(printed.value)
    column = "mean_of_patients" if quantity in OF_PATIENTS else "rmse"
    ours = _accuracy(column, unit, where)
    yield _claim(key, printed.where, f"{of}: {words}", unit, printed.value, allowed, ours, note)
    if printed.sd is not None:
        yield _claim(
            f"{key}.sd",
            printed.where,
            f"SD over patients: {words}",
            unit,
            printed.sd,
            window(printed.sd),
            lambda run: Ours(run.number("accuracy", "sd_of_patients", **where)),
        )


def _accuracy(column: str, unit: str, where: dict[str, str]) -> Callable[[Run], Ours]:
    """A number of table `accuracy`, beside mean less and plus SD of the patients' own errors."""

    def ours(run: Run) -> Ours:
        value = run.number("accuracy", column, **where)
        row = run.row("accuracy", **where)
        mean, sd, noise = (
            float(row[name]) for name in ("mean_of_patients", "sd_of_patients", "reading_noise")
        )
        told = f"ours: reading the films alone makes {noise:.2g} {unit}" if noise > 0.0 else ""
        if not np.isfinite(sd):
            return Ours(value, note=told)
        return Ours(value, mean - sd, mean + sd, told)

    return ours


def _sizes(run: Run, group: str, model: str) -> "pd.Series[float]":
    """Errors without sign of segments that turn against a bend, deg."""
    rows = of_group(run.rows("displacements", model=MODEL[model], opposite=True), group)
    sizes = of_rotations(rows).abs().dropna()
    if sizes.empty:
        raise NotComputed("no film has a segment that turns against a bend")
    return sizes


def _opposite(group: str, model: str, printed: Printed) -> Iterator[Claim]:
    assert printed.value is not None
    assert printed.sd is not None
    key = f"errors.{OPPOSITE}.{ROTATION}.{model}.{group}"
    words = f"error of rotations against the bend, {FILMS[group]}, {MODEL[model]}"

    def mean(run: Run) -> Ours:
        sizes = _sizes(run, group, model)
        middle, sd = float(sizes.mean()), float(sizes.std(ddof=0))
        return Ours(middle, middle - sd, middle + sd, f"ours: {len(sizes)} rotations")

    def deviation(run: Run) -> Ours:
        return Ours(float(_sizes(run, group, model).std(ddof=0)))

    for suffix, what, value, ours in (
        ("", "mean", printed.value, mean),
        (".sd", "SD", printed.sd, deviation),
    ):
        quantity, allowed = f"{what}: {words}", window(value)
        yield _claim(key + suffix, printed.where, quantity, "deg", value, allowed, ours, _NOT_SAID)


def _example() -> Iterator[Claim]:
    """Fig 6: two simulated spines of one patient."""
    for side, value in EXAMPLE.items():
        yield Claim(
            f"errors.fig6_example_{side}_spine.ferguson_angle.example",
            "section 4, Fig 6",
            f"Ferguson error of the {side} spine",
            "deg",
            value,
            exactly(value),
            _not_our_patient,
            "",
        )
    yield Claim(
        "errors.fig6_example.smaller_by",
        "section 4, Fig 6",
        "by how much place and tilt errors of the left spine are below those of the right one",
        "%",
        EXAMPLE_SMALLER_PERCENT,
        exactly(EXAMPLE_SMALLER_PERCENT),
        _not_our_patient,
        "",
    )


def _not_our_patient(run: Run) -> Ours:
    raise NotComputed("one patient of the paper, whose films are not published")


def _acceptable() -> Claim:
    where = {"films": GROUP[BENDING], "measure": MEASURE[FERGUSON], "model": MODEL[TANGENT]}
    return _claim(
        "results.acceptable_ferguson_error",
        "section 3.2",
        "Ferguson error that the literature accepts; ours: bending films, tangent",
        "deg",
        ACCEPTABLE_FERGUSON_DEG,
        at_most(ACCEPTABLE_FERGUSON_DEG),
        _accuracy("rmse", "deg", where),
    )


def _reductions() -> Iterator[Claim]:
    for positions, group in GROUP.items():
        yield _reduction(
            f"improvement.{ROTATION}.{positions}",
            "section 3.1",
            f"error of rotations, {FILMS[group]}",
            REDUCTION[ROTATION, positions],
            _reduced(group, ROTATION, "rmse"),
        )
    yield _ferguson()
    for quantity in OF_PATIENTS:
        yield _reduction(
            f"improvement.{quantity}.four_positions",
            "abstract, sections 3.2, 4",
            f"{MEASURE[quantity]} error",
            REDUCTION[quantity, "four_positions"],
            _of_both(quantity),
            _OF_BOTH,
        )
    for group in GROUP.values():
        for name, paper in REDUCTION_BY_RANGE.items():
            yield _reduction(
                f"improvement.{ROTATION}.all.{name}.{group}",
                "section 4, Fig 7",
                f"rotations {name.replace('_', ' ')} of the published end, {FILMS[group]}",
                paper,
                _in_range(name, group),
                "the paper's is of all positions",
            )
        yield _reduction(
            f"improvement.{ROTATION}.{OPPOSITE}.{group}",
            "section 4",
            f"mean error of rotations against the bend, {FILMS[group]}",
            REDUCTION[ROTATION, OPPOSITE],
            _against_the_bend(group),
            _NOT_SAID,
        )


def _reduction(
    key: str,
    where: str,
    words: str,
    paper: float,
    ours: Callable[[Run], Ours],
    note: str = "",
) -> Claim:
    allowed = window_of_percent(paper)
    return _claim(key, where, _BY_HOW_MUCH + words, "%", paper, allowed, ours, note)


def _ferguson() -> Claim:
    """Of the bending films, whose errors are printed; what the text says of all four is J3's."""
    expected = printed_reduction(BENDING, FERGUSON)
    group = GROUP[BENDING]
    return _claim(
        f"improvement.{FERGUSON}.{BENDING}",
        "section 3.2",
        f"{_BY_HOW_MUCH}error of Ferguson angles, {FILMS[group]}",
        "%",
        None,
        window_of_percent(expected),
        _reduced(group, FERGUSON, "rmse"),
        f"{expected:.1f} of the printed 1 and 3 deg",
    )


def _percent_less(tangent: float, linear: float) -> float:
    if linear == 0.0:
        raise NotComputed("the linear model has no error")
    return 100.0 * (1.0 - tangent / linear)


def _pair(run: Run, group: str, quantity: str, column: str) -> float:
    both = (
        run.number("accuracy", column, films=group, measure=MEASURE[quantity], model=MODEL[model])
        for model in (TANGENT, LINEAR)
    )
    return _percent_less(*both)


def _reduced(group: str, quantity: str, column: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(_pair(run, group, quantity, column))


def _of_both(quantity: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        fitted, unseen = (
            _pair(run, GROUP[one], quantity, "mean_of_patients") for one in (BENDING, UNSEEN)
        )
        told = f"ours: {fitted:.0f} % on fitted, {unseen:.0f} % on held-out films"
        return Ours(0.5 * (fitted + unseen), min(fitted, unseen), max(fitted, unseen), told)

    return ours


def _in_range(name: str, group: str) -> Callable[[Run], Ours]:
    """Segments that turn with and against the bend together, as the paper has them."""

    def pooled(run: Run, model: str) -> float:
        rows = run.rows("by_range", films=group, range=name, model=MODEL[model])
        known = rows[rows["n"] > 0]
        if known.empty:
            raise NotComputed("there is no such rotation")
        counts = known["n"].to_numpy(float)
        squares = known["rmse_deg"].to_numpy(float) ** 2
        return float(np.sqrt((counts * squares).sum() / counts.sum()))

    def ours(run: Run) -> Ours:
        value = _percent_less(pooled(run, TANGENT), pooled(run, LINEAR))
        rows = run.rows("by_range", films=group, range=name, model=MODEL[TANGENT])
        return Ours(value, note=f"ours: {int(rows['n'].sum())} rotations")

    return ours


def _against_the_bend(group: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        tangent, linear = (float(_sizes(run, group, model).mean()) for model in (TANGENT, LINEAR))
        return Ours(_percent_less(tangent, linear))

    return ours

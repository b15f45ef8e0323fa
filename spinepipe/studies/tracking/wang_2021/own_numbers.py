"""What the paper's numbers, words and formulas say of each other: W1, W2, W4, W6, W7 and W10.

W3, W8 and W9 stand with the errors, W5 with the settings. Formulas are asked of what this study
uses.
"""

from collections.abc import Iterator

import numpy as np

from spinepipe.comparison.claim import Claim, Range, exactly
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.skeleton import JOINTS
from spinepipe.studies.tracking.wang_2021.errors_by_approach import ANGLE, CENTRE, HIGHEST, UNIT
from spinepipe.studies.tracking.wang_2021.paper import (
    YES_NO,
    contradicted,
    missing,
    recomputed,
)
from spinepipe.studies.tracking.wang_2021.set_up import CLUSTERS, PER_CLUSTER, SINGLES

APPROACHES_TOLD, APPROACHES_LISTED = 6, 8

_A, _B, _Q = 1.5, 40.0, 0.03
"""N m, 1/rad and rad of a made-up passive element: any will do."""

_ROUND_OFF = 1e-9


def claims_of_own_numbers() -> Iterator[Claim]:
    """Formulas, then the checks in their order."""
    yield from _formulas()
    yield contradicted(
        "closed_form.W1",
        "Abstract, Results",
        "errors are root mean squares, as the abstract has it",
        YES_NO,
        1.0,
        0.0,
        "W1: the results have them as means of absolute errors; such they are here",
    )
    for measure in (CENTRE, ANGLE):
        value = HIGHEST.error(measure)
        yield contradicted(
            f"closed_form.W2.{measure}",
            "Abstract, Results",
            "the largest error of calibrated approaches is below the number of the abstract",
            YES_NO,
            1.0,
            0.0,
            f"W2: it is {value:g} {UNIT[measure]} itself in the results: up to is meant",
        )
    yield contradicted(
        "closed_form.W4",
        "Evaluation",
        "approaches that are compared",
        "count",
        float(APPROACHES_TOLD),
        float(APPROACHES_LISTED),
        f"W4: {APPROACHES_LISTED} are listed: IK, IK with ratios, and OptK with passive elements "
        "none, generic, calibrated, from flexion, from bending and from both",
    )
    yield contradicted(
        "closed_form.W7",
        "Eqs 1, 2",
        "p is one thing",
        YES_NO,
        1.0,
        0.0,
        "W7: in Eq 1 places of markers, in the passive forces of Eq 2 their parameters",
    )
    yield recomputed(
        "closed_form.W10",
        "Measurements",
        "markers on the spine",
        "count",
        22.0,
        exactly(22.0),
        float(PER_CLUSTER * len(CLUSTERS) + len(SINGLES)),
        "W10: six clusters of three, and four single ones",
    )


def passive(q: float) -> tuple[float, float]:
    """Load (N m) and stiffness (N m/rad) of the made-up element, as this study has it."""
    sides = (len(JOINTS), 6, 2)
    law = PassiveLaw(np.full(sides, _A), np.full(sides, _B))
    load, stiffness, _ = law.with_slopes(np.full((1, len(JOINTS), 6), q))
    return float(load[0, 0, 3]), float(stiffness[0, 0, 3])


def _formulas() -> Iterator[Claim]:
    load, stiffness = passive(_Q)
    expected = _A * (np.exp(_B * _Q) - 1.0)
    yield _formula("passive", "Eq 3", "passive moment A (exp(B q) - 1)", "N m", expected, load)
    yield _formula(
        "tangent_stiffness",
        "Eq 3",
        "its slope, B (F + A)",
        "N m/rad",
        _B * (expected + _A),
        stiffness,
    )
    one_sided = _A * (np.exp(-_B) - 1.0)
    yield recomputed(
        "closed_form.W6",
        "Eq 3",
        "load of one exponential far on its other side, over A",
        "",
        -1.0,
        Range(-1.0 - _ROUND_OFF, -1.0 + _ROUND_OFF, "its limit"),
        float(one_sided / _A),
        "W6: it cannot stiffen on both sides; the passive elements of this study have one "
        f"exponential for each, {passive(-_Q)[0] / load:g} times as much on the other side",
    )
    for key, where, quantity, why in (
        (
            "objective",
            "Eq 1",
            "squares of marker errors and of active loads",
            "signs of norms and units are not told; scales are settings here",
        ),
        (
            "dynamics",
            "Eq 2",
            "inertia, weight, velocity terms, active and passive loads balance",
            "it is no number; tests hold the terms against OpenSim's inverse dynamics",
        ),
    ):
        yield missing(f"equations.{key}", where, quantity, "", None, why)


def _formula(key: str, where: str, quantity: str, unit: str, expected: float, ours: float) -> Claim:
    reach = _ROUND_OFF * abs(expected)
    told = Range(expected - reach, expected + reach, f"the formula's {expected:.6g}")
    note = f"A {_A:g} N m, B {_B:g} 1/rad, q {_Q:g} rad"
    return recomputed(f"equations.{key}", where, quantity, unit, None, told, ours, note)

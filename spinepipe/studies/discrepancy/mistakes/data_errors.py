"""Suspected mistakes in the files: they are no physics, and no effect should explain them.

Signs and units come from how joints answer their loads, without any model; scatter from repeats;
exchanged specimens from fits of the base. What cannot be told is not reported: see each part.

Two specimens whose motion changed places: each fits the other's readings far better.

With pure moments on joints of like orientation this cannot be told: stiffness, free for each
specimen, then changes places too, and all fits as well as before. What tells are axes, masses and
load points of their own. So a pair is named only if exchanging it lets both fit about as well as
the other specimens do, and neither did before.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from spinepipe.decomposition import lstsq
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.mistakes.bad_markers import (
    bad_markers,
    beside_the_curve,
    between_cycles,
)
from spinepipe.studies.discrepancy.mistakes.suspected import answers
from spinepipe.studies.discrepancy.mistakes.wrong_units_and_signs import wrong_signs, wrong_units
from spinepipe.studies.discrepancy.search.grounds import Grounds
from spinepipe.studies.discrepancy.search.hypothesis import Hypothesis, hypothesis
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.prediction import NoEquilibrium, Simulated
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.store import Run
from spinepipe.studies.discrepancy.verdict import SuspectedError

LEAST_EXCESS = 3.0
"""SDs of chi2 (sqrt of twice the readings) by which both specimens must fail to be looked at."""

LEAST_SHARE = 0.6
"""Of the pair's excess chi2, over what the other specimens have, that the exchange takes away."""

LEAST_GAIN = 60.0
"""Drop of chi2 that is strong evidence whatever else."""


@dataclass(frozen=True)
class _Exchange:
    pair: tuple[str, str]
    before: float
    after: float
    share: float


def swapped(grounds: Grounds, run: Run) -> list[SuspectedError]:
    """Pairs that evidently changed places, best first, each specimen in one pair at most."""
    chi2 = {name: float(r @ r) for name, r in grounds.fit.residuals.items()}
    failing = [name for name in chi2 if _fails(chi2[name], len(grounds.fit.residuals[name]))]
    tried = [_exchange(grounds, pair, chi2, run) for pair in combinations(failing, 2)]
    strong = [one for one in tried if one is not None and one.share > LEAST_SHARE]
    taken: set[str] = set()
    errors = []
    for one in sorted(strong, key=lambda e: e.after - e.before):
        if not taken & set(one.pair) and one.before - one.after > LEAST_GAIN:
            taken |= set(one.pair)
            evidence = (
                f"chi2 of both {one.before:.0f} as read and {one.after:.0f} exchanged, "
                f"{100.0 * one.share:.0f} % of their excess"
            )
            errors.append(SuspectedError(" and ".join(one.pair), "motion exchanged", evidence))
    return errors


def _fails(chi2: float, count: int) -> bool:
    return chi2 - count > LEAST_EXCESS * float(np.sqrt(2.0 * count))


def _exchange(
    grounds: Grounds, pair: tuple[str, str], chi2: Mapping[str, float], run: Run
) -> _Exchange | None:
    """The pair fitted with each other's readings; None where that cannot be or does not help."""
    readings = _exchanged(grounds.readings[pair[0]], grounds.readings[pair[1]])
    if readings is None:
        return None
    supposed, setting = _question(grounds, pair, readings)
    if not all(_one_step(supposed, setting, name) < chi2[name] for name in pair):
        return None
    fit: JointFit = run(joint_fit, supposed, setting)
    after = {name: float(r @ r) for name, r in fit.residuals.items()}
    if not fit.usable or any(after[name] >= chi2[name] for name in pair):
        return None
    before = sum(chi2[name] for name in pair)
    others = [chi2[n] / len(r) for n, r in grounds.fit.residuals.items() if n not in pair]
    usual = max(1.0, float(np.median(others))) if others else 1.0
    excess = before - usual * sum(len(r) for r in fit.residuals.values())
    share = (before - fit.chi2) / excess if excess > 0.0 else 0.0
    return _Exchange(pair, before, fit.chi2, share)


def _one_step(supposed: Hypothesis, setting: Setting, name: str) -> float:
    """The chi2 of a specimen that one linear step from the start reaches; a cheap first look."""
    member, one = supposed.members[name], setting.readings[name]
    simulated = Simulated(member.model, one.cases, setting.zeroed, member.free)
    try:
        predicted = simulated.at(np.zeros(len(member.free)))
    except NoEquilibrium:
        return np.inf
    errors = [
        np.nan_to_num(seen - test.mean)
        for seen, test in zip(predicted.readings, one.tests, strict=True)
    ]
    white = setting.whitenings[name]
    residual, jacobian = white(errors), white(predicted.by_x)
    step, _ = lstsq(jacobian, residual)
    left = residual - jacobian @ step
    return float(left @ left)


def _exchanged(a: SpecimenReadings, b: SpecimenReadings) -> dict[str, SpecimenReadings] | None:
    """Each with its own frames and loads and the other's readings; None if tests do not match."""
    shapes = [[(t.case.test, t.cycles.shape) for t in one.tests] for one in (a, b)]
    if shapes[0] != shapes[1]:
        return None
    return {
        mine.specimen: replace(mine, tests=_with_cycles(mine.tests, other.tests))
        for mine, other in ((a, b), (b, a))
    }


def _with_cycles(tests: Sequence[Repeats], others: Sequence[Repeats]) -> tuple[Repeats, ...]:
    """Tests with the readings of others."""
    return tuple(
        replace(test, cycles=other.cycles) for test, other in zip(tests, others, strict=True)
    )


def _question(
    grounds: Grounds, pair: tuple[str, str], readings: Mapping[str, SpecimenReadings]
) -> tuple[Hypothesis, Setting]:
    """Both bases fitted anew; each starts with the stiffness that the other's readings gave."""
    other = {pair[0]: pair[1], pair[1]: pair[0]}
    models = {
        name: grounds.fit.models[name].with_effects(grounds.fit.models[other[name]].effects)
        for name in pair
    }
    base = {name: grounds.start.base[other[name]] for name in pair}
    whitenings = {name: grounds.setting.whitenings[other[name]] for name in pair}
    setting = Setting(readings, whitenings, grounds.noise.zeroed)
    supposed = hypothesis(models, base, (), grounds.tests, grounds.start.bound)
    return supposed, setting


CLEAR = 5.0
"""SDs of one reading that a joint's motion must exceed to tell a sign or a unit."""


def suspected_errors(
    grounds: Grounds, measured: Sequence[SpecimenReadings], run: Run
) -> tuple[SuspectedError, ...]:
    """All suspected mistakes, where the base has a fit.

    Parameters
    ----------
    measured : the readings before outliers were left out; loose markers look like outliers.
    """
    joints = next(iter(grounds.fit.models.values())).joints
    found = [*before_a_fit(measured, joints, grounds.noise.sd, zeroed=grounds.noise.zeroed)]
    if not _is_repeated(measured):
        scatter = beside_the_curve(measured, grounds.fit.predicted)
        found += bad_markers(scatter, list(grounds.readings), joints, in_every=True)
    if not found:
        found += swapped(grounds, run)
    return tuple(found)


def before_a_fit(
    measured: Sequence[SpecimenReadings], joints: Sequence[str], sd: Array, *, zeroed: bool
) -> tuple[SuspectedError, ...]:
    """What can be told without a model: signs, units, and scatter between cycles.

    Also when the base has no fit, which a wrong unit may well be the reason for. ``sd`` (6,) m and
    rad, NaN where nothing was read.
    """
    by_name: Mapping[str, SpecimenReadings] = {one.specimen: one for one in measured}
    found = answers(by_name, zeroed, np.nan_to_num(sd), CLEAR)
    errors = [*wrong_units(found), *wrong_signs(found, joints, list(by_name), sd)]
    if _is_repeated(measured):
        errors += bad_markers(between_cycles(measured), list(by_name), joints, in_every=False)
    return tuple(errors)


def _is_repeated(measured: Sequence[SpecimenReadings]) -> bool:
    return any(bool((test.count >= 2).any()) for one in measured for test in one.tests)

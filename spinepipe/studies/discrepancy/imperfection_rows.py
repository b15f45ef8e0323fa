"""What imperfections took up, as rows of their table and in the verdict."""

from collections.abc import Iterator
from typing import Any

from spinepipe.studies.discrepancy.design.masked_effects import MaskedEffects
from spinepipe.studies.discrepancy.search.imperfections import (
    EVERYWHERE,
    AbsorbedGap,
    Imperfection,
    InCommon,
    NuisancePlace,
)
from spinepipe.studies.discrepancy.search.model_files import display_value
from spinepipe.studies.discrepancy.verdict_imperfections import (
    CommonImperfection,
    Imperfections,
    KindOfImperfection,
    LargeImperfection,
    WithheldEffect,
)

Row = dict[str, Any]

MOST_TOLD = 5
LEAST_SHARE = 0.05
"""Kinds that take up less of what all take up are not listed in the sentence."""

SMALL_GAP = 0.1
"""A gap that imperfections change by less is as good as the same."""


def imperfection_rows(taken: AbsorbedGap, model: str) -> Iterator[Row]:
    """One row per imperfection, and one per mean over several."""
    for one in taken.each:
        yield _row(one.at, model, one.size, one.sd) | {
            "taken_chi2": one.chi2,
            "places": 1,
            "chance": None,
            "common": False,
        }
    for mean in taken.common:
        yield _row(mean.at, model, mean.size, mean.sd) | {
            "taken_chi2": None,
            "places": mean.count,
            "chance": mean.chance,
            "common": mean.certain,
        }


def _row(at: NuisancePlace, model: str, size: float, sd: float) -> Row:
    prior, unit = display_value(at.unit, at.sd)
    return {
        "model": model,
        "specimen": at.specimen,
        "kind": at.kind,
        "component": at.component,
        "joint": at.joint,
        "test": at.test,
        "value": size * prior,
        "unit": unit,
        "prior_sd": prior,
        "in_prior_sds": size,
        "posterior_sd": sd,
    }


def told_imperfections(taken: AbsorbedGap) -> Imperfections:
    """The same in a few words and numbers."""
    common = tuple(_common(one) for one in taken.common if one.certain)
    largest = tuple(_large(one) for one in taken.largest[:MOST_TOLD])
    kinds = tuple(KindOfImperfection(kind, chi2) for kind, chi2 in taken.by_kind.items())
    without = None if taken.without is None else taken.without.gap
    parts = [_sizes(without, taken.beside.gap), _kinds(taken), *map(_too_alike, common)]
    if not common and largest and kinds and abs(largest[0].in_prior_sds) > 1.0:
        parts.append(_one_large(largest[0]))
    message = " ".join(part for part in parts if part)
    return Imperfections(without, taken.beside.gap, kinds, largest, common, message)


def told_withheld(one: MaskedEffects) -> WithheldEffect:
    """An effect that an imperfection hides, and to what that would have to be known."""
    allowed, unit = display_value(one.unit, one.prior)
    known = None if one.needed is None else one.needed * allowed
    return WithheldEffect(one.effect, one.kind, allowed, known, unit, one.now, one.at[0.0])


def _large(one: Imperfection) -> LargeImperfection:
    value, unit = display_value(one.at.unit, one.size * one.at.sd)
    return LargeImperfection(one.at.kind, where(one.at), one.size, value, unit)


def _common(one: InCommon) -> CommonImperfection:
    value, unit = display_value(one.at.unit, one.size * one.at.sd)
    return CommonImperfection(one.at.kind, where(one.at), one.size, one.sd, value, unit)


def where(at: NuisancePlace) -> str:
    """``anterior, L4L5, specimen s01``; of a mean: ``anterior, all joints, all specimens``."""
    by_test = at.kind in _BY_TEST
    own = (at.test, "test", "all tests") if by_test else (at.joint, "", "all joints")
    name, word, every = own
    local = every if name == EVERYWHERE else f"{word} {name}".strip()
    of = "all specimens" if at.specimen == EVERYWHERE else f"specimen {at.specimen}"
    return f"{at.component}, {local}, {of}"


_BY_TEST = ("load_axis", "load_gain")


def _sizes(without: float | None, beside: float) -> str:
    if without is None:
        return "Without the small imperfections allowed for the model has no fit to compare with."
    if abs(without - beside) < SMALL_GAP:
        return (
            f"The small imperfections allowed for change little: the gap is {beside:.2f} noise SD "
            f"with them and {without:.2f} without."
        )
    return (
        f"Without the small imperfections allowed for the gap would be {without:.2f} noise SD; "
        f"with them it is {beside:.2f}."
    )


def _kinds(taken: AbsorbedGap) -> str:
    """Which kinds took it up, where they took up much."""
    whole = taken.linear_chi2
    if taken.without is None or abs(taken.without.gap - taken.beside.gap) < SMALL_GAP:
        return ""
    shares = [
        f"{kind} {100.0 * chi2 / whole:.0f} %"
        for kind, chi2 in taken.by_kind.items()
        if chi2 > LEAST_SHARE * whole
    ]
    return f"What took it up: {', '.join(shares)}." if shares else ""


def _too_alike(one: CommonImperfection) -> str:
    return (
        f"Off alike: {one.kind} ({one.where}), {_size(one.value, one.unit)}, that is "
        f"{one.mean_in_prior_sds:.2f} ± {max(one.se, 0.01):.2f} of its prior SD. A shift in common "
        "is no random error: look at how it was measured or told."
    )


def _one_large(one: LargeImperfection) -> str:
    size = _size(one.value, one.unit)
    return f"Largest: {one.kind} ({one.where}), {size}, {one.in_prior_sds:.1f} of its prior SD."


def _size(value: float, unit: str) -> str:
    return f"{100.0 * value:.2g} %" if unit == "1" else f"{value:.2g} {unit}"

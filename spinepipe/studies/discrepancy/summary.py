"""The verdict, from what a search found: names, sets, what stays, and where."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.curve_numbers import numbers_at
from spinepipe.studies.discrepancy.design.distinguishability import Distinguishability
from spinepipe.studies.discrepancy.design.testable import LEAD
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.gaps import places, residual_frame, worst
from spinepipe.studies.discrepancy.search.imperfections import (
    EVERYWHERE,
    AbsorbedGap,
    NuisancePlace,
)
from spinepipe.studies.discrepancy.search.investigation import Investigation, Prepared
from spinepipe.studies.discrepancy.search.model_files import display_value
from spinepipe.studies.discrepancy.search.noise import Noise as FittedNoise
from spinepipe.studies.discrepancy.search.outcome import Outcome
from spinepipe.studies.discrepancy.search.regions import values_with_regions
from spinepipe.studies.discrepancy.search.residual_model import ResidualModel
from spinepipe.studies.discrepancy.search.search_state import SearchResult, SelectedTerm
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import (
    EVEN,
    EVERY,
    LEAST_PROBABLE,
    SOMETHING_ELSE,
    Candidate,
    CommonImperfection,
    Estimate,
    Gaps,
    Imperfections,
    KindOfImperfection,
    LargeImperfection,
    LeftOut,
    MisfitSizes,
    Missing,
    ReportedNoise,
    RivalName,
    Threshold,
    Verdict,
    VerdictScope,
    share_of_gap,
)
from spinepipe.studies.discrepancy.verdict_unnamed import UnnamedMisfit, UnnamedRest
from spinepipe.units import DISPLAY_PER_SI

Row = dict[str, Any]

MOST_RIVALS, MOST_PLACES = 5, 3

MOST_IMPERFECTIONS = 5
LEAST_SHARE = 0.05
"""Kinds that take up less of what all take up are not listed in the sentence."""

SMALL_GAP = 0.1
"""A gap that imperfections change by less is as good as the same."""


def summarise(
    ready: Prepared,
    investigation: Investigation,
    told: Distinguishability,
    stays: ResidualModel,
    numbers: Sequence[Row],
    taken: AbsorbedGap,
    run: PieceRunner,
) -> Verdict:
    """What a search found, in a few words.

    Parameters
    ----------
    told : what these tests can tell. stays : what describes what has no name.
    numbers : rows of the field's numbers.
    taken : what imperfections take up beside the final model.
    """
    cohort = ready.cohort
    found, proof, ended = investigation.found, investigation.proof, investigation.ended
    gaps = {
        "base": found.base_gap,
        "with_effects": found.final_gap,
        "held_out_base": proof.base and proof.base.against(proof.expected),
        "held_out_with_effects": proof.with_effects and proof.with_effects.against(proof.expected),
    }
    final = places(residual_frame(investigation.grounds, found.final.fit, cohort.joint_names))
    largest = "; ".join(
        f"{p.at['joint']}, {str(p.at['coordinate']).replace('_', ' ')}, test {p.at['test']} "
        f"(gap {p.gap.gap:.1f})"
        for p in worst(final, MOST_PLACES)
    )
    left_where = largest or "no single place stands out"
    # what the generic basis sees there
    evident = found.probabilities[SOMETHING_ELSE] >= EVEN
    shape = found.lack.shape if evident else None
    coordinate = found.lack.coordinate if shape else None
    return Verdict(
        cohort=cohort.name,
        verdict=ended.verdict,
        why=ended.why,
        effects=tuple(_missing(found, one, cohort, numbers, run) for one in ended.named),
        candidates_in_set=ended.tied,
        candidates=nearest_candidates(_in_set(found, ended), LEAD),
        not_testable=told.not_testable,
        noise=noise_summary(found.base.noise),
        rms_residual=MisfitSizes(**{name: gap.rms if gap else None for name, gap in gaps.items()}),
        gap=Gaps(
            **{name: gap.gap if gap else None for name, gap in gaps.items()},
            held_out_closed=proof.closed,
            held_out_gap_closed=None if proof.closed is None else share_of_gap(proof.closed),
        ),
        smallest_detectable=told.smallest_detectable,
        unknown=None
        if ended.reason is None
        else UnnamedMisfit(left_where, shape, ended.reason, coordinate),
        part=UnnamedRest(found.final_gap.gap, left_where, shape, ended.left, coordinate)
        if ended.left
        else None,
        suspected_data_errors=investigation.errors,
        threshold=Threshold(investigation.rules.needed),
        imperfections=imperfection_summary(taken),
        tabulated=stays.table,
        left_out=tuple(_left_out(proof)),
        probabilities={n: p for n, p in found.probabilities.items() if p >= LEAST_PROBABLE},
    )


def _left_out(proof: HeldOut) -> Iterator[LeftOut]:
    for kind, folds in proof.by_kind().items():
        if folds.base is None or folds.with_effects is None or folds.expected <= 0.0:
            continue
        yield LeftOut(
            kind,
            len(folds.folds),
            folds.base.against(folds.expected).gap,
            folds.with_effects.against(folds.expected).gap,
            folds.closed,
            None if folds.closed is None else share_of_gap(folds.closed),
        )


def nearest_candidates(candidates: Iterable[Candidate], margin: float) -> tuple[Candidate, ...]:
    """Each name once per place, where it is near: within the margin, else where it is nearest."""
    every = tuple(dict.fromkeys(candidates))
    nearest: dict[str, float] = {}
    for one in every:
        if one.behind is not None:
            nearest[one.name] = min(one.behind, nearest.get(one.name, one.behind))
    return tuple(
        one for one in every if one.behind is None or one.behind <= max(margin, nearest[one.name])
    )


def _in_set(found: SearchResult, ended: Outcome) -> Iterator[Candidate]:
    """Names of the set: what stands there, then its rivals, wherever they are."""
    for one in found.standing:
        if one.name not in ended.tied or any(one is named for named in ended.named):
            continue
        own = one.supposed.form.variant.acts_on or EVERY
        near = {rival.name: rival for rival in one.rivals}
        yield Candidate(one.name, own, 0.0)
        for name in ended.tied:
            if name in near:
                yield Candidate(name, near[name].on or EVERY, near[name].margin)
            elif name != one.name:
                yield Candidate(name, own, None)


def _missing(
    found: SearchResult, one: SelectedTerm, cohort: Cohort, numbers: Sequence[Row], run: PieceRunner
) -> Missing:
    number = next(k for k, standing in enumerate(found.standing) if standing is one)
    form = one.supposed.form
    return Missing(
        name=one.name,
        kind=form.variant.create().kind.value,
        scope=VerdictScope(
            joints=EVERY if form.joint is None else (cohort.joint_names[form.joint],),
            coordinates=form.variant.acts_on or EVERY,
            specimens=EVERY if form.specimen is None else (form.specimen,),
        ),
        variant=dict(form.variant.options),
        spread=form.spread.value,
        parameters=tuple(
            Estimate(
                "@".join([value.name, *value.place]),
                value.value,
                value.unit,
                (value.low, value.high),
                value.at_bound,
                value.open_below,
                value.open_above,
                value.identifiable,
            )
            for value in run(values_with_regions, found.final.fit, found.final.setting, number)
        ),
        log_evidence=one.log_evidence,
        rivals=tuple(
            RivalName(other.name, other.margin, other.on or EVERY)
            for other in one.rivals[:MOST_RIVALS]
        ),
        field_numbers=numbers_at(numbers, form, cohort.joint_names),
    )


def noise_summary(noise: FittedNoise) -> ReportedNoise:
    """SDs of one reading in the units of tables, and how they are known."""
    sd = noise.sd * DISPLAY_PER_SI
    shared = np.where(np.isfinite(sd), noise.accuracy * DISPLAY_PER_SI, np.nan)
    return ReportedNoise(
        source=noise.source,
        rotation_sd_deg=_rms(sd[3:]),
        translation_sd_mm=_rms(sd[:3]),
        serial_correlation=noise.correlation,
        outliers_left_out=noise.outliers,
        accuracy_rotation_deg=_rms(shared[3:]),
        accuracy_translation_mm=_rms(shared[:3]),
        accuracy_assumed=noise.assumed,
    )


def _rms(sd: Array) -> float | None:
    """Of what was read; None where nothing was."""
    read = sd[np.isfinite(sd)]
    return float(np.sqrt(np.mean(read**2))) if len(read) else None


def imperfection_summary(taken: AbsorbedGap) -> Imperfections:
    """What imperfections took up, in a few words and numbers."""
    common = []
    for one in taken.common:
        if one.certain:
            value, unit = display_value(one.at.unit, one.size * one.at.sd)
            common.append(
                CommonImperfection(one.at.kind, place_of(one.at), one.size, one.sd, value, unit)
            )
    largest = []
    for big in taken.largest[:MOST_IMPERFECTIONS]:
        value, unit = display_value(big.at.unit, big.size * big.at.sd)
        largest.append(LargeImperfection(big.at.kind, place_of(big.at), big.size, value, unit))
    kinds = tuple(KindOfImperfection(kind, chi2) for kind, chi2 in taken.by_kind.items())
    without, beside = None if taken.without is None else taken.without.gap, taken.beside.gap
    parts = [_change_of_gap(taken)]
    for mean in common:
        parts.append(
            f"Off alike: {mean.kind} ({mean.where}), {_size(mean.value, mean.unit)}, that is "
            f"{mean.mean_in_prior_sds:.2f} ± {max(mean.se, 0.01):.2f} of its prior SD. A shift in "
            "common is no random error: look at how it was measured or told."
        )
    if not common and largest and kinds and abs(largest[0].in_prior_sds) > 1.0:
        first = largest[0]
        parts.append(
            f"Largest: {first.kind} ({first.where}), {_size(first.value, first.unit)}, "
            f"{first.in_prior_sds:.1f} of its prior SD."
        )
    return Imperfections(without, beside, kinds, tuple(largest), tuple(common), " ".join(parts))


def place_of(at: NuisancePlace) -> str:
    """``anterior, L4L5, specimen s01``; of a mean: ``anterior, all joints, all specimens``."""
    if at.kind in ("load_axis", "load_gain"):
        local = "all tests" if at.test == EVERYWHERE else f"test {at.test}"
    else:
        local = "all joints" if at.joint == EVERYWHERE else at.joint
    of = "all specimens" if at.specimen == EVERYWHERE else f"specimen {at.specimen}"
    return f"{at.component}, {local}, {of}"


def _change_of_gap(taken: AbsorbedGap) -> str:
    """How they change the gap, and which kinds took up much, where that is much."""
    if taken.without is None:
        return "Without the small imperfections allowed for the model has no fit to compare with."
    without, beside = taken.without.gap, taken.beside.gap
    if abs(without - beside) < SMALL_GAP:
        return (
            f"The small imperfections allowed for change little: the gap is {beside:.2f} noise SD "
            f"with them and {without:.2f} without."
        )
    shares = [
        f"{kind} {100.0 * chi2 / taken.linear_chi2:.0f} %"
        for kind, chi2 in taken.by_kind.items()
        if chi2 > LEAST_SHARE * taken.linear_chi2
    ]
    by_kind = f" What took it up: {', '.join(shares)}." if shares else ""
    return (
        f"Without the small imperfections allowed for the gap would be {without:.2f} noise SD; "
        f"with them it is {beside:.2f}.{by_kind}"
    )


def _size(value: float, unit: str) -> str:
    return f"{100.0 * value:.2g} %" if unit == "1" else f"{value:.2g} {unit}"

"""The verdict, from what a search found: names, sets, what stays, and where."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.curve_numbers import numbers_at
from spinepipe.studies.discrepancy.design.distinguishability import Distinguishability
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.gaps import GapPlace, places, residual_frame, worst
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm
from spinepipe.studies.discrepancy.search.investigation import Investigation, Prepared
from spinepipe.studies.discrepancy.search.noise import Noise as FittedNoise
from spinepipe.studies.discrepancy.search.outcome import Outcome
from spinepipe.studies.discrepancy.search.regions import ValueWithRegion, values_with_regions
from spinepipe.studies.discrepancy.search.residual_model import ResidualModel
from spinepipe.studies.discrepancy.search.screen import LEAST_THRESHOLD
from spinepipe.studies.discrepancy.search.search_state import SearchResult, SelectedTerm
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import (
    EVERY,
    Candidate,
    Estimate,
    Gaps,
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


def verdict_found(
    ready: Prepared,
    investigation: Investigation,
    told: Distinguishability,
    stays: ResidualModel,
    numbers: Sequence[Row],
    run: PieceRunner,
) -> Verdict:
    """What a search found, in a few words.

    Parameters
    ----------
    told : what these tests can tell. stays : what describes what has no name.
    numbers : rows of the field's numbers.
    """
    cohort = ready.cohort
    found, proof, ended = investigation.found, investigation.proof, investigation.ended
    final = places(residual_frame(investigation.grounds, found.final.fit, cohort.joint_names))
    screen = found.stages[0].screen
    gaps = {
        "base": found.base_gap,
        "with_effects": found.final_gap,
        "held_out_base": proof.base and proof.base.against(proof.expected),
        "held_out_with_effects": proof.with_effects and proof.with_effects.against(proof.expected),
    }
    return Verdict(
        cohort=cohort.name,
        verdict=ended.verdict,
        why=ended.why,
        effects=tuple(_missing(found, one, cohort, numbers, run) for one in ended.named),
        candidates_in_set=ended.tied,
        candidates=near_alone(_in_set(found, ended), ready.study.margin),
        not_testable=told.not_testable,
        noise=noise_told(found.base.noise),
        rms_residual=MisfitSizes(**{name: gap.rms if gap else None for name, gap in gaps.items()}),
        gap=Gaps(
            **{name: gap.gap if gap else None for name, gap in gaps.items()},
            held_out_closed=proof.closed,
            held_out_gap_closed=None if proof.closed is None else share_of_gap(proof.closed),
        ),
        smallest_detectable=told.smallest_detectable,
        unknown=_unknown(found, ended, final, stays),
        part=_part(found, ended, final, stays),
        suspected_data_errors=investigation.errors,
        threshold=Threshold(screen.threshold, ready.study.false_alarm, screen.draws),
        families=told.families,
        left_out=tuple(_left_out(proof)),
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


def near_alone(candidates: Iterable[Candidate], margin: float) -> tuple[Candidate, ...]:
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
        scope=_scope(form, cohort),
        variant=dict(form.variant.options),
        spread=form.spread.value,
        parameters=tuple(
            _estimate(value)
            for value in run(values_with_regions, found.final.fit, found.final.setting, number)
        ),
        log_evidence=one.log_evidence,
        rivals=tuple(
            RivalName(other.name, other.margin, other.on or EVERY)
            for other in one.rivals[:MOST_RIVALS]
        ),
        field_numbers=numbers_at(numbers, form, cohort.joint_names),
    )


def _estimate(value: ValueWithRegion) -> Estimate:
    return Estimate(
        "@".join([value.name, *value.place]),
        value.value,
        value.unit,
        (value.low, value.high),
        value.at_bound,
        value.open_below,
        value.open_above,
        value.identifiable,
    )


def _scope(form: CandidateForm, cohort: Cohort) -> VerdictScope:
    return VerdictScope(
        joints=EVERY if form.joint is None else (cohort.joint_names[form.joint],),
        coordinates=form.variant.acts_on or EVERY,
        specimens=EVERY if form.specimen is None else (form.specimen,),
    )


def noise_told(noise: FittedNoise) -> ReportedNoise:
    """SDs of one reading in the units of tables, and how they are known."""
    sd = noise.sd * DISPLAY_PER_SI
    return ReportedNoise(
        source=noise.source,
        rotation_sd_deg=_rms(sd[3:]),
        translation_sd_mm=_rms(sd[:3]),
        serial_correlation=noise.correlation,
        outliers_left_out=noise.outliers,
    )


def _rms(sd: Array) -> float | None:
    """Of what was read; None where nothing was."""
    read = sd[np.isfinite(sd)]
    return float(np.sqrt(np.mean(read**2))) if len(read) else None


def _unknown(
    found: SearchResult, ended: Outcome, final: Sequence[GapPlace], stays: ResidualModel
) -> UnnamedMisfit | None:
    if ended.reason is None:
        return None
    shape = _shape(found)
    coordinate = found.lack.coordinate if shape else None
    return UnnamedMisfit(_where(final), shape, ended.reason, coordinate, stays.formula)


def _part(
    found: SearchResult, ended: Outcome, final: Sequence[GapPlace], stays: ResidualModel
) -> UnnamedRest | None:
    """What stays beside the effects that are certain; None where nothing is said to."""
    if not ended.left:
        return None
    shape, gap = _shape(found), found.final_gap.gap
    coordinate = found.lack.coordinate if shape else None
    return UnnamedRest(gap, _where(final), shape, ended.left, coordinate, stays.formula)


def _where(final: Sequence[GapPlace]) -> str:
    """The largest gaps that are left, in words."""
    named = "; ".join(
        f"{p.at['joint']}, {str(p.at['coordinate']).replace('_', ' ')}, test {p.at['test']} "
        f"(gap {p.gap.gap:.1f})"
        for p in worst(final, MOST_PLACES)
    )
    return named or "no single place stands out"


def _shape(found: SearchResult) -> str | None:
    """What the generic basis sees there; None without evidence."""
    evident = found.lack.log_evidence > max(LEAST_THRESHOLD, found.generic_threshold)
    return found.lack.shape if evident else None

"""The verdict, from what a search found: names, sets, what stays, and where."""

from collections.abc import Iterator

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.design.distinguishability import Distinguishability
from spinepipe.studies.discrepancy.proof.held_out import HeldOut
from spinepipe.studies.discrepancy.search.gaps import places, residual_frame, worst
from spinepipe.studies.discrepancy.search.imperfections import AbsorbedGap
from spinepipe.studies.discrepancy.search.investigation import Investigation, Prepared
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
    Estimate,
    Gaps,
    Imperfections,
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

MOST_RIVALS, MOST_PLACES = 5, 3


def summarise(
    ready: Prepared,
    investigation: Investigation,
    told: Distinguishability,
    stays: ResidualModel,
    taken: AbsorbedGap,
    run: PieceRunner,
) -> Verdict:
    """What a search found, in a few words.

    Parameters
    ----------
    told : what these tests can tell. stays : what describes what has no name.
    taken : what imperfections take up beside the final model.
    """
    cohort = ready.cohort
    found, proof, ended = investigation.found, investigation.proof, investigation.ended
    gaps = {
        "base": found.base_gap,
        "with_effects": found.final_gap,
        "held_out_base": proof.base,
        "held_out_with_effects": proof.with_effects,
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
        effects=tuple(_missing(found, one, cohort, run) for one in ended.named),
        candidates_in_set=ended.tied,
        candidates=tuple(dict.fromkeys(_in_set(found, ended))),
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
        else UnnamedMisfit(left_where, shape, ended.reason, coordinate, stays=ended.stays),
        part=UnnamedRest(found.final_gap.gap, left_where, shape, ended.left, coordinate)
        if ended.left
        else None,
        suspected_data_errors=investigation.errors,
        threshold=Threshold(investigation.rules.needed),
        imperfections=Imperfections(
            None if taken.without is None else taken.without.gap, taken.beside.gap
        ),
        tabulated=stays.table,
        left_out=tuple(_left_out(proof)),
        probabilities={n: p for n, p in found.probabilities.items() if p >= LEAST_PROBABLE},
        search=found.extent,
    )


def _left_out(proof: HeldOut) -> Iterator[LeftOut]:
    for kind, folds in proof.by_kind().items():
        assert folds.base is not None
        assert folds.with_effects is not None
        yield LeftOut(
            kind,
            len(folds.folds),
            folds.base.gap,
            folds.with_effects.gap,
            folds.closed,
            None if folds.closed is None else share_of_gap(folds.closed),
        )


def _in_set(found: SearchResult, ended: Outcome) -> Iterator[Candidate]:
    """Names of the set, where they act: those that stand, then each rival where it is nearest."""
    named = set(map(id, ended.named))
    tied = [one for one in found.standing if one.name in ended.tied and id(one) not in named]
    for one in tied:
        yield Candidate(one.name, one.supposed.form.variant.acts_on or EVERY, 0.0)
    for name in (name for name in ended.tied if name not in {one.name for one in tied}):
        near = [rival for one in tied for rival in one.rivals if rival.name == name]
        best = min(near, key=lambda rival: rival.margin, default=None)
        if best is not None:
            yield Candidate(name, best.on or EVERY, best.margin)
        elif tied:  # nothing recorded speaks for it or against it
            yield Candidate(name, tied[0].supposed.form.variant.acts_on or EVERY, None)


def _missing(found: SearchResult, one: SelectedTerm, cohort: Cohort, run: PieceRunner) -> Missing:
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

"""Job: the tests of Gould et al. 2024b (Tables 5 to 7), and beside them those that fit the data.

Do errors differ between specimens or levels, and between two stiffness sets; does stiffness hang on
the load case?
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.tested_rows import FamilyTest, corrected_rows
from spinepipe.statistics import (
    ComputationStatus,
    StatisticalTest,
    f_test_nested,
    friedman,
    kruskal_wallis,
    wilcoxon_signed_rank,
)
from spinepipe.statistics.normality import NESTED
from spinepipe.status import joined
from spinepipe.studies.cohort_stiffness.representations import NUISANCE, POOLED, start_of
from spinepipe.studies.cohort_stiffness.settings import (
    ALL,
    CohortStiffness,
    joint_label,
    load_cases,
)
from spinepipe.studies.cohort_stiffness.stages import (
    FACTORS,
    FITTED,
    LEFT_OUT_CASE,
    LEFT_OUT_SPECIMEN,
    LITERATURE,
    SHARED_ERROR,
    compared_motion,
    of_single_cases,
    unit_of,
)
from spinepipe.studies.cohort_stiffness.tables import STATISTICS
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATES

STAGES = (LITERATURE, FITTED, LEFT_OUT_SPECIMEN, LEFT_OUT_CASE)

VALUES_AS_PUBLISHED = "takes values of the same specimen and joint as independent, as published"
FITS_AS_PUBLISHED = "takes the two fits of a specimen as independent, as published"
FAMILY = "load_case_specific"


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``statistics.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    frames = read_frames(tables)
    rows = list(corrected_rows(all_tests(frames["errors"], frames["fits"])))
    origin = provenance("statistics", settings, cohort)
    write(from_rows(STATISTICS, rows), output, origin)


def all_tests(errors: pd.DataFrame, fits: pd.DataFrame) -> Iterator[FamilyTest]:
    """Every test of the tables ``errors`` and ``fits``, family by family."""
    seen = compared_motion(errors)
    yield from between_groups(seen)
    yield from signed_ranks(seen)
    yield from against_level_ratio(seen)
    yield from load_case_specific(fits)


def between_groups(errors: pd.DataFrame) -> Iterator[FamilyTest]:
    """Kruskal-Wallis as published; Friedman, which keeps what belongs together, beside it.

    Fits to single load cases; of a left out load case, fits to all others.
    """
    for stage in STAGES:
        chosen = of_single_cases(errors, stage)
        for (representation, test), rows in chosen.groupby(["representation", "test"], sort=False):
            for what, (factor, block) in FACTORS.items():
                family = f"between_{what}/{representation}/{stage}"
                # the loaded coordinate alone, and all motion that is compared
                loaded = rows[rows["loaded"].astype(bool)]
                for response, part in (("loaded_error", loaded), (response_of(rows), rows)):
                    for outcome in _both(part, factor, block):
                        yield FamilyTest(family, "*", response, factor, str(test), outcome)


def response_of(rows: pd.DataFrame) -> str:
    """What errors of all motion that is compared are called."""
    return "rotation_error" if unit_of(rows) == "deg" else "translation_error"


def _both(rows: pd.DataFrame, factor: str, block: str) -> Iterator[StatisticalTest]:
    known = rows.dropna(subset="peak_error")
    errors = known["peak_error"].astype(float).abs()
    groups = [part.to_numpy(float) for _, part in errors.groupby(known[factor], sort=False)]
    published = kruskal_wallis(groups)
    yield replace(published, message=joined(published.message, VALUES_AS_PUBLISHED))
    grid = known.assign(error=errors).pivot(
        index=[block, "coordinate"], columns=factor, values="error"
    )
    complete = grid.dropna()
    lost = len(grid) - len(complete)
    # The coordinates of one block hang together: they count as one, by the mean of their ranks.
    ranks = complete.rank(axis=1).groupby(block, sort=False).mean()
    note = f"{lost} incomplete blocks of a coordinate left out" if lost else ""
    paired = friedman(ranks.to_numpy(float))
    yield replace(paired, message=joined(paired.message, note))


def signed_ranks(errors: pd.DataFrame) -> Iterator[FamilyTest]:
    """Wilcoxon tests within each specimen: published against fitted, fitted against predicted.

    Pairs are the absolute errors at the largest load of all motion of all joints; fits to
    single load cases.
    """
    published, fitted, held_out = (
        of_single_cases(errors, stage) for stage in (LITERATURE, FITTED, LEFT_OUT_SPECIMEN)
    )
    for representation in fitted["representation"].unique():
        own = fitted[fitted["representation"] == representation]
        others = held_out[held_out["representation"] == representation]
        before = published[published["representation"] == start_of(representation)]
        for comparison, first, second in (
            ("literature_against_fitted", before, own),
            ("fitted_against_left_out_specimen", own, others),
        ):
            if first.empty or second.empty:
                continue
            # one test per specimen and load case that both have
            keys = ["specimen", "test", "joint", "coordinate"]
            pairs = first[[*keys, "peak_error"]].merge(second[[*keys, "peak_error"]], on=keys)
            for (specimen, test), rows in pairs.groupby(["specimen", "test"], sort=False):
                known = rows.dropna().filter(like="peak_error").abs().to_numpy(float)
                outcome = wilcoxon_signed_rank(known[:, 0], known[:, 1])
                family = f"signed_rank/{comparison}/{representation}/{test}"
                response = response_of(first)
                yield FamilyTest(family, "*", response, "stage", str(test), outcome, str(specimen))


def against_level_ratio(errors: pd.DataFrame) -> Iterator[FamilyTest]:
    """One stiffness for all joints against the published ratio of levels, over specimens.

    The errors are root mean squares over joints at the largest load, per coordinate and overall;
    fits to single load cases.
    """
    fitted = of_single_cases(errors, FITTED)
    names = ("per_specimen", "level_ratio")
    both = [fitted[fitted["representation"] == name] for name in names]
    if any(part.empty for part in both):
        return
    for test in both[0]["test"].unique():
        first, second = (_rms(part[part["test"] == test]) for part in both)
        for response in (name for name in first if name in second):
            pair = pd.concat([first[response], second[response]], axis=1, join="inner")
            values = pair.to_numpy(float)
            family = f"per_specimen_against_level_ratio/{test}"
            published = kruskal_wallis([values[:, 0], values[:, 1]])
            note = f"{published.message}; {FITS_AS_PUBLISHED}"
            paired = wilcoxon_signed_rank(values[:, 0], values[:, 1])
            for outcome in (replace(published, message=note), paired):
                yield FamilyTest(family, "*", response, "representation", "fitted", outcome)


def _rms(rows: pd.DataFrame) -> Mapping[str, pd.Series]:
    """Root mean square over joints by specimen, for each coordinate and overall.

    A specimen with an unknown error has none.
    """
    found = {}
    chosen = {name: rows[rows["coordinate"] == name] for name in COORDINATES}
    for name, part in (*chosen.items(), ("overall", rows)):
        measured = part[part["measured_peak"].notna()]
        squares = (measured["peak_error"].astype(float) ** 2).groupby(measured["specimen"])
        known = squares.count() == squares.size()
        if len(known):
            found[f"{name}_rmse"] = squares.mean()[known].map(np.sqrt)
    return found


def load_case_specific(fits: pd.DataFrame) -> Iterator[FamilyTest]:
    """The extra sum of squares F test for each specimen and each plain representation.

    Pooled fits are no least squares fits: they are drawn towards the cohort. Nor are those with
    nuisances, and separate ones of each load case would be of several places for one joint.
    """
    plain = fits[~fits["representation"].isin((*POOLED, *NUISANCE))]
    for (representation, specimen), rows in plain.groupby(
        ["representation", "specimen"], sort=False
    ):
        family = f"{FAMILY}/{representation}"
        # A fit says where its sum of squares is not one of independent errors.
        notes = rows["message"] if "message" in rows else pd.Series(dtype=str)
        correlated = notes.str.contains(SHARED_ERROR, regex=False).any()
        outcome = _without(SHARED_ERROR) if correlated else nested_fits(rows)
        yield FamilyTest(family, "*", "stiffness", "load case", "", outcome, str(specimen))


def nested_fits(rows: pd.DataFrame) -> StatisticalTest:
    """The test for the fits of one specimen in one representation."""
    if joint_label(rows["fitted_to"]) != ALL:
        return _without("one load case only: nothing to compare")
    joint = rows[rows["fitted_to"] == ALL]
    single = rows[rows["fitted_to"].isin(load_cases(rows["fitted_to"]))]
    single = single[single["readings"] > 0]  # the specimen has no such load case
    if joint["cost"].isna().any() or joint.empty or single["cost"].isna().any():
        return _without("a fit is missing")
    if len(single) < 2:
        return _without("one load case only: nothing to compare")
    readings = int(joint["readings"].sum())
    if readings != int(single["readings"].sum()):
        return _without("the fits are not to the same readings")
    # an unknown at a bound is held there, and is none that the readings were fitted with
    small, large = (int(part["degrees_of_freedom"].sum()) for part in (joint, single))
    if small <= large:
        return _without("the separate fits have no more unknowns inside their bounds")
    # Extra sum of squares: what separate unknowns of each load case gain over shared ones.
    costs = float(joint["cost"].sum()), float(single["cost"].sum())
    outcome = f_test_nested(costs[0], small, costs[1], large)
    return replace(outcome, n=readings) if outcome.status is ComputationStatus.DONE else outcome


def _without(message: str) -> StatisticalTest:
    return NESTED.without(ComputationStatus.TOO_FEW, 0, message)

"""`python -m tests.validation [PART ...]`: measure, print, write tests/validation/results.

`python -m tests.validation discrepancy --help` tells the options of that part.
"""

import sys
from functools import partial

import pandas as pd

from spinepipe.studies.cohort_stiffness.claims import HOLDS
from spinepipe.studies.tracking.tables import LIMIT
from tests.validation import (
    back_muscles,
    comparisons,
    coverage,
    engines,
    film_ratios,
    film_restarts,
    findings,
    flexion_relaxation,
    index_coverage,
    large_files,
    plausibility,
    pooled_coverage,
    posterior_coverage,
    tracking,
    tracking_starts,
    trunk_pressures,
    wrong_inputs,
)
from tests.validation.discrepancy import command as discrepancy
from tests.validation.written import write as _write


def main() -> None:
    """Run the parts that are asked for, or all."""
    if sys.argv[1:2] == ["discrepancy"]:
        discrepancy.main(sys.argv[2:])
        return
    parts = {
        "back_muscles": lambda: _write("back_muscles", back_muscles.HEAD, back_muscles.table()),
        "comparisons": _comparisons,
        "coverage": _coverage,
        "engines": _engines,
        "film_ratios": _film_ratios,
        "film_restarts": _film_restarts,
        "findings": _findings,
        "flexion_relaxation": lambda: _write(
            "flexion_relaxation", flexion_relaxation.HEAD, flexion_relaxation.table()
        ),
        "index_coverage": _index_coverage,
        "large_files": _large_files,
        "plausibility": _plausibility,
        "pooled_coverage": _pooled_coverage,
        "posterior_coverage": _posterior_coverage,
        "tracking": _tracking,
        "tracking_profiles": _tracking_profiles,
        "tracking_starts": lambda: _write(
            "tracking_starts", tracking_starts.HEAD, tracking_starts.table()
        ),
        "trunk_pressures": _trunk_pressures,
        "wrong_inputs": _wrong_inputs,
        "discrepancy": discrepancy.main,
    }
    for name in sys.argv[1:] or parts:
        if name not in parts:
            sys.exit(f"no validation {name!r}: {', '.join(parts)}")
        parts[name]()


def _comparisons() -> None:
    found = comparisons.table()
    if found.empty:
        print("comparisons: no study with a paper was run here, see `make all` and `make full`")
        return
    head = (
        "Published numbers beside ours, study by study, as `against_<paper>.parquet` has them. "
        "Inside a range counts for little unless it has two ends whose width the paper gives "
        "(`inside_two_sided`): `chosen` ones have a width that we chose, `borrowed` ones one "
        "that the paper gives of something else; `wide` ranges, half to twice or more, exclude "
        "hardly anything, `one_sided` ones are an order or a sign, `binary` ones a yes, a no or a "
        "count."
    )
    _write("comparisons", head, found)


def _coverage() -> None:
    found = coverage.table()
    head = (
        f"How many true stiffnesses lie inside their 95 % regions: {coverage.PHANTOMS} phantoms of "
        "each design, one specimen of each, linear truth, each joint's three rotational "
        "stiffnesses free (goal for profile: 92-98 %). profile: every region, one with an open end "
        "being one-sided; local error bar: of stiffnesses whose logarithm has a standard error "
        "below 1, the rule before profiles; identifiable: of these the regions with both ends "
        "known. "
        "low, high: Student's t over phantoms. In flexion alone bending and axial rotation carry "
        "coupled moments only, at most 0.7 N m; bridged joints are 3 to 50 times as stiff, the "
        "stiffest turn by less than their readings err; 3 mm off is a weak test under moments "
        "(docs/decisions/0006)."
    )
    _write("coverage", head, found)


def _pooled_coverage() -> None:
    found = pooled_coverage.table()
    head = (
        "How many true stiffnesses lie inside the 95 % intervals of partially pooled fits: "
        f"{pooled_coverage.PHANTOMS} phantoms of six specimens each, linear truth, all load cases "
        "jointly. low, high: Student's t over phantoms. Under pure moments rotations hardly depend "
        "on joint centres: 3 mm are a weak test (docs/decisions/0006)."
    )
    _write("pooled_coverage", head, found)


def _engines() -> None:
    found = engines.table()
    head = (
        f"Stacks of runs against the engine of record (PyBullet) on {engines.MODELS} random "
        "models, each in six load steps there and back. Differences are shares of the largest "
        "motion in each coordinate, of derivatives of the largest by that unknown; one model in "
        f"{engines.DERIVED} has its derivatives compared. Goal: 1e-10. Some loads are more than "
        "a chain carries; there both engines must say so."
    )
    _write("engines", head, found)


def _posterior_coverage() -> None:
    found = posterior_coverage.table()
    head = (
        f"How often 95 % intervals of the posterior hold the truth: {posterior_coverage.PHANTOMS} "
        "single joints with a stiffness drawn from the prior (a factor of 100 in all, from well "
        "seen to not seen at all), landmarks felt with SD 1 mm, and the declared noise. The "
        f"sampler with {posterior_coverage.CHAINS} short chains of {posterior_coverage.DRAWS} "
        "draws, whose ends are rough. Goal: 92-98 %, of the sampler. Ends of coverage: Wilson's "
        "interval. Little known: the SD is "
        f"above {posterior_coverage.LITTLE_KNOWN:g} of the prior's. sd_over_prior: median, by "
        "Laplace."
    )
    _write("posterior_coverage", head, found)


def _trunk_pressures() -> None:
    found = trunk_pressures.table()
    head = (
        "Computed against measured pressure of the disc L4L5 over tasks 1, 2, 3, 4, 6 and 9 (20 "
        "deg) of Ghezelbash 2016: untuned, with two fitted numbers, and with each task left out of "
        "the fit; two geometries, three places of the hands in task 6. most_stress_mpa: what "
        "muscles have to be allowed to hold all nine tasks that have a pressure (goal: 1.0 MPa). "
        "inside_95: measured pressures of all nine inside the middle 95 % of "
        f"{trunk_pressures.SAMPLES} samples (goal: 80 %). r over six tasks has a wide interval: "
        "its lower end stands beside it."
    )
    _write("trunk_pressures", head, found)


def _tracking() -> None:
    found = tracking.table()
    head = (
        "How far tracked vertebrae are from the true ones: made-up persons, two generators, one "
        f"person a seed, {tracking.INTERVALS} intervals; centres in mm, angles in deg; 95 % "
        "intervals over seeds (Student's t). Goals: centres 3 mm, angles 1.5 deg. Sources: the "
        "same persons and motions, one source of error taken away. Control: joints that resist by "
        "the estimator's own law, seen without errors but noise."
    )
    _write("tracking", head, found)


def _tracking_profiles() -> None:
    found = tracking.profiles()
    out = int((found["cost_of_truth_over_best"] > LIMIT).sum())
    closed = found[found["holds"] != "no end is closed"]
    head = (
        "Whether profiles of regional stiffness hold the truth: true over generic stiffness where "
        f"{tracking.LOAD_NM:g} N m resist, geometric mean over the joints and sides of a region. "
        f"Taken at its word, the cost excludes the truth in {out} of {len(found)} (a rise over "
        f"{LIMIT}); where it falls to the end of what was tried the verdict is not_told. Of "
        f"{len(closed)} verdicts that close an end, {int((closed['holds'] == 'True').sum())} hold "
        "the truth."
    )
    _write("tracking_profiles", head, found)


def _film_ratios() -> None:
    found = film_ratios.table()
    head = (
        "How many true ratios between segments (stiffness at rest over the patient's geometric "
        f"mean) lie inside the 95 % intervals of tangent_fitted: {film_ratios.PHANTOMS} made-up "
        "patients in each kind of reading, laws that are no tangents (goal: 92-98 %). Errors and "
        "half widths are of natural logarithms."
    )
    _write("film_ratios", head, found)


def _film_restarts() -> None:
    found = film_restarts.table()
    worse = int(found["lower_elsewhere"].sum())
    head = (
        f"Fits to the films of `{film_restarts.STUDY}`, started again from elsewhere: cost as "
        "fitted and the least of the restarts, with how many distinct optima each saw. Elsewhere "
        f"it is lower by {film_restarts.TIE} of it or more in {worse} of {len(found)}."
    )
    _write("film_restarts", head, found)


def _plausibility() -> None:
    found = plausibility.every()
    head = (
        "Mistakes put into sound cohorts, and what `spinepipe check` says: told at all in the "
        "right file; with a column that is wrong; with what mends it; and with no line that says "
        "anything else. known cohorts: those that come along, and real spines where they are at "
        "hand; fresh: made up from seeds that nobody looked at while rules were written. known "
        "kinds: those that the rules were written for; fresh: written down before rules were "
        "changed for them (docs/decisions/0039 has the score of the first run); last: written "
        "down afterwards, and no rule was changed for them."
    )
    _write("plausibility", head, plausibility.table(found))
    by_kind = plausibility.by_kind(found)
    _write(
        "plausibility_by_kind",
        "The same, mistake by mistake.",
        by_kind,
        "python -m tests.validation plausibility",
    )


def _index_coverage() -> None:
    found = index_coverage.table()
    head = (
        "How often 95 % intervals of sensitivity indices hold what is known, over "
        f"{index_coverage.SEEDS} seeds (goal: at least 90 % of index x seed pairs). Functions with "
        "closed forms: Ishigami, a sum of normals, the g-function; elementary effects by going "
        "through the grid. PAWN, KS and delta are compared with their mean over seeds, for small "
        "samples lift them. FAST has no intervals in spinepipe; SALib's own show why."
    )
    _write("index_coverage", head, found)


def _wrong_inputs() -> None:
    some = wrong_inputs.drawn()
    found, others = wrong_inputs.tables(some)
    head = (
        f"What `spinepipe check` makes of {len(some)} projects that are spoilt in one place each, "
        "drawn from the catalogue in tests/generators/spoilt, which reads the documentation and no "
        "code of the library. Goal: none accepted though wrong, none that hangs (10 s of processor "
        "time) or ends in a stack, no good one refused. What may be right counts as right whatever "
        "is said, unless it hangs, ends in a stack or takes pages."
    )
    _write("wrong_inputs", head, found)
    named = "Cases of wrong_inputs that did not end as they should."
    _write("wrong_inputs_others", named, others)


def _large_files() -> None:
    found = large_files.table()
    head = (
        "Processor time of `spinepipe check`, its start and imports included, on files of 100 MB "
        f"and at the limits of docs/cohort-format.md. Goal: {large_files.GOAL_S:g} s."
    )
    _write("large_files", head, found)


def _findings() -> None:
    found = findings.tables()
    rows = found["findings"]
    told = rows.groupby(["finding", "law"], sort=False).agg(
        **{word: ("holds", partial(_count, word)) for word in HOLDS},
        median_value=("value", "median"),
        lowest=("value", "min"),
        highest=("value", "max"),
        unit=("unit", "first"),
        quantity=("quantity", "first"),
    )
    signs = found["sign_checks"]["verdict"].value_counts().to_dict()
    head = (
        f"What the study says to each finding: {findings.PHANTOMS} phantoms with linear and with "
        f"stiffening truth. No sign was flipped in the data; sign checks say: {signs}."
    )
    _write("findings", head, told.reset_index())


def _count(word: str, held: pd.Series) -> int:
    return int((held == word).sum())


if __name__ == "__main__":
    main()

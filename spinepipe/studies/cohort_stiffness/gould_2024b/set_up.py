"""Size of the paper's study, and what a fit costs."""

from collections.abc import Callable, Iterator

from spinepipe.comparison.claim import Claim, Ours, Verdict
from spinepipe.comparison.gould_2024b.paper import COUNTS, PAPER
from spinepipe.comparison.ranges import Range, exactly
from spinepipe.comparison.run import NotComputed, Run

_WHERE = "sections 2.4, 2.6"
_BUILT = "the cohort and the study were set up to have it"
_EXACT_DERIVATIVES = (
    "ours solves for equilibrium and knows its derivatives, so that a fit needs a few evaluations"
)


def claims() -> Iterator[Claim]:
    """Specimens, joints, unknowns, pairs, values; then iterations and hours."""
    built = Verdict.CIRCULAR
    yield _count("specimens", "specimens", _distinct("specimen"), evidence=built)
    yield _count("joints", "joints", _distinct("joint"), evidence=built)
    yield _count("fitted_parameters", "unknowns of a fit, per_specimen", _unknowns("per_specimen"),
                 evidence=built)  # fmt: skip
    yield _count("fitted_parameters_level_by_level", "unknowns of a fit, joint by joint",
                 _unknowns("per_joint"), "the paper ran no such fit", built)  # fmt: skip
    yield _count("representation_values", "values per model in Table 7, axial rotation apart",
                 _values("flexion"), evidence=built)  # fmt: skip
    yield _count("representation_values_in_axial_rotation", "values per model in Table 7, axial "
                 "rotation", _values("left_axial_rotation"),
                 "two fits of the paper did not converge; all of ours did", built)  # fmt: skip
    yield from _cost()


def _count(
    name: str,
    quantity: str,
    ours: Callable[[Run], Ours],
    note: str = "",
    evidence: Verdict = Verdict.INSIDE,
) -> Claim:
    paper = float(COUNTS[name])
    return Claim(
        f"counts.{name}", _WHERE, quantity, "count", paper, exactly(paper), ours,
        "this study is not of the paper's size", note or _BUILT,
        evidence=evidence,
    )  # fmt: skip


def _distinct(column: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(float(run.rows("stiffness")[column].nunique()))


def _unknowns(representation: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        found = run.rows("fits", representation=representation)["unknowns"]
        return Ours(float(found.median()), float(found.min()), float(found.max()))

    return ours


def _values(test: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        ended = []
        for name in ("per_specimen", "level_ratio"):
            rows = run.rows("fits", representation=name, fitted_to=test)
            ended.append(set(rows.loc[rows["status"].str.startswith("converged"), "specimen"]))
        return Ours(float(len(set.intersection(*ended))))

    return ours


def _cost() -> Iterator[Claim]:
    printed = PAPER["cost_of_a_fit"]
    iterations = float(printed["dynamic_iterations_above"])
    yield Claim(
        "cost.iterations", "section 2.4", "iterations of a fit, per_specimen, median", "count",
        iterations, Range(iterations, None, "above the paper's bound"), _iterations,
        _EXACT_DERIVATIVES,
    )  # fmt: skip
    for name in ("preliminary_hours_above", "dynamic_iteration_hours_above"):
        hours = float(printed[name])
        yield Claim(
            f"cost.{name.removesuffix('_above')}", "section 2.4",
            "time of a fit" if name.startswith("pre") else "time of an iteration", "h", hours,
            Range(hours, None, "above the paper's bound"), _time, _EXACT_DERIVATIVES,
        )  # fmt: skip


def _iterations(run: Run) -> Ours:
    counts = run.rows("fits", representation="per_specimen")["iterations"]
    return Ours(float(counts.median()), float(counts.min()), float(counts.max()))


def _time(run: Run) -> Ours:
    raise NotComputed("no result table holds times, they differ between computers")

"""How many fits succeed (sections 3.1 and 3.2)."""

from collections.abc import Callable, Iterator

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import COUNTS, REDUCED, SAMPLES
from spinepipe.comparison.ranges import Range, binomial, wilson_percent
from spinepipe.comparison.run import NotComputed, Run

_EXACT = (
    "fits are solved at rest with exact derivatives here; by this rule other ways of fitting may "
    "succeed as often without arriving at the optimum, see success_by_method"
)
_EMULATED = (
    "an emulation of the published way (forward run, differences) on another engine and other "
    "data; tolerances and bounds of the paper's optimiser are not published"
)
METHODS = {
    "exact": "fits with exact derivatives",
    "forward_run_default_step": "forward runs, differences with an optimiser's default step",
    "forward_run_sane_step": "forward runs, differences with a step chosen with care",
    "forward_run_raw_units": "forward runs, default step, on stiffness in N/m and N m/rad",
}


def claims() -> Iterator[Claim]:
    """Shares of successful fits."""
    successful = int(COUNTS["pose_samples_successful"])
    yield _share("pose_samples_successful", "section 3.2", "sampled joint poses fitted",
                 successful, SAMPLES, _successful("poses", "equilibrium"))  # fmt: skip
    yield _share("pose_samples_reduced", "section 3.2", "sampled joint poses in the reduced set",
                 REDUCED, SAMPLES, _reduced)  # fmt: skip
    for part, words in (("start", "start stiffness"), ("damping", "damping")):
        key = f"{part}_stiffness_sets" if part == "start" else f"{part}_sets"
        yield _share(f"{key}_successful", "section 3.1", f"sets of {words} fitted, quasi-static",
                     int(COUNTS[f"{key}_successful"]), int(COUNTS[key]),
                     _successful(f"{part}_bootstrap", "quasi_static"))  # fmt: skip
    for method, words in METHODS.items():
        yield Claim(
            f"success.{method}", "section 3.2", f"sampled joint poses fitted: {words}", "%",
            100.0 * successful / SAMPLES, binomial(successful, SAMPLES), _by_method(method),
            _EXACT if method == "exact" else _EMULATED,
        )  # fmt: skip


def _share(
    name: str, where: str, words: str, count: int, of: int, ours: Callable[[Run], Ours]
) -> Claim:
    paper: Range = binomial(count, of)
    return Claim(f"counts.{name}", where, words, "%", 100.0 * count / of, paper, ours, _EXACT)


def _successful(part: str, loading: str) -> Callable[[Run], Ours]:
    """Solved and moved away from the start, outliers included, as the paper counts."""

    def ours(run: Run) -> Ours:
        row = run.row("counts", part=part, loading=loading)
        failed = int(row[f"near_start_{run.failed_when}"])
        return _percent(int(row["solved"]) - failed, int(row["fits"]))

    return ours


def _reduced(run: Run) -> Ours:
    row = run.row("counts", part="poses", loading="equilibrium")
    return _percent(int(row["reduced"]), int(row["fits"]))


def _percent(count: int, of: int) -> Ours:
    if of == 0:
        raise NotComputed("this run tried no such fit")
    return Ours(100.0 * count / of, *wilson_percent(count, of), f"ours: {count} of {of}")


def _by_method(method: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        row = run.row("success_by_method", method=method)
        return _percent(int(row["successful"]), int(row["fits"]))

    return ours

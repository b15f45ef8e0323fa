"""Fig 5: computed against measured pressures in the disc L4L5 of the volunteer of Wilke 2001.

What was measured, and whether that is confirmed, is in table `pressures`; the heights of the bars
cannot be read off the figure. So the error is what is held, to the paper's own.
"""

from collections.abc import Callable, Iterator

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, Verdict
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.ghezelbash_2016.found import volunteers_task
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import OTHER_MODEL, PAPER
from spinepipe.studies.trunk_loads.tables_of_studies import TIERS

VALIDATION = PAPER["validation"]
RMSE_MPA = float(VALIDATION["rmse_mpa"])

TASKS: tuple[tuple[int, float | None], ...] = (
    *((number, None) for number in (1, 2, 3, 4, 5, 6, 8)),
    (9, 10.0),
    (9, 20.0),
)
"""Numbers of Table 1 that have a measured pressure, and angles sideways."""

_FITTED = {
    "untuned": ("nothing was fitted", Verdict.INSIDE),
    "tuned": ("at most two numbers were fitted to these very pressures", Verdict.CIRCULAR),
    "left_out": (
        "at most two numbers were fitted to the pressures of the other tasks",
        Verdict.INSIDE,
    ),
}
assert set(_FITTED) == set(TIERS), "every tier has its words"


def claims_of_pressures() -> Iterator[Claim]:
    """Each bar and tier, then how well all of them agree."""
    for number, degrees in TASKS:
        for tier in TIERS:
            yield _bar(number, degrees, tier)
    for tier in TIERS:
        yield from _agreement(tier)


def _bar(number: int, degrees: float | None, tier: str) -> Claim:
    sideways = "" if degrees is None else f".{degrees:g}"
    told, evidence = _FITTED[tier]
    return Claim(
        f"fig_5.task_{number}{sideways}.{tier}",
        "Fig 5, 3.3",
        f"computed less measured pressure in L4L5, task {number}"
        + (f" at {degrees:g} deg" if degrees else ""),
        "MPa",
        None,
        Range(-RMSE_MPA, RMSE_MPA, f"nought to the paper's RMSE over its tasks, {RMSE_MPA:g} MPa"),
        _error(volunteers_task(number, degrees), tier),
        f"an error larger than the paper's usual one; {OTHER_MODEL}",
        note=told,
        evidence=evidence,
    )


def _error(task: Callable[[Run], str], tier: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        row = run.row("pressures", tier=tier, task=task(run))
        computed = run.number("pressures", "computed_mpa", tier=tier, task=row["task"])
        if row["status"] != Balanced.CONVERGED.value:
            raise NotComputed(f"task {row['task']} ended with {row['status']}")
        measured = float(row["measured_mpa"])
        told = f"ours: {computed:.3g} MPa computed, {measured:.3g} MPa measured"
        status = str(row["measured_status"])
        if status == "from_memory":
            raise NotComputed(f"the measured value is not confirmed; {told} from memory")
        return Ours(computed - measured, note=f"{told} ({status}, {row['measured_source']})")

    return ours


def _agreement(tier: str) -> Iterator[Claim]:
    told, evidence = _FITTED[tier]
    for key, quantity, unit, paper, allowed, ours in (
        (
            "correlation",
            "Pearson correlation of computed and measured pressures",
            "r",
            float(VALIDATION["r"]),
            Range(0.98, None, "no worse than the paper's, to two decimals"),
            _r(tier),
        ),
        (
            "rmse",
            "root mean square error of computed pressures",
            "MPa",
            RMSE_MPA,
            Range(None, RMSE_MPA + 0.005, "no larger than the paper's, to two decimals"),
            _rmse(tier),
        ),
    ):
        yield Claim(
            f"results.idp_validation_{key}.{tier}",
            "3.3",
            quantity,
            unit,
            paper,
            allowed,
            ours,
            OTHER_MODEL,
            f"{told}; the paper has nine bars, ours are tasks with a confirmed measured value",
            evidence=evidence,
        )


def _r(tier: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        value = run.number("agreement", "r", tier=tier)
        row = run.row("agreement", tier=tier)
        low, high = (None if row[end] != row[end] else row[end] for end in ("r_low", "r_high"))
        return Ours(value, low, high, _over(run, tier) + "; ends: 95 % interval (Fisher)")

    return ours


def _rmse(tier: str) -> Callable[[Run], Ours]:
    return lambda run: Ours(run.number("agreement", "rmse_mpa", tier=tier), note=_over(run, tier))


def _over(run: Run, tier: str) -> str:
    return f"ours: over {run.number('agreement', 'n_tasks', tier=tier):g} tasks"

"""Ranges of the stiffness fitted in both bootstraps: section 3.1."""

from collections.abc import Callable, Iterator

from spinepipe.comparison import summary
from spinepipe.comparison.bootstraps import where_of
from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import FITTED, PAPER, STIFFNESS_KEY, STIFFNESS_UNIT
from spinepipe.comparison.ranges import Range, factor_of_two
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.comparison.settling import SPREAD

CLOSE = 0.01
"""Relative distance from the median within which fits are counted in the notes."""
SAME = 1e-4
"""Spread relative to the median below which fits count as ended in the same stiffness."""


def claims() -> Iterator[Claim]:
    """Ranges, and those over start values in those over damping."""
    for name in FITTED:
        yield from _stiffness_ranges(name)
        yield _start_against_damping(name)


def _stiffness_ranges(name: str) -> Iterator[Claim]:
    for key, what, dataset, words in (
        ("damping", "damping", "all", "over sets of damping"),
        ("start", "start", "all", "over start values"),
        ("start_without_outliers", "start", "reduced", "over start values, outliers left out"),
    ):
        paper = float(PAPER["bootstrap_stiffness_range"][key][STIFFNESS_KEY[name]])
        yield Claim(
            f"stiffness_range.{key}.{name}", "section 3.1",
            f"range of fitted {name} stiffness {words}, quasi-static", STIFFNESS_UNIT[name], paper,
            factor_of_two(paper),
            _stiffness_range(what, dataset, name), SPREAD[what, "quasi_static"],
        )  # fmt: skip


def _stiffness_range(what: str, dataset: str, name: str) -> Callable[[Run], Ours]:
    """Range in the summary, with how many fits end close to the median."""

    def ours(run: Run) -> Ours:
        where = {"quantity": "stiffness", "joint": "*", "coordinate": name}
        where |= where_of(what, "quasi_static", dataset)
        middle = summary.value(run, "median", **where)
        fits = run.rows("bootstrap", bootstrap=what, loading="quasi_static")
        values = fits.groupby("set")[STIFFNESS_KEY[name]].first().dropna()
        close = int(((values - middle).abs() <= CLOSE * abs(middle)).sum())
        which = "" if dataset == "all" else ", outliers counted,"
        share = f"{100.0 * CLOSE:g} % of the median"
        note = f"ours: {close} of {len(values)} fits{which} within {share}"
        return Ours(summary.value(run, "range", **where), note=note)

    return ours


def _start_against_damping(name: str) -> Claim:
    ranges = PAPER["bootstrap_stiffness_range"]
    paper = float(ranges["start"][STIFFNESS_KEY[name]] / ranges["damping"][STIFFNESS_KEY[name]])
    return Claim(
        f"stiffness_range.start_over_damping.{name}", "section 3.1",
        f"range of {name} stiffness over start values, in those over sets of damping", "ratio",
        paper, Range(1.0, None, "start values matter more than damping: above 1"),
        _start_over_damping(name), SPREAD["damping", "quasi_static"],
    )  # fmt: skip


def _start_over_damping(name: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        where = {"quantity": "stiffness", "joint": "*", "coordinate": name}
        start, damping = (
            summary.value(run, "range", **where_of(what, "quasi_static"), **where)
            for what in ("start", "damping")
        )
        middle = summary.value(run, "median", **where_of("damping", "quasi_static"), **where)
        if max(start, damping) < SAME * middle or damping == 0.0:
            told = f"their ranges are {start / middle:.1e} and {damping / middle:.1e} of the median"
            raise NotComputed(f"all fits end in the same stiffness, {told}: no ratio has a meaning")
        return Ours(start / damping)

    return ours

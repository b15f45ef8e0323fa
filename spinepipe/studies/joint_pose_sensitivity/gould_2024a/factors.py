"""Joint pose against stiffness: Friedman tests, regression tree, shares of variance."""

from collections.abc import Callable, Iterator
from itertools import product

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import FITTED, MEASURED_JOINTS, PAPER
from spinepipe.comparison.ranges import Range
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.comparison.tested import tested

_HALF = Range(0.5, 1.0, "the paper's tree finds the joint pose more influential: above one half")
_TREE = (
    "the paper's own grid and tree are not published; how strong either factor is hangs on how "
    "far the landmarks scatter and how far the best stiffness sets differ"
)


def claims() -> Iterator[Claim]:
    """Section 3.4."""
    bound = float(PAPER["friedman"]["p_below"])
    for factor in ("pose", "stiffness"):
        yield Claim(
            f"friedman.{factor}", "section 3.4",
            f"largest p of Friedman tests of errors between levels of {factor}", "p", None,
            Range(0.0, bound, f"the paper finds all below {bound:g}"), _friedman(factor), _TREE,
        )  # fmt: skip
    for joint, name in product(MEASURED_JOINTS, FITTED):
        yield Claim(
            f"tree.{joint}.{name}", "section 3.4",
            f"share of the joint pose in the regression tree of the {name} error at {joint}",
            "share", None, _HALF, _tree(joint, name), _TREE,
        )  # fmt: skip
    for joint, name in product(MEASURED_JOINTS, FITTED):
        yield Claim(
            f"variance_share.{joint}.{name}", "section 3.4",
            f"variance of the {name} error at {joint} due to the joint pose, of that due to pose "
            "or stiffness alone", "share", None, _HALF, _variance(joint, name), _TREE,
            "the paper has no such shares; its tree's order is what is compared",
        )  # fmt: skip


def _friedman(factor: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        rows = tested(run, "friedman", family="friedman", factor=factor)
        largest, corrected = float(rows["p"].max()), float(rows["p_bonferroni"].max())
        note = f"ours: {len(rows)} tests; after Bonferroni at most {corrected:.2g}"
        return Ours(largest, note=note)

    return ours


def _tree(joint: str, name: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        rows = run.rows("importance", joint=joint, coordinate=name)
        known = rows.dropna(subset=["importance"])
        total = float(known["importance"].sum())
        if total <= 0.0:
            raise NotComputed(str(rows.iloc[0]["message"]) or "the pruned tree has no split")
        pose = float(known.loc[known["factor"] == "pose", "importance"].sum())
        first = known.iloc[0]
        return Ours(pose / total, note=f"ours: {int(first['leaves'])} leaves, r2 {first['r2']:.2f}")

    return ours


def _variance(joint: str, name: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        where = {"joint": joint, "coordinate": name}
        pose, stiffness = (
            run.number("variance_shares", "share", factor=factor, **where)
            for factor in ("pose", "stiffness")
        )
        if pose + stiffness == 0.0:
            raise NotComputed("neither factor alone explains any variance")
        note = f"ours: pose {pose:.2f}, stiffness {stiffness:.2f}, rest interaction"
        return Ours(pose / (pose + stiffness), note=note)

    return ours

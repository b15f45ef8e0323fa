"""Joint pose against stiffness, section 3.4: Table 6, Friedman tests, tree, shares of variance."""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

import pandas as pd

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    exactly,
    kendall_p,
    of_sign,
    spearman_p,
    tested,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    FITTED,
    MEASURED_JOINTS,
    P_BELOW,
    PAPER,
    REDUCED,
)
from spinepipe.tables.shared import joined
from spinepipe.units import ROTATIONS

_HALF = Range(0.5, None, "the paper's tree finds the joint pose more influential: above one half")

_TREE = (
    "the paper's own grid and tree are not published; how strong either factor is hangs on how "
    "far the landmarks scatter and how far the best stiffness sets differ"
)

_PRINTED = PAPER["two_factor_correlation"]
_TEST = {"orientation": "kendall", "stiffness": "spearman"}

_AGAINST = {"orientation": "pose", "stiffness": "stiffness"}

_FACTORS = {"orientation": ROTATIONS, "stiffness": FITTED}

_BEST = int(PAPER["counts"]["best_models"])

_FEWEST_TESTS = 2
"""A printed coefficient that is not significant among so few tests is not in any family."""

_POWER = (
    "whether any of many tests passes Bonferroni hangs on the size of the family, which the paper "
    "does not give, and on frames and motion that are not published"
)

_SIGN = "signs hang on frames and motion that are not published"
_ASSUMED = "signs of the paper's joint angles are assumed to be as printed"
NOTES = {
    ("stiffness", "anterior", "anterior"): "A27: Table 5 has the opposite sign, over all poses",
    ("stiffness", "extension", "extension"): "A28: Table 5 has the opposite sign, over all poses",
}


def claims_of_two_factor() -> Iterator[Claim]:
    """One row per cell for significance, one more per significant cell for the coefficients."""
    for kind in ("orientation", "stiffness"):
        for factor, joint, error in product(_FACTORS[kind], MEASURED_JOINTS, FITTED):
            yield from _cell(kind, factor, joint, error)
    yield from _sets()
    yield from _share_of_models()
    yield from _contradicted()


def _cell(kind: str, factor: str, joint: str, error: str) -> Iterator[Claim]:
    printed = _PRINTED[kind][joint].get(factor, {}).get(error)
    key = f"table_6.{factor}_{kind}.{joint}.{error}_error"
    words = f"{_TEST[kind]}: {error} error at {joint} and {factor} {kind}"
    note = _ASSUMED if kind == "orientation" else NOTES.get((kind, factor, error), "")
    significant = float(printed is not None)
    yield Claim(
        f"{key}.significant",
        "Table 6",
        f"{words}, any significant after Bonferroni",
        "1: yes, 0: no",
        significant,
        exactly(significant),
        _any(kind, factor, joint, error),
        _POWER,
    )
    if printed is not None:
        low, high = float(printed[0]), float(printed[1])
        sign = f"sign only; the paper's coefficients run from {low:g} to {high:g}"
        yield Claim(
            f"{key}.coefficient",
            "Table 6",
            f"{words}, median of the significant ones",
            "tau" if kind == "orientation" else "rho",
            None,
            of_sign(low, sign),
            _coefficients(kind, factor, joint, error),
            _SIGN,
            joined(note, _unreachable(kind, low, high)),
        )


def _unreachable(kind: str, low: float, high: float) -> str:
    """Why a printed coefficient cannot be significant after Bonferroni, or nothing.

    Its size is contradicted then. Its sign is printed all the same, and is compared.
    """
    smallest = min(abs(low), abs(high))
    if kind == "stiffness":
        check, n, p = "A24", _BEST, spearman_p(smallest, _BEST)
    else:
        check, n, p = "A25", REDUCED, kendall_p(smallest, REDUCED)
    if _FEWEST_TESTS * p < P_BELOW:
        return ""
    return (
        f"{check}: {smallest:g} of {n} values has p = {p:.2g}, not below {P_BELOW:g} after "
        f"Bonferroni for even {_FEWEST_TESTS} tests"
    )


def _any(kind: str, factor: str, joint: str, error: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        rows = _tests(run, kind, factor, joint, error)
        significant = int((rows["p_bonferroni"] < P_BELOW).sum())
        note = (
            f"ours: {significant} of {len(rows)} tests, family of {int(rows['family_size'].max())}"
        )
        return Ours(float(significant > 0), note=note)

    return ours


def _coefficients(kind: str, factor: str, joint: str, error: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        rows = _tests(run, kind, factor, joint, error)
        low, high = rows["effect"].min(), rows["effect"].max()
        found = rows.loc[rows["p_bonferroni"] < P_BELOW, "effect"]
        if found.empty:
            told = f"none of {len(rows)} tests is significant after Bonferroni"
            raise NotComputed(f"{told}; their coefficients run from {low:.2f} to {high:.2f}")
        note = f"ours: {int((found > 0.0).sum())} of {len(found)} significant ones are positive"
        return Ours(float(found.median()), float(found.min()), float(found.max()), note)

    return ours


def _sets() -> Iterator[Claim]:
    """In how many stiffness sets the extension of the frames goes with the anterior error."""
    count = float(_PRINTED["extension_orientation_stiffness_sets"])
    for joint in MEASURED_JOINTS:
        yield Claim(
            f"table_6.extension_orientation.{joint}.anterior_error.sets",
            "Table 6",
            f"stiffness sets of {_BEST} in which the anterior error at {joint} correlates with "
            "extension orientation",
            "count",
            count,
            exactly(count),
            partial(_number_of_sets, joint),
            _POWER,
        )


def _number_of_sets(joint: str, run: Run) -> Ours:
    rows = _tests(run, "orientation", "extension", joint, "anterior")
    return Ours(float((rows["p_bonferroni"] < P_BELOW).sum()), note=f"ours: of {len(rows)}")


def _share_of_models() -> Iterator[Claim]:
    """In how many of the reduced poses the stiffness correlations are significant."""
    for factor in ("anterior", "extension"):
        count = int(_PRINTED[f"{factor}_stiffness_fewer_models_than"])
        percent = 100.0 * count / REDUCED
        yield Claim(
            f"table_6.{factor}_stiffness.significant_models",
            "Table 6",
            f"poses in which {factor} stiffness correlates with an error, largest cell",
            "%",
            percent,
            Range(None, percent, f"fewer than {count} of {REDUCED} poses in the paper"),
            _largest_share(factor),
            _POWER,
        )


def _largest_share(factor: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        cells = []
        for joint, error in product(MEASURED_JOINTS, FITTED):
            rows = _tests(run, "stiffness", factor, joint, error)
            cells.append(100.0 * float((rows["p_bonferroni"] < P_BELOW).mean()))
        return Ours(max(cells), min(cells), max(cells), "ours: smallest to largest of six cells")

    return ours


def _contradicted() -> Iterator[Claim]:
    yield Claim(
        "table_6.anterior_stiffness_lowers_extension_error",
        "section 3.4, Table 6",
        "anterior stiffness lowers the extension error, any significant at L3L4",
        "1: yes, 0: no",
        1.0,
        exactly(1.0),
        _any("stiffness", "anterior", "L3L4", "extension"),
        "",
        also=(exactly(0.0),),
        contradicted="A29: section 3.4 says so, Table 6 has no significant test at either joint",
    )
    caption = float(_PRINTED["p_below_of_caption"])
    yield Claim(
        "table_6.significance",
        "Table 6, section 2.5",
        "p below which a test is significant",
        "p",
        caption,
        exactly(caption),
        lambda run: Ours(P_BELOW),
        "",
        note="ours: section 2.5",
        contradicted=f"A30: the caption has {caption:g}, section 2.5 and the cells {P_BELOW:g}",
    )


def _tests(run: Run, kind: str, factor: str, joint: str, error: str) -> pd.DataFrame:
    """Tests of one cell that have a result."""
    family = f"two-factor: {error}_error at {joint} against {_AGAINST[kind]}"
    return tested(run, _TEST[kind], family=family, factor=f"{factor}_{kind}")


def claims_of_factors() -> Iterator[Claim]:
    """Section 3.4."""
    bound = float(PAPER["friedman"]["p_below"])
    for factor in ("pose", "stiffness"):
        yield Claim(
            f"friedman.{factor}",
            "section 3.4",
            f"largest p of Friedman tests of errors between levels of {factor}",
            "p",
            None,
            Range(None, bound, f"the paper finds all below {bound:g}"),
            _friedman(factor),
            _TREE,
        )
    for joint, name in product(MEASURED_JOINTS, FITTED):
        yield Claim(
            f"tree.{joint}.{name}",
            "section 3.4",
            f"share of the joint pose in the regression tree of the {name} error at {joint}",
            "share",
            None,
            _HALF,
            _tree(joint, name),
            _TREE,
        )
    for joint, name in product(MEASURED_JOINTS, FITTED):
        yield Claim(
            f"variance_share.{joint}.{name}",
            "section 3.4",
            f"variance of the {name} error at {joint} due to the joint pose, of that due to pose "
            "or stiffness alone",
            "share",
            None,
            _HALF,
            _variance(joint, name),
            _TREE,
            "the paper has no such shares; its tree's order is what is compared",
        )


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

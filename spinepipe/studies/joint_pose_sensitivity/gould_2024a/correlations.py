"""Correlations over the reduced dataset: Table 5 and section 3.3."""

from collections.abc import Callable, Iterator
from itertools import product

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import FITTED, P_BELOW, PAPER, REDUCED
from spinepipe.comparison.ranges import (
    Range,
    exactly,
    insignificant,
    spearman_interval,
    spearman_threshold,
)
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.comparison.tested import tested

_CONFOUNDED = (
    "which errors remain at a best fit hangs on measured motion, weights and joint frames "
    "together; the paper's motion in its own frames is not published"
)
_ELSEWHERE = (
    "signs and sizes hang on joint frames, load line and motion, of which some are assumed here"
)
_JUST = "the paper's one pair was just significant, without correction for the number of pairs"
_THRESHOLD = spearman_threshold(P_BELOW, REDUCED)
OPPOSITE = {
    ("anterior", "anterior"): "A27: Table 6 has the opposite sign, at a fixed pose",
    ("extension", "extension"): "A28: Table 6 has the opposite sign, at a fixed pose",
}


def claims() -> Iterator[Claim]:
    """Table 5 cell by cell, then joint poses."""
    for error, stiffness in product(FITTED, FITTED):
        rho = PAPER["error_stiffness_correlation"][error].get(stiffness)
        allowed = (
            insignificant(P_BELOW, REDUCED)
            if rho is None
            else spearman_interval(float(rho), REDUCED)
        )
        yield Claim(
            f"table_5.{error}_error.{stiffness}_stiffness", "Table 5",
            f"Spearman: {error} error and {stiffness} stiffness", "rho",
            None if rho is None else float(rho), allowed,
            _rho("error against stiffness", f"{error}_error", f"{stiffness}_stiffness"),
            _CONFOUNDED, OPPOSITE.get((error, stiffness), ""),
        )  # fmt: skip
        if rho is not None:
            yield _sign(error, stiffness, float(rho))
    yield from _poses()


def _sign(error: str, stiffness: str, rho: float) -> Claim:
    return Claim(
        f"table_5.{error}_error.{stiffness}_stiffness.sign", "Table 5",
        f"Spearman: {error} error and {stiffness} stiffness, sign only", "rho", rho,
        Range(0.0, 1.0, "the paper's sign") if rho > 0.0 else Range(-1.0, 0.0, "the paper's sign"),
        _rho("error against stiffness", f"{error}_error", f"{stiffness}_stiffness"),
        _CONFOUNDED, OPPOSITE.get((error, stiffness), ""),
    )  # fmt: skip


def _rho(family: str, response: str, factor: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        row = tested(run, "spearman", family=family, response=response, factor=factor).iloc[0]
        rho = float(row["effect"])
        spread = spearman_interval(rho, int(row["n"])) if abs(rho) < 1.0 else None
        ends = (None, None) if spread is None else (spread.low, spread.high)
        return Ours(rho, *ends, f"ours: n = {int(row['n'])}, p = {row['p']:.2g} uncorrected")

    return ours


def _poses() -> Iterator[Claim]:
    printed = PAPER["pose_correlation"]
    yield Claim(
        "pose_correlation.extension_stiffness", "section 3.3",
        "Spearman: extension stiffness and mean left rotation of the joint frames", "rho",
        float(printed["r"]), spearman_interval(float(printed["r"]), REDUCED),
        _rho("stiffness against pose", "extension_stiffness", "left_rotation_orientation"),
        _CONFOUNDED,
    )  # fmt: skip
    for key, family, words, note in (
        ("stiffness", "stiffness against pose", "stiffness", _JUST),
        ("error", "error against pose", "error", ""),
    ):
        count = float(printed[f"significant_pairs_with_{key}"])
        yield Claim(
            f"pose_correlation.significant_pairs_with_{key}", "section 3.3",
            f"pairs of {words} and joint pose with rho beyond {_THRESHOLD:.3f}, the threshold of "
            f"p = {P_BELOW:g} in {REDUCED} pairs", "count", count,
            exactly(count), _significant(family, key), _ELSEWHERE, note,
        )  # fmt: skip


def _significant(family: str, key: str) -> Callable[[Run], Ours]:
    responses = [f"{name}_{key}" for name in FITTED]

    def ours(run: Run) -> Ours:
        rows = tested(run, "spearman", family=family)
        rows = rows[rows["response"].isin(responses)]
        if rows.empty:
            raise NotComputed("no such pair was tested")
        found = int((rows["effect"].abs() > _THRESHOLD).sum())
        corrected = int((rows["p_bonferroni"] < P_BELOW).sum())
        note = f"ours: of {len(rows)} tested; {corrected} significant after Bonferroni"
        return Ours(float(found), note=f"{note} with n = {int(rows['n'].max())}")

    return ours

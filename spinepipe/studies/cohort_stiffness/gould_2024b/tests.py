"""Table 5: do errors differ between specimens, and between levels?"""

from collections.abc import Callable, Iterator, Mapping
from itertools import product

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.gould_2024b.forms import YES_NO, contradicted, yes_or_no
from spinepipe.comparison.gould_2024b.paper import (
    COUNTS,
    LITERATURE,
    LOAD,
    MODELS,
    P_BELOW,
    PAPER,
    PHANTOM,
    STAGES,
    TESTS,
)
from spinepipe.comparison.ranges import exactly
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.comparison.tested import tested

WHERE = "Table 5"
_GROUPS = {"level": "levels", "specimen": "specimens"}
_RESPONSES = ("loaded_error", "rotation_error")
_POWER = (
    PHANTOM + "; which differences are significant hangs on the size of the phantom's invented "
    "differences between levels, on six levels instead of five, and on noise"
)


def claims() -> Iterator[Claim]:
    """The 36 cells, then where the text differs from them."""
    for test, model, group, stage in product(TESTS, MODELS, _GROUPS, STAGES):
        yield _cell(test, model, group, stage)
    yield from _contradicted()


def _printed(test: str, model: str, group: str, stage: str) -> str:
    """What the cell holds: ``p = 0.003``, ``p < 0.001``, or not significant."""
    loads = PAPER["kruskal_wallis"].get(test, {})
    return in_words(loads.get(model, {}).get(group, {}).get(stage, {}))


def in_words(found: Mapping[str, float]) -> str:
    """A printed p of the paper, nothing where none is printed."""
    if "p_below" in found:
        return f"p < {float(found['p_below']):g}"
    return f"p = {float(found['p']):g}" if "p" in found else ""


def _cell(test: str, model: str, group: str, stage: str) -> Claim:
    printed = _printed(test, model, group, stage)
    return yes_or_no(
        f"table_5.{test}.{model}.{group}.{stage}", WHERE,
        f"Kruskal-Wallis: errors under {LOAD[test]} differ between {_GROUPS[group]}, {model}, "
        f"{stage}", bool(printed), _significant(test, model, group, stage), _POWER,
        f"paper: {printed or 'not significant'}",
    )  # fmt: skip


def _significant(test: str, model: str, group: str, stage: str) -> Callable[[Run], Ours]:
    representation = LITERATURE[model] if stage == "literature" else model
    family = f"between_{_GROUPS[group]}/{representation}/{stage}"

    def ours(run: Run) -> Ours:
        where = {"family": family, "stratum": test, "response": _RESPONSES[0]}
        p = float(tested(run, "kruskal", **where)["p"].iloc[0])
        beside = "".join(_beside(run, family, test))
        return Ours(float(p < P_BELOW), note=f"ours: p = {p:.2g} of the loaded error{beside}")

    return ours


def _beside(run: Run, family: str, test: str) -> Iterator[str]:
    """The p of all three rotations, and of the test that fits complete blocks."""
    for name, response in (("kruskal", _RESPONSES[1]), ("friedman", _RESPONSES[0])):
        try:
            rows = tested(run, name, family=family, stratum=test, response=response)
        except NotComputed:
            continue
        what = "all three rotations" if name == "kruskal" else "Friedman's test"
        yield f"; {float(rows['p'].iloc[0]):.2g} of {what}"


def _contradicted() -> Iterator[Claim]:
    yield Claim(
        "section_3.between_specimens.literature", "section 3.2.1, Table 5",
        "errors of per_specimen under flexion differ between specimens with published stiffness",
        YES_NO, 1.0, exactly(1.0), _significant("flexion", "per_specimen", "specimen", STAGES[0]),
        "", contradicted="B14: the text has this stage alone as significant, Table 5 has only the "
        f"left-out specimen ({_printed('flexion', MODELS[0], 'specimen', STAGES[2])})",
    )  # fmt: skip
    yield Claim(
        "section_3.between_levels.left_out_specimen", "section 3.3.1, Table 5",
        "errors of per_specimen under flexion differ between levels in a left-out specimen",
        YES_NO, 0.0, exactly(0.0), _significant("flexion", "per_specimen", "level", STAGES[2]),
        "", contradicted="B15: the text has the fitted stage alone as significant, Table 5 this "
        f"one too ({_printed('flexion', MODELS[0], 'level', STAGES[2])})",
    )  # fmt: skip
    yield contradicted(
        "table_5.tested_coordinates", "section 2.6, Table 5", "coordinates whose errors are tested",
        "count", 3.0, 1.0,
        "B16: the caption has all three rotations, section 2.6 the loaded one alone; our Table 5 "
        "rows are of the loaded one and name the p of all three",
    )  # fmt: skip
    stated = float(COUNTS["kruskal_wallis_tests"])
    per_group = float(len(TESTS) * len(MODELS) * len(STAGES))
    yield contradicted(
        "table_5.tests_between_specimens", "section 2.6.2, Table 5",
        "Kruskal-Wallis tests between specimens", "count", stated, per_group,
        f"B19: {stated:g} are stated for specimens, but {len(TESTS)} loads, {len(MODELS)} models "
        f"and {len(STAGES)} stages make {per_group:g}; Table 5 has {stated:g} with levels counted",
    )  # fmt: skip

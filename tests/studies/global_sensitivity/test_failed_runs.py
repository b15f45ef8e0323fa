"""Where failed runs lie, from runs of which it is known why they failed."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe.sensitivity_analysis.global_indices.design import Design, draw
from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.failed_runs import (
    WAYS,
    Ends,
    failed_rows,
    of_runs,
    rows_of,
)
from spinepipe.studies.global_sensitivity.tables import FAILED_RUNS, RESPONSES
from spinepipe.tables import from_rows, write

FACTORS = ("soft", "tall", "quiet")
UNITS = ("1", "mm", "deg", "1")
SAMPLES = {"sobol": 128, "morris": 60, "latin_hypercube": 400}


def drawn(method: str, seed: int = 1) -> Design:
    return draw(method, FACTORS, SAMPLES[method], seed, second_order=False, dummy=True)


def ended(failed: "np.ndarray[tuple[int], np.dtype[np.bool_]]", how: str = "unstable") -> Ends:
    return np.where(failed, WAYS.index(Status(how)), WAYS.index(Status.CONVERGED)).astype(np.int32)


def rows(design: Design, how: Ends) -> pd.DataFrame:
    found = list(rows_of(design, design.unit, UNITS, how))
    table = from_rows(FAILED_RUNS, [{"specimen": "a", "test": "push", **row} for row in found])
    return table.to_pandas().set_index("factor")


@sweep("method", SAMPLES)
def test_runs_that_fail_at_one_end_are_told_there(method: str) -> None:
    """A soft joint with a tall load tips: where the first is low and the second high."""
    design = drawn(method)
    failed = (design.unit[:, 0] < 0.3) & (design.unit[:, 1] > 0.6)
    found = rows(design, ended(failed))
    n = int(failed.sum())
    assert n > 20
    assert (found["failed"] == n).all()
    assert (found["tipped"] == n).all()
    assert (found["not_converged"] == 0).all()
    assert found.loc["soft", "mostly"] == "lowest_third"
    assert found.loc["soft", "low_third"] == n
    assert found.loc["soft", "highest"] < 0.3
    assert found.loc["tall", "mostly"] == "highest_third"
    assert found.loc["tall", "lowest"] > 0.6
    assert (found.loc[["quiet", "dummy"], "mostly"] == "nowhere").all()
    thirds = found[["low_third", "middle_third", "high_third"]].sum(axis=1)
    assert (thirds == n).all()
    whole = failed.reshape(-1, design.block).any(axis=1).sum() * design.block
    assert (found["left_out"] == whole).all()


def test_runs_that_fail_by_chance_lie_nowhere() -> None:
    """Whole studies in which any factor is named: at most about 5 in 100, here of 80."""
    named = 0
    for seed in range(80):
        design = drawn("sobol", seed)
        rng = np.random.default_rng(seed)
        few = rng.random(design.n) < rng.choice([0.003, 0.01, 0.05])
        named += bool((rows(design, ended(few))["mostly"] != "nowhere").any())
    assert named <= 8, "the 97th percentile of a binomial with 80 draws of 5 %"


def test_three_failures_at_one_end_may_be_chance_and_twelve_are_not() -> None:
    """(1/3)^n times two ends of four factors: 0.30 for 3, 1.5e-5 for 12."""
    design = drawn("latin_hypercube")
    lowest = np.argsort(design.unit[:, 0])
    for n, mostly in ((3, "nowhere"), (12, "lowest_third")):
        failed = np.zeros(design.n, dtype=bool)
        failed[lowest[:n]] = True
        row = rows(design, ended(failed)).loc["soft"]
        share = (design.unit[:, 0] < 1.0 / 3.0).mean()
        assert row["p"] == pytest.approx(8 * share**n)
        assert row["mostly"] == mostly


def test_a_study_without_failures_says_so_in_numbers() -> None:
    found = rows(drawn("morris"), ended(np.zeros(60 * 5, dtype=bool)))
    assert (found["failed"] == 0).all()
    assert (found["left_out"] == 0).all()
    assert found["p"].isna().all()
    assert (found["mostly"] == "nowhere").all()


def test_a_run_counts_once_however_many_steps_and_joints_it_has(tmp_path: Path) -> None:
    """Two tests of two steps and two joints: sample 1 tips in the second step of one test."""
    made = [
        {
            **dict.fromkeys(column.name for column in RESPONSES.columns),
            "specimen": "a",
            "sample": sample,
            "test": test,
            "step": step,
            "joint": joint,
            "status": "unstable" if (sample, test, step) == (1, "pull", 2) else "converged",
            "message": "",
        }
        for sample in range(3)
        for test in ("push", "pull")
        for step in (1, 2)
        for joint in ("L3L4", "L2L3")
    ]
    path = str(tmp_path / "block.parquet")
    write(from_rows(RESPONSES, made), path, {})
    found = of_runs([path])
    told = {test: [WAYS[way] for way in ways] for test, ways in found.items()}
    assert told["push"] == ["converged"] * 3
    assert told["pull"] == ["converged", "unstable", "converged"]
    design = draw("latin_hypercube", FACTORS, 3, 1)
    rows_ = failed_rows(design, design.unit, UNITS, [path], [])
    assert [(row["test"], row["failed"]) for row in rows_] == [("push", 0)] * 3 + [("pull", 1)] * 3

"""The time that a run still takes: catches an estimate of one rule told for the whole run, and a
clock that stands at what another machine needed."""

from pathlib import Path

import pytest
from snakemake_logger_plugin_spinepipe.time_left import MACHINE, TimeLeft, duration, job_seconds

EXPECTED = {"fit": 2.0, "draw": 1.0}


def test_before_the_first_job_costs_of_all_rules_count() -> None:
    totals = {"fit": 10, "draw": 4}
    assert TimeLeft(EXPECTED).seconds(totals, cores=2) == pytest.approx((10 * 2.0 + 4 * 1.0) / 2)


def test_what_jobs_took_here_soon_stands_for_the_rest_of_their_rule_and_scales_the_others() -> None:
    run = TimeLeft(EXPECTED)
    many = {"fit": 2000, "draw": 4}
    for _ in range(1000):
        run.finish("fit", 4.0)
    # Fits take twice as long as expected, and so will the figures.
    assert run.seconds(many, cores=2) == pytest.approx((1000 * 4.0 + 4 * 2.0) / 2, rel=0.01)


def test_one_slow_first_job_does_not_make_hours_of_many_short_ones() -> None:
    run = TimeLeft({"simulate": 0.01})
    run.finish("simulate", 2.0)
    assert 50.0 < run.seconds({"simulate": 5001}, cores=1) < 200.0


def test_what_is_kept_is_what_the_next_run_expects(tmp_path: Path) -> None:
    (tmp_path / ".snakemake").mkdir()
    (tmp_path / "workflow").mkdir()
    (tmp_path / "workflow/job_seconds.csv").write_text("rule,seconds\nfit,9.0\nother,3.0\n")
    run = TimeLeft(job_seconds(tmp_path))
    for _ in range(98):
        run.finish("fit", 4.0)
    run.finish("draw", 10.0)  # one job, and all modules to load: not what a draw costs
    run.keep(tmp_path)
    known = job_seconds(tmp_path)
    assert known["fit"] == pytest.approx(4.0, rel=0.02)
    assert known["draw"] < 5.0
    assert known["other"] == 3.0
    assert known[MACHINE] > 0


@pytest.mark.parametrize(
    ("seconds", "words"), [(99.4, "99 s"), (100.0, "2 min"), (5999.0, "100 min"), (6000.0, "1.7 h")]
)
def test_seconds_as_people_say_them(seconds: float, words: str) -> None:
    assert duration(seconds) == words

"""The time that a run still takes: catches an estimate of one rule told for the whole run, jobs
that are counted twice, and a clock that stands at what another machine needed."""

import io
import itertools
from pathlib import Path

import pytest

from spinepipe.jobs.time_left import MACHINE, TimeLeft, costs, duration

TOTALS = {"fit": 10, "draw": 4}
EXPECTED = {"fit": 2.0, "draw": 1.0}


def left(cores: int = 2, stream: io.StringIO | None = None) -> TimeLeft:
    ticks = itertools.count(0, 10)
    return TimeLeft(lambda: TOTALS, EXPECTED, cores, stream or io.StringIO(), lambda: next(ticks))


def test_before_the_first_job_costs_of_all_rules_count() -> None:
    assert left().seconds_left(TOTALS) == pytest.approx((10 * 2.0 + 4 * 1.0) / 2)
    assert left(cores=1).ahead() == "14 jobs, about 24 s"


def test_what_jobs_took_here_soon_stands_for_the_rest_of_their_rule_and_scales_the_others() -> None:
    run = left()
    many = {"fit": 2000, "draw": 4}
    for _ in range(1000):
        run.finish("fit", 4.0)
    # Fits take twice as long as expected, and so will the figures.
    assert run.seconds_left(many) == pytest.approx((1000 * 4.0 + 4 * 2.0) / 2, rel=0.01)


def test_one_slow_first_job_does_not_make_hours_of_many_short_ones() -> None:
    run = TimeLeft(lambda: {}, {"simulate": 0.01}, 1, io.StringIO())
    run.finish("simulate", 2.0)
    assert 50.0 < run.seconds_left({"simulate": 5001}) < 200.0


def test_a_line_tells_the_whole_run() -> None:
    stream = io.StringIO()
    run = left(stream=stream)
    run.finish("fit", 2.0)
    assert stream.getvalue() == "1 of 14 jobs  ·  11 s left  ·  fit\n"
    for _ in range(9):
        run.finish("fit", 2.0)
    for _ in range(4):
        run.finish("draw", 1.0)
    assert stream.getvalue().endswith("14 of 14 jobs  ·  0 s left  ·  draw\n")


def test_what_is_kept_is_what_the_next_run_expects(tmp_path: Path) -> None:
    (tmp_path / ".snakemake").mkdir()
    (tmp_path / "workflow").mkdir()
    (tmp_path / "workflow/job_seconds.csv").write_text("rule,seconds\nfit,9.0\nother,3.0\n")
    run = left()
    for _ in range(98):
        run.finish("fit", 4.0)
    run.finish("draw", 10.0)  # one job, and all modules to load: not what a draw costs
    run.keep(tmp_path)
    known = costs(tmp_path)
    assert known["fit"] == pytest.approx(4.0, rel=0.02)
    assert known["draw"] < 5.0
    assert known["other"] == 3.0
    assert known[MACHINE] > 0


@pytest.mark.parametrize(
    ("seconds", "words"), [(99.4, "99 s"), (100.0, "2 min"), (5999.0, "100 min"), (6000.0, "1.7 h")]
)
def test_seconds_as_people_say_them(seconds: float, words: str) -> None:
    assert duration(seconds) == words

"""Numbers of papers entered a second time, from the papers, and how these contradict themselves.

`printed.csv` has what is printed, and the range inside which a number agrees where it follows from
the print alone: what rounds to it, its SD, half to twice of it.
"""

import csv
from pathlib import Path

import pytest
from sweeps import sweep

from papers.engine import claims_of, judged, rows_of
from papers.run import StudyRun
from spinepipe.comparison.papers import papers
from tests.generators import ais_films

with Path(__file__).with_name("printed.csv").open(encoding="utf-8", newline="") as file:
    PRINTED = list(csv.DictReader(file))

CHECKS = {
    "gould_2024a": (
        "1 2 3 6 7 11 12 13 14 16 18 19 20 24 25 27 28 29 30",
        "1 2 3 6 7 11 12 13 14 16 17 18 19 20 29 30",
    ),
    "gould_2024b": ("6 8 10 12 13 14 15 16 17 18 19", "1 8 10 12 13 14 15 16 17 19"),
    "jalalian_2017": ("1 2 3 4 5 6 7 8 9 10 11 12", "2 3 7 8 9"),
    "wang_2021": ("1 2 3 4 5 6 7 8 9 10", "1 2 3 4 7"),
    "ghezelbash_2016": ("1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16", "5 6 7 8 10 11 16"),
}
"""Numbers of the checks of each paper that a row names, and those by which it excludes itself."""

LETTERS = dict(zip(CHECKS, "ABJWG", strict=True))


@sweep("row", PRINTED, title=lambda row: row["id"])
def test_a_number_is_the_printed_one(row: dict[str, str]) -> None:
    (claim,) = [claim for claim in claims_of(row["paper"]) if claim.id == row["id"]]
    found = {"printed": claim.printed, "low": claim.range.low, "high": claim.range.high}
    wanted = {name: float(row[name]) for name in found if row[name]}
    assert wanted
    assert {name: found[name] for name in wanted} == pytest.approx(wanted, rel=1e-8, abs=1e-8)


def test_shipped_films_have_the_patients_of_table_1() -> None:
    quantities = {claim.id: claim.quantity for claim in claims_of("jalalian_2017")}
    for number, (sex, _, lenke, _) in enumerate(ais_films.TABLE_1, start=1):
        assert quantities[f"table_1.p{number:02d}.sex"].endswith(f" is {sex}")
        assert quantities[f"table_1.p{number:02d}.lenke_class"].endswith(f" is {lenke}")


@pytest.mark.parametrize("paper", papers())
def test_every_check_of_a_paper_is_told(paper: str) -> None:
    letter, (named, excluded) = LETTERS[paper], CHECKS[paper]
    told = judged(claims_of(paper), StudyRun({}))
    reasons = " ".join(f"{row['id']}: {row['reason']}" for row in told)
    for number in named.split():
        check = f"{letter}{number}"
        assert any(f"{before}{check}" in reasons for before in (" ", "(", ".")), check
    wrong = {row["contradicted"].partition(":")[0] for row in rows_of(paper) if row["contradicted"]}
    assert wrong == {f"{letter}{number}" for number in excluded.split()}


@pytest.mark.parametrize("paper", ["ghezelbash_2016", "wang_2021"])
def test_no_range_is_as_wide_as_half_to_twice(paper: str) -> None:
    """But for order of size: Table 2 of Ghezelbash holds rotations to the reach of Eq 2 alone."""
    for one in claims_of(paper):
        low, high, value = one.range.low, one.range.high, one.printed or 0.0
        if value > 0.0 and low is not None and high is not None and "table_2." not in one.id:
            assert low > 0.5 * value or high < 1.5 * value, one.id


def test_only_what_was_put_in_is_circular() -> None:
    """Of Table 3 of Gould 2024b the loaded coordinates; nothing that was fitted in Table 4."""
    loaded = {("left_lateral_bending", "right_bending"), ("left_axial_rotation", "left_rotation")}
    loaded |= {("flexion", "extension")}
    circular = [row["id"] for row in rows_of("gould_2024b") if row["evidence"] == "circular"]
    of_table_3 = [name.split(".") for name in circular if name.startswith("table_3.")]
    assert {(name[1], name[2]) for name in of_table_3} == loaded
    assert not [name for name in circular if ".fitted." in name]
    errors = ("errors.", "improvement.")
    assert {
        row["evidence"] for row in rows_of("jalalian_2017") if row["id"].startswith(errors)
    } <= {"independent", "contradicted", "recomputed", ""}

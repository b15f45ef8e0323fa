"""The report of a cohort study: doubts first, true to its tables, fetching nothing.

Seen here: a number or word that the tables do not say, a doubt told late, a page that fetches.
"""

import re
from pathlib import Path

import pandas as pd
import pytest
from cohort_study_cases import Size, cohort_of, frame, study_of, tables_of
from drawn import caption
from study_cases import STUDY, project
from study_cases import Size as OtherSize

from spinepipe.jobs import draw, report
from spinepipe.report.page.document import Picture, ResultTables
from spinepipe.studies.cohort_stiffness.kind import KIND
from spinepipe.studies.cohort_stiffness.page import document, left_out, shown_tables
from spinepipe.studies.cohort_stiffness.page_findings import findings
from spinepipe.studies.cohort_stiffness.settings import CrossValidation
from spinepipe.tables import to_arrow, write

PICTURE = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'
SIZES = {
    "three specimens": Size(),
    "one specimen": Size(("a",)),
    "one joint": Size(vertebrae=("L5", "L4")),
    "one of all": Size(("a",), ("L5", "L4"), ("flexion",), ("per_joint",)),
    "none pooled": Size(representations=("per_specimen", "level_ratio")),
    "nothing solved": Size(solved=False),
}


def results(size: Size, **changed: pd.DataFrame) -> ResultTables:
    """Made-up results with a picture."""
    tables = tables_of(size, **changed)
    metadata = {name: {"seed": "7", "code_digest": name} for name in tables}
    title = KIND.figure("error_map").title
    picture = Picture.of("error_map", title, PICTURE, "What it shows.")
    return ResultTables(tables, metadata, {"error_map": picture})


def page_of(size: Size) -> str:
    """The page of made-up results."""
    study, cohort = study_of(size), cohort_of(size)
    return document(study, cohort, results(size)).html(study, cohort)


def told(size: Size, **changed: pd.DataFrame) -> list[str]:
    """The findings, plain spaces before percent signs."""
    found = findings(study_of(size), results(size, **changed))
    return [sentence.replace("\u00a0", " ") for sentence in found]


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES.keys())
def test_page_of_any_cohort_fetches_nothing(size: Size) -> None:
    page = page_of(size)
    before_scripts = page.split("<script")[0]
    for address in re.findall(r' (?:src|href)="([^"]*)"', before_scripts):
        assert address.startswith(("#", "data:image/svg+xml;base64,")), address
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy.startswith("default-src 'none'")
    assert "Figure 1. Errors by specimen and level." in page
    assert "What it shows." in page
    assert "sampled joint frames" not in before_scripts, "nothing was sampled"
    assert "nan" not in " ".join(told(size)).lower().split()


def test_page_has_the_same_bytes_twice() -> None:
    pages = {page_of(Size()) for _ in range(2)}
    assert len(pages) == 1


def test_a_flipped_sign_is_told_before_all_else() -> None:
    signs = tables_of(Size())["sign_checks"]
    assert told(Size())[0] == "18 of 18 measured joint motions go with the load."
    place = (signs["specimen"] == "b") & (signs["joint"] == "L3L4") & (signs["test"] == "flexion")
    signs.loc[place, ["measured_over_expected", "verdict"]] = [-0.93, "flipped"]
    signs.loc[place, "message"] = "moves against the load in cycle 2"
    first, *others = told(Size(), sign_checks=signs)
    assert first.startswith("Look at this first: in 1 place the measured motion goes against")
    assert "b L3L4 in flexion (flexion–extension: moves against the load in cycle 2)" in first
    assert not any("go with the load" in sentence for sentence in others)
    signs.loc[signs["specimen"] == "a", "verdict"] = "undecided"
    assert "11 of 18 measured joint motions go with the load; 6 cannot be told." in told(
        Size(), sign_checks=signs
    )


def test_fits_that_failed_or_stand_at_a_bound_are_told() -> None:
    fits = tables_of(Size())["fits"]
    assert "All 84 fits ended with a stiffness." in told(Size())
    fits.loc[0, ["status", "message"]] = ["unstable", "it tips over"]
    at = fits.index[(fits["fitted_to"] == "all") & (fits["specimen"] == "b")][0]
    fits.loc[at, ["status", "message"]] = ["converged_at_bound", "k at its upper bound"]
    fits.loc[1, ["status", "message"]] = ["converged_at_bound", "other"]
    fits.loc[2, "n_optima"] = 3
    found = told(Size(), fits=fits)
    assert found[1] == (
        "1 of 84 fits have no stiffness: a, one value per specimen, fitted to flexion: "
        "it tips over."
    )
    assert found[2] == (
        "2 fits of 84 ended with a stiffness at a bound, where the data only say that it is "
        "beyond: 1 to all load cases: b, one value per specimen, fitted to all (k at its upper "
        "bound); 1 to fewer load cases, which say too little about it."
    )
    assert found[3].startswith("1 fit has several optima")


def test_where_nothing_was_solved_no_number_is_told() -> None:
    found = told(Size(solved=False))
    assert any(s.startswith("84 of 84 fits have no stiffness") for s in found)
    assert any("and 78 more" in s for s in found)
    assert not any("least to largest" in s or "largest load" in s for s in found)


def test_stiffness_that_is_not_identifiable_is_counted() -> None:
    size = Size(("a", "b"), representations=("per_joint",))
    assert "From all load cases together every fitted stiffness is identifiable." in told(size)
    rows = tables_of(size)["stiffness"]
    own = rows.index[(rows["source"] == "own") & (rows["fitted_to"] == "all")]
    rows.loc[own[:3], "identifiable"] = False
    expected = "each joint its own 3 of 12 values (25 %)"
    assert f"Not identifiable from all load cases together: {expected}." in told(
        size, stiffness=rows
    )


def test_representations_in_order_with_what_cannot_be_told_apart() -> None:
    size = Size(representations=("per_joint", "per_specimen", "level_ratio"))
    assert (
        "Motion of a left-out specimen, from least to largest error (mean ± SE): each joint its "
        "own 0.500 ± 0.050°; one value per specimen 0.600 ± 0.050° (not told apart from the "
        "first, p 0.30); published ratio of levels 0.700 ± 0.050°. The first was chosen after "
        "looking, by these errors: p are too small, and one that tells another from it proves "
        "little."
    ) in told(size)


def test_errors_and_spreads_have_their_numbers() -> None:
    found = told(Size(representations=("partially_pooled",)))
    assert (
        "Flexion, error in the loaded direction at the largest load (median over specimens, "
        "share of the largest motion): partially pooled 2.0° (25 %)."
    ) in found
    # exp(0.25) = 1.2840, exp(0.1) = 1.1052, exp(0.15) = 1.1618
    spread = "between specimens 1.28, between levels 1.11, of joints beyond that 1.16"
    assert any(f"flexion–extension 51.0 N m/rad ({spread})" in sentence for sentence in found)
    one = told(Size(("a",), representations=("partially_pooled",)))
    assert any("flexion–extension 51.0 N m/rad (of joints beyond that 1.16)" in s for s in one)


def test_motion_of_a_wrong_unit_is_told_before_all_else() -> None:
    signs = tables_of(Size())["sign_checks"]
    signs["verdict"], signs["message"] = "implausible", "0.0175 times the motion, as radians give"
    signs["measured_over_expected"] = 0.0175
    sentence = told(Size(), sign_checks=signs)[0]
    assert sentence.startswith(f"Look at units too: in {len(signs)} places")
    assert sentence.endswith(": 0.0175 times the motion, as radians give.")


def claim(name: str, holds: str, **numbers: object) -> dict[str, object]:
    """A row of the table of findings."""
    return {
        "finding": name,
        "statement": f"Claim {name}.",
        "quantity": "difference",
        "unit": "deg",
        "holds": holds,
        "message": "no fit",
        **numbers,
    }


def test_claims_are_counted_and_told_with_their_numbers() -> None:
    rows = [
        claim("a", "yes", value=0.5, low=0.25, high=0.75, p=0.011, p_holm=0.022),
        claim("b", "no"),
        *(claim(f"c{n}", "undecided", value=0.1) for n in range(8)),
    ]
    found = told(Size(), findings=frame("findings", rows))
    assert any(
        s.startswith("Of 10 claims about this cohort: hold 1, do not hold 1, cannot be decided 8;")
        for s in found
    )
    assert (
        "Holds here: claim a (0.500 deg, 95 % interval 0.250 to 0.750, p 0.011, "
        "0.022 beside the other claims)."
    ) in found
    assert "Does not hold here: claim b (no fit)." in found
    assert any(s.endswith("claim c5 (0.100 deg); and 2 more.") for s in found)


def test_shown_rows_are_chosen_and_the_choice_is_told() -> None:
    shown = {table.name: table for table in shown_tables(results(Size()))}
    of_fits = {"ranking", "mae", "pooling", "sign_checks", "fits", "stiffness"}
    assert set(shown) == of_fits | {"load_displacement", "helical_axes"}
    assert len(shown["stiffness"].rows) == 3 * 4 * 2 * 3
    assert "own fits to all load cases; the others are in stiffness.parquet" in (
        shown["stiffness"].about
    )
    assert len(shown["fits"].rows) == 3 * 4 * 4, "without those that leave a load case out"
    assert "Here:" not in shown["ranking"].about


def test_parts_that_are_left_out_are_named() -> None:
    none = CrossValidation(specimens=False, load_cases=False)
    assert left_out(study_of(Size()), 3) == ()
    assert left_out(study_of(Size()), 1) == (
        "prediction of left-out specimens (the cohort has one specimen)",
    )
    assert left_out(study_of(Size(), cross_validation=none), 3) == (
        "prediction of left-out specimens (cross_validation: specimens: false)",
        "prediction of left-out load cases (cross_validation: load_cases: false)",
    )


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """A project with a cohort study and files of all its tables."""
    joint_pose = OtherSize()
    size = Size(joint_pose.specimens, joint_pose.vertebrae, ("flexion",), ("per_joint",))
    project(tmp_path, joint_pose)
    (tmp_path / "config" / "studies" / f"{STUDY}.yaml").write_text(
        f"study: {STUDY}\nkind: cohort_stiffness\ncohort: straight\ncost: published\n"
        "free: [extension]\nrepresentations: [per_joint]\n"
    )
    folder = tmp_path / "results" / STUDY
    folder.mkdir(parents=True)
    for name, found in tables_of(size).items():
        columns = {column: found[column].tolist() for column in found}
        clean = {
            column: [None if pd.isna(v) else v for v in values]
            for column, values in columns.items()
        }
        write(to_arrow(KIND.table(name), clean), str(folder / f"{name}.parquet"), {"seed": "7"})
    return tmp_path


def test_jobs_draw_all_figures_and_write_the_page(made: Path) -> None:
    folder = made / "results" / STUDY
    pictures = [str(folder / f"{figure.name}.svg") for figure in KIND.figures]
    for figure, path in zip(KIND.figures, pictures, strict=True):
        tables = [str(folder / f"{table}.parquet") for table in figure.tables]
        draw.run(str(made), STUDY, figure.name, tables, path, path.replace(".svg", ".png"))
    files = sorted(str(path) for path in folder.glob("*.parquet"))
    captions = [str(caption("cohort_stiffness", figure.name)) for figure in KIND.figures]
    output = str(folder / "report.html")
    report.run(str(made), STUDY, "report", files, pictures, captions, output)
    page = (folder / "report.html").read_text(encoding="utf-8")
    for number, figure in enumerate(KIND.figures, start=1):
        assert f"Figure {number}. {figure.title}." in page
    assert "<td>errors</td>" in page, "tables that are not shown are among the digests"
    assert "the cohort&#39;s own joint frames" in page
    assert "4 of 4 measured joint motions go with the load." in page
    digests = page.split("Digests of code")[1]
    assert all(f"<td>{Path(path).stem}</td>" in digests for path in files)

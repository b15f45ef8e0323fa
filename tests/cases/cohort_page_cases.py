"""Made-up studies of stiffness, one for each outcome that a page can have."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from math import nan
from typing import Any

import pandas as pd
from cohort_study_cases import Size, cohort_of, frame, study_of, tables_of
from page_rules import verdicts

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Drawing
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.studies.cohort_stiffness import charts
from spinepipe.studies.cohort_stiffness.kind import KIND
from spinepipe.studies.cohort_stiffness.page import page
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.tables import StudyTables

UNIT = 57.29577951308232
"""N m/rad that are 1 N m/deg."""

COORDINATES = ("extension", "right_bending", "left_rotation")
Tables = Mapping[str, pd.DataFrame]


@dataclass(frozen=True, eq=False)
class Case:
    """A made-up study: tables in the place of those of its size, and settings."""

    size: Size = field(default_factory=Size)
    tables: Tables = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def study(self) -> CohortStiffness:
        return study_of(self.size, **self.settings)

    @property
    def cohort(self) -> Cohort:
        return cohort_of(self.size)

    @property
    def results(self) -> ResultTables:
        scatter = tables_of(self.size)["fits"].assign(scatter=1.0)
        return ResultTables(StudyTables({**tables_of(self.size), "fits": scatter, **self.tables}))

    @cached_property
    def page(self) -> Page:
        return page(self.study, self.cohort, self.results)

    @cached_property
    def verdicts(self) -> set[tuple[str, str]]:
        return verdicts(self.page.conclusions)

    @cached_property
    def charts(self) -> dict[str, Chart]:
        draw = {one.name: getattr(charts, one.at.partition(":")[2]) for one in KIND.figures}
        tables = self.results.tables
        return {name: of(self.study, self.cohort, tables) for name, of in draw.items()}

    @cached_property
    def html(self) -> str:
        drawings = {name: Drawing.read(name, chart.svg()) for name, chart in self.charts.items()}
        results = replace(self.results, drawings=drawings)
        return self.page.html(self.study, self.cohort, results)


def changed(table: str, **columns: Any) -> Tables:
    """A table with other values in whole columns."""
    return {table: tables_of(Size())[table].assign(**columns)}


def own(
    values: Mapping[str, Any],
    joints: int = 2,
    coordinates: tuple[str, ...] = ("extension",),
    **more: Any,
) -> Tables:
    """Own fits to all load cases: stiffness in N m/deg by specimen, as given or for each joint."""
    rows = []
    names = [("L4L5", "L3L4")[place] for place in range(joints)]
    for (specimen, of), coordinate in product(values.items(), coordinates):
        for joint, value in zip(names, of if isinstance(of, tuple) else [of] * joints, strict=True):
            ends = {"low": 0.9 * value * UNIT, "high": 1.2 * value * UNIT}
            row = {"specimen": specimen, "joint": joint, "coordinate": coordinate, **ends, **more}
            row = {
                "representation": "per_joint",
                "stiffness": value * UNIT,
                "unit": "N m/rad",
            } | row
            row = {
                "identifiable": True,
                "at_bound": "no",
                "fitted_to": "all",
                "source": "own",
            } | row
            rows.append({"status": "converged", "message": "", **row})
    return {"stiffness": frame("stiffness", rows)}


def claims(**holds: Any) -> Tables:
    """Rows of the table of findings, by their names: the verdict, or it with a value."""
    rows = []
    for name, told in holds.items():
        verdict, value = told if isinstance(told, tuple) else (told, 0.5)
        numbers = {
            "value": value,
            "low": value - 0.2,
            "high": value + 0.2,
            "specimens": 3,
            "p": 1e-9,
        }
        named = {"finding": name, "statement": f"Claim {name}.", "quantity": "difference"}
        rows.append({**named, **numbers, "unit": "deg", "holds": verdict, "message": ""})
    return {"findings": frame("findings", rows)}


def of_all(what: tuple[str, ...], *holds: str) -> dict[str, str]:
    """Claims that specimens or levels differ, by direction."""
    return {
        f"stiffness_differs_between_{one}_{name}": verdict
        for one in what
        for name, verdict in zip(COORDINATES, holds, strict=False)
    }


def signs(verdict: str, many: int) -> Tables:
    rows = tables_of(Size())["sign_checks"]
    rows.loc[rows.index[:many], "verdict"] = verdict
    return {"sign_checks": rows}


def covariates(*holds: str) -> Tables:
    numbers = {"factor": 1.3, "low": 1.1, "high": 1.5, "specimens": 6, "needed": 5, "p": 1e-9}
    rows = [
        {"coordinate": name, "covariate": "age_years", "step": "10 years", "holds": one,
         "representation": "per_joint", "message": "too few", **numbers}
        for name, one in zip(COORDINATES, holds, strict=False)
    ]  # fmt: skip
    return {"covariates": frame("covariates", rows)}


def nuisances(pull: float) -> Tables:
    row = {
        "specimen": "a",
        "representation": "per_joint_nuisance",
        "fitted_to": "all",
        "unit": "mm",
    }
    row |= {"joint": "L4L5", "parameter": "centre_anterior", "value": pull, "prior_sd": 1.0}
    return {"nuisances": frame("nuisances", [{**row, "standard_error": 0.1, "pull": pull}])}


def errors(**values: tuple[float, ...]) -> Tables:
    """Table ``ranking``: errors by criterion of per_specimen, per_joint and partially_pooled."""
    names = ("per_specimen", "per_joint", "partially_pooled")
    rows = [
        {"criterion": criterion, "representation": name, "source": "own", "rank": 1, "unit": "deg",
         "value": value, "standard_error": 0.05, "specimens": 3, "message": ""}
        for criterion, of in values.items()
        for name, value in zip(names, of, strict=True)
    ]  # fmt: skip
    return {"ranking": frame("ranking", rows)}


def curves(**columns: Any) -> Tables:
    """Curves of which the measured ones have other values."""
    rows = tables_of(Size())["load_displacement"]
    measured = rows["source"] == "measured"
    for name, value in columns.items():
        rows.loc[measured, name] = value
    return {"load_displacement": rows}


def sure_loops(many: int) -> Tables:
    """Of all measured loops so many lose work beyond noise."""
    rows = tables_of(Size())["load_displacement"].assign(hysteresis_area_low_j=-1.0)
    first = rows.index[rows["source"] == "measured"][:many]
    rows.loc[first, "hysteresis_area_low_j"] = 0.15
    return {"load_displacement": rows}


CASE, SPECIMEN = "left_out_case", "left_out_specimen"
THREE = {"a": (1.0, 3.0), "b": 4.0, "c": 6.0}
ONE, ONE_JOINT = Size(("a",)), Size(vertebrae=("L5", "L4"))
BASE = {"base": {"model": "found.yaml"}}
NONE = {"specimens": False, "load_cases": False}
OPEN = {"identifiable": False, "high": nan}
PUBLISHED = ("cross_validation_beats_literature", f"optimised_beats_literature_{CASE}")
UNTOLD = "undecided"
ALL_KINDS = (
    f"per_joint_beats_per_specimen_{CASE}", f"stiffening_beats_per_specimen_{CASE}",
    f"per_joint_nuisance_beats_per_joint_{CASE}", *PUBLISHED, "stiffness_is_load_case_specific",
)  # fmt: skip
"""A claim of each kind but of differences of stiffness."""

ALIKE = errors(fitted=(0.5, 0.5, 0.501), left_out_specimen=(0.6, 0.6, 0.6), left_out_case=(1, 2, 3))


def others_bound_nothing() -> Tables:
    """The load cases that are left say nothing of the direction of the left-out one."""
    rows = tables_of(Size())["stiffness"]
    rows.loc[rows["fitted_to"].str.startswith("all_but_"), "identifiable"] = False
    return {"stiffness": rows}


BOTH = ("specimens", "levels")
CASES: dict[str, tuple[Case, str]] = {
    "whole": (
        Case(),
        "typical several_3, direction specimens, trust law, sample ok, fits ok, starts ok, "
        "bounded ok, noise ok, signs ok, checks ok, zones soft, hysteresis lost, axes placed, "
        "methods noise, methods_more pooled, methods_more claims",
    ),
    "two directions": (Case(tables=own(THREE, coordinates=COORDINATES[:2])), "typical several_2"),
    "one direction": (Case(tables=own(THREE)), "typical several_1"),
    "one specimen": (Case(ONE), "direction joints, sample few, checks check_cases_alone"),
    "one value, three directions": (
        Case(ONE, own({"a": 1.0}, 1, COORDINATES)),
        "typical single_3, direction single",
    ),
    "one value, two directions": (
        Case(ONE, own({"a": 1.0}, 1, COORDINATES[:2])),
        "typical single_2",
    ),
    "one value": (Case(ONE, own({"a": 1.0}, 1)), "typical single_1"),
    "nothing solved": (Case(Size(solved=False)), "typical none, fits stop"),
    "open above": (
        Case(tables=own(THREE, **OPEN)),
        "typical not_bounded, open above, bounded check",
    ),
    "open": (Case(tables=own(THREE, **OPEN, low=nan)), "typical not_bounded, open both"),
    "a flipped sign": (Case(tables=signs("flipped", 1)), "trust stop_flipped, signs stop"),
    "many flipped": (Case(tables=signs("flipped", 9)), "trust stop_flipped_many"),
    "a unit": (Case(tables=signs("implausible", 18)), "trust sizes, signs check_sizes"),
    "little motion": (Case(tables=signs("undecided", 2)), "signs check_untold"),
    "a base model": (
        Case(settings=BASE),
        "trust base, left_out base, checks check_base, methods_more base",
    ),
    "misfit": (Case(tables=changed("fits", scatter=2.0)), "trust misfit, noise check_large"),
    "small residuals": (Case(tables=changed("fits", scatter=0.5)), "noise check_small"),
    "published cost": (
        Case(settings={"cost": "published"}),
        "trust no_noise, noise check_none, methods published",
    ),
    "a fit lost": (
        Case(tables=changed("fits", status=["unstable"] + ["converged"] * 83, n_optima=2)),
        "fits check, starts check",
    ),
    "several optima elsewhere": (
        Case(tables={"fits": tables_of(Size())["fits"].pipe(
            lambda fits: fits.assign(n_optima=1 + (fits["representation"] != "per_joint"))
        )}),
        "starts ok_others",
    ),
    "nothing left out": (Case(settings={"cross_validation": NONE}), "checks check_neither"),
    "specimens alone left out": (
        Case(settings={"cross_validation": NONE | {"specimens": True}}),
        "checks check_specimens_alone",
    ),
    "left out on published": (Case(tables=others_bound_nothing()), "left_out_stiffness check"),
    "no ratios of levels": (Case(Size(vertebrae=("V3", "V2", "V1"))), "ratios check"),
    "centres as expected": (Case(tables=nuisances(1.0)), "priors ok"),
    "a centre far off": (Case(tables=nuisances(5.0)), "priors check"),
    "all differ": (
        Case(tables=claims(**of_all(BOTH, "yes", "yes", "yes"))),
        "specimens differ, levels differ",
    ),
    "as put in": (
        Case(tables=claims(**of_all(BOTH, "circular", "circular", "circular"))),
        "specimens differ_put_in, levels differ_put_in",
    ),
    "some": (Case(tables=claims(**of_all(BOTH, "yes", "no"))), "specimens some, levels some"),
    "some as put in": (
        Case(tables=claims(**of_all(BOTH, "undecided", "circular"))),
        "specimens some_put_in, levels some_put_in",
    ),
    "alike": (Case(tables=claims(**of_all(BOTH, "no", "no"))), "specimens alike, levels alike"),
    "nothing decided": (
        Case(tables=claims(**of_all(BOTH, "no", "undecided"), **dict.fromkeys(ALL_KINDS, UNTOLD))),
        "specimens not_shown, levels not_shown, descriptions none_shown, laws not_shown, "
        "centres not_shown, published neither_shown, load_cases not_shown",
    ),
    "all pay": (
        Case(tables=claims(**dict.fromkeys(ALL_KINDS, "yes"))),
        "descriptions best, laws better, centres better, published better, load_cases yes",
    ),
    "none pays": (
        Case(tables=claims(**dict.fromkeys(ALL_KINDS, ("no", -0.5)))),
        "descriptions best, laws worse, centres worse, published worse, load_cases small",
    ),
    "one of two about published stiffness": (
        Case(tables=claims(**{PUBLISHED[0]: UNTOLD, PUBLISHED[1]: "yes"})),
        "published not_shown, published better",
    ),
    "one comparison of two": (
        Case(tables=claims(**{
            f"partially_pooled_beats_per_specimen_{CASE}": "yes",
            f"partially_pooled_beats_per_joint_{SPECIMEN}": UNTOLD,
        })),
        "descriptions some",
    ),
    "better than one in each of two": (
        Case(tables=claims(**{
            f"partially_pooled_beats_per_specimen_{CASE}": "yes",
            f"partially_pooled_beats_per_joint_{SPECIMEN}": "yes",
        })),
        "descriptions some",
    ),
    "one joint": (Case(ONE_JOINT, ALIKE), "descriptions same"),
    "covariates": (
        Case(tables=covariates("yes", UNTOLD, "refused")),
        "covariates yes, covariates others_not_shown, asked check",
    ),
    "no covariate": (Case(tables=covariates(UNTOLD)), "covariates not_shown"),
    "ranges agree": (Case(tables=curves(range_of_motion_low_deg=-40.0)), "ranges agree"),
    "ranges differ": (
        Case(tables=curves(range_of_motion_deg=5.0, range_of_motion_low_deg=4.0,
                           range_of_motion_high_deg=6.0)),
        "ranges differ",
    ),
    "no limit": (Case(tables=curves(range_of_motion_low_deg=nan)), "ranges no_noise"),
    "straight curves": (
        Case(tables=curves(neutral_zone="not_meaningful", hysteresis_area_low_j=-1.0)),
        "zones straight, hysteresis none",
    ),
    "one loop for sure": (Case(tables=sure_loops(1)), "hysteresis none"),
    "many loops for sure": (Case(tables=sure_loops(9)), "hysteresis lost"),
    "zones without a number": (
        Case(tables=curves(neutral_zone="not_described", neutral_zone_deg=nan)),
        "zones soft_shapeless",
    ),
    "zones by another definition": (
        Case(settings={"neutral_zone": "at_zero_load"}), "zones named, methods_more neutral_zone",
    ),
    "no zone by it": (
        Case(tables=curves(neutral_zone="not_meaningful", neutral_zone_deg=nan),
             settings={"neutral_zone": "threshold", "neutral_zone_below_nm_per_deg": 1.0}),
        "zones named_none",
    ),
    "a direction that no reading depends on": (
        Case(tables=own({"a": 1.0, "b": 1.0, "c": 1.0})), "not_fitted directions",
    ),
    "no loops": (
        Case(tables=curves(neutral_zone="one_side", hysteresis_area_j=nan)),
        "zones check, hysteresis check",
    ),
    "no places": (Case(tables=changed("helical_axes", status="direction_only")), "axes check"),
    "no SDs": (Case(tables=changed("helical_axes", centre_anterior_sd_mm=nan)), "axes no_noise"),
}  # fmt: skip
LONG = Size(
    tuple(f"specimen_with_a_long_name_{n}" for n in range(5)),
    tuple(f"vertebra_number_{n}" for n in range(6)),
)
SPINE = ("S1", "L5", "L4", "L3", "L2", "L1", *(f"T{n}" for n in range(12, 0, -1)))
EDGES = {
    "long names": Case(LONG),
    "many": Case(Size(tuple(f"s{n:02d}" for n in range(20)), SPINE, ("flexion",), ("per_joint",))),
    "one of all": Case(Size(("a",), ("L5", "L4"), ("flexion",), ("per_joint",))),
    "no rows at all": Case(tables={name: rows[:0] for name, rows in tables_of(Size()).items()}),
}
ALL = {**{name: case for name, (case, _) in CASES.items()}, **EDGES}

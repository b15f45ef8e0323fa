"""What the paper's numbers and formulas say of each other: consistency checks G1 to G11 and G16.

G12 to G15 are about Eq 6 and stand with it.
"""

from collections.abc import Iterator
from math import sqrt

from spinepipe.comparison.claim import Claim, Range, exactly
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import (
    PAPER,
    YES_NO,
    confronted,
    missing,
    near,
    recomputed,
    rounded,
)

FIG_9, REFERENCE, TABLE_2 = PAPER["fig_9"], PAPER["reference"], PAPER["table_2"]

_HALF_PERCENT = 0.5
"""Half the last digit of printed percentages."""

_NO_ANDERSON = (
    "the regressions of Anderson 2012 are not part of this product: its reference person is the "
    "paper's"
)


def claims_of_own_numbers() -> Iterator[Claim]:
    """The checks in their order, and what stands with them."""
    yield from _sums()
    yield from _reference()
    yield from _stiffness()
    yield from _loads()
    yield from _slips()


def _sums() -> Iterator[Claim]:
    """G1 and G2."""
    for check, name in (("G1", "flexion"), ("G2", "lateral")):
        printed = PAPER["partition"][f"{name}_percent"]
        allowed = near(100.0, 0.05 * len(printed), "as far as the rounding of seven shares goes")
        yield recomputed(
            f"closed_form.{check}",
            "2.6",
            f"sum of the shares of {name} bending",
            "%",
            100.0,
            allowed,
            float(sum(printed)),
            f"{check}: here they are made to sum to 100",
        )


def _reference() -> Iterator[Claim]:
    """G3 and G4."""
    tall = REFERENCE["height_cm"] / 100.0
    for key in ("closed_form.G3", "results.reference_bmi"):
        yield recomputed(
            key,
            "3.2, 4.2",
            "body mass index of the reference person",
            "kg/m2",
            float(REFERENCE["bmi"]),
            rounded(float(REFERENCE["bmi"]), 1.0),
            float(REFERENCE["mass_kg"] / tall**2),
            "G3: from mass and height",
        )
    for key in ("closed_form.G4", "results.bh_lower_bound"):
        yield recomputed(
            key,
            "2.7, 3.2",
            "least height that Eq 3 may find",
            "cm",
            float(REFERENCE["least_height_cm"]),
            rounded(float(REFERENCE["least_height_cm"]), 0.1),
            float(REFERENCE["height_cm"]),
            "G4: the height found is the bound itself, no optimum of Eq 3 inside its range",
        )
    yield missing(
        "results.spine_length_to_height_limit",
        "2.7",
        "largest length of the spine over body height",
        "ratio",
        float(PAPER["model"]["longest_spine_over_height"]),
        "no table holds the length of the spine from T1 down",
    )
    yield missing(
        "equations.reference_subject",
        "Eq 3",
        "deviation of muscle distances from regressions, least",
        "",
        None,
        _NO_ANDERSON,
    )
    yield missing(
        "results.anderson_sample",
        "4.1",
        "persons of Anderson 2012",
        "count",
        float(PAPER["model"]["anderson_sample"]),
        _NO_ANDERSON,
    )


def _stiffness() -> Iterator[Claim]:
    """G6 to G8: one area ratio A cannot give both changes, k_axial = A / h, k_angular = A^2 / h."""
    for check, height_cm in (("G6", 160), ("G7", 190)):
        changes = PAPER["stiffness_of_bmi_25"][str(height_cm)]
        h = height_cm / REFERENCE["height_cm"]
        angular, axial = (float(changes[name]) for name in ("angular", "axial"))
        from_axial = (1.0 + axial / 100.0) * h
        from_angular = sqrt((1.0 + angular / 100.0) * h)
        yield _stiffness_claim(
            f"results.sensitivity_angular_BH{height_cm}",
            "angular",
            height_cm,
            angular,
            tuple(_of_area((1.0 + (axial + e) / 100.0) * h, h)[1] for e in (0.0, *_ENDS)),
            f"{check}: the axial change of {axial:g} % needs {from_axial:.3f} times the area",
        )
        yield _stiffness_claim(
            f"results.sensitivity_axial_BH{height_cm}",
            "axial",
            height_cm,
            axial,
            tuple(_of_area(sqrt((1.0 + (angular + e) / 100.0) * h), h)[0] for e in (0.0, *_ENDS)),
            f"G8: the angular change of {angular:g} % needs {from_angular:.3f} times the area",
        )


_ENDS = (-_HALF_PERCENT, _HALF_PERCENT)


def _of_area(area: float, h: float) -> tuple[float, float]:
    """Changes of axial and angular stiffness, %, by ratios of area and height."""
    return 100.0 * (area / h - 1.0), 100.0 * (area**2 / h - 1.0)


def _stiffness_claim(
    key: str, which: str, height_cm: int, paper: float, ours: tuple[float, ...], reason: str
) -> Claim:
    """A printed change, and what the other printed change implies: its value and ends."""
    value, low, high = ours
    reach = max(value - low, high - value) + _HALF_PERCENT
    return confronted(
        key,
        "2.7, 4.2",
        f"change of {which} stiffness of a man of {height_cm} cm and BMI 25",
        "%",
        paper,
        near(paper, reach, "as far as the rounding of both changes goes"),
        value,
        f"{reason}, and a beam of this height and area changes by {value:.1f} %, not {paper:g} "
        "(k_axial = A / h, k_angular = A^2 / h, h as body height)",
    )


def _loads() -> Iterator[Claim]:
    """G9: loads of which 410 N are 21 % and 72 N are 30 %."""
    for name in ("compression", "shear"):
        percent, newton = float(FIG_9[f"{name}_percent"]), float(FIG_9[f"{name}_n"])
        low, high = (
            100.0 * (newton + 0.5 * way) / (percent - _HALF_PERCENT * way) for way in (-1.0, 1.0)
        )
        yield recomputed(
            f"closed_form.G9.{name}",
            "4.2",
            f"{name} of L4L5 of the lighter of two persons, where they differ most",
            "N",
            None,
            Range(low, high, "what the rounding of both numbers leaves"),
            base_n(name),
            f"G9: {newton:g} N are {percent:g} % of it",
        )


def base_n(name: str) -> float:
    """G9: the load, N, of which a printed difference is a printed share."""
    return 100.0 * float(FIG_9[f"{name}_n"]) / float(FIG_9[f"{name}_percent"])


def _slips() -> Iterator[Claim]:
    """G5, G10, G11 and G16."""
    yield confronted(
        "closed_form.G5",
        "Table 2",
        "number of the equation of least moments",
        "",
        3.0,
        exactly(3.0),
        2.0,
        "G5: the caption of Table 2 names Eq 3, which finds the reference person; moments are in "
        "Eq 2",
    )
    one, other = TABLE_2["A"], TABLE_2["D"]
    differing = sum(one[name] != other[name] for name in ("age_years", "height_m", "mass_kg"))
    yield confronted(
        "closed_form.G10",
        "Table 2, 4.2",
        "parameters in which the two persons differ whose loads differ most",
        "count",
        2.0,
        exactly(2.0),
        float(differing),
        "G10: section 4.2 tells of height and mass; in Table 2 they are of "
        f"{one['age_years']} and {other['age_years']} years as well",
    )
    heights = [float(TABLE_2[key]["height_m"]) for key in "ABCD"]
    for where, (low, high) in FIG_9["heights_m"].items():
        for which, paper, ours in (("least", low, min(heights)), ("largest", high, max(heights))):
            yield confronted(
                f"closed_form.G11.{where}.{which}",
                f"{where}, Table 2",
                f"{which} height of the four persons, as section {where} has it",
                "m",
                float(paper),
                rounded(float(paper), 0.01),
                ours,
                f"G11: {ours:g} m in Table 2",
            )
    yield confronted(
        "closed_form.G16",
        "2.6, Table 1",
        "task 8 and its 5 deg of flexion are from one source",
        YES_NO,
        1.0,
        exactly(1.0),
        0.0,
        "G16: Rajaee 2015 in Table 1, Wilke 2001 in section 2.6: the number of the task may be "
        "another",
    )

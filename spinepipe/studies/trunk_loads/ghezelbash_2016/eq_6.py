"""Pressure in the disc L4L5 by compression and flexion: Eq 6, Fig 4, and what it implies."""

from collections.abc import Iterator

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import (
    PAPER,
    missing,
    near,
    put_in,
    recomputed,
)
from spinepipe.studies.trunk_loads.ghezelbash_2016.product import by_dreischarf, by_eq_6

EQ_6, FIG_4 = PAPER["eq_6"], PAPER["fig_4"]
AREA_MM2 = float(EQ_6["disc_area_mm2"])

_MPA = 1e-6
"""To what the 24 values are held, MPa; they are written down with six decimals."""

_NO_DATA = "the finite element results that Eq 6 was fitted to are not published"
_NO_DISC = "no disc of this study is divided into nucleus and annulus"
_OTHERS = "the disc of another model, which this study does not use"


def claims_of_eq_6() -> Iterator[Claim]:
    """Coefficients, the 24 values of Fig 4, areas, and checks G12 to G15."""
    yield from _coefficients()
    yield from _values()
    yield from _dreischarf()
    yield from _areas()
    yield from _limits()


def _coefficients() -> Iterator[Claim]:
    """Each, as second differences of our function have it: a quadratic has no other terms."""
    h = 0.5
    at = {(p, t): by_eq_6(p * h, t * h) for p in (-1, 0, 1) for t in (-1, 0, 1)}
    found = (
        ("1", "MPa", "constant_mpa", at[0, 0]),
        ("P", "-", "p", (at[1, 0] - at[-1, 0]) / (2.0 * h)),
        ("theta", "MPa/deg", "theta_mpa_per_deg", (at[0, 1] - at[0, -1]) / (2.0 * h)),
        ("P^2", "1/MPa", "p2_per_mpa", (at[1, 0] + at[-1, 0] - 2.0 * at[0, 0]) / (2.0 * h**2)),
        (
            "P*theta",
            "1/deg",
            "p_theta_per_deg",
            (at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1]) / (4.0 * h**2),
        ),
        (
            "theta^2",
            "MPa/deg^2",
            "theta2_mpa_per_deg2",
            (at[0, 1] + at[0, -1] - 2.0 * at[0, 0]) / (2.0 * h**2),
        ),
    )
    for term, unit, name, ours in found:
        paper = float(EQ_6[name])
        allowed = near(paper, 1e-9, "a quadratic's differences are exact but for rounding")
        yield recomputed(
            f"idp.coefficient.{term}", "Eq 6", f"coefficient of {term}", unit, paper, allowed, ours
        )


def _values() -> Iterator[Claim]:
    rows = zip(FIG_4["nominal_pressure_mpa"], FIG_4["compression_n"], FIG_4["idp_mpa"], strict=True)
    for p, newton, values in rows:
        for theta, value in zip(FIG_4["theta_deg"], values, strict=True):
            yield recomputed(
                f"idp.p_{p:g}.theta_{theta:g}",
                "Eq 6, Fig 4",
                f"pressure in L4L5 at nominal pressure {p:g} MPa and flexion {theta:g} deg",
                "MPa",
                float(value),
                near(float(value), _MPA, "six decimals are written down"),
                by_eq_6(float(p), float(theta)),
            )
        for key in (f"idp.p_{p:g}.compression_n", f"closed_form.G15.p_{p:g}"):
            yield recomputed(
                key,
                "Fig 4",
                f"compression of L4L5 at nominal pressure {p:g} MPa",
                "N",
                float(newton),
                near(float(newton), 0.05, "one decimal is written down"),
                float(p) * AREA_MM2,
                f"G15: times {AREA_MM2:g} mm2",
            )


def _dreischarf() -> Iterator[Claim]:
    rows = zip(FIG_4["nominal_pressure_mpa"], FIG_4["idp_dreischarf_mpa"], strict=True)
    for p, value in rows:
        yield recomputed(
            f"idp.p_{p:g}.idp_dreischarf_mpa",
            "Fig 4",
            f"pressure in L4L5 by Dreischarf 2013 at nominal pressure {p:g} MPa",
            "MPa",
            float(value),
            near(float(value), _MPA, "six decimals are written down"),
            by_dreischarf(float(p)),
        )
    yield put_in(
        "equations.idp_dreischarf",
        "Fig 4",
        "nominal pressure over the pressure by Dreischarf 2013, the one farthest from the paper's",
        "ratio",
        float(EQ_6["dreischarf"]),
        _nominal_over_dreischarf,
    )


def _nominal_over_dreischarf(run: Run) -> Ours:
    rows = run.rows("tasks").dropna(subset=["l4l5_pressure_dreischarf_mpa"])
    ratio = (rows["l4l5_nominal_pressure_mpa"] / rows["l4l5_pressure_dreischarf_mpa"]).dropna()
    if ratio.empty:
        raise NotComputed("no task of this run has pressures")
    return Ours(float(ratio.iloc[(ratio - float(EQ_6["dreischarf"])).abs().argmax()]))


def _areas() -> Iterator[Claim]:
    newton, p = FIG_4["compression_n"][-1], FIG_4["nominal_pressure_mpa"][-1]
    yield recomputed(
        "results.idp_disc_area",
        "3.1",
        "area of the disc L4L5 that Eq 6 was fitted with",
        "mm2",
        AREA_MM2,
        near(AREA_MM2, 0.5, "no decimal is printed"),
        float(newton) / float(p),
        "compression over nominal pressure",
    )
    yield recomputed(
        "results.idp_nominal_pressures",
        "Fig 4",
        "largest nominal pressure of Fig 4",
        "MPa",
        float(p),
        near(float(p), 0.005, "two decimals are printed"),
        float(newton) / AREA_MM2,
        "compression over area; the others are rows of their own (idp.p_...)",
    )
    for key, name, unit, why in (
        ("idp_nucleus_area", "nucleus_area_mm2", "mm2", _NO_DISC),
        ("dreischarf_disc_area", "dreischarf_disc_area_mm2", "mm2", _OTHERS),
        ("dreischarf_nucleus_area", "dreischarf_nucleus_area_mm2", "mm2", _OTHERS),
        ("idp_compression_levels", "compression_levels", "count", _NO_DATA),
        ("idp_rotations_per_level", "rotations_per_level", "count", _NO_DATA),
        ("idp_regression_r2", "fit_r2", "r2", _NO_DATA),
        ("idp_regression_rmse", "fit_rmse_mpa", "MPa", _NO_DATA),
    ):
        quantity = key.replace("idp_", "of Eq 6: ", 1).replace("_", " ")
        yield missing(f"results.{key}", "2.10, 3.1, 4.2", quantity, unit, float(EQ_6[name]), why)


def _limits() -> Iterator[Claim]:
    """G12 to G14: not nought without load, not monotone in flexion, higher than Dreischarf's."""
    rmse = float(EQ_6["fit_rmse_mpa"])
    yield recomputed(
        "closed_form.G12",
        "Eq 6",
        "pressure without compression and flexion",
        "MPa",
        0.0,
        Range(-rmse, rmse, "nought to the RMSE of the fit"),
        by_eq_6(0.0, 0.0),
        "G12: the intercept of a fit, a little below nought",
    )
    for p, expected in zip(FIG_4["nominal_pressure_mpa"][1:], (-1.5, 0.8, 3.0), strict=True):
        yield recomputed(
            f"closed_form.G13.p_{p:g}",
            "Eq 6",
            f"flexion of least pressure at nominal pressure {p:g} MPa",
            "deg",
            None,
            near(expected, 0.05, "worked out by hand from the coefficients"),
            _least(float(p)),
            "G13: Eq 6 falls and then rises with flexion",
        )
    p = float(FIG_4["nominal_pressure_mpa"][-1])
    printed = float(FIG_4["idp_mpa"][-1][0] / FIG_4["idp_dreischarf_mpa"][-1])
    yield recomputed(
        "closed_form.G14",
        "Eq 6, Fig 4",
        f"pressure by Eq 6 over that by Dreischarf 2013 at nominal pressure {p:g} MPa, upright",
        "ratio",
        None,
        near(printed, 1e-6, "from six decimals of both"),
        by_eq_6(p, 0.0) / by_dreischarf(p),
        "G14: a derived expectation",
    )


def _least(p: float) -> float:
    """Flexion, deg, of least pressure: the vertex of a parabola through three points."""
    low, middle, high = (by_eq_6(p, theta) for theta in (-5.0, 0.0, 5.0))
    return float(-0.5 * 5.0 * (high - low) / (high + low - 2.0 * middle))

"""Job: whether a person's markers tell the stiffness of a region.

Passive elements of the region are held at so many times the generic size, all else is fitted anew:
motions, all other elements, and how the region's own bend. What the fits cost beside the best of
them is a profile likelihood (Raue 2009). The prior of what is held does not count, else it would
close what markers leave open.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.objective import MotionObjective, SampledTrial
from spinepipe.motion.skeleton import JOINTS
from spinepipe.motion.trajectory import solve
from spinepipe.studies.recordings import motion_digests
from spinepipe.studies.tracking.approaches import (
    calibration_objective,
    first_guess,
    sample_at_nodes,
)
from spinepipe.studies.tracking.persons import person_of
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import LIMIT, PROFILE_POINTS, PROFILES
from spinepipe.studies.tracking.trials import BOTH
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES

REGIONS = {
    "lumbar": slice(JOINTS.index("L5S1"), JOINTS.index("T12L1") + 1),
    "lower_thoracic": slice(JOINTS.index("T11T12"), JOINTS.index("T6T7") + 1),
    "upper_thoracic": slice(JOINTS.index("T5T6"), JOINTS.index("T1T2") + 1),
}
"""Joints whose elements are held together."""

PROFILED = ("extension", "right_bending")

Row = dict[str, Any]


def run(
    root: str,
    study: str,
    specimen: str,
    region: str,
    coordinate: str,
    profiles: str,
    profile_points: str,
) -> None:
    """Write the rows of a region and coordinate, a file for each table."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    made_by = provenance("profile", settings, cohort, [specimen], motion_digests(cohort, specimen))
    known: Row = {"specimen": specimen, "region": region, "coordinate": coordinate}
    ratios = np.array(sorted(settings.profiles.ratios))
    message, coarse = "", settings.model_copy(update={"intervals": settings.profiles.intervals})
    ask = calibration_objective(coarse, person)
    try:
        seen = [sample_at_nodes(coarse, person, one) for one in person.trials if one.kind in BOTH]
        costs = profile_costs(ask, seen, held_parameters(ask, region, coordinate), ratios)
    except (ValueError, np.linalg.LinAlgError) as why:
        costs, message = np.full(len(ratios), np.inf), str(why)
    points = [known | row for row in point_rows(ratios, costs)]
    write(from_rows(PROFILE_POINTS, points), profile_points, made_by)
    write(from_rows(PROFILES, [known | verdict(ratios, costs, message)]), profiles, made_by)


def held_parameters(ask: MotionObjective, region: str, coordinate: str) -> Array:
    """(P,) which parameters are held: the sizes of a region's elements."""
    wanted = np.zeros_like(ask.fitted)
    wanted[REGIONS[region], COORDINATES.index(coordinate)] = True
    sizes = wanted[ask.fitted]
    return np.concatenate([sizes, np.zeros_like(sizes)])


def profile_costs(
    ask: MotionObjective, seen: Sequence[SampledTrial], held: Array, ratios: Array
) -> Array:
    """(R,) least costs, infinite where a fit did not settle.

    Each fit begins where that of the ratio next to it, nearer to 1, ended.
    """
    found = np.full(len(ratios), np.inf)
    middle = int(np.argmin(np.abs(np.log(ratios))))
    known = [first_guess(ask, one) for one in seen]
    seen, begin = [one for one, _ in known], [start for _, start in known]
    first = begin, np.zeros(ask.parameters)
    # from the middle upwards, then from where the middle ended downwards
    for order in (range(middle, len(ratios)), range(middle - 1, -1, -1)):
        starts, parameters = first
        for k in order:
            # parameters are logarithms over the generic elements: those held are the ratio's own
            parameters = np.where(held, np.log(ratios[k]), parameters)
            solved = solve(ask, seen, starts, parameters, held)
            if not solved.status.usable:
                break
            starts, parameters = list(solved.coefficients), solved.parameters
            if k == middle:
                first = starts, parameters
            # the prior of what is held does not count, else it would close what markers leave open
            prior = float(np.sum((parameters[held] / ask.sizes.size) ** 2))
            found[k] = solved.cost - prior
    return found


def point_rows(ratios: Array, costs: Array) -> list[Row]:
    """What each ratio costs over the best."""
    best = float(costs.min())
    return [
        {
            "point": k,
            "ratio": float(ratio),
            "cost_over_best": float(cost) - best if np.isfinite(cost) else None,
        }
        for k, (ratio, cost) in enumerate(zip(ratios, costs, strict=True))
    ]


def verdict(ratios: Array, costs: Array, message: str = "") -> Row:
    """Which ratios are not excluded; an end is open where no ratio beyond it is.

    Where the cost falls to the last ratio that settled, nothing is told at all. Loads of muscles
    are smaller the slacker joints are, so that such a cost speaks of itself, not of the person: on
    made-up persons it shuts the truth out (`tests/validation/results/tracking_profiles.md`).
    """
    settled = np.isfinite(costs)
    if not settled.any():
        return _verdict_row(None, None, None, message or "no fit settled")
    # costs are sums of squares over variance: twice the fall of the log likelihood
    tried, over = ratios[settled], costs[settled] - costs[settled].min()
    best = int(np.argmin(over))
    least = float(tried[best])  # as it was asked for: a reader may look for it among the points
    open_ends = bool(over[0] <= LIMIT), bool(over[-1] <= LIMIT)
    lost = int((~settled).sum())
    text = f"{lost} of {len(ratios)} fits did not settle" if lost else ""
    if best in (0, len(tried) - 1):
        edge = "softest" if best == 0 else "stiffest"
        falls = f"the cost falls to the end of what was tried, the {edge}"
        return _verdict_row(least, None, None, f"{falls}; {text}".strip("; "), open_ends)
    low, high = (_crossing(np.log(tried), over, way) for way in (-1, 1))
    return _verdict_row(least, low, high, text, open_ends)


def _crossing(at: Array, over: Array, way: int) -> float | None:
    """The outermost ratio on a side at which the cost rises past the limit, straight in logs."""
    inside = np.flatnonzero(over <= LIMIT)
    edge = int(inside.max() if way > 0 else inside.min())
    beyond = edge + way
    if not 0 <= beyond < len(at):
        return None
    share = (LIMIT - over[edge]) / (over[beyond] - over[edge])
    return float(np.exp(at[edge] + share * (at[beyond] - at[edge])))


def _verdict_row(
    best: float | None,
    low: float | None,
    high: float | None,
    message: str,
    open_ends: tuple[bool, bool] = (True, True),
) -> Row:
    closed = (low is not None) + (high is not None)
    open_below, open_above = open_ends
    return {
        "best_ratio": best,
        "low": low,
        "high": high,
        "open_below": open_below,
        "open_above": open_above,
        "verdict": ("not_told", "one_sided", "told")[closed],
        "message": message,
    }

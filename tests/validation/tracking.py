"""How far tracked vertebrae are from the true ones, over made-up people that nothing was tuned on.

Two generators, ten seeds each, one person a seed. Beside it the reason: the same persons in the
same motions with one source of error taken away; and the control, joints that resist by the
estimator's own law, tracked with that law and with the generic one.
"""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import read
from spinepipe.motion.passive import PassiveLaw, passive_elements
from spinepipe.motion.skeleton import JOINTS
from spinepipe.motion.trajectory import solve
from spinepipe.progress import Progress
from spinepipe.statistics.outcome import mean_of
from spinepipe.studies.tracking.approaches import (
    calibration_objective,
    find_motion,
    first_guess,
    objective_of,
    sample_at_nodes,
)
from spinepipe.studies.tracking.error_metrics import Truth, errors_of, truths
from spinepipe.studies.tracking.kind import KIND
from spinepipe.studies.tracking.persons import TrackedPerson, person_of, ratios_of
from spinepipe.studies.tracking.profile import (
    PROFILED,
    REGIONS,
    held_parameters,
    profile_costs,
    verdict,
)
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tracked_motions import TrackedMotion
from spinepipe.studies.tracking.trials import BOTH
from spinepipe.units import COORDINATES
from tests.generators.tracking.seen import EXACT, Errors
from tests.generators.tracking.write import Subject, Wanted, write

GENERATORS = ("torques", "muscles")
SEEDS = tuple(range(4001, 4011))
"""Held out: nothing was ever chosen by what these gave."""

FEW = SEEDS[:4]
"""Of which sources of error are taken away."""

INTERVALS = 50
APPROACHES = (
    *("ik", "ik_constrained_white_panjabi_1990", "ik_smooth", "ik_springs"),
    *("optk_zero", "optk_generic", "optk_from_both"),
)
SOURCES = {
    "as made": Errors(),
    "skin does not slide": replace(Errors(), slides_mm=(0.0, 0.0)),
    "markers are where they are told to be": replace(Errors(), placed_mm=0.0),
    "lengths and tilts are told right": replace(Errors(), length=0.0, tilt_deg=0.0),
    "none of these": EXACT,
}
MEASURES = ("centre_mm", "angle_deg", "joint_angle_deg")
SETTINGS = Tracking(study="held", kind="tracking", cohort="held", intervals=INTERVALS)

PROFILED_SEEDS = SEEDS[:2]
RATIOS = np.array([0.05, 0.15, 0.4, 1.0, 2.5, 6.0])
LOAD_NM = 3.0
"""At which the generators tell how stiff joints are."""

Row = dict[str, Any]


@cache
def subject(generator: str, seed: int, plain: bool = False) -> Subject:
    """One person of a seed."""
    return Subject(Wanted(seed, generator, 1, plain, rate_hz=25.0), 0)


class Made:
    """A person as files tell them, read as any cohort is, and the truth."""

    def __init__(self, one: Subject, folder: Path) -> None:
        write(one.wanted, [one], folder)
        self.cohort = read(folder, KIND.forms)
        self.person: TrackedPerson = person_of(self.cohort, one.name, folder)
        self.bones = self.person.skeleton, self.person.centres
        self.truths: dict[str, Truth] = {
            truth.trial: truth for truth in truths(dict(self.cohort.further))
        }
        self.folder = folder

    def calibrated(self) -> PassiveLaw:
        """Passive elements from both motions together."""
        ask = calibration_objective(SETTINGS, self.person)
        trials = [one for one in self.person.trials if one.kind in BOTH]
        known = [first_guess(ask, sample_at_nodes(SETTINGS, self.person, one)) for one in trials]
        law = solve(ask, [seen for seen, _ in known], [start for _, start in known]).law
        assert law is not None
        return law

    def rows(self, approach: Any, law: PassiveLaw | None = None) -> Iterator[Row]:
        """Mean errors in each trial."""
        for trial in self.person.trials:
            if trial.kind == "stance" and approach == "ik_smooth":
                continue
            ask = objective_of(SETTINGS, self.person, approach, law)
            seen = sample_at_nodes(SETTINGS, self.person, trial)
            found = find_motion(approach, ask, seen, ratios_of(self.cohort))
            moved = TrackedMotion("", trial.name, approach, found.watched.grid.times_s, found.q)
            for off in errors_of(moved, self.truths[trial.name], *self.bones):
                if off.known.any():
                    mean = float(off.size[off.known].mean())
                    named = {"motion": trial.kind, "approach": approach, "measure": off.measure}
                    yield {**named, "error": mean, "status": found.status.value}


def table() -> pd.DataFrame:
    """Mean errors with intervals over seeds, by part, generator, motion, approach and measure."""
    rows = pd.DataFrame([*_held_out(), *_sources(), *_control()])
    kept = rows[(rows["motion"] != "stance") | (rows["measure"] != "joint_angle_deg")]
    named = ["part", "generator", "case", "motion", "measure", "approach"]
    found = []
    for key, own in kept.groupby(named, sort=False):
        mean = mean_of(own["error"].to_numpy(float))
        low, high = mean.interval or (np.nan, np.nan)
        found.append(
            {
                **dict(zip(named, key, strict=True)),
                **{"mean": mean.value, "low": low, "high": high, "seeds": mean.n},
                "not_converged": int((own["status"] != "converged").sum()),
            }
        )
    return pd.DataFrame(found)


def _held_out() -> Iterator[Row]:
    for generator, seed in _through(SEEDS, "held-out persons"):
        with tempfile.TemporaryDirectory() as folder:
            made = Made(subject(generator, seed), Path(folder) / "held")
            known = {"part": "held out", "generator": generator, "case": "as made"}
            for approach in APPROACHES:
                law = made.calibrated() if approach == "optk_from_both" else None
                yield from (known | row for row in made.rows(approach, law))


def _through(seeds: Sequence[int], what: str) -> Iterator[tuple[str, int]]:
    """Generators and seeds, saying how far it is."""
    yield from Progress(_say).through(list(product(GENERATORS, seeds)), what)


def _say(line: str) -> None:
    print(line, flush=True)


def _sources() -> Iterator[Row]:
    for generator, seed in _through(FEW, "sources of error"):
        for case, errors in SOURCES.items():
            one = subject(generator, seed).with_errors(errors)
            with tempfile.TemporaryDirectory() as folder:
                made = Made(one, Path(folder) / "held")
                known = {"part": "sources", "generator": "both", "case": case}
                yield from (known | row for row in made.rows("optk_generic"))


def _control() -> Iterator[Row]:
    """Joints that resist by exponentials, with the true ones and with the generic ones."""
    for generator, seed in _through(FEW, "control"):
        with tempfile.TemporaryDirectory() as folder:
            made = Made(subject(generator, seed, plain=True), Path(folder) / "held")
            known = {"part": "control", "generator": "both"}
            for case, law in (("generic law", None), ("true law", _true(made))):
                yield from (known | {"case": case} | row for row in made.rows("optk_generic", law))


def _true(made: Made) -> PassiveLaw:
    """What the control's folder says of how joints resist."""
    rows = pd.read_csv(made.folder / "true_passive.csv")
    rows.index += 2
    elements = passive_elements(rows)
    return PassiveLaw(elements.a, elements.b)


def profiles() -> pd.DataFrame:
    """Whether profiles hold the true stiffness: that of the region where 3 N m resist."""
    found = []
    for generator, seed in _through(PROFILED_SEEDS, "profiles"):
        with tempfile.TemporaryDirectory() as folder:
            made = Made(subject(generator, seed), Path(folder) / "held")
            truth = pd.read_csv(made.folder / "hidden" / "truth.csv")
            for region, coordinate in product(REGIONS, PROFILED):
                known = {"generator": generator, "seed": seed, "region": region}
                row = _profile(made, truth, region, coordinate)
                found.append(known | {"coordinate": coordinate} | row)
    return pd.DataFrame(found)


def _profile(made: Made, truth: pd.DataFrame, region: str, coordinate: str) -> Row:
    coarse = SETTINGS.model_copy(update={"intervals": SETTINGS.profiles.intervals})
    ask = calibration_objective(coarse, made.person)
    seen = [
        sample_at_nodes(coarse, made.person, one) for one in made.person.trials if one.kind in BOTH
    ]
    costs = profile_costs(ask, seen, held_parameters(ask, region, coordinate), RATIOS)
    told, settled = verdict(RATIOS, costs), np.isfinite(costs)
    ratio = _true_ratio(made, truth, region, coordinate)
    at, over = np.log(RATIOS[settled]), costs[settled] - costs[settled].min()
    ends = ("low", "high")
    inside = (told["low"] or 0.0) <= ratio <= (told["high"] or np.inf)
    closed = any(told[end] is not None for end in ends)
    return {
        **{name: "open" if told[name] is None else float(told[name]) for name in ends},
        **{"best_ratio": told["best_ratio"], "verdict": told["verdict"], "true_ratio": ratio},
        "cost_of_truth_over_best": float(np.interp(np.log(ratio), at, over)),
        "holds": str(inside) if closed else "no end is closed",
    }


def _true_ratio(made: Made, truth: pd.DataFrame, region: str, coordinate: str) -> float:
    """Geometric mean over joints and sides of true over generic stiffness where 3 N m resist."""
    generic = PassiveLaw(made.person.passive.a, made.person.passive.b)
    usual = generic.stiffness_at(np.full(generic.a.shape, LOAD_NM))
    own = truth[truth["coordinate"] == coordinate]
    logs = []
    for row in own[own["joint"].isin(JOINTS[REGIONS[region]])].to_dict("records"):
        side = 0 if row["side"] == "positive" else 1
        at = JOINTS.index(row["joint"]), COORDINATES.index(coordinate), side
        logs.append(np.log(row["at_3_nm_nm_per_rad"] / usual[at]))
    return float(np.exp(np.mean(logs)))

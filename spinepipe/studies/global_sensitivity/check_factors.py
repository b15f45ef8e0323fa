"""Is what each factor changes there in the cohort, and does changing it do anything?"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.cohort.read_yaml import Document
from spinepipe.cohort.varied.change import Change, Of
from spinepipe.problems import Problem
from spinepipe.studies.check_landmark_factors import check_landmark
from spinepipe.studies.global_sensitivity import GlobalSensitivity
from spinepipe.studies.places import at, unknown_names

__all__ = ["check_factors"]

_FORCES = ["fx_n", "fy_n", "fz_n"]
_MOMENTS = ["mx_nm", "my_nm", "mz_nm"]


def check_factors(
    document: Document, study: GlobalSensitivity, cohort: Cohort
) -> Iterator[Problem]:
    """Problems of all factors, in their order."""
    specimens = [s for s in study.chosen_specimens(cohort) if s in cohort.specimen_names]
    for number, factor in enumerate(study.factors):
        change, key = factor.change, f"factors.{number}"
        if change.of is Of.LANDMARK:
            yield from check_landmark(document, key, change, cohort, specimens)
        elif change.of in _CHECKS:
            yield from _CHECKS[change.of](document, key, change, cohort, study, specimens)


def _joints(
    document: Document, key: str, change: Change, cohort: Cohort, *_: Any
) -> Iterator[Problem]:
    yield from unknown_names(document, f"{key}.joints", "joint", change.at, cohort.joint_names)


def _bodies(
    document: Document,
    key: str,
    change: Change,
    cohort: Cohort,
    study: GlobalSensitivity,
    specimens: Sequence[str],
) -> Iterator[Problem]:
    """Bodies must be vertebrae that move, listed, and felt: in equilibrium only weight is."""
    moving, place = cohort.vertebrae[1:], f"{key}.vertebrae"
    yield from unknown_names(document, place, "moving vertebra", change.at, moving)
    if cohort.bodies is None:
        found = f"{change.of.value} in cohort '{cohort.name}', which has no bodies.csv"
        allowed = "factors of bodies in a cohort that lists them"
        yield Problem(*at(document, key), found, allowed, "delete the factor, or add bodies.csv")
        return
    if not cohort.gravity:
        found = f"{change.of.value} in cohort '{cohort.name}' without gravity: it would do nothing"
        allowed = "factors of bodies where gravity is true: in equilibrium bodies only weigh"
        yield Problem(*at(document, key), found, allowed, "delete the factor")
    rows = zip(cohort.bodies["specimen"], cohort.bodies["vertebra"], strict=True)
    listed = set(rows)
    asked = [name for name in change.at or moving if name in moving]
    missing = [f"{v} of {s}" for s in specimens for v in asked if (s, v) not in listed]
    if missing:
        found = f"no body in bodies.csv for {', '.join(missing[:5])}"
        allowed = "bodies that the cohort lists, of all chosen specimens"
        yield Problem(*at(document, place), found, allowed, "leave them out, or add their bodies")


def _loads(
    document: Document,
    key: str,
    change: Change,
    cohort: Cohort,
    study: GlobalSensitivity,
    specimens: Sequence[str],
) -> Iterator[Problem]:
    """Something must act: a point matters to forces, direction and size to moments as well."""
    if cohort.loads is None:
        return
    columns = _FORCES if change.of is Of.LOAD_POINT else [*_FORCES, *_MOMENTS]
    chosen = cohort.loads["test"].isin(study.chosen_tests(cohort))
    chosen &= cohort.loads["specimen"].isin([*specimens, "*"])
    if chosen.any() and not cohort.loads.loc[chosen, columns].any(axis=None):
        what = "force" if change.of is Of.LOAD_POINT else "load"
        found = f"{change.of.value}, but no {what} acts in any chosen test: it would do nothing"
        allowed = f"{change.of.value} in tests with a {what}"
        yield Problem(
            *at(document, key), found, allowed, "delete the factor, or choose other tests"
        )


_CHECKS: dict[Of, Callable[..., Iterator[Problem]]] = {
    Of.STIFFNESS: _joints,
    Of.JOINT_CENTRE: _joints,
    Of.JOINT_AXES: _joints,
    Of.MASS: _bodies,
    Of.CENTRE_OF_MASS: _bodies,
    Of.LOAD_POINT: _loads,
    Of.LOAD_DIRECTION: _loads,
    Of.LOAD_SIZE: _loads,
}
"""What is demanded of the cohort; damping is always there."""

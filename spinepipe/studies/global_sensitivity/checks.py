"""Is the design of a global sensitivity study one that can be drawn, with distinct names?"""

from collections.abc import Iterator
from math import log2

from spinepipe.cohort.read_yaml import Document
from spinepipe.problems import Problem, one_of
from spinepipe.studies.global_sensitivity import DUMMY, INDICES, GlobalSensitivity
from spinepipe.studies.places import at

__all__ = ["check_sensitivity_design"]

TAKE_GROUPS = ("sobol", "morris")
FEWEST = 2


def check_sensitivity_design(document: Document, study: GlobalSensitivity) -> Iterator[Problem]:
    """Everything about names, groups and numbers that a method cannot do with."""
    yield from _samples(document, study)
    yield from _indices(document, study)
    yield from _names(document, study)
    yield from _groups(document, study)
    compared = [name for name in study.compared if name != DUMMY]
    if len(compared) < FEWEST:
        what = f"{len(study.factors)} factors, compared as {len(compared)}"
        allowed = f"at least {FEWEST} factors or groups: one alone has nothing to be compared with"
        yield Problem(*at(document, "factors"), what, allowed, "add factors, or split the group")


def _samples(document: Document, study: GlobalSensitivity) -> Iterator[Problem]:
    """Numbers that the methods ask for."""
    design = study.design
    n, place = design.samples, at(document, "design.samples")
    if design.method == "sobol" and n & (n - 1):
        below = 2 ** int(log2(n))
        remedy = f"take {below} or {2 * below}"
        yield Problem(*place, str(n), "a power of two with method sobol", remedy)
    others = max(1, len(study.factor_names) - 1)
    fewest = 4 * design.harmonics**2 * others + 1  # for each factor a frequency of its own
    if design.method == "fast" and n < fewest:
        count = f"{design.harmonics} harmonics and {others + 1} factors"
        allowed = f"at least {fewest} with method fast, {count}"
        yield Problem(*place, str(n), allowed, "take more samples, or fewer harmonics")
    if design.method == "morris" and design.levels % 2:
        allowed = "an even number: steps of half the levels must stay on the grid"
        levels = str(design.levels)
        yield Problem(*at(document, "design.levels"), levels, allowed, "take one more or one less")


def _indices(document: Document, study: GlobalSensitivity) -> Iterator[Problem]:
    """Each method has indices of its own."""
    there = INDICES[study.design.method]
    for number, index in enumerate(study.indices or ()):
        if index not in there:
            place = at(document, f"indices.{number}")
            allowed = f"with method {study.design.method}: {one_of(there)}"
            yield Problem(*place, index, allowed, "delete it, or choose another method")


def _names(document: Document, study: GlobalSensitivity) -> Iterator[Problem]:
    """Factors are told apart by their names."""
    seen: dict[str, int] = {}
    for number, factor in enumerate(study.factors):
        name = factor.label
        key = f"factors.{number}.name" if factor.name else f"factors.{number}"
        if name == DUMMY and study.dummy:
            allowed = f"any other name: '{DUMMY}' is the factor that changes nothing"
            yield Problem(*at(document, key), f"'{name}'", allowed, "rename it")
        if name in seen:
            found = f"'{name}', the name of factor {seen[name] + 1} as well"
            remedy = "delete one, or give one a `name:` of its own"
            yield Problem(*at(document, key), found, "each name once", remedy)
        seen.setdefault(name, number)


def _groups(document: Document, study: GlobalSensitivity) -> Iterator[Problem]:
    """Groups are told apart from factors, and only some methods have indices of groups."""
    labels = [*(factor.label for factor in study.factors), *([DUMMY] if study.dummy else [])]
    for number, factor in enumerate(study.factors):
        if factor.group is None:
            continue
        place = at(document, f"factors.{number}.group")
        if factor.group in labels:
            allowed = "a name that no factor has"
            yield Problem(*place, f"'{factor.group}'", allowed, "rename the group")
        if study.design.method not in TAKE_GROUPS:
            found = f"'{factor.group}' with method {study.design.method}"
            allowed = f"no group, or method {one_of(TAKE_GROUPS)}"
            yield Problem(*place, found, allowed, "delete the group, or choose another method")

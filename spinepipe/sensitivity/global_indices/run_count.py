"""How many runs a design takes, and what is wrong with one, before anything is drawn."""

from collections.abc import Sequence

from spinepipe.sensitivity.global_indices.design import Method


def run_count(method: str, inputs: int, samples: int, second_order: bool = True) -> int:
    """Number of runs of a design.

    Parameters
    ----------
    inputs : number of groups, a factor without one counting as a group, the dummy included.
    samples : see `Design`.
    second_order : of Sobol only.
    """
    per_sample = {
        Method.SOBOL: (2 if second_order else 1) * inputs + 2,
        Method.LATIN_HYPERCUBE: 1,
        Method.MORRIS: inputs + 1,
        Method.FAST: inputs,
    }
    return samples * per_sample[Method(method)]


def design_problems(
    method: str,
    factors: Sequence[str],
    groups: Sequence[str | None],
    samples: int,
    levels: int = 4,
    harmonics: int = 4,
) -> list[str]:
    """All that stands against a design, in plain words; empty where it can be drawn."""
    found = _names(factors, groups)
    if len(groups) == len(factors) and any(group is not None for group in groups):
        found += _groups(Method(method))
    if Method(method) is Method.FAST:
        return found + _fast_samples(len(factors), samples, harmonics)
    return found + _samples(Method(method), samples, levels)


def _names(factors: Sequence[str], groups: Sequence[str | None]) -> list[str]:
    found = [] if factors else ["a design needs at least one factor"]
    if len(set(factors)) != len(factors):
        twice = sorted({name for name in factors if list(factors).count(name) > 1})
        found.append(f"factors of the same name: {', '.join(twice)}")
    if len(groups) != len(factors):
        found.append(f"{len(factors)} factors but {len(groups)} groups (None for a factor alone)")
    alone = {name for name, group in zip(factors, groups, strict=False) if group is None}
    found += [f"group {name!r} is also a factor" for name in sorted(alone & set(groups) - {None})]
    return found


def _groups(method: Method) -> list[str]:
    """Methods that look at one factor at a time have nothing to say of a group.

    SALib's Latin hypercube gives all factors of a group the same share (rank correlation 1), so
    that opposite effects cancel; its FAST knows no groups.
    """
    if method in (Method.SOBOL, Method.MORRIS):
        return []
    return [f"{method.value} has no indices of groups: leave groups out, or use sobol or morris"]


def _samples(method: Method, samples: int, levels: int) -> list[str]:
    if method is Method.SOBOL and (samples < 2 or samples & (samples - 1)):
        return [f"sobol needs a power of two as samples (balance of the sequence), found {samples}"]
    if method is Method.MORRIS and (levels < 2 or levels % 2):
        return [f"morris needs an even number of levels, found {levels}"]
    return [] if samples >= 2 else [f"at least 2 samples are needed, found {samples}"]


def _fast_samples(factors: int, samples: int, harmonics: int) -> list[str]:
    """With fewer samples SALib lets two other factors share a frequency; they then move as one."""
    least = 4 * harmonics**2 * max(1, factors - 1) + 1
    if harmonics >= 1 and samples >= least:
        return []
    return [
        f"fast with {harmonics} harmonics and {factors} factors needs at least {least} samples per "
        f"curve, for each factor its own frequency, found {samples}"
    ]

"""Motion that follows from the moment and the published stiffness."""

from collections.abc import Callable, Iterator
from math import degrees

from spinepipe.comparison.claim import Claim, Ours, Verdict
from spinepipe.comparison.gould_2024b.paper import (
    JOINTS,
    LOADED,
    LOWER_FIVE,
    MODELS,
    MOMENT_NM,
    TESTS,
    of_level,
    uniform,
)
from spinepipe.comparison.gould_2024b.rows_of import errors, predicted
from spinepipe.comparison.ranges import Range
from spinepipe.comparison.run import Run

WHERE = "Table 2"
OVER_PREDICTED = ("left_lateral_bending", "flexion")
_REACH = 0.1
_TURNED = (
    "the formula leaves out weight, whose arm grows as the column bends (the phantom's T12 carries "
    "a pot of 1 kg): without it the same model is within 3 % of the formula"
)


def claims() -> Iterator[Claim]:
    """Closed forms beside the predictions of our model."""
    for test in TESTS:
        angle = by_uniform(test)
        yield _run(f"uniform.{test}", test, "B2", angle, MODELS[0], JOINTS)
    for test in OVER_PREDICTED:
        yield _run(
            f"levels.{test}", test, "B3", mean_of_levels(test, LOWER_FIVE), MODELS[1], LOWER_FIVE
        )
    bending = "left_lateral_bending"
    one = ("L3L4",)
    yield _run(
        f"levels.{bending}.L3L4", bending, "B3", mean_of_levels(bending, one), MODELS[1], one
    )
    yield _levels_over_uniform(bending)


def by_uniform(test: str) -> float:
    """Rotation of any joint by the stiffness that all joints share, deg."""
    return degrees(MOMENT_NM / uniform(LOADED[test]))


def mean_of_levels(test: str, joints: tuple[str, ...]) -> float:
    """Mean rotation of joints by their published stiffness, deg."""
    angles = [degrees(MOMENT_NM / of_level(joint, LOADED[test])) for joint in joints]
    return sum(angles) / len(angles)


def near(value: float, of: str) -> Range:
    """A closed form with the reach of what it leaves out."""
    what = f"{of}, with {100.0 * _REACH:g} % either way, chosen here, for tilt and coupled moments"
    return Range(value * (1.0 - _REACH), value * (1.0 + _REACH), what)


def _run(
    key: str, test: str, check: str, angle: float, model: str, joints: tuple[str, ...]
) -> Claim:
    place = joints[0] if len(joints) == 1 else f"{joints[0]} to {joints[-1]}"
    return Claim(
        f"closed_form.literature_rotation.{key}", WHERE,
        f"mean {LOADED[test]} of {place} at {MOMENT_NM:g} N m with published stiffness, {model}",
        "deg", None, near(angle, f"{check}: moment over stiffness is {angle:.1f} deg"),
        _mean_rotation(model, test, joints), _TURNED, "ours: predicted motion of the whole model",
        evidence=Verdict.RECOMPUTED,
    )  # fmt: skip


def _mean_rotation(model: str, test: str, joints: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        seen = errors(run, model, "literature", test)
        sizes = predicted(seen[seen["joint"].isin(joints)])
        return Ours(float(sizes.mean()), float(sizes.min()), float(sizes.max()))

    return ours


def _levels_over_uniform(test: str) -> Claim:
    def ours(run: Run) -> Ours:
        uniform_set, levels = (_mean_rotation(m, test, LOWER_FIVE)(run).value for m in MODELS)
        return Ours(levels / uniform_set)

    ratio = mean_of_levels(test, LOWER_FIVE) / by_uniform(test)
    return Claim(
        f"closed_form.literature_rotation.levels_over_uniform.{test}", WHERE,
        f"mean {LOADED[test]} predicted by published level_ratio in that by per_specimen",
        "ratio", None, near(ratio, f"B3: the closed forms have {ratio:.2f}"), ours, _TURNED,
        evidence=Verdict.RECOMPUTED,
    )  # fmt: skip

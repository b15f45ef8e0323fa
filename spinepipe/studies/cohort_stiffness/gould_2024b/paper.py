"""Gould et al. 2024b as the comparison reads it: its numbers, its loads and models."""

from spinepipe.anatomy import published

PAPER = published("gould_2024b")
COUNTS = PAPER["counts"]
SPECIMENS = int(COUNTS["specimens"])
P_BELOW = float(PAPER["significance"]["p_below"])
MOMENT_NM = float(PAPER["load"]["largest_moment_nm"])

TESTS = ("left_lateral_bending", "left_axial_rotation", "flexion")
"""Load cases in the order of the paper."""

LOAD = dict(zip(TESTS, ("lateral bending", "axial rotation", "flexion"), strict=True))
LOADED = {test: str(PAPER["loaded_coordinate"][test]) for test in TESTS}
"""The coordinate that a load case drives, and whose error is reported."""

COORDINATES = ("right_bending", "left_rotation", "extension")
"""Rotations in the order of the paper's tables."""

JOINTS = tuple(name for name in PAPER["level_stiffness"] if name != "where")
LOWER_FIVE = JOINTS[1:]
"""The five levels that the paper's numbers point to (B5)."""

LITERATURE = {"per_specimen": "literature", "level_ratio": "literature_levels"}
"""The paper's two models, and what each is before it is fitted."""

MODELS = tuple(LITERATURE)
STAGES = ("literature", "fitted", "left_out_specimen")

PHANTOM = (
    "the paper's motion is not published; ours is that of a phantom with linear stiffness, whose "
    "geometry, levels, coupled moments and noise are assumed (docs/decisions/0006)"
)
PUT_IN = (
    "the phantom's specimen factors were drawn with the median and spread that Table 3 has in the "
    "loaded coordinate"
)
NOT_BY_SPECIMEN = (
    "compared as a distribution: the phantom's specimens are not those of the paper, so that no "
    "specimen stands beside its namesake"
)


def not_converged(model: str, test: str) -> tuple[str, ...]:
    """Specimens of the paper whose fit did not end."""
    return tuple(PAPER["not_converged"].get(model, {}).get(test, ()))


def uniform(name: str) -> float:
    """Published stiffness of all joints, N m/rad."""
    return float(PAPER["uniform_stiffness"][f"{name}_nm_per_rad"])


def of_level(joint: str, name: str) -> float:
    """Published stiffness of one joint, N m/rad."""
    return float(PAPER["level_stiffness"][joint][f"{name}_nm_per_rad"])


def table_3(test: str, name: str) -> dict[str, float]:
    """Fitted stiffness of the specimens whose fit ended, N m/rad."""
    printed = PAPER["fitted_stiffness_nm_per_rad"][test][name]
    return {specimen: float(value) for specimen, value in printed.items()}


def spread(test: str, name: str) -> float:
    """Largest less smallest value of one row of Table 3, N m/rad."""
    values = table_3(test, name).values()
    return max(values) - min(values)


def table_4(model: str, test: str, stage: str, what: str) -> float:
    """One cell of Table 4."""
    return float(PAPER["mae"][model][test][stage][what])

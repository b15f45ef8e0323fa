"""The paper that asked what joint-pose studies ask, and the cohort rebuilt from it."""

from spinepipe.anatomy.published import Reproduction

GOULD_2024A = Reproduction("gould_2024a", "palanca_l1l4", "Gould et al. 2024")


def stiffness_quartiles(cohort: str, column: str) -> tuple[float, float, float] | None:
    """Lower quartile, median and upper quartile over the paper's reduced poses, where it has them.

    Parameters
    ----------
    cohort : only beside that of the paper. column : of a stiffness, see `STIFFNESS_COLUMNS`.
    """
    paper = GOULD_2024A.beside(cohort)
    if paper is None or column not in paper[1]["reduced_stiffness"]["median"]:
        return None
    reduced = paper[1]["reduced_stiffness"]
    low, middle, high = (reduced[at][column] for at in ("quartile_25", "median", "quartile_75"))
    return low, middle, high

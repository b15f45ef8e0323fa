"""The pictures of README and tutorial: copies of figures that a plain run makes, no others."""

from collections.abc import Mapping
from pathlib import Path

from spinepipe.files import appearing

FOLDER = Path("docs") / "figures"

PICTURES: Mapping[str, str] = {
    "stiffness.png": "results/l1l4_joint_pose/figures/stiffness.png",
    "missing_effect.png": "results/stiffening_spines/discrepancy/figures/gap_by_step.png",
    "factor_indices.png": "results/l1l4_factors/figures/factor_indices.png",
}
"""Names in `docs/figures`, and the result of which each is a copy."""


def renewed(root: Path) -> dict[str, bool]:
    """Copy the results that are there; by picture, whether its result was.

    Parameters
    ----------
    root : folder of the Snakefile.
    """
    found = {}
    for name, result in PICTURES.items():
        found[name] = (root / result).is_file()
        if found[name]:
            with appearing(root / FOLDER / name) as temporary:
                temporary.write_bytes((root / result).read_bytes())
    return found

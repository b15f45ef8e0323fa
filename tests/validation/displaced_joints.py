"""How often regions of stiffness cover the truth where joints are not where they are stated.

Run ``PYTHONPATH=.:tests/cases python -m tests.validation.displaced_joints [PHANTOMS [PRIOR]]``;
PRIOR is the SD in mm and deg that the fits are told, the truth is 3 mm and 3 degrees.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from displaced_cases import ROTATIONS, cohort, drawn, true_values

SD_MM, SD_DEG = 3.0, 3.0
REPRESENTATIONS = ("per_joint", "per_joint_nuisance")
STUDY = f"representations: [{', '.join(REPRESENTATIONS)}]\nstarts: 1\n"


@dataclass(frozen=True)
class Coverage:
    """Of one representation; N regions.

    Attributes
    ----------
    covered : (N,) whether the truth lies in the region. coordinate : (N,) of which stiffness.
    log_error : (N,) of the stiffness. scatter : root mean square over phantoms.
    """

    covered: np.ndarray
    coordinate: np.ndarray
    log_error: np.ndarray
    scatter: float

    def of(self, coordinate: str) -> float:
        """Share of the regions of a coordinate that cover the truth."""
        return float(self.covered[self.coordinate == coordinate].mean())


def coverage(phantoms: int, prior: float = SD_MM, seed: int = 7) -> dict[str, Coverage]:
    """Of phantoms whose centres and axes are off by draws.

    Parameters
    ----------
    prior : SD that the study says, mm and deg.
    """
    study = STUDY + f"nuisance: {{centre_mm: {prior}, axes_deg: {prior}}}\n"
    rng = np.random.default_rng(seed)
    specimens = {f"s{number:02d}": drawn(rng, SD_MM, SD_DEG) for number in range(phantoms)}
    with TemporaryDirectory() as folder:
        project = cohort(specimens, study).write(Path(folder))
        found = {}
        for name in REPRESENTATIONS:
            parts, scatters = [], []
            for specimen, one in specimens.items():
                fitted = project.fit(specimen, name)
                rows = fitted["stiffness"]
                true, k = true_values(one, rows), rows["stiffness"].to_numpy(float)
                low = rows["low"].astype(float).fillna(0.0).to_numpy()
                high = rows["high"].astype(float).fillna(np.inf).to_numpy()
                inside = (low <= true) & (true <= high)
                parts.append((inside, rows["coordinate"].to_numpy(str), np.log(k / true)))
                scatters.append(fitted["fits"]["scatter"].item())
            columns = [np.concatenate(one) for one in zip(*parts, strict=True)]
            found[name] = Coverage(*columns, float(np.sqrt(np.mean(np.square(scatters)))))
    return found


def main(phantoms: int = 40, prior: float = SD_MM) -> None:
    """Print what `docs/studies/cohort_stiffness.md` states."""
    for name, one in coverage(phantoms, prior).items():
        print(f"{name}: {one.covered.sum()} of {len(one.covered)}, scatter {one.scatter:.2f}")
        for coordinate in ROTATIONS:
            size = np.sqrt(np.mean(one.log_error[one.coordinate == coordinate] ** 2))
            print(f"  {coordinate}: {one.of(coordinate):.0%} covered, error {size:.1%}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]), *map(float, sys.argv[2:3]))

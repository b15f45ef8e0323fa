"""Three small cohorts that show what a discrepancy study says: a missing effect, none, and one
that it does not know. ``python -m tests.generators.missing_effects`` writes them again.

The data are made by `tests.generators.hidden` (OpenSim and numpy laws, nothing of spinepipe).
"""

from dataclasses import replace
from pathlib import Path

from tests.generators.hidden import Hidden, Recipe, draw_hidden, make

COHORTS = Path(__file__).resolve().parents[2] / "config" / "cohorts"

SMALL = Recipe(seed=2026)

RECIPES = {
    "stiffening_spines": replace(
        SMALL,
        gap=1.0,
        hidden=(Hidden("nonlinear_stiffening", "extension", shape={"formula": "tangent"}),),
    ),
    "linear_spines": SMALL,
    "cross_coupled_spines": replace(
        SMALL, gap=1.0, hidden=(draw_hidden("quadratic_cross_coupling", SMALL),)
    ),
}
"""Name of each cohort and how it was made."""

if __name__ == "__main__":
    for name, recipe in RECIPES.items():
        print(name, make(recipe, COHORTS / name).gap)

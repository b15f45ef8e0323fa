"""Cohorts with a hidden truth, for scoring what a search for missing effects finds.

Interface
---------
``make(recipe, folder) -> Truth`` writes a cohort folder and truth.json in it (never read by
studies). ``Recipe`` says what is wanted (plain values; ``recipe.as_dict()`` and ``recipe_from``
go to and from JSON). ``draw_hidden(name, recipe, number=0, **given)`` draws coordinate, scope
and shape of one effect by the recipe's seed; ``KNOWN`` are the names of the vocabulary,
``UNKNOWN`` the effects outside it. Dirt: ``DIRT`` (names), ``USUAL`` (sizes). Mistakes in the
files: ``ERRORS`` (names) and ``LOAD_UNIT``.

    recipe = Recipe(seed=7, gap=0.5, unloading=True)
    recipe = replace(recipe, hidden=(draw_hidden("hysteresis", recipe),))
    truth = make(recipe, folder)

Designs: the defaults are the small one (3 specimens x 3 sweeps of 0, +1/3 .. +1, -1/3 .. -1 of
7.5 N m); ``unloading=True`` makes it 13 steps; ``preload_n=200`` repeats every test under a
preload (400 brings soft spines near buckling); ``joints`` and ``lowest`` cut a short specimen out
of a ``region``; ``design="shear"`` pushes the upper vertebra forth and back with ``peak_n``, read
as ``only=("anterior",)``; the full one is ``Recipe(seed, n_specimens=6, design="directions",
steps=10, unloading=True)``.

Formulas: each effect has several (`Entry.formulas`), the library's own (SAME) and others of the
same physics (OTHER), judged by the formula as it is written. ``draw_hidden(..., other=True)`` draws
one that the library does not have, `is_other` tells.

A gap that no plausible strength reaches (a hysteresis of 4 N m in a stiff axial rotation, a
preload effect without preloads) ends at the largest strength: see ``reached`` and ``gap``, and
pool scores by the gap achieved. `NoEquilibriumError` means dirt or the second effect made a
spine buckle: take another seed.

truth.json: ``recipe`` (with the strengths used), ``effects`` (name, kind, known, scope,
parameters in SI and border units, gap alone, whether the wanted gap was reached), ``gap`` of all
effects together, ``stiffness`` (P, 6), ``errors``.

Mechanics: poses and Jacobians of the rigid spine in closed form (`rigid.py`, held against
OpenSim by a test), every law and load a small numpy function of this package, Newton (`solve.py`)
finds the static poses. Nothing here knows spinepipe. The gap is defined in `gap.py`.
"""

from .catalogue import CATALOGUE, KNOWN, UNKNOWN, draw_hidden, is_other
from .dirt import DIRT, USUAL
from .errors import ERRORS, LOAD_UNIT
from .make import Truth, draw, make
from .recipe import Hidden, Recipe, recipe_from
from .solve import NoEquilibriumError

__all__ = [
    "CATALOGUE",
    "DIRT",
    "ERRORS",
    "KNOWN",
    "LOAD_UNIT",
    "UNKNOWN",
    "USUAL",
    "Hidden",
    "NoEquilibriumError",
    "Recipe",
    "Truth",
    "draw",
    "draw_hidden",
    "is_other",
    "make",
    "recipe_from",
]

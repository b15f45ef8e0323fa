"""Made-up people with markers on their backs, moved by a physics engine of others (MuJoCo).

``python -m tests.generators.tracking --seed 1 --generator torques --subjects 10 --out FOLDER``.
Nothing of spinepipe is used, neither code nor formulas: joints resist by drawn curves, and bodies
are moved by torques of a controller or by muscles that span several joints.
"""

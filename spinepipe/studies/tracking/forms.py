"""The forms of files that a study of tracked motions reads, as `forms.yaml` declares them."""

from pathlib import Path

from spinepipe.documents.form import read_forms

STANCE = "stance"
MOVING = ("flexion_extension", "lateral_bending", "axial_rotation")
"""Kinds of trials that move, in the order of the rotation that they are about."""

FORMS = tuple(read_forms(Path(__file__).with_name("forms.yaml")).values())
TRIALS, MARKER_SET, PASSIVE, RATIOS, BOUNDS, CENTRES, TRUTH_CENTRES = FORMS

"""Mass, centre of mass and inertia of one vertebra with what stays on it in the laboratory.

All of it is assumed: docs/decisions/0006-t12s1-phantom.md. mm in, SI out, rounded as in bodies.csv.
"""

import numpy as np

CENTRE_BEHIND = 0.3
"""Share of the body depth by which the posterior elements draw the centre of mass backwards."""
SEGMENT_PER_BODY_VOLUME = 2.5
"""Vertebra with posterior elements, disc and ligaments, in volumes of its cylindrical body."""
DENSITY_KG_PER_MM3 = 1.14e-6
"""Bone as in Gould et al. 2024a (doi 10.3389/fbioe.2024.1304334); used for soft tissue too."""
POT_MASS_KG = 1.0
"""T12's pot, as in Gould et al. 2024a."""
POT_DEPTH_WIDTH_HEIGHT_MM = (100.0, 100.0, 50.0)
POT_ABOVE_MM = 20.0
"""Centre of the pot above T12's superior endplate."""


def body(marks, axes, size):
    """Mass kg, centre (3,) m and inertia (3, 3) kg m2 of one segment.

    Parameters
    ----------
    marks : its landmarks, mm. axes : (3, 3) its axes in ground. size : depth, width, height, mm.
    """
    return _as_written(*_segment(marks, axes, size))


def potted_body(marks, axes, size):
    """The same for a segment that carries the pot."""
    mass, centre, inertia = _segment(marks, axes, size)
    pot = marks["superior_endplate_centre"] + [0.0, POT_ABOVE_MM, 0.0]
    inertia = inertia + _elliptic_cylinder(POT_MASS_KG, *POT_DEPTH_WIDTH_HEIGHT_MM)
    inertia += _two_points(mass, POT_MASS_KG, pot - centre)
    total = mass + POT_MASS_KG
    return _as_written(total, (mass * centre + POT_MASS_KG * pot) / total, inertia)


def _segment(marks, axes, size):
    depth, width, height = size
    mass = SEGMENT_PER_BODY_VOLUME * DENSITY_KG_PER_MM3 * np.pi / 4.0 * depth * width * height
    middle = (marks["superior_endplate_centre"] + marks["inferior_endplate_centre"]) / 2.0
    centre = middle - CENTRE_BEHIND * depth * axes[:, 0]
    return mass, centre, axes @ _elliptic_cylinder(mass, *size) @ axes.T


def _as_written(mass, centre_mm, inertia):
    cells = np.array([[float(f"{cell:.6e}") for cell in row] for row in inertia])
    upper = np.triu(cells)
    return np.round(mass, 6), np.round(centre_mm, 6) / 1000.0, upper + np.triu(upper, 1).T


def _elliptic_cylinder(mass, depth_mm, width_mm, height_mm):
    """(3, 3) kg m2 of a solid elliptic cylinder standing along y."""
    a, c, h = np.array([depth_mm / 2.0, width_mm / 2.0, height_mm]) / 1000.0
    moments = [(3 * c**2 + h**2) / 12, (a**2 + c**2) / 4, (3 * a**2 + h**2) / 12]
    return mass * np.diag(moments)


def _two_points(first_kg, second_kg, apart_mm):
    """(3, 3) kg m2 of two points about their common centre of mass (parallel axes)."""
    arm = apart_mm / 1000.0
    reduced = first_kg * second_kg / (first_kg + second_kg)
    return reduced * (arm @ arm * np.eye(3) - np.outer(arm, arm))

"""A small made-up trunk: a curved line of vertebrae and a handful of fascicles."""

import numpy as np

from spinepipe.muscles.trunk import BODIES, NO_BODY, Muscles, Trunk

HEIGHT_STEP_M = 0.03


def made_up_trunk() -> Trunk:
    """Seventeen vertebrae 3 cm apart above L5S1, leaning as a parabola; five fascicles."""
    up = HEIGHT_STEP_M * np.arange(17, 0, -1)
    ahead = 0.02 - 0.3 * (up - 0.2) ** 2
    vertebrae = np.column_stack([ahead, up, 0.001 * np.sin(9 * up)])
    above = np.array([-0.004, 0.5 * HEIGHT_STEP_M, 0.0])
    joints = np.vstack([np.zeros(3), vertebrae[:-7:-1] + above])
    return Trunk(
        source="made up",
        joints=joints,
        disc_tilt=np.linspace(-0.4, 0.2, 7),
        disc_height=np.linspace(0.013, 0.007, 7),
        disc_area=np.linspace(1.5e-3, 1.0e-3, 7),
        vertebrae=vertebrae,
        head=np.array([0.03, 0.68, 0.0]),
        shoulders=np.array([[0.0, 0.46, 0.18], [0.0, 0.46, -0.18]]),
        arm_length=0.65,
        sheath=np.array([[[0.10, 0.02, z], [0.12, 0.30, z]] for z in (0.04, -0.04)]),
        muscles=_muscles(),
    )


def _muscles() -> Muscles:
    s1, l3, t12, ribs = (BODIES.index(name) for name in ("S1", "L3", "T12", "T11"))
    paths = {
        "multifidus_r": [(s1, (-0.05, -0.02, 0.02)), (l3, (-0.04, 0.10, 0.01))],
        "longissimus_r": [
            (s1, (-0.06, -0.01, 0.03)),
            (t12, (-0.05, 0.185, 0.035)),
            (ribs, (-0.05, 0.33, 0.04)),
        ],
        "rectus_r": [(s1, (0.10, -0.03, 0.03)), (ribs, (0.13, 0.31, 0.05))],
        "oblique_r": [(ribs, (0.05, 0.24, 0.13)), (ribs, (0.11, 0.16, 0.04))],
        "oblique_l": [(ribs, (0.05, 0.24, -0.13)), (ribs, (0.11, 0.16, -0.04))],
    }
    body = np.full((5, 3), NO_BODY, dtype=np.int64)
    point = np.zeros((5, 3, 3))
    for k, path in enumerate(paths.values()):
        for n, (on, at) in enumerate(path):
            body[k, n], point[k, n] = on, at
    groups = ("multifidus", "longissimus", "rectus_abdominis", *["external_oblique"] * 2)
    return Muscles(
        names=tuple(paths),
        groups=groups,
        sides=("right", "right", "right", "right", "left"),
        pcsa=np.array([1.0, 2.0, 4.0, 3.0, 3.0]) * 1e-4,
        fibre=np.array([0.08, 0.12, 0.3, 0.0, 0.0]),
        body=body,
        point=point,
        wraps=np.array([False, True, False, False, False]),
        in_sheath=np.array([False, False, False, True, True]),
    )

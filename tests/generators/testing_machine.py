"""Made-up files of a testing machine: one joint with a known law, known noise, odd notation.

It shares no mechanics with the library: a joint turns by what a law says of the moment, that is
all. A loop comes from friction, which goes over from one side to the other after a reversal along
an exponential. Run as a program it writes the example of the tutorial again:

    python -m tests.generators.testing_machine docs/examples/testing_machine
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

Law = Callable[[np.ndarray], np.ndarray]
"""Rotation, deg, of a moment, N m, without friction."""


@dataclass(frozen=True)
class Rig:
    """A machine and what it does.

    Attributes
    ----------
    peak_nm : moment at the turns. both_sides : whether it goes to either side.
    cycles, seconds, hertz : how often, seconds of one cycle, rows a second.
    friction_nm : half the width of the loop, as a moment. goes_over_nm : decay of its transition.
    noise_deg, noise_nm : SD of a row.
    """

    peak_nm: float = 7.5
    both_sides: bool = True
    cycles: int = 3
    seconds: float = 40.0
    hertz: float = 5.0
    friction_nm: float = 0.0
    goes_over_nm: float = 0.5
    noise_deg: float = 0.0
    noise_nm: float = 0.0


def moments(rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Time, s, and moment, N m: straight lines between the turns, from zero and back to it."""
    per_cycle = round(rig.seconds * rig.hertz)
    phase = np.arange(rig.cycles * per_cycle + 1) / per_cycle
    within = phase % 1.0
    if rig.both_sides:
        shape = np.interp(within, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    else:
        shape = np.interp(within, [0, 0.5, 1], [0, 1, 0])
    return phase * rig.seconds, rig.peak_nm * shape


def friction(moment: np.ndarray, half_nm: float, decay_nm: float) -> np.ndarray:
    """The part of the moment that friction takes up: it lags behind whichever way the load goes."""
    held = np.zeros_like(moment)
    for row in range(1, len(moment)):
        way = np.sign(moment[row] - moment[row - 1])
        left = held[row - 1] - way * half_nm
        held[row] = way * half_nm + left * np.exp(-abs(moment[row] - moment[row - 1]) / decay_nm)
    return held


def record(law: Law, rig: Rig, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, s, moment, N m, and rotation, deg, as the machine reads them, row by row."""
    rng = np.random.default_rng(seed)
    time, moment = moments(rig)
    turned = law(moment - friction(moment, rig.friction_nm, rig.goes_over_nm))
    return (
        time,
        moment + rng.normal(0.0, 1.0, len(time)) * rig.noise_nm,
        turned + rng.normal(0.0, 1.0, len(time)) * rig.noise_deg,
    )


def german(time: np.ndarray, moment: np.ndarray, turned: np.ndarray, offset: float) -> str:
    """The file: a head, semicolons, decimal commas, N mm, and an angle from anywhere."""
    return table(time, {"Moment": moment}, {"Winkel": turned + offset})


def table(time: np.ndarray, moments: dict[str, np.ndarray], angles: dict[str, np.ndarray]) -> str:
    """The same with any number of columns: moments, N m, and angles, deg, by their names."""
    names = ["Zeit", *moments, *angles]
    units = ["s", *["N mm"] * len(moments), *["deg"] * len(angles)]
    digits = [2, *[0] * len(moments), *[3] * len(angles)]
    columns = [time, *(1000.0 * one for one in moments.values()), *angles.values()]
    lines = ["Pruefmaschine WS-20;;", "Bediener;NN;", ";".join(names), ";".join(units)]
    for row in zip(*columns, strict=True):
        cells = [f"{cell:.{n}f}" for cell, n in zip(row, digits, strict=True)]
        lines.append(";".join(cells).replace(".", ","))
    return "\n".join(lines) + "\n"


def slack(k: float, ratio: float, width_deg: float) -> Law:
    """A zone around zero that resists little: ``k`` N m/deg outside, ``ratio`` of it inside.

    The corner is round: moment = k q - k (1 - ratio) w tanh(q / w), turned around on a fine grid.
    """
    angle = np.linspace(-60.0, 60.0, 240_001)
    moment = k * angle - k * (1.0 - ratio) * width_deg * np.tanh(angle / width_deg)
    return lambda given: np.interp(given, moment, angle)


EXAMPLE = Rig(cycles=4, seconds=40.0, hertz=8.0, noise_deg=0.03, noise_nm=0.02)
SPECIMENS = {"s01": (1.05, 2.0), "s02": (1.35, 1.5)}
"""Of the example: N m/deg outside the zone, and half its width in deg."""


def main(folder: Path) -> None:
    """Write the files of the example: the machine turns about Z, then about X."""
    folder.mkdir(parents=True, exist_ok=True)
    tests = {"flexion_extension": ("Z", "X"), "lateral_bending": ("X", "Z")}
    for number, (name, (k, width)) in enumerate(SPECIMENS.items()):
        for way, (test, axes) in enumerate(tests.items()):
            law = (slack(k, 0.3, width), slack(1.3 * k, 0.3, 0.6 * width))[way]
            seed = 10 * number + way
            time, moment, turned = record(law, EXAMPLE, seed)
            rng = np.random.default_rng(1000 + seed)
            idle = rng.normal(0.0, 1.0, (2, len(time)))
            moments = {axes[0]: moment, axes[1]: EXAMPLE.noise_nm * idle[0]}
            angles = {axes[0]: turned + 12.345, axes[1]: EXAMPLE.noise_deg * idle[1] - 3.21}
            text = table(
                time,
                {f"Moment {axis}": moments[axis] for axis in "ZX"},
                {f"Winkel {axis}": angles[axis] for axis in "ZX"},
            )
            (folder / f"{name}_{test}.csv").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

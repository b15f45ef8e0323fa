"""Analog channels and force plates of a `.c3d`.

By the user guide of the form (2008), FORCE_PLATFORM: the corners of a plate, in the laboratory,
are those of its quadrants +x +y, -x +y, -x -y, +x -y, and tell its axes; ORIGIN leads from where
its sensors count their moments to the middle of its surface, on its own axes. What channels hold:

- type 1: force; x and y of the centre of pressure; free moment;
- type 2: force; moment;
- type 3: forces x 12, x 34, y 14, y 23, z 1, z 2, z 3, z 4 of four sensors, whose distances from
  the middle stand in ORIGIN;
- type 4: what CAL_MATRIX turns into force and moment.

Forces are as files have them, those on the person: upwards where somebody stands. ZERO, a range of
frames for a baseline, is not used; nor is FPCOPPOLY, which bends the centre of pressure by a few
tenths of a mm.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.reading_c3d import AGAIN, C3dFile, open_c3d
from spinepipe.motion.recording import M_PER
from spinepipe.problems import InputError, InputProblem

PLATES = "FORCE_PLATFORM"

CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}
"""Of a plate, by its type."""

LEAST_N = 10.0
"""Force through a plate below which its centre of pressure is noise."""

NEWTONS = ("n", "nt", "newton", "newtons")

WRONG_ORIGIN = "ORIGIN of plate {} leads upwards and is taken the other way"
NO_NEWTONS = "ANALOG:UNITS of plate {} says '{}', taken for N"


@dataclass(frozen=True, eq=False)
class ForcePlate:
    """What a plate measured, on the axes of the file.

    Attributes
    ----------
    time_s : (S,). force : (S, 3) N on the person.
    centre_of_pressure : (S, 3) m on the surface, NaN below `LEAST_N`. free_moment : (S, 3) N m,
        about it and square to the surface; NaN with it.
    repaired : what was read otherwise than it stands in the file, one sentence each.
    """

    time_s: Array
    force: Array
    centre_of_pressure: Array
    free_moment: Array
    repaired: tuple[str, ...]


def read_force_plates(path: Path, file: str | None = None) -> tuple[ForcePlate, ...]:
    """Force plates of a `.c3d`, none where it has none.

    Parameters
    ----------
    file : its name in messages; None: that of the path.

    Raises
    ------
    InputError
        Where it cannot be read or contradicts itself, and of plates of other types.
    """
    name = file or path.name
    whole = open_c3d(path, name, markers=False)
    count = int(next(iter(whole.numbers(PLATES, "USED")), 0))
    return tuple(_plate(whole, k, count, name) for k in range(count))


def analog_values(whole: C3dFile) -> Array:
    """(S, C) values of the channels, in the units that the file tells."""
    samples = max(whole.samples, 1)
    count = whole.analog // samples
    raw = whole.cells()[:, 4 * whole.points : 4 * whole.points + count * samples]
    raw = raw.reshape(whole.frames * samples, count)
    unsigned = "UNSIGNED" in whole.texts("ANALOG", "FORMAT")
    if unsigned and raw.dtype == np.int16:
        raw = raw.view("u2")

    def of_channels(name: str, usual: float) -> Array:
        told = whole.numbers("ANALOG", name)[:count]
        return np.array(told + [usual] * (count - len(told)))

    # parameters are read without a sign
    offset = of_channels("OFFSET", 0.0)
    offset -= np.where((offset >= 1 << 15) & (not unsigned), 1 << 16, 0)
    general = next(iter(whole.numbers("ANALOG", "GEN_SCALE")), 1.0)
    return (raw - offset) * (general * of_channels("SCALE", 1.0))


def _plate(whole: C3dFile, k: int, count: int, file: str) -> ForcePlate:
    def fail(column: str, found: str, allowed: str) -> InputError:
        place = (file, None, f"{PLATES}:{column}")
        return InputError([InputProblem(*place, found, allowed, AGAIN)])

    def of_plate(name: str, *shape: int) -> Array:
        """The part of a parameter that is this plate's; its last index counts plates."""
        size, told = int(np.prod(shape)), whole.numbers(PLATES, name)
        if len(told) < (k + 1) * size:
            raise fail(name, f"{len(told)} numbers", f"{size} for each plate")
        return np.array(told[k * size : (k + 1) * size]).reshape(shape, order="F")

    kind = int(of_plate("TYPE", 1)[0])
    if kind not in CHANNELS:
        raise fail("TYPE", f"a plate of type {kind}", "types 1 to 4")
    unit_m, analog = whole.unit_m(file), analog_values(whole)
    corners, origin = unit_m * of_plate("CORNERS", 3, 4).T, unit_m * of_plate("ORIGIN", 3)
    rows = max(CHANNELS[kind], len(whole.numbers(PLATES, "CHANNEL")) // count)
    channels = of_plate("CHANNEL", rows).astype(int)[: CHANNELS[kind]] - 1
    if channels.min() < 0 or channels.max() >= analog.shape[1]:
        found = f"channels {', '.join(str(one + 1) for one in channels)}"
        raise fail("CHANNEL", found, f"{CHANNELS[kind]} of {analog.shape[1]}")
    told = dict(enumerate(whole.texts("ANALOG", "UNITS")))
    values, units = analog[:, channels], [told.get(one, "") for one in channels.tolist()]
    repaired = []
    if kind == 4:
        values = values @ of_plate("CAL_MATRIX", 6, 6).T
    elif (said := units[0]).strip().lower() not in (*NEWTONS, ""):
        repaired.append(NO_NEWTONS.format(k + 1, said))
    if kind in (2, 4) and origin[2] > 0.0:  # the sensors are below the surface, z leads downwards
        origin = -origin
        repaired.append(WRONG_ORIGIN.format(k + 1))
    # forces and moments on the axes of the plate, about the middle of its surface
    if kind == 3:
        x12, x34, y14, y23, z1, z2, z3, z4 = values.T
        force = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=1)
        moment = np.stack(
            [
                origin[1] * (z1 + z2 - z3 - z4),
                origin[0] * (z2 + z3 - z1 - z4),
                origin[1] * (x34 - x12) + origin[0] * (y14 - y23),
            ],
            axis=1,
        )
        moment += np.cross(force, [0.0, 0.0, -abs(origin[2])])
    elif kind == 1:
        force = values[:, :3]
        at = np.pad(values[:, 3:5] * M_PER.get(units[3].strip().lower(), unit_m), ((0, 0), (0, 1)))
        moment = np.cross(at, force)
        moment[:, 2] += values[:, 5] * _newton_metre(units[5], unit_m)
    else:
        force = values[:, :3]
        moment = values[:, 3:] * _newton_metre(units[3], unit_m) + np.cross(force, origin)
    x, y = corners[0] - corners[1], corners[0] - corners[3]
    z = np.cross(x, y)
    if not np.linalg.norm(z) > 0.0:
        raise fail("CORNERS", "corners of no plane", "four corners, +x +y first")
    own = np.stack([axis / np.linalg.norm(axis) for axis in (x, np.cross(z, x), z)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.stack([-moment[:, 1], moment[:, 0]], axis=1) / force[:, 2:]
    at = np.pad(at, ((0, 0), (0, 1)))
    at[np.abs(force[:, 2]) < LEAST_N] = np.nan
    free = moment - np.cross(at, force)
    time_s = whole.time_s(max(whole.samples, 1))
    at = corners.mean(axis=0) + at @ own.T
    return ForcePlate(time_s, force @ own.T, at, free @ own.T, tuple(repaired))


def _newton_metre(unit: str, unit_m: float) -> float:
    """What a unit of moments is in N m; where it tells no length, that of POINT:UNITS counts."""
    letters = "".join(filter(str.isalpha, unit.lower()))
    lengths = (M_PER.get(letters.removeprefix(start)) for start in NEWTONS[:2])
    return next((one for one in lengths if letters[:1] == "n" and one), unit_m)

"""Names that what was recorded cannot exclude: without times, and without a second preload."""

from collections.abc import Sequence

import numpy as np
from sweeps import sweep

from spinepipe.effects import Wrench
from spinepipe.effects.registry import registered
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.search.outcome import cannot_be_excluded

LEVELS = (0.0, 4.0, 8.0, 4.0, 0.0)
TIMES = (0.0, 30.0, 60.0, 90.0, 120.0)
NONE = (None,) * 5


def case(times: Sequence[float | None] = TIMES, forces: Sequence[float] = (0.0,) * 5) -> LoadCase:
    steps = tuple(
        LoadStep(
            number,
            (Wrench(0, np.zeros(3), np.array([0.0, -force, 0.0]), np.array([0.0, 0.0, moment])),),
            time,
        )
        for number, (moment, time, force) in enumerate(zip(LEVELS, times, forces, strict=True))
    )
    return LoadCase("flexion", 1, steps)


def excluded(name: str, *cases: LoadCase) -> tuple[str, ...]:
    return cannot_be_excluded(name, {"a": cases, "b": cases[:1]})


@sweep("name", ["hysteresis", "neutral_pose_drift"])
def test_without_time_a_loop_may_be_creep(name: str) -> None:
    assert excluded(name, case()) == ()
    assert excluded(name, case(NONE)) == ("creep",)
    assert excluded(name, case((5.0,) * 5)) == ("creep",)  # a clock that stands
    assert excluded(name, case((0.0, 30.0, 30.0, 30.0, 30.0))) == ()  # it went, if only once
    assert excluded(name, case((0.0, 0.0, 0.0, 0.0, 30.0))) == ()
    assert excluded(name, case((120.0, 90.0, 60.0, 30.0, 0.0))) == ("creep",)  # it goes back
    assert excluded(name, case(), case(NONE)) == ("creep",)  # time is known of a part only
    assert excluded(name, case((0.0, 30.0, None, 90.0, 120.0))) == ("creep",)


def test_a_test_of_one_step_neither_takes_time_nor_needs_any() -> None:
    single = LoadCase("flexion", 1, case().steps[:1])
    assert excluded("hysteresis", case(), single) == ()
    assert excluded("hysteresis", single) == ("creep",)


@sweep("lighter, alike", [(95.0, True), (94.9, False)])
def test_forces_are_alike_within_a_twentieth_of_the_largest(lighter: float, alike: bool) -> None:
    two = case(forces=(100.0,) * 5), case(forces=(lighter,) * 5)
    assert excluded("level_dependence", *two) == (("preload_stiffening",) if alike else ())
    changing = case(forces=(100.0, 100.0, lighter, 100.0, 100.0))
    for cases in (two, [changing]):
        expected = ("level_dependence",) if alike else ()
        assert excluded("preload_stiffening", *cases) == expected


def test_without_any_test_nothing_is_recorded() -> None:
    assert cannot_be_excluded("hysteresis", {}) == ("creep",)
    assert cannot_be_excluded("level_dependence", {}) == ()
    assert cannot_be_excluded("preload_stiffening", {}) == ("level_dependence",)


def test_one_compression_does_not_tell_levels_from_preload() -> None:
    bare, pressed, harder = case(), case(forces=(300.0,) * 5), case(forces=(500.0,) * 5)
    assert excluded("level_dependence", pressed) == ("preload_stiffening",)
    assert excluded("level_dependence", case(forces=(0.5,) * 5)) == ("preload_stiffening",)
    assert excluded("level_dependence", bare) == ()  # nothing listed compresses
    for two in ((bare, pressed), (pressed, harder)):
        assert excluded("level_dependence", *two) == ()
        assert excluded("preload_stiffening", *two) == ()
    assert excluded("preload_stiffening", pressed) == ("level_dependence",)
    growing = case(forces=(0.0, 200.0, 400.0, 200.0, 0.0))
    assert excluded("preload_stiffening", growing) == ()
    assert excluded("level_dependence", growing) == ()


def test_other_effects_need_nothing_that_is_not_there() -> None:
    told = {"hysteresis", "neutral_pose_drift", "level_dependence", "preload_stiffening"}
    assert told <= set(registered())
    for name in set(registered()) - told:
        assert excluded(name, case(NONE)) == ()

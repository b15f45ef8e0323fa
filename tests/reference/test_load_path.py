"""Which equilibrium: the end of the path along which the loads come on, or unstable.

Against closed forms of columns and softening springs, friction by its differential equation, chains
followed slowly by virtual work and by OpenSim. Catches a pose on the wrong side of a fork or beyond
a limit point, one that hangs on the size of the steps or on where Newton starts, and a pose that
exists called unstable.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from sweeps import sweep

from spinepipe.effects import Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System, follow
from spinepipe.statics.batched import Stack
from spinepipe.status import Status
from spinepipe.units import COORDINATES
from spinepipe.world import Chain as LoadedChain
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer
from tests.reference.peers.virtual_work import slowly

Array = np.ndarray
NOWHERE = np.zeros(3)
EXTENSION = COORDINATES.index("extension")
HEIGHT = 0.15
RIGID = (1e10, 1e10, 1e10)


def column(
    *stiffness: Sequence[float], effects: Sequence[ScopedEffect] = (), rise: float = HEIGHT
) -> SpineModel:
    """Upright joints without translations, each with three stiffnesses, N m/rad."""
    count = len(stiffness)
    springs = np.array([[*RIGID, *own] for own in stiffness])
    bushing = ScopedEffect(create("linear_bushing"), tuple(range(count)), springs)
    origins = [np.array([0.0, rise * j, 0.0]) for j in range(count)]
    return SpineModel(
        specimen="column",
        joints=tuple(f"L{4 - j}L{5 - j}" for j in range(count)),
        frames=tuple(Pose(np.eye(3), origin) for origin in origins),
        bodies=tuple(Body(f"L{4 - j}", 0.0, o, np.zeros((3, 3))) for j, o in enumerate(origins)),
        gravity=np.zeros(3),
        damping=np.tile([200.0] * 3 + [1.0] * 3, (count, 1)),
        effects=(bushing, *effects),
    )


def law(name: str, values: Sequence[float], **options: object) -> ScopedEffect:
    """A law at the lowest joint, in extension unless told otherwise."""
    effect = create(name, {"coordinate": "extension", **options})
    return ScopedEffect(effect, (0,), np.array([values], dtype=float))


def loads(
    model: SpineModel, *turns: tuple[float, Sequence[float]], parts: int = 1, rise: float = HEIGHT
) -> LoadCase:
    """Steps of N down on the top and N m there, each reached in so many equal parts."""
    body = model.n_joints - 1
    point = np.array([0.0, rise * model.n_joints, 0.0])
    every, last = [], np.zeros(4)
    for press, moment in turns:
        now = np.array([press, *moment])
        every += [last + (now - last) * share for share in np.arange(1, parts + 1) / parts]
        last = now
    return LoadCase(
        "test",
        1,
        tuple(
            LoadStep(n, (Wrench(body, point, np.array([0.0, -press, 0.0]), np.array(moment)),))
            for n, (press, *moment) in enumerate(every)
        ),
    )


def bending(moment: float) -> tuple[float, float, float]:
    return (0.0, 0.0, moment)


def ends(model: SpineModel, case: LoadCase, parts: int = 1) -> tuple[Array | None, str]:
    """Poses (T, J, 6) by both engines, which agree, or None; and the last word that is said."""
    solved = follow(System(LoadedChain(model), model, case))
    found = Stack.of([model], [(0, case)]).solve()
    assert found.status.tolist() == [step.equilibrium.status.value for step in solved]
    bad = [step for step in solved if not step.usable]
    if bad:
        assert found.messages[len(solved) - len(bad)] == bad[0].equilibrium.message
        return None, bad[0].equilibrium.message
    poses = np.array([step.equilibrium.q for step in solved]).reshape(found.q.shape)
    np.testing.assert_allclose(found.q, poses, rtol=0, atol=1e-10)
    assert found.messages.get(len(poses) - 1, "") == solved[-1].equilibrium.message
    return poses[parts - 1 :: parts], solved[-1].equilibrium.message


# Forks


@sweep("parts", [1, 2, 30])
@sweep(
    "stiffness, degrees",
    [
        *((100, -0.859), (95, -1.714), (92, -4.136), (90, -12.354), (88, -22.892)),
        *((85, -34.204), (80, -48.036), (75, -59.128), (70, -68.806), (65, -77.620)),
    ],
)
def test_a_column_leans_where_its_moment_pushes_it(
    stiffness: float, degrees: float, parts: int
) -> None:
    """Case 60: k q = P h sin q - m, P h = 90 N m/rad, m = 0.15 N m come on together."""
    model = column((stiffness, 1000.0, 1000.0))
    found, said = ends(model, loads(model, (600.0, bending(-0.15)), parts=parts), parts)
    assert found is not None
    assert np.rad2deg(found[0, 0, EXTENSION]) == pytest.approx(degrees, abs=5e-4)
    assert ("past a critical load" in said) is (stiffness < 90)


@sweep("moment", [1e-6, -1e-4, 0.01, -1.0])
def test_the_smallest_push_decides_the_side_and_its_mirror_image_the_other(moment: float) -> None:
    model = column((80.0, 85.0, 1000.0))

    def missing(angle: float) -> float:
        return 80.0 * angle - 90.0 * np.sin(angle) - moment

    sign = np.sign(moment)
    expected = brentq(missing, 0.6 * sign, 1.39 * sign, xtol=1e-13)
    for parts in (1, 7):
        found, _ = ends(model, loads(model, (600.0, bending(moment)), parts=parts), parts)
        assert found is not None
        assert found[0, 0, EXTENSION] == pytest.approx(expected, abs=1e-9)


@sweep(
    "stiffness, tips, share",
    [
        ((80.0, 1000.0, 1000.0), "extension", 80 / 90),
        ((1000.0, 72.0, 1000.0), "right bending", 72 / 90),
        ((80.0, 80.0, 1000.0), "", 80 / 90),
        ((80.0, 80.001, 1000.0), "extension", 80 / 90),
    ],
)
@sweep("steps", [((600.0, bending(0.0)),), ((600.0, bending(0.0)), (600.0, bending(-5.0)))])
def test_a_column_tips_before_any_moment_acts(stiffness, tips: str, share: float, steps) -> None:
    """Two directions at once: the determinant keeps its sign, and no pivot does."""
    model = column(stiffness)
    found, said = ends(model, loads(model, *steps))
    assert found is None
    assert "tips over under the load of step 0" in said
    assert f"{tips} of L4L5" in said
    assert f"{100 * share:.1f} %" in said


@sweep("share", [0.99, 1.01])
def test_two_joints_one_above_the_other(share: float) -> None:
    """Equal springs k and links h: the critical load is (3 - sqrt 5) / 2 k / h."""
    model, critical = column((60.0, 500.0, 500.0), (60.0, 500.0, 500.0)), (3 - np.sqrt(5)) / 2 * 60
    case = loads(model, (share * critical / HEIGHT, bending(0.0)))
    found, said = ends(model, case)
    assert (found is not None) is (share < 1.0)
    if share > 1.0:
        assert "tips over under the load of step 0: extension of L4L5" in said
        assert f"{100 / share:.1f} %" in said
    pushed = loads(model, (share * critical / HEIGHT, bending(-1e-3)), parts=3)
    leaning, _ = ends(model, pushed, 3)
    assert leaning is not None
    q = leaning[0, :, EXTENSION]
    press = share * critical
    lower = 60 * q[0] - press * (np.sin(q[0]) + np.sin(q.sum())) + 1e-3
    upper = 60 * q[1] - press * np.sin(q.sum()) + 1e-3
    assert np.abs([lower, upper]).max() < 1e-9
    assert (q < 0.0).all()


def test_a_fork_is_passed_back_the_way_it_came() -> None:
    """Leaning to one side, the other moment leads no further than where that side ends."""
    model = column((80.0, 1000.0, 1000.0))
    over, back = (600.0, bending(-0.15)), (600.0, bending(-0.02))
    found, _ = ends(model, loads(model, over, back, (0.0, bending(0.0)), parts=2), 2)
    assert found is not None
    assert (found[:2, 0, EXTENSION] < -0.7).all()
    assert np.abs(found[2]).max() < 1e-12
    for parts in (1, 25):
        _, said = ends(model, loads(model, over, (600.0, bending(9.0)), parts=parts))
        assert "snaps under the load of step" in said


def test_starts_elsewhere_and_company_change_nothing() -> None:
    """Guesses on the wrong side, and a stack with others, end where the load leads."""
    models = [column((k, 300.0, 1000.0)) for k in (70.0, 80.0, 88.0, 95.0)]
    steps = ((400.0, bending(-0.1)), (600.0, bending(-0.15)), (620.0, bending(-0.2)))
    cases = [loads(model, *steps) for model in models]
    alone = np.concatenate(
        [Stack.of([m], [(0, c)]).solve().q for m, c in zip(models, cases, strict=True)]
    )
    stack = Stack.of(models, list(enumerate(cases)))
    rng = np.random.default_rng(1)
    for guess in (
        None,
        -alone,
        alone + rng.normal(0.0, 0.3, alone.shape) * ([0.0] * 3 + [1.0] * 3),
    ):
        np.testing.assert_allclose(stack.solve(guess).q, alone, rtol=0, atol=1e-12)
    for number, (model, case) in enumerate(zip(models, cases, strict=True)):
        wrong = [-q.ravel() for q in alone[3 * number : 3 * number + 3]]
        solved = follow(System(LoadedChain(model), model, case), wrong)
        found = np.array([step.equilibrium.q for step in solved]).reshape(3, 1, 6)
        np.testing.assert_allclose(found, alone[3 * number : 3 * number + 3], rtol=0, atol=1e-10)


# Limit points


@sweep("parts", [1, 3, 40])
@sweep("moment", [2.0, 2.36, 2.42, 2.43, 2.5, 2.55, 2.6, 2.7, 2.9, 3.0, 5.5, 8.0])
def test_a_spring_that_softens_carries_up_to_its_limit(moment: float, parts: int) -> None:
    """50 N m/rad, 70 less between 0.05 and 0.1 rad: corners are rounded over 5 % of the reach, so
    the slope is zero at 0.045 + 0.01 x 5/7 rad, under 2.4286 N m."""
    model = column((50.0, 1e3, 1e3), effects=[law("tabulated_law", [0] * 6 + [-70, 10])])
    found, said = ends(model, loads(model, (0.0, bending(moment)), parts=parts))
    assert (found is not None) is (moment < 2.25 + 2.5 / 14)
    if found is None:
        assert "snaps under the load of step" in said
        assert "extension of L4L5" in said
        if parts == 1:
            assert f"{100 * (2.25 + 2.5 / 14) / moment:.1f} %" in said


@pytest.mark.slow
@sweep("seed", range(3))
def test_any_table_gives_the_same_in_one_step_as_in_sixty(seed: int) -> None:
    rng = np.random.default_rng(seed)
    models, cases = [], []
    for _ in range(60):
        stiffness = np.exp(rng.uniform(np.log(20.0), np.log(100.0)))
        table = law("tabulated_law", rng.normal(0.0, 0.6 * stiffness, 8))
        models.append(column((stiffness, 1e3, 1e3), effects=[table]))
        moment = rng.uniform(-8.0, 8.0)
        cases.append([loads(models[-1], (0.0, bending(moment)), parts=n) for n in (1, 4, 60)])
    last = []
    for number in range(3):
        stack = Stack.of(models, [(n, every[number]) for n, every in enumerate(cases)])
        last.append(stack.solve(why=False).q[stack.first[1:] - 1])
    assert 2 <= np.isnan(last[2][:, 0, 0]).sum() <= 30
    for other in last[:2]:
        np.testing.assert_allclose(other, last[2], rtol=0, atol=1e-9)  # NaN where NaN


# Poses that exist


@sweep("coordinate, unit", [("extension", 1.0), ("anterior", 100.0)])
@sweep("ratio", [0.1, 0.5, 1.0, 3.0, 8.0, 20.0])
def test_friction_up_and_down_is_that_of_its_equation(
    coordinate: str, unit: float, ratio: float
) -> None:
    """dh/dq = (1 - h sign(dq)) / yield; F / (k yield) from 0.1 to 20. Corners are rounded over 1e-4
    of the yield."""
    at, stiffness, width = COORDINATES.index(coordinate), 20.0 * unit**2, 0.02 / unit
    force = ratio * stiffness * width
    model = column(
        (1e3, 1e3, 1e3), effects=[law("hysteresis", [force, width], coordinate=coordinate)]
    )
    values = model.effects[0].values.copy()
    values[0, at] = stiffness
    model = model.with_effects((model.effects[0].with_values(values), *model.effects[1:]))
    sizes = unit * np.array([0.0, 7.5, 0.0, -7.5, 3.0])
    steps = [
        Wrench(
            0,
            NOWHERE,
            *(np.array([s, 0, 0]), NOWHERE) if at == 0 else (NOWHERE, np.array([0, 0, s])),
        )
        for s in sizes.tolist()
    ]
    case = LoadCase("test", 1, tuple(LoadStep(n, (one,)) for n, one in enumerate(steps)))
    found, _ = ends(model, case)
    assert found is not None
    q, h = 0.0, 0.0
    for number, (before, after) in enumerate(pairwise(sizes.tolist()), start=1):
        side = np.sign(after - before)

        def slopes(_: float, y: Array, side: float = side) -> list[float]:
            by_q = (1.0 - y[1] * side) / width
            by_load = 1.0 / (stiffness + force * by_q)
            return [by_load, by_q * by_load]

        q, h = solve_ivp(slopes, (before, after), [q, h], rtol=1e-10, atol=1e-12).y[:, -1]
        assert found[number, 0, at] == pytest.approx(q, abs=4e-4 * width * max(1.0, ratio))


def test_friction_and_a_stop_of_the_issue_are_no_snaps() -> None:
    model = column((20.0, 1e3, 1e3), effects=[law("hysteresis", [1.0, 0.003])])
    found, _ = ends(model, loads(model, *((0.0, bending(m)) for m in (0.0, 7.5, 0.0, -7.5))))
    assert found is not None
    assert found[3, 0, EXTENSION] == pytest.approx(-0.325, abs=1e-6)
    zone, stop = (
        law("neutral_zone", [0.045, 0.055, 21.3]),
        law("facet_contact", [2954, 0.0477, 1.13]),
    )
    model = column((42.2, 1e3, 1e3), effects=[zone, stop])
    found, _ = ends(model, loads(model, (0.0, bending(7.5)), (0.0, bending(-7.5))))
    assert found is not None


def monotone(rng: np.random.Generator) -> tuple[SpineModel, LoadCase]:
    """A joint whose load rises with its angle, and moments of either sign."""

    def spread(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    laws = []
    if rng.random() < 0.6:
        laws.append(law("neutral_zone", [rng.uniform(0.01, 1), spread(5e-3, 0.12), spread(2, 50)]))
    if rng.random() < 0.4:
        laws.append(
            law("nonlinear_stiffening", [spread(1, 400), rng.uniform(0.053, 0.2)], shape="bilinear")
        )
    if rng.random() < 0.6:
        side = ("positive", "negative")[int(rng.integers(2))]
        laws.append(
            law("facet_contact", [spread(8, 8e3), rng.uniform(0, 0.2), spread(1, 4)], side=side)
        )
    if rng.random() < 0.6:
        jenkins = [rng.uniform(0, 2)] if rng.random() < 0.5 else []
        values = [spread(0.05, 15), spread(1e-3, 0.1), *jenkins]
        laws.append(law("hysteresis", values, law="jenkins" if jenkins else "dahl"))
    model = column((spread(2.0, 200.0), 1e3, 1e3), effects=laws)
    moments = rng.uniform(-8.0, 8.0, int(rng.integers(1, 6)))
    return model, loads(model, *((0.0, bending(m)) for m in moments.tolist()))


@pytest.mark.parametrize(
    ("seed", "count"), [(1, 400), pytest.param(2, 2000, marks=pytest.mark.full)]
)
def test_no_law_that_rises_is_called_unstable(seed: int, count: int) -> None:
    """But for joints that turn beyond 80 degrees, which the message says."""
    rng = np.random.default_rng(seed)
    models, cases = zip(*(monotone(rng) for _ in range(count)), strict=True)
    found = Stack.of(models, list(enumerate(cases))).solve()
    lost = np.flatnonzero(found.status == Status.UNSTABLE.value).tolist()
    said = {found.messages[lane] for lane in lost}
    assert len(lost) < 0.2 * len(found.status)
    assert all("turns beyond 80" in one or one == "an earlier load step failed" for one in said)


# Chains


def pressed(rng: np.random.Generator) -> chains.Chain:
    """An upright chain of one to three soft joints, pressed down and pushed a little aside."""
    count = int(rng.integers(1, 4))
    origins = np.array([[0.0, 0.035 * j, 0.0] for j in range(count)])
    turning = np.exp(rng.uniform(np.log(20.0), np.log(100.0), (count, 3)))
    top = np.array([0.0, 0.035 * count + 0.08, 0.0])
    down, aside = np.array([0.0, -rng.uniform(60, 500), 0.0]), 10.0 ** rng.uniform(-2, 0.5)
    load = chains.Load(count - 1, force=down, moment=aside * rng.normal(size=3), point=top)
    return replace(
        chains.random_chain(rng, count),
        origins=origins,
        rotations=np.tile(np.eye(3), (count, 1, 1)),
        stiffness=np.hstack([np.tile([1e5, 1e6, 1e5], (count, 1)), turning]),
        gravity=chains.WEIGHTLESS,
    ).with_loads(load)


def tilted(rng: np.random.Generator) -> chains.Chain:
    """A random chain under many times its usual loads."""
    chain = replace(chains.random_chain(rng, int(rng.integers(1, 4))), gravity=chains.WEIGHTLESS)
    size = np.exp(rng.uniform(np.log(1.0), np.log(30.0)))
    return chain.with_loads(
        *(
            replace(one, force=size * one.force, moment=0.3 * size * one.moment)
            for one in chain.loads
        )
    )


STEPS = 100
"""Of virtual work: a share that is lost is known to one of them."""


@pytest.mark.slow
@sweep("draw", [pressed, tilted])
@pytest.mark.parametrize("seeds", [range(3), pytest.param(range(100, 140), marks=pytest.mark.full)])
def test_chains_stand_where_slow_loads_bring_them_by_virtual_work(draw, seeds: range) -> None:
    lost = 0
    for seed in seeds:
        chain = draw(np.random.default_rng(seed))
        expected = slowly(chain, STEPS)
        found = bridge.equilibrium(chain)
        if expected.share == 1.0:
            assert found.status is Status.CONVERGED
            np.testing.assert_allclose(found.q.reshape(-1, 6), expected.q, rtol=0, atol=2e-6)
        else:
            lost += 1
            assert found.status is Status.UNSTABLE
            assert found.reached == pytest.approx(expected.share, abs=2.0 / STEPS)
    assert lost < len(seeds)


@pytest.mark.slow
@sweep("draw", [pressed, tilted])
def test_a_mirrored_specimen_under_mirrored_loads_stands_mirrored(draw) -> None:
    """Left and right exchanged: z of ground, and with it all that points or turns about it."""
    flip = np.diag([1.0, 1.0, -1.0])
    for seed in range(20):
        chain = draw(np.random.default_rng(700 + seed))
        turned = chain.rotations.copy()
        other = replace(
            chain,
            origins=chain.origins @ flip,
            rotations=flip @ turned @ flip,
            centres=chain.centres @ flip,
            inertias=flip @ chain.inertias @ flip,
        ).with_loads(
            *(
                replace(
                    one, force=flip @ one.force, moment=-flip @ one.moment, point=flip @ one.point
                )
                for one in chain.loads
            )
        )
        own, own_other = bridge.equilibrium(chain), bridge.equilibrium(other)
        assert own.status is own_other.status
        assert own.reached == pytest.approx(own_other.reached, abs=1e-5)
        if own.status is Status.CONVERGED:
            sides = np.tile([1.0, 1.0, -1.0, 1.0, -1.0, -1.0], chain.n_joints)
            np.testing.assert_allclose(own_other.q, sides * own.q, rtol=0, atol=1e-9)


@pytest.mark.slow
def test_ten_spines_past_their_critical_loads_lean_as_in_opensim() -> None:
    """Loads that come on over 40 s and stay; damping is heavy, so that little of it is left."""
    done, seed = 0, 0
    while done < 10:
        seed += 1
        chain = pressed(np.random.default_rng(5000 + seed))
        found = bridge.equilibrium(chain)
        past = found.status is Status.CONVERGED and "past a critical load" in found.message
        if not past or np.abs(found.q.reshape(-1, 6)[:, 3:]).max() > 1.2:
            continue
        done += 1
        settled = opensim_peer.settle(chain, 60.0, ramp_time=40.0, accuracy=1e-6)[-1]
        np.testing.assert_allclose(found.q.reshape(-1, 6), settled, rtol=0, atol=2e-3)

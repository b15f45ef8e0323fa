"""A motion of two bodies by collocation with CasADi and IPOPT: `python collocation.py IN OUT`.

Written from the problem alone: Lagrange's equations of two bodies on a pelvis that stands still,
six coordinates each, three of which turn; passive exponentials; uniform cubic B-splines. A process
of its own, since CasADi and pinocchio do not stand each other.
"""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

DOWN = 9.81
BODIES, TURNS = 2, (3, 4, 5, 9, 10, 11)


def main() -> None:
    """Solve what a file asks, and write what came out."""
    asked = json.loads(Path(sys.argv[1]).read_text())
    Path(sys.argv[2]).write_text(json.dumps(solved(asked)))


def solved(asked: dict[str, Any]) -> dict[str, Any]:
    """Least cost, coordinates at nodes (N + 1, 6) and CPU seconds of IPOPT."""
    nodes, step = len(asked["places"]), asked["step_s"]
    coefficients = ca.MX.sym("c", len(TURNS), nodes + 2)
    node = _node(asked)
    cost = 0.0
    for k in range(nodes):
        before, at, after = (coefficients[:, k + i] for i in range(3))
        place = (before + 4.0 * at + after) / 6.0
        speed, bend = (after - before) / (2.0 * step), (before - 2.0 * at + after) / step**2
        cost += node(place, speed, bend, np.array(asked["places"][k]).T)
    cost *= asked["frames"] / nodes
    problem = {"x": ca.vec(coefficients), "f": cost}
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": 1e-9, "ipopt.sb": "yes"}
    solver = ca.nlpsol("motion", "ipopt", problem, quiet)
    start = time.process_time()
    found = solver(x0=0.0)
    seconds = time.process_time() - start
    if not solver.stats()["success"]:
        raise RuntimeError(solver.stats()["return_status"])
    c = np.array(found["x"]).reshape(nodes + 2, len(TURNS))
    turns = (c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0
    return {"cost": float(found["f"]), "turns": turns.tolist(), "cpu_s": seconds}


@dataclass
class _Chain:
    """Origins and turns of the two bodies, as expressions of twelve coordinates."""

    origins: list[ca.SX]
    turns: list[ca.SX]


def _turn(axis: int, angle: ca.SX) -> ca.SX:
    one, two = (axis + 1) % 3, (axis + 2) % 3
    found = ca.SX.eye(3)
    found[one, one] = found[two, two] = ca.cos(angle)
    found[one, two], found[two, one] = -ca.sin(angle), ca.sin(angle)
    return found


def _chain(asked: dict[str, Any], q: ca.SX) -> _Chain:
    origin, turn, found = ca.SX.zeros(3), ca.SX.eye(3), _Chain([], [])
    for body in range(BODIES):
        own = q[6 * body : 6 * body + 6]
        base = turn @ ca.DM(asked["step_turns"][body])
        origin = origin + turn @ ca.DM(asked["step_origins"][body]) + base @ own[:3]
        turn = base @ _turn(2, own[3]) @ _turn(0, own[4]) @ _turn(1, own[5])
        found.origins.append(origin)
        found.turns.append(turn)
    return found


def _forces(asked: dict[str, Any], q: ca.SX, v: ca.SX, a: ca.SX) -> ca.SX:
    """(12,) by Lagrange's equations: what moves the bodies against inertia and weight."""
    chain, kinetic, high = _chain(asked, q), 0.0, 0.0
    for body in range(BODIES):
        mass, turn = asked["kg"][body], chain.turns[body]
        centre = chain.origins[body] + turn @ ca.DM(asked["com"][body])
        speed = ca.jtimes(centre, q, v)
        spun = turn.T @ ca.reshape(ca.jtimes(ca.vec(turn), q, v), 3, 3)
        spin = ca.vertcat(spun[2, 1], spun[0, 2], spun[1, 0])
        about = ca.DM(asked["about"][body])
        kinetic += 0.5 * mass * ca.dot(speed, speed) + 0.5 * ca.dot(spin, about @ spin)
        high += mass * DOWN * centre[1]
    if asked["force_cost"] == "minus_gravity":
        high = ca.SX(0.0)
    momentum = ca.gradient(kinetic, v)
    changing = ca.jtimes(momentum, q, v) + ca.jtimes(momentum, v, a)
    return changing - ca.gradient(kinetic, q) + ca.gradient(high, q)


def _resisted(asked: dict[str, Any], q: ca.SX) -> ca.SX:
    parts = []
    for k in range(6 * BODIES):
        (up_a, down_a), (up_b, down_b) = asked["a"][k], asked["b"][k]
        up = up_a * (ca.exp(up_b * q[k]) - 1.0)
        down = -down_a * (ca.exp(-down_b * q[k]) - 1.0)
        parts.append(ca.if_else(q[k] < 0.0, down, up))
    return ca.vertcat(*parts)


def _node(asked: dict[str, Any]) -> ca.Function:
    """Cost of one node, of six turns, their rates and accelerations, and markers (3, K) m."""
    turns, rates, bends = (ca.SX.sym(name, len(TURNS)) for name in "tsb")
    seen = ca.SX.sym("m", 3, len(asked["marker_body"]))
    q, v, a = (ca.SX.sym(name, 6 * BODIES) for name in "qva")
    loads = (_forces(asked, q, v, a) + _resisted(asked, q)) / ca.DM(asked["load_sizes"])
    full = [ca.SX.zeros(6 * BODIES) for _ in range(3)]
    for whole, some in zip(full, (turns, rates, bends), strict=True):
        for k, at in enumerate(TURNS):
            whole[at] = some[k]
    loads = ca.substitute(loads, ca.vertcat(q, v, a), ca.vertcat(*full))
    if asked["force_cost"] == "level_difference":
        # above the second body nothing weighs anything
        whole = asked["common_share"] * (loads[:3] + loads[6:9])
        loads = ca.vertcat(loads[6:] - loads[:6], -loads[6:], whole)
    chain, off = _chain(asked, full[0]), []
    for k, (body, at) in enumerate(zip(asked["marker_body"], asked["marker_at"], strict=True)):
        place = chain.origins[body] + chain.turns[body] @ ca.DM(at)
        off.append((place - seen[:, k]) / asked["marker_m"])
    cost = ca.sumsqr(ca.vertcat(*off)) + ca.sumsqr(loads)
    cost += ca.sumsqr(bends / asked["bend_size"])
    return ca.Function("node", [turns, rates, bends, seen], [cost])


if __name__ == "__main__":
    main()

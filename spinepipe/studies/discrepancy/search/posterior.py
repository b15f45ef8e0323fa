"""PROTOTYPE. One posterior over which effects are missing, explored where its mass is."""

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import log_ndtr, logsumexp

from spinepipe.statics import with_parameters
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import STRENGTH_SDS, ActiveTerm
from spinepipe.studies.discrepancy.search.joint_fit import joint_fit
from spinepipe.studies.discrepancy.search.lack_of_fit import lack_of_fit
from spinepipe.studies.discrepancy.search.prediction import Simulated
from spinepipe.studies.discrepancy.search.projected import taken_out
from spinepipe.studies.discrepancy.search.refit import (
    STARTS, _degenerate, curvature_of, standing, starting_term, weaker,
)
from spinepipe.studies.discrepancy.search.screen import SIZES
from spinepipe.studies.discrepancy.search.search_state import Rules, look
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.units import subtract_baseline

FORMULA_ERROR = 0.1
PRIOR = (0.3, 0.4, 0.15, 0.05)
ELSE = 0.15
ENOUGH = 0.05


@dataclass
class Node:
    terms: tuple[ActiveTerm, ...]
    baseline: BaselineFit | None
    log_evidence: float
    lack: object = None
    screen: object = None
    log_else: float = -np.inf

    @property
    def names(self):
        return frozenset(t.form.name for t in self.terms)

    @property
    def key(self):
        return frozenset((t.form) for t in self.terms)


def joint_laplace(fit, numbers, gain, formula):
    unknowns = fit.hypothesis.unknowns
    own = np.array([u.supposed in numbers for u in unknowns])
    curvature = curvature_of(fit, own)
    chosen = [u for u in unknowns if u.supposed in numbers]
    away = fit.x[own] - np.array([u.mean for u in chosen])
    strength = np.array([u.is_strength for u in chosen])
    of = np.array([u.supposed for u in chosen])
    declared = np.array([u.sd / STRENGTH_SDS if u.is_strength else u.sd for u in chosen])
    sides = np.array([
        fit.hypothesis.supposed[u.supposed].form.variant.create().parameters[u.column].side for u in chosen
    ])
    found = []
    for sizes in product(SIZES, repeat=len(numbers)):
        size = np.select([of == n for n in numbers], sizes)
        sd = np.where(strength, size, 1.0) * declared
        spread = np.eye(len(sd)) + curvature * sd**2
        _, logdet = np.linalg.slogdet(spread)
        fit_to_prior = away @ np.linalg.solve(spread, curvature @ away)
        posterior = np.linalg.inv(curvature + np.diag(sd**-2.0))
        mean = posterior @ (curvature @ away)
        inside = sides * mean / np.sqrt(np.diagonal(posterior))
        half = np.where(sides != 0.0, np.log(2.0) + log_ndtr(inside), 0.0)
        found.append(-0.5 * (logdet + fit_to_prior) + float(half.sum()))
    return 0.5 * gain + formula + float(logsumexp(found)) - float(len(numbers) * np.log(len(SIZES)))


def formula_error(baseline, fit):
    """Log evidence gained where the named effects' formulas are allowed to be off by a share."""
    n = len(fit.hypothesis.supposed)
    if not n or not FORMULA_ERROR:
        return 0.0
    taken = taken_out(fit)
    total_gram, total_moment = None, None
    rank = 0
    columns = {}
    for name, one in baseline.readings.items():
        model = fit.models[name]
        base_effects = len(baseline.start.models[name].effects)
        blocks = []
        extra = model.effects[base_effects:]
        place = 0
        for number, term in enumerate(fit.hypothesis.supposed):
            if not term.form.acts_in(name):
                blocks.append(None)
                continue
            many = len(set(range(1)))
            count = len(baseline.tests) if term.form.spread.name == "BY_TEST" else 1
            without = model.effects[: base_effects + place] + model.effects[base_effects + place + count :]
            place += count
            try:
                other = Simulated(model.with_effects(without), one.cases, baseline.noise.zeroed, ()).at(np.zeros(0)).readings
            except Exception:
                other = None
            blocks.append(other)
        columns[name] = blocks
    # basis: per effect, test, coordinate a smooth function of own motion and progress
    knots = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    grid = np.array([(a, b) for a in knots for b in (0.0, 0.5, 1.0)])
    def kernel(p, q):
        return np.exp(-0.5 * (((p[:, None, 0] - q[None, :, 0]) / 0.4) ** 2 + ((p[:, None, 1] - q[None, :, 1]) / 0.3) ** 2))
    half = np.linalg.cholesky(kernel(grid, grid) + 1e-6 * np.eye(len(grid)))
    tests = list(baseline.tests)
    gram = moment = coupled = None
    shared_gram = shared_moment = 0.0
    q = len(grid)
    for name, one in baseline.readings.items():
        predicted = fit.predicted[name]
        rows = []
        for case_number, case in enumerate(one.cases):
            now = predicted[case_number]
            T, J, _ = now.shape
            reach = np.maximum(np.abs(now).max(axis=0), 1e-9)
            progress = np.linspace(0, 1, T)[:, None, None] * np.ones((1, J, 6))
            points = np.stack([(now / reach).reshape(-1), progress.reshape(-1)], axis=1)
            phi = np.linalg.solve(half, kernel(grid, points)).T.reshape(T, J, 6, q)
            used = [c for c in range(6) if one.tests[case_number].count[..., c].any()]
            columns_here = []
            for other in columns[name]:
                c = np.zeros_like(now) if other is None else now - other[case_number]
                block = FORMULA_ERROR * c[..., None] * phi
                for coordinate in range(6):
                    if coordinate not in all_used(baseline):
                        continue
                    for test in tests:
                        own = np.zeros((T, J, 6, q))
                        if test == case.test:
                            own[:, :, coordinate] = block[:, :, coordinate]
                        columns_here.append(own)
            rows.append(np.concatenate(columns_here, axis=-1))
        white = baseline.setting.whitenings[name](rows)
        t = taken[name]
        left = t.out_of(white)
        g, m, s = left.T @ left, left.T @ t.residual, left.T @ t.shared
        gram = g if gram is None else gram + g
        moment = m if moment is None else moment + m
        coupled = s if coupled is None else coupled + s
        shared_gram = shared_gram + t.shared.T @ t.shared
        shared_moment = shared_moment + t.shared.T @ t.residual
    if coupled.shape[1]:
        inv = np.linalg.pinv(shared_gram, rcond=1e-10, hermitian=True)
        moment = moment - coupled @ inv @ shared_moment
        gram = gram - coupled @ inv @ coupled.T
    a = np.eye(len(gram)) + gram
    factor = cho_factor(a)
    return float(0.5 * moment @ cho_solve(factor, moment) - np.log(np.diagonal(factor[0])).sum())


def all_used(baseline):
    used = set()
    for one in baseline.readings.values():
        for test in one.tests:
            used |= {c for c in range(6) if test.count[..., c].any()}
    return used


def log_prior(names, trials):
    n = len(trials)
    k = len(names)
    ways = {0: 1, 1: n, 2: n * (n - 1) / 2, 3: n * (n - 1) * (n - 2) / 6}[k]
    return float(np.log(PRIOR[k] / ways))


def explore(base: BaselineFit, rules: Rules, most_fits: int, run: PieceRunner, say=print):
    trials = {t.effect: t for t in rules.trials}
    fitted: dict = {}
    predicted: dict = {}
    screens = 0

    def expand(node):
        nonlocal screens
        node.screen = run(look, node.baseline, rules.trials, 0, rules.false_alarm, rules.seed, 0.0)
        node.lack = run(lack_of_fit, node.baseline, rules.coordinates, 0, rules.seed)
        node.log_else = node.lack.log_evidence
        screens += 1
        if len(node.terms) >= min(rules.most_effects, 3):
            return
        excess = sum(float(r @ r) for r in node.baseline.fit.residuals.values())
        for one in node.screen.effects:
            if one.effect in node.names:
                continue
            seen = set()
            for form in one.forms:
                if form.form.variant in seen:
                    continue
                seen.add(form.form.variant)
                key = node.key | {form.form}
                if key in fitted:
                    continue
                value = node.log_evidence + min(form.log_evidence, 0.5 * excess)
                if value > predicted.get(key, (-np.inf,))[0] or key not in predicted:
                    predicted[key] = (value, node, starting_term(form))

    root = Node((), base, 0.0)
    fitted[frozenset()] = root
    expand(root)
    fits = 0
    log = []
    WEAK = 2.0

    def weak(key):  # the linear prediction holds where an effect does next to nothing
        value, parent, _ = predicted[key]
        return value - parent.log_evidence < WEAK

    while fits < most_fits:
        total = logsumexp([lp(node, trials) for node in fitted.values()])
        best = max(
            ((value + log_prior({f.name for f in key}, trials), key) for key, (value, *_ ) in predicted.items() if key not in fitted and not weak(key)),
            default=None, key=lambda p: p[0],
        )
        if best is None:
            break
        known = logsumexp([total, *(v + log_prior({f.name for f in k}, trials) for k, (v, *_) in predicted.items() if k not in fitted and weak(k))])
        rest = logsumexp([v + log_prior({f.name for f in k}, trials) for k, (v, *_) in predicted.items() if k not in fitted and not weak(k)])
        unfitted = np.exp(rest - np.logaddexp(rest, known))
        if unfitted < ENOUGH:
            break
        _, key = best
        value, parent, term = predicted.pop(key)
        fits += 1
        before = parent.baseline
        for share in STARTS:
            supposed = (*standing(before.fit), weaker(term, share))
            fit = run(joint_fit, before.suppose(supposed), before.setting, before.fit.poses)
            if fit.usable:
                break
        if not fit.usable or any(_degenerate(fit, k) for k in range(len(supposed))):
            fitted[key] = Node(supposed, None, -np.inf)
            log.append((sorted(f.name for f in key), value, -np.inf))
            continue
        gain = base.fit.chi2 - fit.chi2
        at = before.at(fit)
        numbers = tuple(range(len(supposed)))
        extra = formula_error(at, fit)
        evidence = joint_laplace(fit, numbers, gain, extra) + sum(trials[t.form.name].log_share(t.form) for t in supposed)
        node = Node(supposed, at, evidence)
        fitted[key] = node
        log.append((sorted(f.name for f in key), value, evidence, extra))
        # look beside it only where it holds mass
        total = logsumexp([lp(n, trials) for n in fitted.values()])
        if lp(node, trials) > total - 3.0:
            expand(node)
    nodes = [n for n in fitted.values() if np.isfinite(n.log_evidence)]
    logs, what = [], []
    for n in nodes:
        p = n.log_evidence + log_prior(n.names, trials)
        logs.append(p + np.log(1 - ELSE)); what.append((n.names, False))
        if np.isfinite(n.log_else):
            logs.append(p + np.log(ELSE) + n.log_else); what.append((n.names, True))
    for k, (v, parent, _) in predicted.items():
        if k not in fitted and weak(k):
            p = v + log_prior({f.name for f in k}, trials)
            logs.append(p + np.log(1 - ELSE)); what.append((frozenset(f.name for f in k), False))
            logs.append(p + np.log(ELSE) + parent.log_else); what.append((frozenset(f.name for f in k), True))
    weights = np.exp(np.array(logs) - logsumexp(logs))
    prob: dict = {}
    for w, (names, other) in zip(weights, what):
        for name in names:
            prob[name] = prob.get(name, 0.0) + w
        if other:
            prob["something_else"] = prob.get("something_else", 0.0) + w
        if not names and not other:
            prob["null"] = prob.get("null", 0.0) + w
    sets: dict = {}
    for w, (names, other) in zip(weights, what):
        sets[(tuple(sorted(names)), other)] = sets.get((tuple(sorted(names)), other), 0.0) + w
    return prob, dict(sorted(sets.items(), key=lambda kv: -kv[1])[:6]), fits, screens, log, fitted


def lp(node, trials):
    return node.log_evidence + log_prior(node.names, trials) if np.isfinite(node.log_evidence) else -np.inf

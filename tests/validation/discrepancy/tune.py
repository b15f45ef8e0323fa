"""`python -m tests.validation.discrepancy.tune --kinds null,one,part --n 12 --seed 20000`.

A quick look while the search is being changed: one line per cohort, nothing is kept. Seeds are
those for tuning alone; they are never scored.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from multiprocessing import get_context

from tests.validation.discrepancy.judged import Judged, judged
from tests.validation.discrepancy.parameters import Compared, compared
from tests.validation.discrepancy.row import Row, scored
from tests.validation.discrepancy.seeds import TUNING
from tests.validation.discrepancy.targets import DRAWN, Target

HEADER = (
    f"{'seed':>5} {'kind':<9} {'hidden':<46} {'formula':<13} {'gap':>5} {'left':>5} "
    f"{'verdict':<7} {'right':<5} {'cpu seconds':>13}  names"
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make, search and tell cohorts for tuning."""
    asked = _options(arguments)
    wanted = list(_targets(asked.kinds.split(","), asked.n, asked.seed, asked.effect))
    print(HEADER, flush=True)
    answers: Counter[str] = Counter()
    found: list[Compared] = []
    started = time.monotonic()
    for target, row in _scored(wanted, asked.jobs):
        one = judged(row) if row["status"] in ("scored", "refused") else None
        answers[f"{target.kind}: {_right(one)}"] += 1
        found += compared(row) if row["status"] == "scored" else []
        print(_line(target, row, one, asked.why), flush=True)
    seconds = time.monotonic() - started
    print(f"{len(wanted)} cohorts in {seconds:.0f} s; " + ", ".join(_told(answers)), flush=True)
    print(_inside(found), flush=True)


def _inside(found: Sequence[Compared]) -> str:
    """How many true parameters lie in their regions."""
    scored = [one for one in found if one.inside is not None]
    known = [one for one in scored if one.identifiable]
    every, closed = (f"{sum(bool(o.inside) for o in of)} of {len(of)}" for of in (scored, known))
    return f"parameters: truth in the region {every}; where both its ends are known {closed}"


def _scored(targets: Sequence[Target], jobs: int) -> Iterator[tuple[Target, Row]]:
    if jobs <= 1:
        yield from map(_one, targets)
        return
    with get_context("spawn").Pool(jobs) as workers:
        yield from workers.imap(_one, targets)


def _one(target: Target) -> tuple[Target, Row]:
    row = scored(target.recipe)
    told = {"kind": target.kind, "label": target.label, "seed": target.seed}
    return target, row | {"target": told | {"gap": target.recipe.gap}}


def _targets(kinds: Sequence[str], number: int, seed: int, effect: str | None) -> Iterator[Target]:
    """As many of each kind as asked for, kinds by turns; only those that hide an effect, if any."""
    counts = dict.fromkeys(kinds, 0)
    for place in range(TUNING[1] - seed):
        for order, kind in enumerate(kinds):
            if counts[kind] >= number:
                continue
            target = DRAWN[kind](place, seed + place * len(kinds) + order)
            if effect is None or effect in target.label.split("+"):
                counts[kind] += 1
                yield target
        if min(counts.values()) >= number or place > 100 * number:
            return


def _line(target: Target, row: Row, one: Judged | None, why: bool) -> str:
    seconds = row.get("seconds", {})
    parts = ("make", "search", "besides")
    spent = "+".join(f"{seconds.get(part, 0.0):.1f}" for part in parts)
    said = row.get("verdict", row["status"])
    names = "+".join(row.get("named", [])) or row["message"]
    tied = f" | set: {', '.join(row['tied'])}" if row.get("tied") else ""
    reason = f"\n      {row.get('why', '')}" if why and row.get("why") else ""
    gap = row.get("truth", {}).get("gap", 0.0)
    left = row.get("gap", {}).get("final", 0.0) or 0.0
    return (
        f"{target.seed:>5} {target.kind:<9} {target.label[:46]:<46} {_formulas(row):<13} "
        f"{gap:5.2f} {left:5.2f} {said:<7} {_right(one):<5} {spent:>13}  {names}{tied}{reason}"
    )


def _formulas(row: Row) -> str:
    hidden = row["recipe"]["hidden"]
    return "+".join(str(one["shape"].get("formula", "-")) for one in hidden)[:13]


def _right(one: Judged | None) -> str:
    return "fail" if one is None else one.answer


def _told(answers: Counter[str]) -> list[str]:
    return [f"{what} {number}" for what, number in sorted(answers.items())]


def _seed(text: str) -> int:
    seed = int(text)
    if not TUNING[0] <= seed < TUNING[1]:
        sys.exit(f"seeds for tuning are {TUNING[0]} to {TUNING[1] - 1}; others are scored once")
    return seed


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.validation.discrepancy.tune")
    parser.add_argument("--kinds", default="null,one,part", help=", ".join(DRAWN))
    parser.add_argument("--n", type=int, default=12, help="of each kind")
    parser.add_argument("--seed", type=_seed, default=TUNING[0], help="the first")
    parser.add_argument("--effect", help="only cohorts that hide this effect")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--why", action="store_true", help="with the sentence of the verdict")
    asked = parser.parse_args(arguments)
    if unknown := set(asked.kinds.split(",")) - set(DRAWN):
        parser.error(f"no kind {', '.join(sorted(unknown))}: {', '.join(DRAWN)}")
    return asked


if __name__ == "__main__":
    main()

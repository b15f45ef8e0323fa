"""`python -m tests.mutants [--each N] [--seed S] [AREA ...]`: put in faults, count who sees them.

Each fault is put into a copy of the project. The tests that run its line are run, then all of the
files they are in. What no test sees is listed, to be looked at by a person: a test is missing, or
the code means the same, which goes into `equal.csv`.
"""

import argparse
from collections.abc import Sequence

from tests.mutants.copies import Copies
from tests.mutants.reach import ROOT, Reach
from tests.mutants.sample import AREAS, Mutant, drawn
from tests.mutants.table import Ended, equal_ones, table

TABLE = ROOT / "docs" / "mutants.md"
KEPT = ROOT / ".mutants"
"""What the tests were seen to run; followed again where code or tests changed."""


def followed(copies: Copies) -> Reach:
    """What all tests run; progress is printed."""
    KEPT.mkdir(exist_ok=True)
    reach = Reach(KEPT)
    missing = reach.missing()
    failures = copies.each(lambda copy, tests: copy.follow(tests, reach), missing)
    for number, (name, failed) in enumerate(zip(missing, failures, strict=True), start=1):
        fails = f": fails without a fault: {failed}" if failed else ""
        print(f"followed {number}/{len(missing)} {name}{fails}", flush=True)
    return Reach(KEPT)


def tried(mutants: Sequence[Mutant], workers: int) -> list[Ended]:
    """All mutants, in copies of their own; progress is printed."""
    with Copies(workers) as copies:
        reach = followed(copies)
        ended = []
        for one in copies.each(lambda copy, mutant: copy.try_one(mutant, reach), mutants):
            ended.append(one)
            was, becomes = one.mutant.change()
            where = f"{one.mutant.path}:{one.mutant.line} {was} -> {becomes}"
            print(f"{len(ended)}/{len(mutants)} {one.seen_by or 'LIVES'}: {where}", flush=True)
        return ended


def main() -> None:
    """Draw, try, print and write the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants")
    parser.add_argument("areas", nargs="*", choices=[[], *AREAS], help="all by default")
    parser.add_argument("--each", type=int, default=20, help="mutants of each area")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--workers", type=int, default=2, help="copies at once")
    asked = parser.parse_args()
    areas = asked.areas or list(AREAS)
    mutants = [one for area in areas for one in drawn(area, asked.each, asked.seed)]
    equal = [one for one in mutants if (one.path, *one.change()) in equal_ones()]
    ended = tried([one for one in mutants if one not in equal], asked.workers)
    words = " ".join(["python -m tests.mutants", f"--each {asked.each}", f"--seed {asked.seed}"])
    text = table(ended, equal, " ".join([words, *asked.areas]))
    print(text)
    TABLE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

"""``python -m tests.generators.tracking``: write a cohort of made-up people."""

import argparse
from pathlib import Path

from tests.generators.tracking.write import Wanted, cohort


def main() -> None:
    """Read the arguments and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--generator", choices=("torques", "muscles"), default="torques")
    parser.add_argument("--subjects", type=int, default=10)
    parser.add_argument("--plain", action="store_true", help="the control: exponentials, no errors")
    parser.add_argument("--rate", type=float, default=50.0, help="frames a second")
    parser.add_argument("--long", type=float, default=4.0, help="seconds that a bend takes")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    wanted = Wanted(
        *(asked.seed, asked.generator, asked.subjects, asked.plain, asked.rate, asked.long)
    )
    cohort(wanted, asked.out)


if __name__ == "__main__":
    main()

"""Write the cohort ``t12s1_phantom``; as a library, import ``tests.generators.phantom``.

Usage: python tests/generators/t12s1_phantom.py [folder]
"""

import sys
from pathlib import Path

from phantom import SEED, phantom, write  # beside this script

if __name__ == "__main__":
    default = Path(__file__).parents[2] / "config" / "cohorts" / "t12s1_phantom"
    write(phantom(SEED), sys.argv[1] if len(sys.argv) > 1 else default)

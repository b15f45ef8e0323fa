"""`python -m spinepipe.cli` is `spinepipe`."""

import sys

from spinepipe.cli.program import main

sys.exit(main())

"""The map of parameters: laws of the generator and of spinepipe at mapped values are the same."""

from typing import Any

import numpy as np
import pytest

from spinepipe.effects import PATH_KINDS_UNUSED, create  # noqa: F401

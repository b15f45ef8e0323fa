"""All cases, in order, from one seed."""

import random
from collections.abc import Iterator

from tests.generators.spoilt.case import Case
from tests.generators.spoilt.cells import cell_cases
from tests.generators.spoilt.folders import stray_cases, yaml_cases
from tests.generators.spoilt.keys import key_cases, yaml_files
from tests.generators.spoilt.projects import projects
from tests.generators.spoilt.quantities import quantity_cases
from tests.generators.spoilt.recordings import recording_cases
from tests.generators.spoilt.tables import table_cases


def cases(seed: int = 19) -> Iterator[Case]:
    """Every case; the same for the same seed."""
    met: set[str] = set()
    for project in projects():
        rng = random.Random(f"{seed} {project.name}")
        yield from recording_cases(project)
        if project.spoilt_elsewhere:
            continue
        for stem in project.tables:
            if _new(f"{project.folder}/{stem}", met):
                yield from cell_cases(project, stem, rng)
                yield from table_cases(project, stem, rng)
        for file, form in yaml_files(project):
            if _new(file, met):
                yield from key_cases(project, file, form, rng)
                yield from yaml_cases(project, file)
        if not project.mapping:
            yield from stray_cases(project)
        yield from quantity_cases(project)


def _new(file: str, met: set[str]) -> bool:
    """Whether no project before had this file, which is then noted."""
    is_new = file not in met
    met.add(file)
    return is_new


def sample(number: int, seed: int = 19) -> list[Case]:
    """So many of them, drawn from all."""
    every = list(cases(seed))
    return random.Random(seed).sample(every, number)

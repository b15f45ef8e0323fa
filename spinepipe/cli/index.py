"""`spinepipe index`: the page of all studies, with the state of each."""

import argparse

from spinepipe.cli.find import study_names
from spinepipe.jobs.expected import Expected
from spinepipe.problems import InputError
from spinepipe.report.overview.index import write_index
from spinepipe.studies import read as studies


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """It asks nothing: a run writes the page too, and looks at the studies of the run alone."""


def run(options: argparse.Namespace) -> int:
    """Work out of each study that has results whether they are up to date; write the page."""
    up_to_date: dict[str, bool | None] = {}
    for name in study_names(options.root):
        if (options.root / "results" / name).is_dir():
            try:
                checked = studies.check(options.root, name, starting=False)
                up_to_date[name] = Expected(str(options.root), *checked).is_up_to_date
            except InputError:
                up_to_date[name] = None
    print(write_index(options.root, up_to_date))
    return 0

"""`spinepipe index`: the page of all studies, with the state of each."""

import typer

from spinepipe.cli.find import study_names
from spinepipe.jobs.expected import Expected
from spinepipe.problems import InputError
from spinepipe.report.overview.index import entry, write_index
from spinepipe.studies import read as studies


def command(context: typer.Context) -> int:
    """Write the page of all studies, and say which are up to date."""
    root = context.obj
    up_to_date: dict[str, bool | None] = {}
    for name in study_names(root):
        if (root / "results" / name).is_dir():
            try:
                checked = studies.check(root, name, starting=False)
                up_to_date[name] = Expected(str(root), *checked).is_up_to_date
            except InputError:
                up_to_date[name] = None
    page = write_index(root, up_to_date)
    entries = [entry(root, name, up_to_date) for name in study_names(root)]
    for one in entries:
        print(f"{one.state:14}{one.name}" + (f": {one.trouble}" if one.trouble else ""))
    print(f"Page: {page}")
    if late := [one.name for one in entries if one.level == "check"]:
        print(f"Next: spinepipe why {late[0]}, or  spinepipe run {late[0]}")
    context.meta["data"] = {
        "page": str(page),
        "studies": [
            {"study": one.name, "state": one.state, "trouble": one.trouble, "answer": one.answer}
            for one in entries
        ],
    }
    return 0

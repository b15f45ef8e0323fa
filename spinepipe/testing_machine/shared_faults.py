"""A fault that many files show, told once: at the key of the settings where that is behind it."""

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem
from spinepipe.report.words import count, listed
from spinepipe.testing_machine.recording import NO_COLUMN
from spinepipe.testing_machine.settings import MachineMapping

OF_FORM = re.compile(r"is `form\.(?P<doubt>\w+)` right\?|set `form: \{(?P<key>\w+): ")

OWN = (
    "if each file holds one direction, give it columns of its own under `files`: "
    '{glob: "{specimen}_LB.csv", test: LB, loads: [...], motion: [...]}'
)


def told_once(
    document: YamlDocument, mapping: MachineMapping, problems: Sequence[InputProblem]
) -> Iterator[InputProblem]:
    """Problems of files, those of one cause in one.

    Parameters
    ----------
    document, mapping : the settings, an item of `files` for each file.
    """
    groups: dict[tuple[str, ...], list[InputProblem]] = defaultdict(list)
    for one in problems:
        if of_form := OF_FORM.search(one.remedy):
            groups["form", of_form["doubt"] or of_form["key"], one.remedy].append(one)
        elif one.found == NO_COLUMN:
            groups["column", str(one.column)].append(one)
        else:
            groups["other", str(one.column), one.found, one.allowed, one.remedy].append(one)
    declared = {
        str(channel.column): f"{side}.{number}.column"
        for side in ("loads", "motion")
        for number, channel in enumerate(getattr(mapping, side))
    }
    common = {of.file for of in mapping.files if of.form is None}
    for (what, key, *_), alike in groups.items():
        first, files = alike[0], list(dict.fromkeys(one.file for one in alike))
        where = f"{count(len(files), 'file')} ({listed(files)})"
        if what == "form" and len(files) > 1 and common <= set(files):
            columns = listed(dict.fromkeys(str(one.column or "nothing") for one in alike))
            stands = getattr(mapping.form, key) or "nothing"
            found = f"{stands}, with which {columns} cannot be read in {where}"
            place = document.place_of(f"form.{key}")
            yield InputProblem(*place, found, "as the files have it", first.remedy)
        elif len(files) < 2:
            yield from alike
        elif what == "column":
            place = (first.file, first.row, key)
            place = document.place_of(declared[key]) if key in declared else place
            remedy = OWN if len(files) < len(mapping.files) else first.remedy
            yield InputProblem(
                *place, f"'{key}', and {NO_COLUMN} in {where}", first.allowed, remedy
            )
        else:
            yield replace(first, found=f"{first.found}, in {where}")

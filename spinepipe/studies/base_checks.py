"""Does the model file that a study builds on exist, can it be read, and does it fit the cohort?"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects import EffectKind, create
from spinepipe.model.file import EffectEntry, ModelFile, effects_for, read_model
from spinepipe.problems import InputError, InputProblem, Spelling
from spinepipe.studies.base_model import BUSHING, made_by

KEY = "base.model"
LAWS = (EffectKind.JOINT_LAW, EffectKind.PATH)


@dataclass(frozen=True)
class BaseCheck:
    """Every way in which the model file of a study is none, or is of another spine.

    Attributes
    ----------
    own_bushings : whether the study brings the bushings itself, so that those of the file say
        nothing, and what else the file holds comes behind the study's.
    """

    own_bushings: bool

    def __call__(
        self, document: YamlDocument, study: Any, cohort: Cohort, root: Path
    ) -> Iterator[InputProblem]:
        """Problems of ``study.base.model``; none where the study builds on no file.

        A file that another study makes may be missing until that study has run.

        Parameters
        ----------
        document : the study file, for the line of the key.
        root : folder of the Snakefile.
        """
        name = None if study.base is None else study.base.model
        if name is None:
            return
        path = root / name  # an absolute path replaces the root
        maker = made_by(path, root)
        if maker == study.study:
            allowed = "a model file that this study does not write itself"
            yield InputProblem(*document.place_of(KEY), name, allowed, "copy it to another folder")
        elif path.is_file():
            remade = f"; or delete the file, and study {maker} makes it anew" if maker else ""
            for problem in self._of_file(path, name, cohort, maker):
                yield replace(problem, remedy=problem.remedy + remade)
        elif maker is None:
            allowed = "a model file, or a result of another study in config/studies"
            remedy = "correct the path (it begins at the folder of the Snakefile) or add the file"
            yield InputProblem(*document.place_of(KEY), f"no file '{name}'", allowed, remedy)

    def _of_file(
        self, path: Path, name: str, cohort: Cohort, maker: str | None
    ) -> Iterator[InputProblem]:
        """Problems of a file that is there, told under the name that the study gives it.

        A result of another study may be of another cohort: its name says whose it is.
        """
        try:
            model = read_model(path)
            effects_for(model, "*", cohort.joint_names)
        except InputError as error:
            yield from (replace(problem, file=name) for problem in error.problems)
            return
        if maker is None and model.cohort != cohort.name:
            found, allowed = f"'{model.cohort}'", f"the study's cohort, '{cohort.name}'"
            remedy = "take another file; or, where the model is meant for this cohort too, write so"
            yield InputProblem(name, None, "cohort", found, allowed, remedy)
        if self.own_bushings:
            yield from _order(model, name)
        for number, entry in enumerate(model.effects):
            place = f"effects.{number}"
            # Bushings that a study replaces are judged, too, in a file that no study makes.
            if entry.effect != BUSHING or not self.own_bushings or maker is None:
                yield from _strangers(entry, name, place, cohort)
            if entry.effect != BUSHING and self.own_bushings:
                yield from _without_values(entry, name, place, cohort)


def _order(model: ModelFile, name: str) -> Iterator[InputProblem]:
    """The study's bushing comes first; laws before the file's would no longer be before it."""
    names = [entry.effect for entry in model.effects]
    if BUSHING not in names:
        return
    for number, entry in enumerate(model.effects[: names.index(BUSHING)]):
        if create(entry.effect, entry.options).kind in LAWS:
            allowed = f"{BUSHING} before all laws: later ones may scale what it carries"
            place = (name, None, f"effects.{number}")
            yield InputProblem(
                *place, f"{entry.effect} first", allowed, f"move {BUSHING} to the top"
            )


def _strangers(entry: EffectEntry, name: str, place: str, cohort: Cohort) -> Iterator[InputProblem]:
    """Specimens and tests that the cohort does not have."""
    specimens = cohort.specimen_names
    named = [("scope.specimens", "specimen", one, specimens) for one in entry.scope.specimens]
    named += [("scope.tests", "test", one, cohort.tests) for one in entry.scope.tests]
    named += [("values.specimen", "specimen", row.specimen, specimens) for row in entry.values]
    words = {tuple(known): Spelling(known, "delete it or correct its name") for *_, known in named}
    for where, what, one, known in named:
        if one != "*" and one not in known:
            spelling = words[tuple(known)]
            found, allowed = f"unknown {what} '{one}'", f"* or {spelling.allowed}"
            yield InputProblem(name, None, f"{place}.{where}", found, allowed, spelling.remedy(one))


def _without_values(
    entry: EffectEntry, name: str, place: str, cohort: Cohort
) -> Iterator[InputProblem]:
    """Specimens in scope for which a file with values has none."""
    rows, scope = {row.specimen for row in entry.values}, entry.scope.specimens
    if not rows or "*" in rows:
        return
    acts_in = [one for one in cohort.specimen_names if "*" in scope or one in scope]
    missing = [one for one in acts_in if one not in rows]
    if missing:
        found, allowed = f"no value for {', '.join(missing)}", "a value for every specimen in scope"
        remedy = "add values for them or for *, or name the others as its scope"
        yield InputProblem(name, None, f"{place}.values", found, allowed, remedy)

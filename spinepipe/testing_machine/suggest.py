"""Settings for files that nobody has described: what names and numbers suggest, as import.yaml.

The test with the widest swing of a moment tells whose direction that moment has; a rotation has the
sign with which it follows its moment, as a joint moves with its load.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import yaml

from spinepipe.cohort.checks import height
from spinepipe.cohort.cohort import joint_names
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.imports.file_patterns import with_files
from spinepipe.problems import InputError, InputProblem
from spinepipe.testing_machine.channels import DIRECTIONS, factor_of
from spinepipe.testing_machine.sniff import SeenColumn, SeenFile

ANSWERS = ("time", "moment", "angle", "force", "no")
"""What a column may be taken as; `no`: it is not used."""

WORDS = {
    "time": r"\b(time|zeit|temps|tiempo|x_value|t)\b",
    "moment": r"torque|moment|drehmo|couple|\bm[xyz]\b",
    "angle": r"angle|rotation|winkel|ángulo|\b(rx|ry|rz)\b",
    "force": r"force|load|kraft|fuerza|\bf[xyz]\b",
}
"""Names of columns by what they hold, in small letters."""

KINDS_OF_UNITS = {
    **{"s": "time", "ms": "time", "min": "time", "clock": "time", "N": "force", "kN": "force"},
    **{"N m": "moment", "N mm": "moment", "N cm": "moment", "deg": "angle", "rad": "angle"},
}

SIDES = (
    ({"fe", "flexion", "flex", "extension", "ext", "flexext"}, ("flexion", "extension")),
    ({"lb", "lateral", "bending", "bend", "side"}, ("right_bending", "left_bending")),
    ({"ar", "axial", "rotation", "rot", "torsion", "twist"}, ("left_rotation", "right_rotation")),
)
"""Words in names of tests, and their directions; the first where a test goes to both sides."""

OTHER_WORDS = {"left", "right", "and"}

LARGE_NM, SMALL_DEG = 50.0, 0.35
"""Without a unit, moments above are N mm, and angles that stay below this are rad."""

SAID = {
    "form": "  # how the files are written",
    "loads": "  # where a positive number turns or pushes the upper vertebra",
    "motion": "  # where a positive number moves it, relative to the vertebra below",
    "files": "  # preconditioning_cycles: so many are left out at the beginning",
}
"""What is said in import.yaml of its keys."""

JOINT = re.compile(r"\b(S1|[LTC]\d{1,2})[-_/ ]?(S1|[LTC]\d{1,2})\b", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Suggestion:
    """What files are taken as; every part may be corrected before `settings` is asked for.

    Attributes
    ----------
    of : specimen and test by name of the file.
    taken : what each column is and its unit, by the key of the column.
    towards : where a positive moment turns the upper vertebra, by test; empty: not known.
    joints : joint that an angle moves, by key of the column; those left out move the lowest.
    force_towards : direction of forces that count, by key. load_point_mm : where all of them act.
    """

    folder: Path
    files: Sequence[SeenFile]
    of: Mapping[str, tuple[str, str]]
    taken: dict[str | int, tuple[str, str]]
    towards: dict[str, str]
    vertebrae: tuple[str, ...]
    joints: dict[str | int, str]
    force_towards: dict[str | int, str] = field(default_factory=dict)
    load_point_mm: list[float] = field(default_factory=list)

    @property
    def specimens(self) -> list[str]:
        """Each once, in the order of the files."""
        return list(dict.fromkeys(specimen for specimen, _ in self.of.values()))

    @property
    def tests(self) -> list[str]:
        """Each once, in the order of the files."""
        return list(dict.fromkeys(test for _, test in self.of.values()))

    def columns(self) -> dict[str | int, list[SeenColumn]]:
        """The columns of all files, by key."""
        found: dict[str | int, list[SeenColumn]] = defaultdict(list)
        for file in self.files:
            for one in file.columns:
                found[one.key].append(one)
        return found

    def _is(self, file: SeenFile, what: str) -> list[SeenColumn]:
        return [one for one in file.columns if self.taken[one.key][0] == what]

    def channels(
        self, file: SeenFile
    ) -> tuple[SeenColumn | None, list[dict[str, Any]], list[dict[str, Any]]]:
        """The moment that drives a file, and its `loads` and `motion`."""
        towards = self.towards.get(self.of[file.name][1], "")
        moments = self._is(file, "moment")
        if not moments or not towards:
            return None, [], []
        sizes = [
            np.nanstd(o.values) * abs(factor_of(self.taken[o.key][1], towards)) for o in moments
        ]
        driving = moments[int(np.argmax(sizes))]
        loads = [self._channel(driving.key, positive=towards)]
        of_joint: dict[str, list[SeenColumn]] = defaultdict(list)
        for one in self._is(file, "angle"):
            of_joint[self.joints.get(one.key, joint_names(self.vertebrae)[0])].append(one)
        motion = []
        for joint, angles in of_joint.items():
            most = max(angles, key=lambda one: float(np.nanstd(one.values)))
            both = np.isfinite(most.values) & np.isfinite(driving.values)
            follows = np.cov(most.values[both], driving.values[both])[0, 1] >= 0.0
            way = towards if follows else opposite(towards)
            motion.append(self._channel(most.key, joint=joint, positive=way))
        for one in self._is(file, "force"):
            loads.append(
                self._channel(one.key, positive=self.force_towards.get(one.key, "superior"))
            )
        return driving, loads, motion

    def _channel(self, key: str | int, **more: str) -> dict[str, Any]:
        return {"column": key, "unit": self.taken[key][1], **more}

    def settings(self, header: Mapping[str, Any], preconditioning: int) -> str:
        """The text of import.yaml.

        Parameters
        ----------
        header : `cohort`, `title`, `source` and what else stands above the files.
        preconditioning : so many cycles at the beginning of each file are left out.
        """
        own: dict[str, dict[str, Any]] = {}
        for file in self.files:
            driving, loads, motion = self.channels(file)
            time = [self._channel(one.key) for one in self._is(file, "time")]
            own[file.name] = {"form": dict(file.form), "time": time[0] if time else {}}
            own[file.name] |= {"loads": loads, "motion": motion}
            own[file.name]["driving"] = driving.key if driving is not None else None
        common: dict[str, Any] = {}
        for key in ("form", "time"):
            values = [one[key] for one in own.values()]
            common[key] = max(values, key=values.count)
        names = [{str(one.key) for one in file.columns} for file in self.files]
        for key in ("loads", "motion"):
            every = {_flow(c): c for one in own.values() for c in one[key]}.values()
            ways = Counter((DIRECTIONS[c["positive"]].motion, c.get("joint")) for c in every)
            columns = Counter(str(c["column"]) for c in every)
            # else a column has another direction in each test, or only some files have it
            if max(*columns.values(), *ways.values(), 0) == 1 and all(
                columns.keys() <= o for o in names
            ):
                common[key] = list(every)
        lines = [
            "# What these files are: `spinepipe import` of this file. All keys: docs/import.md",
            *(f"{key}: {_flow(value)}" for key, value in header.items()),
        ]
        for key, value in common.items():
            words = SAID.get(key, "")
            rows = [f"  - {_flow(one)}" for one in value] if key in ("loads", "motion") else []
            if value:
                lines += [f"{key}:{words}", *rows] if rows else [f"{key}: {_flow(value)}{words}"]
        lines.append(f"files:{SAID['files'] if preconditioning else ''}")
        for item, name in self._items(own):
            if len(common.get("loads", own[name]["loads"])) > 1:
                item["driving"] = own[name]["driving"]
            if preconditioning:
                item["preconditioning_cycles"] = preconditioning
            differ = [key for key in ("form", "time") if own[name][key] != common[key]]
            differ += [key for key in ("loads", "motion") if key not in common]
            of_file = {key: own[name][key] for key in differ}
            parts = [f"{key}: {_flow(value)}" for key, value in (item | of_file).items()]
            lines.append(f"  - {_flow(item)}" if not of_file else "  - " + "\n    ".join(parts))
        return "\n".join(lines) + "\n"

    def _items(self, own: Mapping[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
        """Items of `files`, each with the first file that it is of: patterns where they do."""
        groups: dict[str, list[str]] = defaultdict(list)
        for name, one in own.items():
            groups[yaml.safe_dump([self.of[name][1], one])].append(name)
        for names in groups.values():
            test = self.of[names[0]][1]
            patterns = {_pattern(name, *self.of[name]) for name in names}
            item = {"glob": next(iter(patterns)), "test": test}
            document, _, problems = with_files(
                self.folder, YamlDocument("", {"files": [item]}, {}), ("specimen", "test")
            )
            there = {(one.get("file"), one.get("specimen")) for one in document.data["files"]}
            if not problems and there == {(name, self.of[name][0]) for name in names}:
                yield item, names[0]
            else:
                for name in names:
                    yield {"file": name, "specimen": self.of[name][0], "test": test}, name


def suggested(folder: Path, files: Sequence[SeenFile], pattern: str | None) -> Suggestion:
    """What names and numbers of the files suggest.

    Raises
    ------
    InputError
        Where names do not tell specimen and test.
    """
    of = _of_pattern(folder, files, pattern) if pattern else _of_names(files)
    taken: dict[str | int, tuple[str, str]] = {}
    joints: dict[str | int, str] = {}
    for file in files:
        for one in file.columns:
            what = KINDS_OF_UNITS.get("clock" if one.clock else one.unit) or next(
                (what for what, words in WORDS.items() if re.search(words, one.words)), "no"
            )
            size = float(np.nanmax(np.abs(one.values)))
            before = taken.get(one.key, ("no", ""))
            if before[1] in ("", "N m", "rad"):  # of all files the largest number tells the unit
                taken[one.key] = what, one.unit or likely_unit(what, size, one.clock, before[1])
            if what == "angle" and (found := JOINT.search(str(one.key))):
                joints[one.key] = "".join(found.groups()).upper()
    forces = {key: ("no", unit) for key, (what, unit) in taken.items() if what == "force"}
    tests = dict.fromkeys(test for _, test in of.values())
    towards = {test: direction_of(test) for test in tests}
    named = {vertebra for joint in joints.values() for vertebra in re.findall(r"[SLTC]\d+", joint)}
    heights = {one: at for one in named if (at := height(one)) is not None}
    chain = tuple(sorted(heights, key=heights.__getitem__)) or ("L5", "L4")
    return Suggestion(folder, files, of, taken | forces, towards, chain, joints)


def likely_unit(what: str, size: float, clock: bool = False, before: str = "") -> str:
    """The unit of a column that tells none, by its largest number."""
    if what == "time":
        return "clock" if clock else "ms" if size > 5000 else "s"
    if what == "moment":
        return "N mm" if size > LARGE_NM else "N m"
    if what == "angle":
        return "rad" if size < SMALL_DEG and before != "deg" else "deg"
    return "N" if what == "force" else ""


def opposite(direction: str) -> str:
    """The other way."""
    one = DIRECTIONS[direction]
    return next(
        word for word, o in DIRECTIONS.items() if o.motion == one.motion and o.sign == -one.sign
    )


def direction_of(test: str) -> str:
    """Where a test turns the upper vertebra first, by the words of its name; empty: not told."""
    words = _words(test)
    for names, (first, second) in SIDES:
        if names & set(words):
            one_sided = (
                set(words) & names <= {"extension", "ext"}
                if first == "flexion"
                else (second.partition("_")[0] in words and first.partition("_")[0] not in words)
            )
            return second if one_sided else first
    return ""


def _words(name: str) -> list[str]:
    return re.findall("[a-z]+", re.sub("(?<=[a-z])(?=[A-Z])", " ", name).lower())


def _of_names(files: Sequence[SeenFile]) -> dict[str, tuple[str, str]]:
    """Specimen and test of names that end with words for a direction, and a number of a repeat."""
    known = OTHER_WORDS.union(*(names for names, _ in SIDES))
    found, wrong = {}, []
    for file in files:
        parts = re.split(r"([_\- ])", PurePath(file.name).stem)
        end = len(parts) - 2 if len(parts) > 4 and parts[-1].isdigit() else len(parts)
        start = end - 1 if len(parts) == 3 else end
        at = end - 1
        while at > 0 and (words := set(_words(parts[at]))) and words <= known:
            start, at = at, at - 2
        if start >= end:
            wrong.append(file.name)
        found[file.name] = "".join(parts[: start - 1]), "".join(parts[start:end])
    if wrong:
        remedy = 'say where they stand: --pattern "{specimen}_{test}.csv"'
        allowed = "names that end with the test: s01_FE, s01_lateral_bending"
        raise InputError(
            [
                InputProblem(
                    wrong[0],
                    None,
                    None,
                    "a name that does not tell its specimen and test",
                    allowed,
                    remedy,
                    len(wrong) - 1,
                )
            ]
        )
    return found


def _of_pattern(
    folder: Path, files: Sequence[SeenFile], pattern: str
) -> dict[str, tuple[str, str]]:
    """Specimen and test as a pattern tells them; a part that it does not have is named `1`."""
    asked = YamlDocument("--pattern", {"files": [{"glob": pattern}]}, {})
    document, _, problems = with_files(folder, asked, ("specimen", "test"))
    there = {one.get("file"): one for one in document.data["files"]}
    if not problems and (other := next((f.name for f in files if f.name not in there), None)):
        problems = [InputProblem(other, None, None, "another name", pattern, "correct --pattern")]
    if problems:
        raise InputError(problems)
    told = {f.name: there[f.name] for f in files}
    return {k: (one.get("specimen", "s1"), one.get("test", "test")) for k, one in told.items()}


def _pattern(name: str, specimen: str, test: str) -> str:
    """The name of a file with its specimen left open, and the number of a repeat."""
    stem, end = name.rpartition(".")[0], PurePath(name).suffix
    stem = re.sub(rf"({re.escape(test)}[_\- ])\d+$", r"\1*", stem)
    return stem.replace(specimen, "{specimen}", 1) + end


def _flow(value: Any) -> str:
    text: str = yaml.safe_dump(
        value, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10_000
    )
    return text.removesuffix("\n").removesuffix("\n...")

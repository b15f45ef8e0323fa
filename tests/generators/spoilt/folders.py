"""YAML files as a whole, and what lies beside files: folders, links, locks, copies."""

import random
from collections.abc import Iterator
from functools import partial

from tests.generators.spoilt.case import FOLDER, GONE, Case, Changes, Content, Expected, Link
from tests.generators.spoilt.projects import Project

REFUSED, TOLD, FINE, OPEN = Expected.REFUSED, Expected.TOLD, Expected.FINE, Expected.OPEN


def _bomb(levels: int) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    for n in range(1, levels):
        inner = ", ".join([f"*a{n - 1}"] * 9)
        lines.append(f"a{n}: &a{n} [{inner}]")
    return "\n".join(lines) + "\n"


def yaml_cases(project: Project, file: str) -> Iterator[Case]:
    """All cases of a YAML file as a whole."""
    text = project.files[file].decode()
    for what, (expected, content) in _contents(text, file).items():
        is_there = isinstance(content, bytes)

        def changes(what: str = what) -> Changes:
            return {file: _contents(text, file)[what][1]}

        beside = () if is_there else ("*",)
        yield Case(project, "file", what, file, "", expected, changes, beside)


BRACKETS, BRACES, COMMENT = "[" * 900_000, "{a: " * 200_000, "#" * 2_000_000
FEW, MANY = ("".join(f"q{k}: 1\n" for k in range(number)) for number in (500, 30_000))
BOMB = _bomb(30)


def _contents(text: str, file: str) -> dict[str, tuple[Expected, Content]]:
    """A YAML file as others write it, and other things in its place."""
    first, _, rest = text.partition("\n")
    return {
        "empty": (REFUSED, b""),
        "blanks alone": (REFUSED, b" \n \n"),
        "a comment alone": (REFUSED, b"# later\n"),
        "a list": (REFUSED, b"- a\n- b\n"),
        "a number": (REFUSED, b"5\n"),
        "JSON": (REFUSED, b'{"a": 1}'),
        "HTML": (REFUSED, b"<html><body>404</body></html>"),
        "alias bomb": (REFUSED, (text + BOMB).encode()),
        "two documents": (REFUSED, f"{text}---\n{text}".encode()),
        "ends of documents": (FINE, f"---\n{text}...\n".encode()),
        "tabs": (REFUSED, (text + "q7:\n\ta: 1\n").encode()),
        "indented first line": (REFUSED, f" {first}\n{rest}".encode()),
        "unknown key": (REFUSED, (text + "q7: 1\n").encode()),
        "500 unknown keys": (
            REFUSED,
            (text + FEW).encode(),
        ),
        "30 000 unknown keys": (
            REFUSED,
            (text + MANY).encode(),
        ),
        "a key of 100 000 characters": (REFUSED, f"{text}{'k' * 100_000}: 1\n".encode()),
        "a key in question": (REFUSED, (text + "? [a, b]\n: 1\n").encode()),
        "directive": (OPEN, f"%TAG ! tag:yaml.org,2002:python/\n---\n{text}".encode()),
        "50 000 dashes": (REFUSED, (text + "q7:\n  " + "- " * 50_000 + "1\n").encode()),
        "900 kB of brackets": (REFUSED, (text + "q7: " + BRACKETS).encode()),
        "900 kB of braces": (REFUSED, (text + "q7: " + BRACES).encode()),
        "2 MB comment": (REFUSED, (text + COMMENT).encode()),
        "CR LF": (FINE, text.replace("\n", "\r\n").encode()),
        "byte-order mark": (FINE, b"\xef\xbb\xbf" + text.encode()),
        "comments": (FINE, f"# about\n\n{text}\n# end\n".encode()),
        "UTF-16": (REFUSED, text.encode("utf-16")),
        "Latin 1": (REFUSED, (text + "# é\n").encode("latin-1")),
        "NUL at the end": (REFUSED, text.encode() + b"\0"),
        "conflict of versions": (REFUSED, f"<<<<<<< HEAD\n{text}=======\n".encode()),
        "noise": (REFUSED, random.Random(2).randbytes(10_000)),
        "packed": (REFUSED, b"\x1f\x8b\x08\x00" + bytes(64)),
        "a folder": (REFUSED, FOLDER),
        "a dead link": (REFUSED, Link("nowhere.yaml")),
        "a link to itself": (REFUSED, Link(file.rpartition("/")[2])),
        "a pipe": (REFUSED, "pipe"),
        "missing": (REFUSED, GONE),
    }


def stray_cases(project: Project) -> Iterator[Case]:
    """What systems and editors leave beside files."""
    inside = project.folder
    stem = project.tables[-1]
    study = project.study.removesuffix(".yaml")
    beside: dict[str, tuple[Expected, Content]] = {
        f"{inside}/.#{stem}.csv": (FINE, Link("somebody@somewhere.123:456")),
        f"{inside}/._{stem}.csv": (FINE, b"\x00\x05\x16\x07"),
        f"{inside}/{stem}.csv~": (FINE, b"\xff"),
        f"{inside}/#{stem}.csv#": (FINE, b"\xff"),
        f"{inside}/.{stem}.csv.swp": (FINE, b"b0VIM"),
        f"{inside}/{stem}.csv.bak": (FINE, b"\xff"),
        f"{inside}/{stem}.csv.orig": (FINE, b"\xff"),
        f"{inside}/~${stem}.csv": (FINE, b"\xff"),
        f"{inside}/{stem} (1).csv": (FINE, b"\xff"),
        f"{inside}/.DS_Store": (FINE, b"\x00\x00\x00\x01Bud1"),
        f"{inside}/Thumbs.db": (FINE, b"\xd0\xcf\x11\xe0"),
        f"{inside}/desktop.ini": (FINE, b"[x]"),
        f"{inside}/notes.txt": (FINE, b"\xff"),
        f"{inside}/raw/{stem}.csv": (FINE, b"\xff"),
        f"{inside}/.git/config": (FINE, b"\xff"),
        f"{inside}/__pycache__/x.pyc": (FINE, b"\xff"),
        f"{inside}/evil.pkl": (FINE, b"cos\nsystem\n(S'id'\ntR."),
        "config/cohorts/.hidden/cohort.yaml": (FINE, b"\xff"),
        "config/cohorts/._x": (FINE, b"\xff"),
        "config/cohorts/README.md": (FINE, b"\xff"),
        f"{study}.yaml~": (FINE, b"\xff"),
        "config/studies/.#x.yaml": (FINE, Link("somebody@somewhere.1:2")),
        "config/studies/._x.yaml": (FINE, b"\xff"),
        "config/studies/#x.yaml#": (FINE, b"\xff"),
        "config/studies/.x.yaml.swp": (FINE, b"\xff"),
        "config/studies/notes.txt": (FINE, b"\xff"),
        "config/studies/x.yaml": (TOLD, FOLDER),
        "config/studies/y.yaml": (TOLD, Link("nowhere.yaml")),
        "config/studies/z.yml": (TOLD, b"study: z\n"),
        "config/studies/u.YAML": (TOLD, b"study: u\n"),
        "config/studies/-rf.yaml": (REFUSED, b"study: -rf\n"),
        "config/studies/a b.yaml": (REFUSED, b"study: a b\n"),
        "config/.#config.yaml": (FINE, Link("somebody@somewhere.1:2")),
        "config/config.yaml~": (FINE, b"\xff"),
    }
    for path, (expected, content) in beside.items():
        yield Case(
            project,
            "stray",
            "beside",
            path,
            "",
            expected,
            partial(dict, {path: content}),
        )

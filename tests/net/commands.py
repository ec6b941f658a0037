"""Sequences of commands, each in a separate folder, and the contents of their files."""

import contextlib
import gc
import io
import json
import os
import re
import shlex
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, NoReturn
from unittest import mock

from tests.net import artists, contents
from tests.net.digests import ROOT, data, table, text

LIKE_ANOTHER = (
    "b.h5",
    "part.h5",
    "cut.partial.h5",
    "kept.h5",
)  # results whose pictures would be those of a.h5


def sections(file: str) -> dict[str, list[str]]:
    """Return the lines of a file of this folder by the head of their section."""
    groups: dict[str, list[str]] = {}
    for line in Path(__file__).with_name(file).read_text().splitlines():
        if head := re.fullmatch(r"\[(\w+)\](.*)", line):
            lines = groups.setdefault(head[1] + head[2], [])
        elif line and not line.startswith("#"):
            lines.append(line)
    return groups


def sequences() -> dict[str, list[str]]:
    """Return the command lines of each sequence."""
    groups = sections("sequences.txt")
    of_run = groups.pop("run")
    for head in [head for head, lines in groups.items() if not lines]:
        name, _, scenario = head.partition(" ")
        groups[name] = [line.replace("SCENARIO", scenario) for line in of_run]
        if scenario:
            del groups[head]
    return groups


def names() -> list[str]:
    """Return the sequences, those that take long first."""
    return sorted(sequences(), key=lambda name: (name != "sweep", "belt" not in name, name))


def of_sequence(name: str, folder: Path) -> Iterator[tuple[str, str, Any]]:
    """Run the commands of a sequence; yield part, name and content."""
    for line in sequences()[name]:
        command, _, file = line.partition(" > ")
        content, out = told(shlex.split(command), folder)
        if file:
            Path(file).write_text(out)
        yield "commands", f"{name}: {line}", content
    made = {str(path.relative_to(folder)): path for path in sorted(folder.rglob("*"))}
    yield "commands", f"{name}: files", list(made)
    for file, path in made.items():
        called = f"{name}: {file}"
        if path.suffix == ".h5":
            yield "files", called, contents.structure(path)
            if file not in LIKE_ANOTHER and path.parent == folder:
                shown = told(["show", file, "--json"], folder)[1]
                for view, content in artists.of_file(Path(file), shown):
                    yield "figures", f"{called} {view}", content
        elif path.suffix == ".html":
            yield "reports", called, contents.report(path, folder)
        elif path.suffix == ".csv":
            yield "commands", called, table(path.read_text())
        elif path.suffix in (".toml", ".json"):
            yield "commands", called, text(path.read_text(), folder)


class Ended(BaseException):
    """The program has ended its process."""


def told(arguments: list[str], folder: Path) -> tuple[dict[str, Any], str]:
    """Run the command line in this process; return its record, and stdout as it is."""
    out, err, process, end = io.StringIO(), io.StringIO(), os.getpid(), os._exit

    def ended(code: int) -> NoReturn:
        if os.getpid() != process:  # a child of the program ends its own
            end(code)
        raise Ended(code)

    with (
        mock.patch.object(sys, "argv", ["frictionsim", *arguments]),
        mock.patch.object(sys, "stdin", io.StringIO("")),
        mock.patch.object(os, "_exit", ended),
        mock.patch.dict(os.environ),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            code: Any = _program()()
        except Ended as at_its_end:
            code = at_its_end.args[0]
        except BaseException as error:
            code = f"{type(error).__name__}: {error}"
        finally:
            gc.enable()  # which the program does without, as its process runs one command
    said = out.getvalue()
    return {
        "code": code,
        "stdout": _parsed(said, folder),
        "stderr": text(err.getvalue(), folder),
    }, said


def _program() -> Any:
    """Return the function behind the console script."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    script = project["scripts"]["frictionsim"]
    return EntryPoint("frictionsim", script, "console_scripts").load()


def _parsed(said: str, folder: Path) -> Any:
    """Return stdout as data where it is JSON or CSV."""
    if said.startswith("{"):
        with contextlib.suppress(ValueError):
            return data(json.loads(said), folder)
    first = said.partition("\n")[0]
    return table(said) if first.count(",") > 3 and " [" in first else text(said, folder)

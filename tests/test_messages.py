"""What the program says of mistakes, held against `tests/messages`, which is read as a whole.

A file has the messages of a room. A case begins with its name, then what leads to the message:

    # a negative coefficient
    pulley.toml: mu_s = 0.2 -> mu_s = -0.2
    $ check pulley.toml
    2| pulley.toml:8: effects.shaft_friction.mu_s = -0.2: ...

Lines in their order, as many of each as needed:

- `FILE: OLD -> NEW` replaces a text that is there once, in a copy of a shipped scenario;
  `FILE: 'TEXT'` writes a file, with the escapes of Python.
- `$ ARGUMENTS` is a command line; what follows is its exit code and what it writes to stderr.
  With code 2 or 4 it changes no file and prints nothing to stdout (but `check`, of other files).
- `> EXPRESSION` is Python, with `fs`, `np` and `Path`, and what the case has named before, as in
  `> (fit := lambda key: ...)`; what follows is the error, the warnings, or the sentences that it
  returns. With an error of input or output it changes no file.

Three dots in what is expected stand for any text on that line. `pytest tests/test_messages.py
--update-messages` writes what does not match anew.
"""

import ast
import re
import shlex
import shutil
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS, in_this_process

FOLDER = Path(__file__).parent / "messages"
ANSWER = re.compile(r"(\d+|\w*Error|\w*Warning|nothing|says)\| ?")


def cases(path: Path) -> list[tuple[str, list[str]]]:
    """Return the names and lines of the cases of a file."""
    first, *rest = re.split(r"^# ", path.read_text(encoding="utf-8"), flags=re.M)
    assert not first.strip(), f"{path.name} begins with a case"
    return [
        (name, body.strip().splitlines()) for name, _, body in (x.partition("\n") for x in rest)
    ]


def files() -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in Path().rglob("*") if not path.is_dir()}


def said(line: str, names: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return the messages of a command or expression, each line behind its exit code or class."""
    before = files()
    if line.startswith("$ "):
        done = in_this_process(capsys, *shlex.split(line[2:]))
        if done.returncode in (2, 4):
            assert files() == before
            assert not done.stdout or done.args[0] == "check"
        # That kernels are compiled is said where no test before has compiled them.
        told = [text for text in done.stderr.splitlines() if "compiling the kernels" not in text]
        return [f"{done.returncode}| {text}".rstrip() for text in told or [""]]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        may_write = True
        try:
            value = eval(line[2:], names)
            messages = [(type(one.message).__name__, str(one.message)) for one in caught]
            said = value if isinstance(value, list | tuple) else [value]
            if ":=" not in line and all(isinstance(one, str) for one in said):
                messages += [("says", text) for text in said]
        except Exception as error:
            messages = [(type(error).__name__, str(error))]
            # What the case has named may write files of its own.
            may_write = len(names) > 3 or not isinstance(error, (fs.InputError, fs.OutputError))
    assert may_write or files() == before
    lines = [(name, text) for name, message in messages for text in message.splitlines()]
    return [f"{name}| {text}".rstrip() for name, text in lines or [("nothing", "")]]


def prepare(line: str) -> None:
    """Write or change a file of a case."""
    name, _, change = line.partition(": ")
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    if change.startswith(("'", '"')):
        path.write_text(ast.literal_eval(change), encoding="utf-8")
        return
    old, arrow, new = change.partition(" -> ")
    if not arrow:
        old, arrow, new = change.removesuffix(" ->"), "->", ""
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{name} has {old!r} {text.count(old)} times"
    path.write_text(text.replace(old, new), encoding="utf-8")


def as_expected(lines: list[str], wanted: list[str]) -> bool:
    patterns = [".*".join(map(re.escape, line.split("..."))) for line in wanted]
    return len(lines) == len(wanted) and all(map(re.fullmatch, patterns, lines))


@pytest.mark.parametrize(
    ("path", "name", "lines"),
    [
        pytest.param(path, name, lines, id=f"{path.stem}: {name}")
        for path in sorted(FOLDER.glob("*.txt"))
        for name, lines in cases(path)
    ],
)
def test_message(
    path: Path, name: str, lines: list[str], here: Path, request: pytest.FixtureRequest,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    for scenario in SCENARIOS.glob("*.toml"):
        shutil.copy(scenario, here)
    messages: list[str] = []
    names: dict[str, Any] = {"fs": fs, "np": np, "Path": Path}
    for line in lines:
        if ANSWER.match(line):
            continue
        messages.append(line)
        if line.startswith(("$ ", "> ")):
            messages += said(line, names, capsys)
        else:
            prepare(line)
    if request.config.getoption("--update-messages") and not as_expected(messages, lines):
        head = f"# {name}\n"
        text = path.read_text(encoding="utf-8")
        new = text.replace(head + "\n".join(lines), head + "\n".join(messages))
        path.write_text(new, encoding="utf-8")
        return
    assert messages == lines or as_expected(messages, lines)

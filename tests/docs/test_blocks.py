"""Every code block of the README and of the pages runs, and prints what the page says.

Blocks of one page run one after another in a folder of their own that has a copy of the scenarios.
What they leave there is known to git, so that following a page keeps the checkout clean.
A comment right above a block says what is particular about it:

    <!-- not run: REASON -->          it is not run
    <!-- exit code 5 -->              `sh`: the last command ends with this code
    <!-- output --> <!-- stderr -->   `text`: what the block before it prints, also of Python
    <!-- part of: FILE -->            `toml`: keys that go over those of a shipped scenario
    <!-- study: FILE -->              `toml`: a study, written there for the blocks that follow

A comment anywhere says what is installed for a page, a project of the checkout:

    <!-- installed: FOLDER -->
"""

import math
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.docs.pages import PAGES, Block, blocks
from tests.support.plugins import install
from tests.support.scenarios import ROOT, SCENARIOS, in_this_process

Done = subprocess.CompletedProcess[str]
RUNNABLE = [page for page in PAGES if any(not b.skipped for b in blocks(page))]
INSTALLED = re.compile(r"^<!-- installed: (\S+) -->$", re.MULTILINE)
PLAIN = re.compile(r"frictionsim [^|<>$;&*`~(]*")
WALL_TIME = re.compile(r"(?<=solved in )\S+(?= s)")
# Roundings are those of a processor.
RELATIVE, ABSOLUTE = 1e-6, 1e-9


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder with the scenarios, where the commands are those of this Python."""
    shutil.copytree(SCENARIOS, tmp_path / "scenarios")
    (tmp_path / ".commands").mkdir()
    for name, arguments in (("frictionsim", "-m frictionsim"), ("python", "")):
        command = tmp_path / ".commands" / name
        command.write_text(f'#!/bin/sh\nexec "{sys.executable}" {arguments} "$@"\n')
        command.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{tmp_path / '.commands'}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path


@pytest.mark.parametrize(
    "page", [p if p == "README.md" else pytest.param(p, marks=pytest.mark.slow) for p in RUNNABLE]
)
def test_the_blocks_of_a_page_run(
    page: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    installed = INSTALLED.findall(PAGES[page].read_text(encoding="utf-8"))
    for project in installed:
        shutil.copytree(ROOT / project, folder / project)
        site = install(folder / project, folder / ".site")
        monkeypatch.setenv("PYTHONPATH", f"{ROOT}{os.pathsep}{site}")
    last: Done | None = None
    names: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.skipped:
            continue
        if block.language == "sh":
            last = run_commands(block, None if installed else capsys)
        elif block.language == "text":
            assert last is not None, f"{block.place}: no commands before this output"
            assert_printed(block, {"output": last.stdout, "stderr": last.stderr}[block.mark])
        elif block.mark.startswith("study: "):
            Path(block.mark.removeprefix("study: ")).write_text(block.text, encoding="utf-8")
        elif block.language == "toml":
            fs.load(scenario_of(block), folder=SCENARIOS)
        elif block.language == "python":
            with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
                # With the names of the blocks before it, as cells of a notebook.
                exec(compile(block.text, block.place, "exec"), names)
            last = subprocess.CompletedProcess([], 0, out.getvalue(), err.getvalue())
        else:
            pytest.fail(f"{block.place}: nothing tests a block of '{block.language}'")
    assert not unknown_to_git(folder), "add them to .gitignore"


def unknown_to_git(folder: Path) -> list[str]:
    """Return the files in a folder that git would show as new if they were in the checkout."""
    if not (ROOT / ".git").exists():  # a copy of the sources
        return []
    files = [str(p.relative_to(folder)) for p in sorted(folder.rglob("*")) if p.is_file()]
    made = [name for name in files if not name.startswith(".")]
    known = set()
    for command in ("ls-files", "check-ignore"):
        line = ["git", "-C", str(ROOT), command, "--", *made]
        known |= {*subprocess.run(line, capture_output=True, text=True).stdout.splitlines()}
    return sorted(set(made) - known)


def run_commands(block: Block, capsys: pytest.CaptureFixture[str] | None) -> Done:
    """Run the commands of a block; each but the last ends with 0.

    With `capsys` those of frictionsim alone, which need no shell, are run in this process.
    """
    lines = block.text.replace("\\\n", " ").strip().splitlines()
    if capsys and all(PLAIN.fullmatch(line) for line in lines):
        runs = [in_this_process(capsys, *shlex.split(line, comments=True)[1:]) for line in lines]
        assert all(run.returncode == 0 for run in runs[:-1]), f"{block.place}: {runs}"
        out, err = "".join(run.stdout for run in runs), "".join(run.stderr for run in runs)
        done = subprocess.CompletedProcess(lines, runs[-1].returncode, out, err)
    else:
        line = ["bash", "-euo", "pipefail", "-c", block.text]
        done = subprocess.run(line, capture_output=True, text=True, timeout=300)
    code = re.fullmatch(r"exit code (\d+)", block.mark)
    wanted = int(code[1]) if code else 0
    assert done.returncode == wanted, f"{block.place}: {done.returncode}\n{done.stderr}"
    return done


def assert_printed(block: Block, printed: str) -> None:
    """Compare the output on a page with the printed one; `...` stands for any lines."""
    shown, actual = words(block.text), words(printed)
    if ["..."] in shown:
        cut = shown.index(["..."])
        tail = len(shown) - cut - 1
        shown, actual = shown[:cut] + shown[cut + 1 :], actual[:cut] + actual[len(actual) - tail :]
    assert len(shown) == len(actual), f"{block.place}: this is printed now:\n{printed}"
    for expected, got in zip(shown, actual, strict=True):
        agree = len(expected) == len(got) and all(map(same, expected, got))
        assert agree, f"{block.place}: {' '.join(expected)}\nis printed as\n{' '.join(got)}"


def words(text: str) -> list[list[str]]:
    return [WALL_TIME.sub("*", line).split() for line in text.strip().splitlines()]


def same(expected: str, got: str) -> bool:
    """Tell whether two words agree, numbers but for their roundings."""
    try:
        return math.isclose(float(expected), float(got), rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    except ValueError:
        return expected == got


def scenario_of(block: Block) -> dict[str, Any]:
    """Return the scenario of a block, or the shipped one with the keys of the block over it."""
    data = tomllib.loads(block.text)
    if "kind" in data:
        return data
    match = re.fullmatch(r"part of: (\S+)", block.mark)
    assert match, f"{block.place}: no scenario; say above it what it is a part of"
    return merged(tomllib.loads((ROOT / match[1]).read_text(encoding="utf-8")), data)


def merged(under: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    both = under | over
    for key in under.keys() & over.keys():
        if isinstance(under[key], dict) and isinstance(over[key], dict):
            both[key] = merged(under[key], over[key])
    return both

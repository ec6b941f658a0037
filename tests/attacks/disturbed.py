"""A command in a separate process, with its files, to be compared with the undisturbed one."""

import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from shlex import quote
from tempfile import mkdtemp
from typing import NamedTuple

from tests.attacks.promise import BrokenPromise
from tests.support.scenarios import ROOT, SCENARIOS

SECONDS = 60.0
# Each with the file that it writes with the same bytes each time.
COMMANDS = (
    ("solve pulley.toml -o a.h5", "a.h5"),
    ("solve pulley.toml -o a.h5 -q", "a.h5"),
    ("solve pulley.toml -o a.h5 --json", "a.h5"),
    ("solve pulley.toml -o a.h5 -vv --set output.interval=9", "a.h5"),
    ("solve pulley.toml -o a.h5 --set output.checkpoint=1e-9", "a.h5"),
    ("solve pulley.toml -o a.h5 --max-steps 50", ""),  # how long it took is in it
    ("solve - -o a.h5", "a.h5"),
    ("resume part.partial.h5 -o a.h5 --json", "a.h5"),
    *((f"show p.h5 {what}", "") for what in ("--json", "--csv", "--scenario")),
    *((f"check {what}", "") for what in ("pulley.toml --json", "missing.toml")),
    ("static pulley.toml", ""),
    *((f"compare p.h5 {what}", "") for what in ("p.h5", "part.partial.h5 --json", "missing.h5")),
    ("new pulley new.toml", "new.toml"),
    ("plot p.h5 -o a.png", "a.png"),
    ("cost pulley.toml --backends events --tolerances 1e-3 --repeats 1 --csv a.csv", ""),
    *(("--help", ""), ("--version", ""), ("solve", "")),
)


class Outcome(NamedTuple):
    """Outcome of a command: exit code, output and files."""

    code: int
    out: str
    err: str
    files: dict[str, bytes]


@cache
def originals() -> Path:
    """Return a folder with a scenario, a whole result and a part of one."""
    folder = Path(mkdtemp(prefix="attack-"))
    shutil.copy(SCENARIOS / "pulley.toml", folder)
    for line in ("solve pulley.toml -q -o p.h5", "solve pulley.toml -q -o part.h5 --max-steps 100"):
        assert run(line, folder).files, line
    return folder


def prepare(folder: Path) -> None:
    """Write the input files of a command."""
    for path in originals().iterdir():
        shutil.copy(path, folder)


def run(
    line: str,
    folder: Path,
    redirections: str = "",
    environment: dict[str, str | None] | None = None,
    before: str = "",
) -> Outcome:
    """Run a command; return what it did. It must neither hang nor crash nor print a traceback.

    Redirections are in the words of bash; variables are set, or taken away where the value is None;
    before the command, the shell does such as `ulimit -n 20;`.
    """
    variables = {**os.environ, "PYTHONPATH": str(ROOT), **(environment or {})}
    given = {name: value for name, value in variables.items() if value is not None}
    there = set(os.listdir(folder))
    source = "< pulley.toml" if " - " in line and "<" not in redirections else ""
    text = f"{before} {quote(sys.executable)} -m frictionsim {line} {source} {redirections}"
    try:
        done = subprocess.run(
            ["bash", "-c", text], cwd=folder, env=given, capture_output=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        raise BrokenPromise(f"{text}: hangs") from None
    out, err = (stream.decode(errors="replace") for stream in (done.stdout, done.stderr))
    if done.returncode in (70, 134, 139) or "Traceback" in err:
        raise BrokenPromise(f"{text}: exit {done.returncode}\n{err}")
    files = {
        name: (folder / name).read_bytes()
        for name in sorted(set(os.listdir(folder)) - there)
        if (folder / name).is_file()
    }
    return Outcome(done.returncode, out, err, files)


@cache
def undisturbed(line: str) -> Outcome:
    """Return the outcome of an undisturbed command."""
    folder = Path(mkdtemp(prefix="attack-"))
    prepare(folder)
    outcome = run(line, folder)
    shutil.rmtree(folder)
    return outcome


def check_undisturbed(line: str, outcome: Outcome, case: str, code: int | None = None) -> str:
    """Check that a command ends and writes as if nothing were in its way; return its exit code.

    A code that is given stands for that of the undisturbed command.
    """
    expected = undisturbed(line)
    code = expected.code if code is None else code
    if outcome.code != code:
        raise BrokenPromise(f"{case}: exit {outcome.code} instead of {code}\n{outcome.err}")
    name = dict(COMMANDS).get(line)
    if name and outcome.files.get(name) != expected.files.get(name):
        raise BrokenPromise(f"{case}: {name} is another file")
    return f"exit {code}"

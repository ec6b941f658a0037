"""Closed, full and broken standard streams: they change neither files nor exit code nor JSON."""

import json
import random
from contextlib import suppress
from pathlib import Path

from tests.attacks.disturbed import COMMANDS, Outcome, originals, prepare, run, undisturbed, written
from tests.attacks.promise import BrokenPromise

STDOUT = ("", ">&-", ">/dev/full", "> >(exit)", "> >(head -c 10 >/dev/null)")
STDERR = ("", "2>&-", "2>/dev/full", "2> >(exit)")
STDIN = ("", "<&-", "</dev/null")
FULL = 4  # of a command that does nothing but print


def attack(rng: random.Random, folder: Path) -> str:
    """Run a command with random streams and compare with the undisturbed one."""
    line, _ = rng.choice(COMMANDS)
    stdout, stderr = rng.choice(STDOUT), rng.choice(STDERR)
    stdin = "" if " - " in line else rng.choice(STDIN)
    prepare(folder)
    found = run(line, folder, f"{stdin} {stdout} {stderr}")
    case = f"{line} {stdin} {stdout} {stderr}"
    _compare(case, found, undisturbed(line), line, stdout)
    return f"exit {found.code}"


def _compare(case: str, found: Outcome, expected: Outcome, line: str, stdout: str) -> None:
    prints_only = not expected.files
    codes = {expected.code}
    if "full" in stdout and prints_only and expected.out:
        codes = {FULL}
    if found.code not in codes:
        raise BrokenPromise(f"{case}: exit {found.code} instead of {codes}\n{found.err}")
    for name in written(line):
        if found.files.get(name) != expected.files.get(name):
            raise BrokenPromise(f"{case}: {name} is another file")
    if found.files.keys() != expected.files.keys():
        raise BrokenPromise(f"{case}: files {sorted(found.files)}")
    if stdout == "" and "--json" in line:
        with suppress(ValueError):
            json.loads(found.out)
            return
        raise BrokenPromise(f"{case}: no JSON: {found.out!r:.500}")


def warm_up() -> None:
    """Make the files that the commands use."""
    originals()

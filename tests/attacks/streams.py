"""Closed, full and broken standard streams: they change neither files nor exit code nor JSON."""

import json
import random
from contextlib import suppress
from pathlib import Path

from tests.attacks.disturbed import (
    COMMANDS,
    check_undisturbed,
    originals,
    prepare,
    run,
    undisturbed,
)
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
    answer = run(line, folder, f"{stdin} {stdout} {stderr}")
    case = f"{line} {stdin} {stdout} {stderr}"
    expected = undisturbed(line)
    prints_only = "full" in stdout and expected.out and not expected.files
    outcome = check_undisturbed(line, answer, case, FULL if prints_only else None)
    if answer.files.keys() != expected.files.keys():
        raise BrokenPromise(f"{case}: files {sorted(answer.files)}")
    if stdout == "" and "--json" in line:
        with suppress(ValueError):
            json.loads(answer.out)
            return outcome
        raise BrokenPromise(f"{case}: no JSON: {answer.out!r:.500}")
    return outcome


warm_up = originals

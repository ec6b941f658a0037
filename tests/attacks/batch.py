"""Cases of one attack in a process of its own, with bounded memory.

    python -m tests.attacks.batch ATTACK SEED FIRST COUNT

prints two lines of JSON for each case: its number when it starts, then its number and outcome. A
process that ends early was ended by the first case without an outcome. What cases themselves write
to stdout goes nowhere: it would stand between these lines.
"""

import contextlib
import faulthandler
import importlib
import json
import os
import random
import sys
import tempfile
from pathlib import Path
from typing import TextIO

from tests.attacks.promise import BrokenPromise

MEMORY = 2 << 30  # address space, bytes; the program and its libraries take half a gigabyte of it


def run_cases(attack: str, seed: int, first: int, count: int) -> None:
    """Try cases of an attack, each in an empty folder."""
    module = importlib.import_module(f"tests.attacks.{attack}")
    report = _take_stdout()
    if hasattr(module, "warm_up"):
        module.warm_up()
    for number in range(first, first + count):
        print(json.dumps({"number": number}), file=report)
        with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
            found = _outcome(module, attack, seed, number, Path(name))
        print(json.dumps({"number": number, **found}), file=report)


def _take_stdout() -> TextIO:
    """Return the stdout of this process, and lead descriptor 1 of its cases to the null device."""
    report = os.fdopen(os.dup(1), "w", buffering=1)  # not inherited by what the cases start
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)
    return report


def _outcome(module: object, attack: str, seed: int, number: int, folder: Path) -> dict[str, str]:
    rng = random.Random(f"{attack} {seed} {number}")
    try:
        return {"outcome": module.attack(rng, folder)}  # type: ignore[attr-defined]
    except BrokenPromise as broken:
        return {"broken": str(broken)}
    except Exception as error:  # of the program, where the command line did not catch it
        return {"broken": f"{type(error).__name__}: {error}"}


def main() -> None:
    """Read the arguments, limit the memory and run the cases."""
    faulthandler.enable()
    with contextlib.suppress(ImportError):  # not on Windows
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    attack, *numbers = sys.argv[1:]
    run_cases(attack, *map(int, numbers))


if __name__ == "__main__":
    main()

"""Cases of one attack in a process of its own, with bounded memory.

    python -m tests.attacks.batch ATTACK SEED FIRST COUNT

prints a line for each case: its number when it starts, then its outcome as JSON. A process that
ends early was ended by the case that it printed last.
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

from tests.attacks.promise import BrokenPromise

MEMORY = 2 << 30  # address space, bytes; the program and its libraries take half a gigabyte of it


def run_cases(attack: str, seed: int, first: int, count: int) -> None:
    """Try cases of an attack, each in an empty folder."""
    module = importlib.import_module(f"tests.attacks.{attack}")
    report = os.fdopen(os.dup(1), "w", buffering=1)  # cases may close or replace their stdout
    if hasattr(module, "warm_up"):
        module.warm_up()
    for number in range(first, first + count):
        print(number, file=report)
        with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
            print(json.dumps(_outcome(module, attack, seed, number, Path(name))), file=report)


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

"""Faulty plug-ins: commands on built-in kinds do what they do without."""

import os
import random
from pathlib import Path

from frictionsim.scenario.kinds import GROUP
from tests.attacks.disturbed import (
    COMMANDS,
    check_undisturbed,
    originals,
    prepare,
    run,
    undisturbed,
)
from tests.attacks.promise import BrokenPromise
from tests.support.scenarios import ROOT

MODULES = (
    *("", "x = (", "raise RuntimeError('odd')", "import sys; sys.exit(3)", "raise SystemExit"),
    *("import nowhere", "SCENARIO = 1", "raise BaseException", "raise MemoryError"),
    "def __getattr__(name): raise SystemExit(3)",
    "class Odd(Exception):\n    def __str__(self): raise SystemExit(3)\nraise Odd",
)
POINTS = (
    "pulley = odd",
    "odd = odd",
    "odd = odd:x",
    "odd = nowhere",
    "belt_drive = odd",
    "x y = odd",
)
# A kind of a faulty plug-in is refused as one that there is not, and does not disturb another.
PRINTING = ("schema pulley", "schema odd")
LINES = (
    *(line for line, _ in COMMANDS if line.startswith(("solve p", "show", "check", "plot", "new"))),
    *("new --list", *PRINTING),
)


def attack(rng: random.Random, folder: Path) -> str:
    """Run a command where a faulty plug-in is installed."""
    line = rng.choice(LINES)
    prepare(folder)
    module, points = rng.choice(MODULES), rng.sample(POINTS, k=rng.randint(1, 2))
    _install(folder / "site", module, points)
    outcome = run(line, folder, environment={"PYTHONPATH": f"{ROOT}{os.pathsep}{folder / 'site'}"})
    if line in PRINTING and outcome.out != undisturbed(line).out:
        raise BrokenPromise(f"{module!r}, {points}: {line} prints {outcome.out}")
    return check_undisturbed(line, outcome, f"{module!r}, {points}: {line}")


def _install(site: Path, module: str, points: list[str]) -> None:
    metadata = site / "odd-1.0.dist-info"
    metadata.mkdir(parents=True)
    (site / "odd.py").write_text(module)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1.0\n")
    lines = "\n".join([f"[{GROUP}]", *points])
    (metadata / "entry_points.txt").write_text(f"{lines}\n")


warm_up = originals

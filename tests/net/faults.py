"""Three hundred faulty scenarios, options and files, made by a seeded program."""

import os
import random
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import frictionsim as fs
from tests.net.commands import sections, told
from tests.net.digests import ROOT

COUNT, BATCH = 300, 10
# Named, so that a further shipped scenario does not change the cases.
SOURCES = [
    *("pulley", "lift", "marble_machine", "epicyclic", "shaft", "hoist_drum", "belt_verification"),
    *("belt_string", "belt_tensioner", "belt_patch", "hard/bouncing_body", "hard/jump_from_csv"),
]
METHODS = ["events", "rkf45", "moreau", "rk45", "dop853", "radau", "bdf", "lsoda", "euler", ""]
LAWS = ["set-valued", "regularised", "published", "creep", "stribeck", ""]
PARTS = sections("faults.txt")
GOLDEN = ROOT / "tests" / "golden"
RESULTS = (GOLDEN / "pulley.h5", GOLDEN / "belt_verification.h5")
OF_RESULTS = ["show @/d.h5", "show @/d.h5 --csv", "resume @/d.h5", "report @/d.h5 -o r.html",
              "compare @/d.h5 @/a.h5"]  # fmt: skip
OF_SCENARIOS = ["check", "check", "static", "solve --max-steps 5 -o r.h5"]


def names() -> list[str]:
    """Return the batches by their first number."""
    return [str(first) for first in range(0, COUNT, BATCH)]


def of_batch(name: str, folder: Path) -> Iterator[tuple[str, Any]]:
    """Yield the messages of the program on some faulty cases."""
    for number in range(int(name), int(name) + BATCH):
        way = WAYS[number % len(WAYS)]
        here = folder / str(number)
        here.mkdir()
        os.chdir(here)
        shutil.copy(RESULTS[0], "a.h5")
        command, what = way(random.Random(f"{way.__name__} {number}"), number)
        said, _ = told([part.replace("@", str(here)) for part in command], here)
        yield f"{number:03}", {"of": what, "command": " ".join(command)} | said


Made = tuple[list[str], str]  # a command, in which @ is the folder, and what is wrong


def edited(rng: random.Random, number: int) -> Made:
    """Check or run a scenario of which a key, a value or a line was changed."""
    name = rng.choice(SOURCES)
    path = fs.scenarios()[name]
    for data in path.parent.glob("*.csv"):
        shutil.copy(data, ".")
    lines = path.read_text().splitlines()
    at = rng.choice([i for i, line in enumerate(lines) if re.match(r"\w+ *=", line)])
    key, rest = re.split(r"(?= *=)", lines[at], maxsplit=1)
    i = rng.randrange(len(key))
    tables = [j for j, line in enumerate(lines) if line.startswith("[")]
    way = rng.choice(["key"] * 3 + ["value"] * 5 + ["removed", "doubled", "cut", "moved", "table"])
    if way == "key":
        lines[at] = f"{key[:i]}{rng.choice(['', key[i] * 2, 'x', '-'])}{key[i + 1 :]}{rest}"
    elif way == "value":
        lines[at] = f"{key} = {rng.choice(PARTS['values'])}"
    elif way == "cut":
        lines[at] = lines[at][: rng.randrange(1, len(lines[at]))]
    elif way == "table":
        at = rng.choice(tables)
        lines[at] = rng.choice(
            ["", "[efects.nothing]", lines[at].replace("]", "x]", 1), "[solver]"]
        )
    elif way == "doubled":
        lines.insert(at, lines[at])
    else:
        line = lines.pop(at)
        if way == "moved":
            lines.insert(rng.randrange(len(lines)), line)
    Path("s.toml").write_text("\n".join(lines) + "\n")
    what = f"{name}:{at + 1} {way}: {lines[at] if at < len(lines) else ''}"
    return [*rng.choice(OF_SCENARIOS).split(), "@/s.toml"], what


def method(rng: random.Random, number: int) -> Made:
    """Check a scenario with a law and a method that may not fit."""
    name = rng.choice(SOURCES)
    effects = re.findall(r"^\[effects\.(\w+_friction)\]", fs.scenarios()[name].read_text(), re.M)
    sets = [f"solver.backend={rng.choice(METHODS)}"]
    sets += [f"effects.{effect}.law={rng.choice(LAWS)}" for effect in effects]
    sets.append(rng.choice(["solver.step=1e-3", "solver.max_step=1e-3", "solver.rtol=1e-5"]))
    return ["check", name, *(part for one in sets for part in ("--set", one))], "law and method"


def override(rng: random.Random, number: int) -> Made:
    """Override a key wrongly."""
    command = rng.choice(OF_SCENARIOS).split()
    return [*command, rng.choice(SOURCES), "--set", rng.choice(PARTS["overrides"])], "override"


def call(rng: random.Random, number: int) -> Made:
    """Give a command what it does not take; each call comes in its turn."""
    shutil.copy(fs.scenarios()["pulley"], "s.toml")
    turn = sum(WAYS[i % len(WAYS)] is call for i in range(number))
    line = PARTS["calls"][turn % len(PARTS["calls"])]
    return [{"S": "@/s.toml", "R": "@/a.h5"}.get(part, part) for part in line.split()], "call"


def result(rng: random.Random, number: int) -> Made:
    """Read a result of which bytes are changed, or the end is cut off."""
    content = bytearray(rng.choice(RESULTS).read_bytes())
    if rng.random() < 0.4:
        content = content[: rng.randrange(len(content))]
    else:
        for _ in range(rng.choice([1, 8, 200])):
            content[rng.randrange(len(content))] = rng.randrange(256)
    Path("d.h5").write_bytes(content)
    return rng.choice(OF_RESULTS).split(), f"damaged result of {len(content)} bytes"


WAYS = (edited, call, edited, method, edited, override, edited, result, edited, call)
